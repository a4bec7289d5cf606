"""kahanmaps analyze: the report in three forms and how it ends; what it says is in answers.txt and said.txt."""

import json
import os
import pty
import signal
import subprocess

import pytest
from cli_helpers import COMMAND, Outcome, time_is_over

from kahanmaps.laboratory.analyses import table
from kahanmaps.laboratory.laboratory import Laboratory


def report(out):
    """(section, status, text) of every line, and the verdict."""
    blocks = [block.splitlines() for block in out.strip().split("\n\n")]
    lines = [(block[0], *line.split("\t")) for block in blocks[1:-1] for line in block[1:]]
    assert (blocks[-1][0], blocks[-1][2][-14:]) == ("verdict", " million units")
    return lines, tuple(blocks[-1][1].split("\t"))


def test_text_json_and_markdown_say_the_same(once):
    lines, verdict = report(once("analyze nahm_tetrahedral").out)
    result = once("analyze nahm_tetrahedral --json").json
    markdown = once("analyze nahm_tetrahedral --markdown").out
    assert [(line["section"], line["status"], line["text"]) for line in result["statements"]] == lines
    assert (result["verdict"]["integrability"], result["verdict"]["sentence"]) == verdict
    assert all(text in markdown.replace("\\", "") for _, _, text in lines)


@pytest.fixture
def one_process(monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.analysis.processors", lambda: 1)


def interrupted(*_, **__):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("part", "sections"),
    [
        ("constant_structures", "not done"),
        ("linear_symmetries", "vector field, integrals, measure, the flow, growth, singularities, structure, not done"),
    ],
)
@pytest.mark.usefixtures("one_process")
def test_an_interrupt_in_any_part_leaves_what_was_found(kahanmaps, monkeypatch, part, sections):
    monkeypatch.setattr(f"kahanmaps.laboratory.analyses.table.{part}", interrupted)
    outcome = kahanmaps("analyze weierstrass")
    lines, verdict = report(outcome.out)
    assert outcome.status == 130
    assert "interrupted: the verdict rests on the results so far" in outcome.err
    assert ", ".join(dict.fromkeys(section for section, _, _ in lines)) == sections
    skipped = [text for section, _, text in lines if section == "not done"]
    assert skipped[-1] == "commuting systems: interrupted"
    assert (verdict[0] == "undecided") is (part == "constant_structures")
    as_json = kahanmaps("analyze weierstrass --json")
    assert (as_json.status, as_json.json["skipped"], as_json.json["interrupted"]) == (130, skipped, True)


@pytest.mark.usefixtures("one_process")
def test_seconds_end_an_analysis_and_what_is_complete_is_printed_unchanged(kahanmaps, monkeypatch, tmp_path):
    complete = kahanmaps("analyze weierstrass").out.split("\n\n")
    monkeypatch.setattr(table, "linear_symmetries", time_is_over)
    outcome = kahanmaps("analyze weierstrass --seconds 1000")
    *sections, skipped, verdict = outcome.out.split("\n\n")
    assert outcome.status == 3
    assert outcome.err == "stopped after 1000 s (--seconds): symmetries\n"
    assert (len(sections), [section for section in sections if section not in complete]) == (8, [])
    parts = ("symmetries", "commuting systems")
    assert skipped.splitlines()[1:] == [f"note\t{part}: stopped (--seconds)" for part in parts]
    assert verdict.startswith("verdict\nintegrable\t")
    as_json = kahanmaps("analyze weierstrass --seconds 1000 --json -q")
    assert (as_json.status, as_json.err, as_json.json["interrupted"]) == (3, "", True)
    page = kahanmaps(f"report weierstrass --seconds 1000 -q -o {tmp_path}/page.html")
    text = (tmp_path / "page.html").read_text()
    assert (page.status, page.err) == (3, "")
    assert "stopped after 1000 s (--seconds): symmetries" in text
    assert "<svg" not in text


def test_seconds_end_a_search_that_has_no_partial_result_with_a_line(kahanmaps, monkeypatch):
    monkeypatch.setattr("kahanmaps.laboratory.preserve.integrals.Laboratory", time_is_over)
    outcome = kahanmaps("find-integrals weierstrass --seconds 1000")
    assert outcome == Outcome(3, "", "stopped after 1000 s (--seconds)\n")
    assert kahanmaps("find-integrals weierstrass --seconds 1000 -q") == Outcome(3, "", "")


def test_seconds_are_those_of_all_rows_of_a_table(kahanmaps, monkeypatch):
    searches = []

    def laboratory(*args, **options):
        searches.append(args)
        return (time_is_over if len(searches) == 3 else Laboratory)(*args, **options)

    monkeypatch.setattr("kahanmaps.laboratory.preserve.integrals.Laboratory", laboratory)
    outcome = kahanmaps("find-integrals henon_heiles -p c=-3..0 --max-degree 1 --seconds 1000")
    assert (outcome.status, [row[0] for row in outcome.rows], len(searches)) == (3, ["c = -3", "c = -2"], 3)
    assert outcome.err == "stopped after 1000 s (--seconds)\n"


def test_seconds_end_a_process_at_any_load():
    words = ["analyze", "kirchhoff_generic", "--effort", "5", "--seconds", "0.5", "--json"]
    done = subprocess.run([*COMMAND, *words], capture_output=True, text=True, timeout=100)
    assert done.returncode == 3
    if done.stdout:  # on a busy machine it may be stopped before the analysis has begun, and nothing is complete
        assert json.loads(done.stdout)["interrupted"] is True
    assert done.stderr.startswith("stopped after 0.5 s (--seconds)")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.usefixtures("one_process")
def test_sections_are_reported_as_soon_as_they_are_final(kahanmaps, monkeypatch):
    messages = []
    monkeypatch.setattr("kahanmaps_cli.commands.analyze.print_stdout", lambda text, **_: messages.append(text.strip()))
    seen = {}
    for part in ("find_densities", "height_survey", "linear_symmetries"):
        original = getattr(table, part)

        def recorded(*args, part=part, original=original, **options):
            seen[part] = list(messages)
            return original(*args, **options)

        monkeypatch.setattr(table, part, recorded)
    kahanmaps("analyze weierstrass")
    assert ("integrals" in seen["find_densities"], "measure" in seen["find_densities"]) == (True, False)
    assert ("the flow" in seen["height_survey"], "growth" in seen["height_survey"]) == (True, False)
    assert ("singularities" in seen["linear_symmetries"], "symmetry" in seen["linear_symmetries"]) == (True, False)
    assert [text for text in ("integrals", "growth", "verdict") if messages.count(text) != 1] == []


@pytest.mark.slow
def test_an_interrupt_gives_130_and_is_prompt():
    ours, theirs = pty.openpty()  # on a terminal progress is told from the first second on
    words = ["analyze", "kirchhoff_generic", "--effort", "5", "--json"]
    process = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=theirs)
    os.close(theirs)
    said = os.read(ours, 4096)  # work is under way
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=60)  # one step in exact arithmetic, on a busy machine
    while b"interrupted" not in said:
        said += os.read(ours, 4096)
    os.close(ours)
    assert process.returncode == 130
    assert json.loads(out)["skipped"][-1].endswith(": interrupted")
    assert b"Traceback" not in said
