"""What others wrote obeys nobody: texts of files on terminals, in pipes, pages and tables, commands printed."""

import csv
import json
import re
from contextlib import chdir
from pathlib import Path

import pytest
from cli_helpers import shell

from kahanmaps_cli.main import main

FREE = "T\\u001b[31m\\u009b2J\\u202e\\n<script>t</script>\\r=cmd() | `x` <img src=x onerror=y>"
NAME = "=cmd()<script>a</script>,=b|`c`"
SYSTEM = f"""
name = {NAME!r}
variables = ["x1", "x2", "x3", "x4"]
[family]
A = [["1","0","0","0"], ["0","-2","0","0"], ["0","0","1","0"], ["0","0","0","-2"]]
H = "x1^3 + x2^3 + x1^2*x3 + x3^3 + x2*x4^2"
[integrals]
"=cmd()<script>i</script>" = "x1"
'@x,"' = "x2"
[density]
phi = "1"
[catalog]
title = "{FREE}"
facts = ["{FREE}"]
convention = "{FREE}"
sources = ["petrera-suris-2016"]
"""
SPEC = '[experiments.e]\ntask = "check-integrals"\nsystem = "s.toml"\n'
ORBIT = "s.toml --start 1,2,3,4 --eps 1/10 --steps 2"

COMMANDS = [
    "systems s.toml",
    "systems s.toml --toml",
    f"orbit {ORBIT} --integral known",
    f"orbit {ORBIT} --integral known --format csv",
    f"orbit {ORBIT} --integral known --format jsonl",
    f"ensemble {ORBIT.replace('--start 1,2,3,4', '--random 2')}",
    "check-integrals s.toml",
    "verify s.toml --section 2 --markdown",
    "family show s.toml",
    "degrees s.toml --terms 2",
    "find-symmetry s.toml",
    "batch status --db r.db",
    "batch summary --db r.db --by name,message,system --markdown",
    "batch export --db r.db --csv",
    "batch show KEY --db r.db",
    f"plot portrait {ORBIT} -o - --format svg --title <script>\x1b[31m",
    "analyze s.toml --effort -8 --markdown",
    "report s.toml --from checks --no-pictures -o -",
    *(f"convert s.toml --to {language}" for language in ("pari", "latex", "mathematica")),
]
PAGES = ("report", "svg", "--markdown")
TAGS = re.compile(r"<script|<img")
# What a terminal obeys, but for the colours of a terminal.
OBEYED = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e]")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a system lies whose texts are hostile, and a database of checks of it."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "s.toml").write_text(SYSTEM)
    (folder / "spec.toml").write_text(SPEC)
    with chdir(folder):
        assert main(["batch", "run", "spec.toml", "--db", "r.db", "-q", "-j", "1"]) == 0
        assert main(["batch", "export", "--db", "r.db", "--jsonl", "-o", "r.jsonl"]) == 0
    return folder


@pytest.mark.parametrize("line", COMMANDS)
def test_no_text_of_a_file_moves_a_terminal_or_becomes_a_tag(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    key = json.loads(Path("r.jsonl").read_text().splitlines()[1])["key"]
    assert main([key if word == "KEY" else word for word in line.split()]) in (0, 1, 3)
    out, err = capsys.readouterr()
    assert len(out) > 20
    assert OBEYED.findall(out + err) == []
    if any(word in line for word in PAGES):
        assert TAGS.findall(re.sub(r"(`+).*?\1", "", out)) == []


@pytest.mark.parametrize("line", [f"orbit {ORBIT} --integral known --format csv", "batch export --db r.db --csv"])
def test_no_cell_of_a_table_is_a_formula(line, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(line.split()) in (0, 3)
    cells = [cell for row in csv.reader(capsys.readouterr().out.splitlines()) for cell in row]
    assert any("=cmd()" in cell for cell in cells)
    assert [c for c in cells if re.match(r"[=+\-@\t\r]", c) and not re.fullmatch(r"-?[0-9./]+", c)] == []


def test_the_commands_that_a_batch_prints_can_be_pasted_whatever_its_files_are_called(tmp_path):
    spec, db = "a b;touch PWNED;#.toml", "$(touch PWNED) '.db"
    (tmp_path / spec).write_text('[experiments.e]\ntask = "check-integrals"\nsystem = "lorenz"\n')
    first = shell('kahanmaps batch run "$SPEC" --db "$DB" -j 1 -e e', tmp_path, SPEC=spec, DB=db)
    why, again = re.search("1 task failed, why: (.*); to try again: (.*)", first.err).groups()
    reasons = shell(why, tmp_path)
    assert (reasons.status, "failed" in reasons.out) == (0, True)
    repeated = shell(again, tmp_path)
    assert repeated.err.splitlines()[0].startswith("1 task to do, results go to $(touch")
    assert repeated.err.splitlines()[-1] == first.err.splitlines()[-1]
    assert not (tmp_path / "PWNED").exists()
