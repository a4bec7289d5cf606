"""The examples do what stands beside them: every script prints its .out file, the notebooks show what they have stored
(their pictures are only asked to be there), the study learns what it has committed, and the demo runs through.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from notebook_runner import NOTEBOOKS, executed

import kahanmaps as km

EXAMPLES = Path(__file__).parent.parent / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))


# The cluster and the whole paper have quicker tests of their own.
LONG = {"08_the_paper", "10_cluster_batch"}


@pytest.mark.parametrize(
    "script", [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in LONG), id=path.stem) for path in SCRIPTS]
)
def test_an_example_prints_what_stands_beside_it(script, tmp_path):
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == script.with_suffix(".out").read_text(encoding="utf-8")


def test_the_script_of_the_guide_is_the_example():
    guide = (EXAMPLES.parent / "docs" / "howto" / "python.md").read_text(encoding="utf-8")
    assert (EXAMPLES / "11_exact_and_float.py").read_text(encoding="utf-8") in guide


def test_the_demo_proves_what_it_promises_and_leaves_files_to_play_with(tmp_path):
    # It writes beside the folder it is in. One test, so that only one process runs it.
    (tmp_path / "examples").mkdir()
    (tmp_path / "bin").mkdir()
    shutil.copy(EXAMPLES / "demo.sh", tmp_path / "examples")
    command = tmp_path / "bin" / "kahanmaps"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m kahanmaps_cli.main "$@"\n')
    command.chmod(0o755)
    path = f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"
    script = ["bash", str(tmp_path / "examples" / "demo.sh")]
    done = subprocess.run(script, env={**os.environ, "PATH": path}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "verdict\tproved" in done.stdout
    assert "refuted (as expected)" in done.stdout
    assert {"pair.toml", "pair-ppp.toml", "pair-pmm.toml"} <= {path.name for path in (tmp_path / ".demo").iterdir()}


STUDY = Path(__file__).parent.parent / "examples" / "members"


@pytest.mark.slow
def test_what_was_learned_comes_out_of_the_first_members_too(tmp_path: Path) -> None:
    text, count = re.subn(r'"0\.\.\d+"', '"0..0"', (STUDY / "study.toml").read_text())
    assert count == 5
    assert {record.outcome for record in km.run(text, tmp_path / "study.db")} == {"ok"}
    command = [sys.executable, STUDY / "learned.py", tmp_path / "study.db"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[:3] == [f"m = {m}: dimension {4 * m} of the space of cubics, for 2 of 2 members" for m in (2, 3, 4)]
    committed = (STUDY / "learned.out").read_text().splitlines()
    kinds = [re.sub(r"[-\d.e]+", "#", line) for line in lines if not line.startswith(" ")]
    assert kinds[3:5] == [re.sub(r"[-\d.e]+", "#", line) for line in committed if not line.startswith(" ")][3:5]


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


DUMP = re.compile(r"\b[A-Z]\w+\(\w+=")  # a dataclass with all its fields: ClassName(field=...)


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_fresh_run_of_a_notebook_shows_what_is_stored(path):
    pages = shown(executed(path))
    assert pages == shown(nbformat.read(path, as_version=4))
    assert not [page for page in pages if DUMP.search(page[2]) or page[1] == "error"]


def test_a_dump_of_a_dataclass_is_seen():
    assert DUMP.search("(FoundDensity(function=x, verdict='proved'),)")
    assert not DUMP.search("<FoundIntegral: (x + 1)/(y)> KahanMap(x, y; eps=1/10, over QQ)")
