"""Completion in the shell: what is offered where, at once, and never a traceback."""

import os
import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_helpers import COMMAND, Outcome, environment, shell

from kahanmaps.documents.catalog import names
from kahanmaps_cli.main import COMMANDS

HEAVY = ("numpy", "flint", "rich", "matplotlib")


def question(line: str) -> dict[str, str]:
    """The environment in which bash asks for what may stand at the end of that line."""
    return {"_KAHANMAPS_COMPLETE": "bash_complete", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)}


@pytest.fixture
def ask(kahanmaps, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Outcome]:
    """Ask at the end of a line, in a folder."""

    def ask(line: str, folder: Path | None = None) -> Outcome:
        with monkeypatch.context() as here:
            for name, value in question(line).items():
                here.setenv(name, value)
            if folder is not None:
                here.chdir(folder)
            outcome: Outcome = kahanmaps("")
        return outcome

    return ask


@pytest.fixture
def offered(ask: Callable[..., Outcome]) -> Callable[..., list[str]]:
    """What is offered for the last word of a line."""

    def offer(line: str, folder: Path | None = None) -> list[str]:
        outcome = ask(line, folder)
        assert outcome.err == ""
        return [item.partition(",")[2] for item in outcome.out.splitlines() if item]

    return offer


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "my-top.toml").write_text('variables = ["x"]\n[system]\nrhs = ["a*x"]\n[parameters]\nalpha = 1\n')
    (tmp_path / "broken.toml").write_text("[[[")
    (tmp_path / "notes.txt").touch()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "other.toml").touch()
    return tmp_path


def test_commands_are_offered(offered):
    assert offered("kahanmaps ") == list(COMMANDS)
    assert offered("kahanmaps check-i") == ["check-integrals"]


def test_system_files_and_folders_are_offered_and_no_other_file(offered, folder):
    assert offered("kahanmaps orbit m", folder) == ["mine/", "my-top.toml"]
    assert offered("kahanmaps orbit n", folder) == [name for name in names() if name.startswith("n")]


def test_nothing_that_computes_is_loaded():
    code = (
        "import sys\nfrom kahanmaps_cli.main import main\nmain([])\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)"
    )
    env = environment(**question("kahanmaps ensemble euler_"))
    done = subprocess.run([COMMAND[0], "-c", code], env=env, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["plain,euler_top"]
    assert done.stderr == "[]\n"


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_with_the_script(tmp_path):
    # The script calls `kahanmaps` through env, so it has to be a program.
    program = tmp_path / "kahanmaps"
    program.write_text(f'#!/bin/sh\nexec {shlex.join(COMMAND)} "$@"\n')
    program.chmod(0o755)
    script = """
    eval "$(kahanmaps completion bash)"
    try() {
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
        _kahanmaps_completion kahanmaps
        echo "${COMPREPLY[@]}"
    }
    complete -p kahanmaps
    try kahanmaps orbit eul
    try kahanmaps orbit euler_top -p a1 = 2 --ste
    """
    outcome = shell(script, tmp_path, PATH=f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert outcome.out.splitlines() == ["complete -o nosort -F _kahanmaps_completion kahanmaps", "euler_top", "--steps"]
    assert outcome.err == ""
