"""The manual as a web site: a page for each chapter, from the same sources as the PDF.

Typst exports the manual as HTML, formulas as MathML; MkDocs turns it into pages with navigation and search. The
tutorial in Python is a page more, which is executed. Needs the extra ``docs``.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typst

from bayesid._io.errors import InputError
from studies.manual.notebook import TITLE as TUTORIAL_TITLE
from studies.manual.notebook import TUTORIAL, write_notebook
from studies.manual.pictures.store import STORED
from studies.manual.sources import sources

__all__ = ["write_site"]

HEADINGS = ["h3", "h4", "h5"]  # below a chapter's
BETWEEN_CODE = "</code><wbr><code>"  # where code may break: the theme frames every piece, so they become one
STYLE = Path(__file__).with_name("site.css")
TITLE = re.compile(r"^[\d.]+\s+")  # number of a heading, which the PDF has


@dataclass(frozen=True)
class _Page:
    """A chapter of the manual: its title, its elements in order, and the names under which others refer to it."""

    title: str
    elements: Sequence[Any]
    anchors: Sequence[str]

    @property
    def name(self) -> str:
        """Name of the file, without suffix."""
        return _slug(self.title)

    def markdown(self, places: dict[str, str]) -> str:
        """Return the page; headings are those of Markdown, which navigation and search know, all else is HTML."""
        parts = [f"# {self.title}"]
        for element in self.elements:
            for link in element.find_all("a", href=True):
                target = link["href"].removeprefix("#")
                if link["href"].startswith("#") and target in places:
                    link["href"] = places[target]
            for drawing in element.select("figure svg"):
                drawing["style"] += "; max-width: 100%; height: auto"  # on narrow screens
                drawing["role"], drawing["aria-label"] = "img", _caption(drawing.find_parent("figure"))
            if element.name in HEADINGS:
                anchor = element.get("id") or _slug(element.get_text())
                parts.append(f"{'#' * (int(element.name[1]) - 1)} {_heading(element)} {{ #{anchor} }}")
            else:
                parts.append(str(element))
        return "\n\n".join(parts) + "\n"


def write_site(folder: Path) -> None:
    """Write the site.

    Parameters
    ----------
    folder : path
        Folder of the site, whose ``index.html`` is the first page.

    Raises
    ------
    InputError
        If the extra ``docs`` is not installed.
    """
    try:
        import ipykernel  # noqa: F401
        import jupytext  # noqa: F401
        import nbconvert  # noqa: F401
        from bs4 import BeautifulSoup
        from mkdocs.commands.build import build
        from mkdocs.config import load_config
    except ImportError as error:
        remedy = 'Install the extra: pip install -e ".[docs,test]"'
        raise InputError(f"the site needs {error.name}, which is not installed", remedy=remedy) from error
    with tempfile.TemporaryDirectory() as work:
        typ, docs = Path(work) / "typst", Path(work) / "docs"
        docs.mkdir()
        text = typst.compile(str(sources(typ)), root=str(typ), format="html").decode().replace(BETWEEN_CODE, "<wbr>")
        pages = list(_pages(BeautifulSoup(text, "html.parser")))
        files = [docs / f"{'index' if number == 0 else page.name}.md" for number, page in enumerate(pages)]
        places = {
            anchor: f"{file.stem}.html" for page, file in zip(pages, files, strict=True) for anchor in page.anchors
        }
        places |= {
            element["id"]: f"{file.stem}.html#{element['id']}"
            for page, file in zip(pages, files, strict=True)
            for top in page.elements
            for element in [top, *top.find_all(id=True)]
            if element.get("id")
        }
        for page, file in zip(pages, files, strict=True):
            file.write_text(page.markdown(places), encoding="utf-8")
        shutil.copytree(STORED, docs / "pictures")
        shutil.copy(STYLE, docs)
        tutorial = write_notebook(TUTORIAL, docs, _slug(TUTORIAL_TITLE))
        contents = [{page.title: file.name} for page, file in zip(pages, files, strict=True)]
        contents.insert(1, {TUTORIAL_TITLE: tutorial.name})
        settings = {
            "site_name": "bayesid",
            "docs_dir": str(docs),
            "site_dir": str(folder.resolve()),
            "use_directory_urls": False,
            "theme": {"name": "material", "font": False, "features": ["toc.follow", "search.suggest"]},
            "markdown_extensions": ["attr_list", "pymdownx.highlight", "pymdownx.superfences"],
            "extra_css": [STYLE.name],
            "plugins": ["search"],
            "nav": contents,
            "strict": True,
        }
        file = Path(work) / "mkdocs.yml"
        file.write_text(json.dumps(settings), encoding="utf-8")  # every JSON is YAML
        build(load_config(str(file)))


def _pages(document: Any) -> Iterator[_Page]:
    """Yield the chapters of the manual as Typst exports it; what stands before the first one is the PDF's title."""
    chapter: Any = None
    elements: list[Any] = []
    for element in [*_flat(document.body), None]:
        if element is None or element.name == "h2":
            if chapter is not None:
                anchors = [chapter["id"]] if chapter.get("id") else []
                yield _Page(TITLE.sub("", chapter.get_text()), elements, anchors)
            chapter, elements = element, []
        else:
            elements.append(element)


def _flat(parent: Any) -> Iterator[Any]:
    """Yield the elements of a page; those that frame a heading are left out for what they contain."""
    for element in parent.find_all(recursive=False):
        if element.name == "div" and element.find(HEADINGS):
            yield from _flat(element)
        else:
            yield element


def _heading(element: Any) -> str:
    """Return the text of a heading, code between back quotes."""
    text = "".join(f"`{part.get_text()}`" if part.name == "code" else part.get_text() for part in element.children)
    return TITLE.sub("", text)


def _caption(figure: Any) -> str:
    """Return the caption of a figure, for readers who do not see it."""
    return " ".join(figure.figcaption.get_text().split())


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", TITLE.sub("", text).lower()).strip("-")
