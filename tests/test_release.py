"""The release: what is built works in a bare environment, and the version is the same everywhere."""

import re
import subprocess
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from kahanmaps.version import __version__

ROOT = Path(__file__).parent.parent
QUIET = ["--quiet", "--disable-pip-version-check"]


def run(*command, cwd):
    done = subprocess.run([str(word) for word in command], cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def environment(folder):
    """A new environment with pip alone; its folder of programs."""
    venv.create(folder, with_pip=True, symlinks=True)
    return folder / "bin"


@pytest.mark.slow
def test_what_is_built_has_its_licences_and_works_in_a_bare_environment(tmp_path):
    required = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    builder = environment(tmp_path / "builder")
    run(builder / "pip", "install", *QUIET, *required, cwd=tmp_path)
    run(builder / "python", "-m", "hatchling", "build", "-d", tmp_path / "dist", cwd=ROOT)
    (wheel,), (source,) = (list((tmp_path / "dist").glob(pattern)) for pattern in ("*.whl", "*.tar.gz"))
    names = zipfile.ZipFile(wheel).namelist()
    assert {"LICENSE", "GUST-FONT-LICENSE.txt"} <= {Path(name).name for name in names if "/licenses/" in name}
    with tarfile.open(source) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {"Makefile", "CITATION.cff", "docs/index.md", "tests/test_release.py", "examples/demo.sh"} <= inside
    for archive in (wheel, source):
        programs = environment(tmp_path / archive.suffix)
        run(programs / "pip", "install", *QUIET, archive, cwd=tmp_path)
        assert run(programs / "kahanmaps", "--version", cwd=tmp_path).strip() == f"kahanmaps {__version__}"
        analysis = run(programs / "kahanmaps", "analyze", "--rhs", "q' = p; p' = q^2 - q", cwd=tmp_path)
        assert "\nintegrable\t" in analysis


def test_the_version_is_the_same_everywhere():
    changes, cited, page = (
        (ROOT / name).read_text(encoding="utf-8") for name in ("CHANGELOG.md", "CITATION.cff", "docs/citing.md")
    )
    version, day = re.search(r"^## (\S+) - (\d{4}-\d\d-\d\d)$", changes, re.MULTILINE).groups()
    assert version == __version__
    assert f"\nversion: {version}\ndate-released: {day}\n" in cited
    assert f"version = {{{version}}}" in page
    assert f"{{{day}}}" in page
