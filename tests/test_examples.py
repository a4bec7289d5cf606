"""The examples do what stands beside them: every script prints its .out file, the notebooks show what they have stored
(their pictures are only asked to be there), the study learns what it has committed, and the demo runs through.
"""

import importlib.util
import os
import random
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


# The cluster, the whole paper and planar fields have quicker tests of their own.
LONG = {"08_the_paper", "10_cluster_batch", "13_planar_fields", "14_lotka_volterra_fields", "15_certified_classes"}
LONG |= {"11_exact_and_float"}  # compiles machine code; docs/howto/python.md has its parts


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


def fields_of_the_plane(name="13_planar_fields"):
    """The example on planar fields, or another one, as a module."""
    spec = importlib.util.spec_from_file_location(name[3:], EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def moved(field, matrix):
    """g^-1 f(g x) for the matrix g, times det g."""
    (p, q), (r, s) = matrix
    parts = [
        (
            a * p * p + b * p * r + c * r * r,
            2 * a * p * q + b * (p * s + q * r) + 2 * c * r * s,
            a * q * q + b * q * s + c * s * s,
        )
        for a, b, c in field
    ]
    return tuple(tuple(u * x + v * y for x, y in zip(*parts, strict=True)) for u, v in ((s, -q), (-r, p)))


def test_the_class_of_a_planar_field_is_invariant_and_tells_degrees_apart():
    module, draw = fields_of_the_plane(), random.Random(1)
    for _ in range(500):
        field = tuple(tuple(draw.choice((-2, -1, 0, 0, 1, 2)) for _ in range(3)) for _ in range(2))
        matrix = [[draw.randint(-3, 3) for _ in range(2)] for _ in range(2)]
        if matrix[0][0] * matrix[1][1] != matrix[0][1] * matrix[1][0]:
            assert module.class_of(moved(field, matrix)) == module.class_of(field)
    # The exponents (1, 1, 1), (1, 1, 2) and (1, 2, 3) of three lines.
    nahm = [((1, 0, -1), (0, -2, 0)), ((2, 0, -12), (0, -6, -4)), ((2, 0, -1), (0, -10, 1))]
    assert len({module.class_of(field) for field in nahm}) == 3


def test_fields_of_one_class_have_the_same_degrees():
    module = fields_of_the_plane()
    fields = module.classes()
    assert (len(fields), sum(map(len, fields.values()))) == (1132, 15624)
    draw = random.Random(2)
    for members in draw.sample([members for members in fields.values() if len(members) > 20], 3):
        results = {
            tuple(km.degree_growth(module.system_of(field), max_terms=6, steps=10, enclosed=False).degrees)
            for field in draw.sample(members, 3)
        }
        assert len(results) == 1


def test_the_class_of_a_lotka_volterra_system_is_that_of_its_permutations_and_signs():
    module, draw = fields_of_the_plane("14_lotka_volterra_fields"), random.Random(3)
    for _ in range(200):
        A = [[draw.choice((-1, 0, 1)) for _ in range(3)] for _ in range(3)]
        order, signs = draw.sample(range(3), 3), [draw.choice((-1, 1)) for _ in range(3)]
        assert module.class_of([[A[i][j] * signs[j] for j in order] for i in order]) == module.class_of(A)
        assert module.class_of(module.class_of(A)) == module.class_of(A)
    chain, with_own_pair = ((0, 1, 1), (1, 0, -1), (-1, -1, 0)), ((0, 1, 0), (1, 0, 0), (1, 1, 0))
    assert module.right_hand_sides(chain) == ["x*(y + z)", "y*(x - z)", "z*(-x - y)"]
    assert [module.is_indecomposable(A) for A in (chain, with_own_pair)] == [True, False]
    assert module.class_of(chain) == module.class_of(((0, 1, -1), (-1, 0, 1), (1, -1, 0)))  # LV(3, 1)


def test_every_integral_of_the_tables_is_certified_by_sympy():
    printed = (EXAMPLES / "15_certified_classes.out").read_text(encoding="utf-8")
    for accepted, formulas, refuted in re.findall(r": (\d+) of (\d+) integrals .* accepted, (\d+) controls", printed):
        assert accepted == formulas == refuted
    rows = fields_of_the_plane("15_certified_classes").rows
    names = ("13_planar_fields", "14_lotka_volterra_fields")
    found = [integrals for name in names for _, integrals in rows(EXAMPLES / f"{name}.out")]
    assert sum(map(len, found)) == sum(int(number) for number in re.findall(r"of (\d+) integrals", printed)) == 45
