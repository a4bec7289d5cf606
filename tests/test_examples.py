"""The examples do what stands beside them: every script prints its .out file, and the demo runs through."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

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
