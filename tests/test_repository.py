"""Housekeeping: what is true of every file of the project."""

import ast
import inspect
import re
import subprocess
import tokenize
from pathlib import Path

import pytest
from helpers import parsed

ROOT = Path(__file__).resolve().parent.parent
CODE = ("kahanmaps", "cli", "tests", "examples", "benchmarks")

# A folder at the root of some machine; "examples/root/" in the middle of a path is not one.
MACHINE_PATH = re.compile(r"(?<![\w.~$}-])/(?:work|root)/")


def files_of_the_project() -> list[Path]:
    """What git follows, and what is about to be added to it."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: nothing tells the project's files from others")
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def python_files(*folders: str) -> list[Path]:
    """The Python files below some folders of the project."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def opens_with_a_docstring(path: Path) -> bool:
    """Whether a text is the first statement of a file; all other lines are left unread."""
    remarks = (tokenize.COMMENT, tokenize.NL)
    with tokenize.open(path) as lines:
        tokens = tokenize.generate_tokens(lines.readline)
        return next(token for token in tokens if token.type not in remarks).type == tokenize.STRING


def undocumented(source: str) -> list[str]:
    """The public functions and classes at the top of a file that have no docstring."""
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    public = [node for node in parsed(source).body if isinstance(node, kinds) and not node.name.startswith("_")]
    return [node.name for node in public if not ast.get_docstring(node)]


def test_no_file_mentions_a_folder_of_somebodys_machine():
    found = []
    for path in files_of_the_project():
        text = path.read_bytes().decode("utf-8", errors="ignore")
        found += [f"{path.relative_to(ROOT)}: {match.group()}" for match in MACHINE_PATH.finditer(text)]
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize("before", ["", "see ", "'", "(", "file://"])
def test_a_folder_of_somebodys_machine_is_found_wherever_it_begins(before):
    assert MACHINE_PATH.search(before + "/" + "root/notes.txt")


@pytest.mark.parametrize("before", ["examples", "..", "~", "$HOME"])
def test_a_folder_below_another_one_is_not_taken_for_a_machines(before):
    assert not MACHINE_PATH.search(before + "/" + "work/notes.txt")


def test_every_python_file_starts_with_a_docstring():
    silent = [str(path.relative_to(ROOT)) for path in python_files(*CODE) if not opens_with_a_docstring(path)]
    assert not silent, f"files that do not open by saying what they are: {silent}"


@pytest.mark.parametrize(
    ("source", "expected"), [("# a\n\n'One.'\n", True), ("import re\n'One.'\n", False), ("", False)]
)
def test_a_file_without_a_docstring_is_found(source, expected, tmp_path):
    (tmp_path / "a.py").write_text(source)
    assert opens_with_a_docstring(tmp_path / "a.py") == expected


def test_every_public_function_and_class_of_the_library_has_a_docstring():
    silent = []
    for path in python_files("kahanmaps"):
        silent += [f"{path.relative_to(ROOT)}: {name}" for name in undocumented(path.read_text(encoding="utf-8"))]
    assert not silent, "\n" + "\n".join(silent)


def test_a_public_name_without_a_docstring_is_found():
    assert undocumented("def seen(): ...\ndef _helper(): ...\nclass Told:\n    'Yes.'\n") == ["seen"]


def test_every_name_that_kahanmaps_exports_exists_and_is_documented():
    import kahanmaps

    exported = {name: getattr(kahanmaps, name) for name in kahanmaps.__all__}
    callables = {name: value for name, value in exported.items() if inspect.isroutine(value) or inspect.isclass(value)}
    assert callables
    assert [name for name, value in callables.items() if not value.__doc__] == []


def test_every_test_that_is_left_to_the_thorough_runs_exists():
    for line in (ROOT / "tests" / "thorough.txt").read_text(encoding="utf-8").splitlines():
        path, name = line.split("[")[0].split("::")
        # Of a docstring the name of the function is the end of that of the test.
        assert f"def {name.rpartition('.')[2]}(" in (ROOT / path).read_text(encoding="utf-8"), line


def test_of_a_test_whose_cases_are_left_to_the_thorough_runs_others_run_each_day(wrongly_left):
    assert wrongly_left == []
