"""The notebook of the examples: its cells run in order in a fresh kernel and show what stands below them.

Pictures are only asked to be there: their bytes depend on the version of matplotlib.
"""

import nbformat
import pytest
from notebook_runner import NOTEBOOK, executed


def shown(notebook):
    """What the cells show: formulas and tables, or text where there is nothing better, or that there is a picture."""
    pages = []
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        for output in cell.outputs:
            data = output.get("data", {})
            kind = next((kind for kind in ("text/html", "text/latex", "image/png", "text/plain") if kind in data), None)
            content = "" if kind == "image/png" else data[kind] if kind else output.get("text", str(output))
            pages.append((cell.id, kind or output.output_type, content))
    return pages


@pytest.fixture(scope="module")
def stored():
    return nbformat.read(NOTEBOOK, as_version=4)


def test_a_fresh_run_shows_what_is_stored(stored):
    assert shown(executed()) == shown(stored)
