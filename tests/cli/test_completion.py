"""Completion in the shell: what is offered where, at once, and never a traceback."""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from cli_helpers import COMMAND, environment, shell

from kahanmaps.documents.catalog import names
from kahanmaps_cli.main import COMMANDS

HEAVY = ("numpy", "flint", "rich", "matplotlib")


def question(line: str) -> dict[str, str]:
    """The environment in which bash asks for what may stand at the end of that line."""
    return {"_KAHANMAPS_COMPLETE": "bash_complete", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split(" ")) - 1)}


@pytest.fixture
def offered(kahanmaps, monkeypatch):
    """What is offered for the last word of a line."""

    def offer(line):
        with monkeypatch.context() as here:
            for name, value in question(line).items():
                here.setenv(name, value)
            outcome = kahanmaps("")
        assert outcome.err == ""
        return [item.partition(",")[2] for item in outcome.out.splitlines() if item]

    return offer


def test_commands_are_offered(offered):
    assert offered("kahanmaps ") == list(COMMANDS)
    assert offered("kahanmaps check-i") == ["check-integrals"]


def test_system_files_and_folders_are_offered_and_no_other_file(offered, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my-top.toml").write_text("[[[")
    Path("notes.txt").touch()
    Path("mine").mkdir()
    Path("mine/other.toml").touch()
    assert offered("kahanmaps orbit m") == ["mine/", "my-top.toml"]
    assert offered("kahanmaps orbit n") == [name for name in names() if name.startswith("n")]


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
