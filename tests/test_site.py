"""The manual as a web site: in a headless browser every page opens, every link leads somewhere, and search finds."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
NEEDED = ("mkdocs", "material", "bs4", "jupytext", "nbconvert", "nbclient", "ipykernel", "PyQt6.QtWebEngineCore")


def is_there(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ModuleNotFoundError:
        return False


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not all(map(is_there, NEEDED)) and not os.environ.get("CI"),
        reason='the site needs the extra docs: pip install -e ".[docs,test]"',
    ),
]


class Anchors(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if tag == "a" and values.get("href"):
            self.links.append(str(values["href"]))
        if values.get("id"):
            self.names.add(str(values["id"]))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("manual")
    command = [sys.executable, "-m", "studies.manual", "--output", folder / "manual.pdf", "--site", folder / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def seen(site):
    script = Path(__file__).with_name("headless_browser.py")
    command = [sys.executable, str(script), str(site), "wheel-momentum"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_every_page_opens(seen):
    assert len(seen["pages"]) >= 12
    for name, page in seen["pages"].items():
        assert page["opened"], name
        assert page["title"], name
        assert page["height"] > 100, name
    assert sum(page["formulas"] for page in seen["pages"].values()) > 40
    assert seen["errors"] == []


def test_search_finds_a_cause(seen):
    assert any(hit.startswith("effects.html#") for hit in seen["hits"])


def test_every_link_leads_somewhere(site):
    pages = {file.name: Anchors(file.read_text(encoding="utf-8")) for file in site.glob("*.html")}
    links = [(name, link) for name, page in pages.items() for link in page.links if "://" not in link]
    assert len(links) > 100
    broken = []
    for name, link in links:
        target, _, anchor = link.partition("#")
        target = target.removeprefix("/") or name
        if target in (".", "./"):
            target = "index.html"
        if not (site / target).is_file() or (anchor and anchor not in pages[target].names):
            broken.append((name, link))
    assert broken == []


def test_the_drawings_of_the_manual_are_on_their_pages(site):
    for name, caption in [("index", "From files to results"), ("tasks", "Frames, signs and quaternions")]:
        page = (site / f"{name}.html").read_text(encoding="utf-8")
        figures = [part.partition("</figure>")[0] for part in page.split("<figure")[1:]]
        (figure,) = (one for one in figures if caption in one.partition("<figcaption")[2])
        assert "<svg" in figure, name


def test_pictures_from_real_runs_are_on_their_pages(site):
    for name, count in [("index", 4), ("tasks", 7), ("in-python", 1)]:
        sources = re.findall(r'<img [^>]*src="(pictures/[^"]+)"', (site / f"{name}.html").read_text(encoding="utf-8"))
        assert len(sources) == count, name
        assert all((site / source).is_file() for source in sources)


def test_every_picture_has_a_text_of_its_own_for_readers_who_do_not_see_it(site):
    pages = "\n".join(file.read_text(encoding="utf-8") for file in sorted(site.glob("*.html")))
    pictures = re.findall(r"<img [^>]*>", pages)
    texts = [text for picture in pictures for text in re.findall(r'alt="([^"]{25,})"', picture)]
    assert len(texts) == len(pictures) == len(set(texts))
    figures = [part.partition("</figure>")[0] for part in pages.split("<figure")[1:]]
    drawings = [part.partition(">")[0] for figure in figures for part in figure.split("<svg")[1:2]]
    assert len(drawings) == 2
    assert all('role="img"' in drawing and "aria-label=" in drawing for drawing in drawings)


def test_the_theme_frames_no_pieces_of_code(site):
    assert not any("</code><wbr" in file.read_text(encoding="utf-8") for file in site.glob("*.html"))


def test_the_tutorial_in_python_was_executed(site):
    page = (site / "tutorial-in-python.html").read_text(encoding="utf-8")
    assert "Verdict: explained, wheel-momentum" in page
    pictures = re.findall(r'<img [^>]*src="(output_[^"]+)"', page)
    assert len(pictures) == 3
    assert all((site / picture).stat().st_size > 10_000 for picture in pictures)
    cells = json.loads((site / "tutorial-in-python.ipynb").read_text(encoding="utf-8"))["cells"]
    assert all(cell["execution_count"] for cell in cells if cell["cell_type"] == "code")


def test_an_error_in_the_tutorial_stops_the_build(tmp_path):
    source = tmp_path / "wrong.py"
    source.write_text("# %%\nraise ValueError('wrong cell')\n", encoding="utf-8")
    call = "import sys, pathlib; from studies.manual.notebook import write_notebook\n"
    call += "write_notebook(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), 'wrong')"
    command = [sys.executable, "-c", call, source, tmp_path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "wrong cell" in done.stderr
    assert not (tmp_path / "wrong.md").exists()


def test_the_index_of_the_pdf_is_not_on_the_site(site):
    assert not any("Index</h1>" in file.read_text(encoding="utf-8") for file in site.glob("*.html"))
