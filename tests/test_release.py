"""The release: wheel and source distribution are built, and what is installed from them works by itself."""

import re
import subprocess
import tarfile
import tomllib
import venv
import zipfile
from datetime import date
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


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The folder with the wheel and the source distribution, made by the builder that pyproject.toml names."""
    folder = tmp_path_factory.mktemp("release")
    programs = environment(folder / "builder")
    required = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    run(programs / "pip", "install", *QUIET, *required, cwd=folder)
    run(programs / "python", "-m", "hatchling", "build", "-d", folder / "dist", cwd=ROOT)
    return folder / "dist"


@pytest.mark.slow
@pytest.mark.parametrize("pattern", ["*.whl", "*.tar.gz"])
def test_what_is_built_is_installed_and_works_in_a_bare_environment(built, tmp_path, pattern):
    (archive,) = built.glob(pattern)
    programs = environment(tmp_path / "bare")
    run(programs / "pip", "install", *QUIET, archive, cwd=tmp_path)
    command = programs / "kahanmaps"
    assert run(command, "--version", cwd=tmp_path).strip() == f"kahanmaps {__version__}"
    assert "\nintegrable\t" in run(command, "analyze", "--rhs", "q' = p; p' = q^2 - q", cwd=tmp_path)
    run(command, "report", "euler_top", "-o", "top.html", cwd=tmp_path)
    page = (tmp_path / "top.html").read_text(encoding="utf-8")
    assert "font/woff" in page
    assert "kahanmaps[plot]" in page  # nothing was installed that is not required


@pytest.mark.slow
def test_both_archives_have_the_licences_and_the_source_has_what_tests_and_pages_need(built):
    (wheel,), (source,) = built.glob("*.whl"), built.glob("*.tar.gz")
    names = zipfile.ZipFile(wheel).namelist()
    for licence in ("LICENSE", "GUST-FONT-LICENSE.txt"):
        assert any(re.search(rf"dist-info/licenses/.*{licence}$", name) for name in names)
    assert not [name for name in names if name.startswith(("tests/", "docs/"))]
    with tarfile.open(source) as archive:
        inside = {name.partition("/")[2] for name in archive.getnames()}
    assert {"Makefile", "CITATION.cff", "docs/index.md", "tests/test_release.py", "examples/demo.sh"} <= inside
    assert not [name for name in inside if name.startswith((".venv", "docs/_build"))]


def test_the_version_is_the_same_everywhere():
    dated = re.search(r"^## (\S+) - (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "citing.md").read_text(encoding="utf-8")
    assert dated is not None
    version, day = dated.groups()
    assert date.fromisoformat(day)
    assert version == __version__
    assert f"\nversion: {version}\ndate-released: {day}\n" in cited
    assert f"version = {{{version}}}" in page
    assert f"{{{day}}}" in page
