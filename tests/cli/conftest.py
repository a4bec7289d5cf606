"""The command line in the process of the tests, and a member of the family to try it on."""

import shlex
from collections.abc import Callable
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import pytest
from cli_helpers import Outcome
from small_databases import ok, planned

from kahanmaps_cli.main import main


@pytest.fixture
def kahanmaps(capsys: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run a command: texts are split as a shell would, paths are taken as they are."""

    def run(*pieces: str | Path) -> Outcome:
        arguments: list[str] = []
        for piece in pieces:
            arguments += [str(piece)] if isinstance(piece, Path) else shlex.split(piece)
        capsys.readouterr()
        return Outcome(main(arguments), *capsys.readouterr())

    return run


@pytest.fixture(scope="module")
def outcomes() -> dict[str, Outcome]:
    """What `once` has run for the tests of a file."""
    return {}


@pytest.fixture
def once(kahanmaps: Callable[..., Outcome], outcomes: dict[str, Outcome]) -> Callable[[str], Outcome]:
    """Run a command that changes nothing; where another test of the file has run it, that outcome is looked at."""

    def run(command: str) -> Outcome:
        if command not in outcomes:
            outcomes[command] = kahanmaps(command)
        return outcomes[command]

    return run


@pytest.fixture(scope="session")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of kind [family]: m = 2, A with the eigenvalues 1 and -2."""
    path = tmp_path_factory.mktemp("family") / "pair.toml"
    assert main(["family", "new", "--eigenvalues", "1,-2", "--seed", "7", "-q", "-o", str(path)]) == 0
    return path


@pytest.fixture
def least_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the lines of `LEAST` run: with a database and a spec."""
    monkeypatch.chdir(tmp_path)
    planned(tmp_path / "DB", 1, 2, records=[ok(1)])
    Path("SPEC").write_text('[experiments.a]\ntask = "orbit"\nsystem = "harmonic"\naxes = {eps = "1/10"}\n')
    return tmp_path


@pytest.fixture
def unrendered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made but not rendered: for tests of what is said."""
    monkeypatch.setattr("kahanmaps.plots.figures.picture_bytes", lambda *_: b"")


@pytest.fixture
def slow_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten seconds pass between any two looks that progress takes at the clock."""
    ticks = count(0, 10)
    monkeypatch.setattr("kahanmaps_cli.screen.progress.time", SimpleNamespace(monotonic=lambda: next(ticks)))
