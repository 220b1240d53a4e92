"""The tutorial in Python as a page of the site: a notebook that is executed when the site is built.

Its source is ``tutorial.py``, a notebook of Jupytext. Needs the extra ``docs``.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["TITLE", "TUTORIAL", "write_notebook"]

TUTORIAL = Path(__file__).with_name("tutorial.py")
TITLE = "Tutorial in Python"
PATIENCE = 600  # time for one cell [s], on a busy machine


def write_notebook(source: Path, folder: Path, name: str) -> Path:
    """Execute a notebook in a folder, and write it there as Markdown, with its pictures, and as notebook.

    Parameters
    ----------
    source : path
        Notebook of Jupytext.
    folder : path
    name : str
        Name of the files, without suffix.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell ends with an error.
    """
    import jupytext
    import nbformat
    from nbclient import NotebookClient
    from nbconvert import MarkdownExporter

    notebook = jupytext.read(source)
    client = NotebookClient(notebook, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": folder}})
    client.execute()
    nbformat.write(notebook, folder / f"{name}.ipynb")
    body, resources = MarkdownExporter().from_notebook_node(notebook)
    for file, content in resources["outputs"].items():
        (folder / file).write_bytes(content)
        cell = notebook.cells[int(file.split("_")[1])]  # a file is output_CELL_NUMBER.png
        body = body.replace(f"![png]({file})", f"![Picture drawn by {cell.source.splitlines()[-1]}]({file})")
    page = folder / f"{name}.md"
    page.write_text(f"# {TITLE}\n\n[Download the notebook]({name}.ipynb)\n\n{body}", encoding="utf-8")
    return page
