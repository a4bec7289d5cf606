"""The documentation hangs together: names, sources and links. `make docs` builds it; each picture has its command."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from kahanmaps.paper.verify import verify
from kahanmaps_cli.commands.verify import markdown
from kahanmaps_cli.main import main

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS / "_ext"))

from check_pages import mistakes  # noqa: E402
from helpers import together  # noqa: E402
from kahanmaps_docs import expanded  # noqa: E402
from kahanmaps_docs.links import outside_code  # noqa: E402
from page_helpers import letters_of_formulas, letters_of_the_font  # noqa: E402
from redraw import command_of  # noqa: E402

from kahanmaps.documents.catalog import names  # noqa: E402


def markdown_files() -> list[Path]:
    """All pages, and the Markdown files that are read beside them."""
    pages = [path for path in DOCS.rglob("*.md") if not path.relative_to(DOCS).parts[0].startswith("_")]
    return sorted([*pages, ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"])


def anchors(text: str) -> set[str]:
    """The anchors that a Git host gives the headings of a Markdown text, as MyST does."""
    without_blocks = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.+)$", without_blocks, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


def broken_links(path: Path) -> list[str]:
    """The local links of a Markdown file that lead to no file, or to no heading of it."""
    text = path.read_text(encoding="utf-8")
    results = []
    prose = "".join(piece for is_text, piece in outside_code(text) if is_text)
    for target in re.findall(r"\]\(([^)\s]+)\)", prose):
        if "://" in target:
            continue
        file, _, anchor = target.partition("#")
        there = (path.parent / file).resolve() if file else path
        if not there.exists() or (anchor and anchor not in anchors(there.read_text(encoding="utf-8"))):
            results.append(target)
    return results


def test_every_system_of_the_catalogue_has_its_section_with_its_sources():
    text = expanded("reference/catalogue", (DOCS / "reference" / "catalogue.md").read_text(encoding="utf-8"))
    assert [name for name in names() if f"(system-{name})=" not in text] == []
    top = text.partition("(system-euler_top)=")[2].partition("(system-")[0]
    assert "[`hirota-kimura-2000`](#source-hirota-kimura-2000)" in top
    assert r"x_1^\prime &= x_2 x_3" in top


@together("path", markdown_files())
def test_local_links_lead_to_a_file_and_to_a_heading_in_it(path):
    assert broken_links(path) == []


@pytest.mark.slow
def test_the_pages_are_built_without_a_warning_and_no_link_is_broken(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-q", "-n", "-W", "--keep-going", "-d", tmp_path / "trees"]
    built = subprocess.run([*command, DOCS, tmp_path / "html"], capture_output=True, text=True, check=False)
    assert (built.returncode, built.stderr) == (0, "")
    assert mistakes(tmp_path / "html") == []
    assert "<math" in (tmp_path / "html" / "reference" / "catalogue.html").read_text(encoding="utf-8")
    assert (tmp_path / "html" / "_static" / "kahanmaps-math.woff").is_file()
    letters = (letters_of_formulas(page.read_text(encoding="utf-8")) for page in (tmp_path / "html").rglob("*.html"))
    assert set().union(*letters) - letters_of_the_font() == set()


@pytest.mark.slow
@pytest.mark.thorough
def test_the_table_of_the_audit_is_what_verify_prints():
    audit = (DOCS / "audit.md").read_text(encoding="utf-8")
    assert audit.split("<!-- table -->\n")[1].strip() == markdown(verify(m=3)).strip()


PICTURES = sorted(path for path in (DOCS / "pictures").iterdir() if path.suffix in (".png", ".svg"))


@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_the_metadata_hold_the_command_and_the_system(tmp_path, kind):
    picture = tmp_path / f"é <&> (1).{kind}"
    words = [*shlex.split("plot portrait harmonic --eps 1/20 --start 1,2 --steps 3 -q -o"), str(picture)]
    assert main(words) == 0
    assert b"[hamiltonian]" in picture.read_bytes()
    if kind != "pdf":
        assert shlex.split(command_of(picture)) == ["kahanmaps", *words]


@pytest.mark.slow
@pytest.mark.parametrize("picture", PICTURES, ids=lambda path: path.name)
def test_the_command_makes_the_picture(picture, tmp_path, monkeypatch):
    """Not the same bytes, which depend on the version of matplotlib: the same command, and a file of that size."""
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command_of(picture))[1:]) == 0
    made = tmp_path / picture.name
    assert command_of(made) == command_of(picture)
    assert 0.7 < made.stat().st_size / picture.stat().st_size < 1.4
