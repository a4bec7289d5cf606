"""Batches of maps that are not Kahan's."""

from pathlib import Path

import pytest

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.store import Store
from kahanmaps.experiments.running.local import perform
from kahanmaps.experiments.running.run import run
from kahanmaps.experiments.spec import parse_spec

FILES = sorted((Path(__file__).parents[2] / "examples" / "maps").glob("*.toml"))
SPEC = """
name = "maps"
[experiments.degrees]
task = "degrees"
system = [{files}]
options = { terms = 3 }
[experiments.confined]
task = "singularities"
system = [{files}]
options = { eps = "1/3" }
[experiments.orbits]
task = "orbit"
system = [{files}]
options = { eps = "1/10", steps = 3 }
axes = { arithmetic = ["exact", "float", "mod:10007"] }
[experiments.measures]
task = "check-measure"
system = [{files}]
[experiments.integrals]
task = "find-integrals"
system = [{files}]
"""


def test_a_batch_takes_all_kinds_of_map_and_says_of_each_task_that_does_not(tmp_path):
    text = SPEC.replace("{files}", ", ".join(f'"{path}"' for path in FILES))
    database = tmp_path / "maps.db"
    list(run(parse_spec(text, "maps.toml"), database))
    answer, verdicts = {}, set()
    with Store.open(database) as store:
        for row in store.rows():
            answer.setdefault(row.task.kind, []).append((row.record.outcome, row.record.result or {}))
            verdicts.add((row.task.kind, row.record.verdict))
    assert sorted(result["degrees"][3] for _, result in answer["degrees"]) == [8, 9, 19, 19, 74]
    assert [outcome for outcome, _ in answer["singularities"]] == ["ok"] * 5
    assert {(outcome, result["status"]) for outcome, result in answer["orbit"]} == {("ok", "completed")}
    assert {verdict for kind, verdict in verdicts if kind == "check-measure"} == {"proved"}
    assert [outcome for outcome, _ in answer["find-integrals"]] == ["ok"] * 5


WITHOUT_EPS = """
[experiments.orbits]
task = "orbit"
system = ["lyness", "somos_4"]
options = { steps = 3 }
[experiments.heights]
task = "heights"
system = "lyness"
options = { steps = 12 }
[experiments.exponents]
task = "lyapunov"
system = "lyness"
options = { steps = 12, orbits = 2 }
[experiments.many]
task = "ensemble"
system = "lyness"
options = { steps = 12, orbits = 2 }
"""


def test_no_eps_is_asked_for_where_no_map_depends_on_it():
    spec = parse_spec(WITHOUT_EPS, "maps.toml")
    tasks = [task for experiment in spec.experiments for task in experiment.tasks()]
    assert [perform(task, None, spec.documents)["outcome"] for task in tasks] == ["ok"] * 5
    with pytest.raises(InputError, match=r"axes\.eps: missing, expected half the time step"):
        parse_spec(WITHOUT_EPS.replace('"lyness", "somos_4"', '"lyness", "euler_top"'), "maps.toml")
