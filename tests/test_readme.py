"""What README and docs show is what happens: their console sessions are run and compared, their Python sessions too.

A block of TOML that opens with the comment `# NAME.toml` is that file, for all sessions of its page. What the
pages say of orbits of x' = x (1 - y), y' = y (x - 1) is computed once more.
"""

import doctest
import math
import re
import shlex
from pathlib import Path

import pytest
from flint import arb, ctx
from helpers import quick

import kahanmaps as km
from kahanmaps_cli.main import main

ROOT = Path(__file__).parent.parent
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").glob("**/*.md")])
QUICK = [page for page in PAGES if page.stem not in ("find-integrable-cases", "laboratory")]
FLAGS = doctest.ELLIPSIS


def sessions(page: Path) -> list[tuple[str, str]]:
    """Commands and expected output of the ```console blocks of a page, in order."""
    results = []
    for block in re.findall(r"```console\n(.*?)```", page.read_text(), re.DOTALL):
        for piece in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, output = piece.partition("\n")
            results.append((command, output))
    return results


def files(page: Path) -> dict[str, str]:
    """The files that a page shows, by name."""
    blocks = re.findall(r"```toml\n(# ([\w-]+\.toml)\n.*?)```", page.read_text(), re.DOTALL)
    assert len({name for _, name in blocks}) == len(blocks), f"{page.name} shows two files of one name"
    return {name: text for text, name in blocks}


def go_where_the_files_of(page: Path, folder: Path, monkeypatch) -> None:
    """Make `folder` the current one, with the examples and the files of the page in it."""
    monkeypatch.chdir(folder)
    (folder / "examples").symlink_to(ROOT / "examples")
    for name, text in files(page).items():
        (folder / name).write_text(text)


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", quick([page for page in PAGES if sessions(page)], QUICK), ids=name_of)
def test_console_sessions_print_what_the_page_shows(page, tmp_path, monkeypatch, capfd):
    go_where_the_files_of(page, tmp_path, monkeypatch)
    checker = doctest.OutputChecker()
    status = 0
    for command, expected in sessions(page):
        words = shlex.split(command)
        if words == ["echo", "$?"]:
            assert expected == f"{status}\n", command
            continue
        assert words[0] == "kahanmaps", command
        status = main(words[1:])
        out, err = capfd.readouterr()
        assert checker.check_output(expected, err + out, FLAGS), f"$ {command}\n{err + out}"


@pytest.mark.parametrize("page", quick([page for page in PAGES if ">>> " in page.read_text()], QUICK), ids=name_of)
def test_python_sessions_print_what_the_page_shows(page, tmp_path, monkeypatch):
    go_where_the_files_of(page, tmp_path, monkeypatch)
    outcome = doctest.testfile(str(page), module_relative=False, optionflags=FLAGS)
    assert outcome.attempted > 0
    assert outcome.failed == 0


def test_a_session_that_shows_something_else_would_be_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```console\n$ kahanmaps --version\nkahanmaps 999\n```\n")
    ((command, expected),) = sessions(page)
    assert command == "kahanmaps --version"
    assert not doctest.OutputChecker().check_output(expected, "kahanmaps 0.1.0\n", FLAGS)


def H(point) -> float:
    x, y = map(float, point)
    return x + y - math.log(x * y)


@pytest.mark.parametrize("y", [1.5, 2.5, 4])
def test_the_orbits_of_the_picture_stay_on_rings_and_those_of_euler_do_not(y):
    orbit = km.orbit("lotka_volterra", start=[1, y], eps="1/20", steps=400, arithmetic="float")
    kahan = [H(point.x) for point in orbit]
    x, z = 1.0, y
    for _ in range(400):
        x, z = x + x * (1 - z) / 10, z + z * (x - 1) / 10
    width, start = H((1, y)) - 2, H((1, y))  # 2 is the minimum of H
    assert max(abs(value - start) for value in kahan) < width / 10
    assert x < 0 or z < 0 or H((x, z)) - start > width / 2


def test_the_orbit_of_5_1_leaves_the_positive_quadrant_at_step_139(monkeypatch):
    # Balls of 2,000 bits, for the digits of exact points double at every step.
    monkeypatch.setattr(ctx, "prec", 2000)
    x, y, e = arb(5), arb(1), arb(1) / 5
    step = 0
    while x > 0 and y > 0 and step < 200:
        step += 1
        # (I - eps f') (x~ - x) = 2 eps f by Cramer's rule
        a, b, c, d = 1 - e * (1 - y), e * x, -e * y, 1 - e * (x - 1)
        f, g, det = 2 * e * x * (1 - y), 2 * e * y * (x - 1), a * d - b * c
        x, y = x + (f * d - b * g) / det, y + (a * g - c * f) / det
    assert step == 139
    assert x < 0 or y < 0
