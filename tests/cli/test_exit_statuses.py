"""Exit statuses: what scripts branch on.

0 the claim holds (proved or supported) or the work is done; 1 refuted, and nothing else; 2 usage error or bad input,
with a message that says what was found and what is expected; 3 undecided or stopped early; 70 an internal error;
130 interrupted. (70 and 130 are in test_main.py and test_orbit.py.) Wrong use prints nothing on standard output.
"""

from pathlib import Path

import pytest
from helpers import table

from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report
from kahanmaps_cli.screen.render import exit_status

COMMANDS = table(Path(__file__).with_name("exit_statuses.txt"))
TOP = "euler_top --start 1,2,3 --eps 1/10"


def report(verdict: Certainty, ended_early: bool = False, control: Certainty = Certainty.REFUTED) -> Report:
    """A report of one claim and one control."""
    findings = [Finding("c", v, Evidence("m", "s"), control=c) for v, c in ((verdict, False), (control, True))]
    return Report("commute", tuple(findings), ended_early=ended_early)


STATUSES = {"proved": 0, "supported": 0, "refuted": 1, "undecided": 3}


@pytest.mark.parametrize(("verdict", "status"), [(Certainty(word), status) for word, status in STATUSES.items()])
def test_every_verdict_has_its_exit_status(verdict, status):
    assert exit_status(report(verdict)) == status


def test_an_undecided_check_gives_3(kahanmaps, monkeypatch):
    context = {"system": "henon_heiles", "eps": "every", "time_step": "every"}
    undecided = Report("poisson", report(Certainty.UNDECIDED).findings, context)
    monkeypatch.setattr("kahanmaps.checks.preserve.check_poisson", lambda *_: undecided)
    assert kahanmaps("check-poisson henon_heiles --json").status == 3


# 3


@pytest.mark.parametrize(("command", "status"), [line.split(" => ") for line in COMMANDS["orbits"]])
def test_an_orbit_stopped_early_gives_3_and_a_sentence_on_standard_error(kahanmaps, command, status):
    outcome = kahanmaps(command)
    assert outcome.status == 3
    assert outcome.err.startswith(f"{status}: ")
    assert outcome.out.splitlines()[-1] == f"# {outcome.err.strip()}"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("form", ["text", "jsonl", "csv", "npz"])
def test_a_full_disk_is_no_wrong_use_gives_3_and_names_the_file(kahanmaps, form):
    outcome = kahanmaps(f"orbit {TOP} --steps 2 --format {form} -o /dev/full")
    assert (outcome.status, outcome.err) == (3, "Error: No space left on device: /dev/full\n")
