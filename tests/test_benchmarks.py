"""The benchmarks measure the same thing: all contestants that are present compute the same numbers, on a tiny case."""

import gc
import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest
from flint import fmpq
from helpers import quick

from kahanmaps import KahanMap, load

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
STEPS = 4


@pytest.fixture(autouse=True)
def _scripts(monkeypatch):
    """The scripts import each other by name, as they do when they are run."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield
    for name in [entry for entry in sys.modules if entry in ("work", "run", "peers") or entry.startswith("bench_")]:
        sys.modules.pop(name, None)


def stepped(work, steps):
    """The last iterate by the definition of the map, as reduced pairs."""
    phi, x = KahanMap(work.system, work.eps), work.start
    for _ in range(steps):
        x = phi.step(x)
    return [(entry.p, entry.q) for entry in x]


@pytest.mark.parametrize("m", quick([2, 3], [2]))
@pytest.mark.parametrize("kind", ["KAHANMAPS", "PEERS", "FRACTION"])
def test_contestants_of_the_exact_orbit_arrive_where_the_map_does(kind, m):
    import bench_exact
    import work

    listed = getattr(bench_exact, kind)
    present = []
    for name, run in listed if isinstance(listed, list) else [listed]:
        try:
            _, last = run(work.work(m), STEPS)
        except work.Absent:
            continue
        assert last == stepped(work.work(m), STEPS), name
        present.append(name)
    assert present


def test_a_contestant_with_another_result_stops_the_run():
    import bench_exact
    import work

    name, run = bench_exact.KAHANMAPS[0]

    def wrong(work, steps):
        return run(work, steps + 1)

    with pytest.raises(work.Disagreement, match="the wrong one"):
        bench_exact.contest(work.work(2), STEPS, [(name, run), ("the wrong one", wrong)])


def test_other_programs_get_the_map_and_the_inverse_that_kahanmaps_has():
    import peers

    for name in peers.INPUTS:
        entry, file = peers.described(name, 1), load(name)
        point = [fmpq(int(p), int(q)) for p, q in (text.split("/") for text in entry["start"])]
        for sign in (1, -1):
            *images, last = (form(*point, fmpq(1)) for form in peers.forms(file.system.scaled(sign)))
            assert [image / last for image in images] == list(KahanMap(file.system, fmpq(sign, 10)).step(point))


@pytest.mark.parametrize("name", [*sorted(path.stem for path in BENCHMARKS.glob("[!p]*.py")), "peers"])
def test_a_benchmark_changes_no_setting_of_python_by_being_imported(name):
    def settings():
        return sys.get_int_max_str_digits(), sys.getrecursionlimit(), gc.get_threshold(), dict(os.environ)

    before = settings()
    importlib.import_module(name)
    assert settings() == before


@pytest.mark.slow
@pytest.mark.parametrize("part", ["exact", "fields", "catalogue", "iterate", "degrees", "analysis", "memory", "units"])
def test_a_part_of_the_benchmarks_runs_in_its_quick_form(part):
    command = [sys.executable, str(BENCHMARKS / "run.py"), "--quick", "--only", part]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, f"== {part}" in done.stdout + done.stderr) == (0, True), done.stderr[-1000:]


def test_other_answers_of_other_programs_are_noticed():
    import peers

    assert peers.compared("SageMath", "degrees", [2, 4, 8], [2, 4, 8]) == ""
    assert peers.compared("Macaulay2", "degrees", "{2, 4, 9}", [2, 4, 8]) == "**2, 4, 9**"
    assert peers.compared("PARI", "orbit", "[[1/2, 1/3]~, [3, 4]~]", [["1/2", "1/3"], ["3", "4"]]) == ""
    assert peers.compared("PARI", "orbit", "[[1/2, 1/3]~, [3, 5]~]", [["1/2", "1/3"], ["3", "4"]]) != ""
    # At infinity kahanmaps lists no fixed points.
    assert peers.compared("SageMath", "fixed points", [["0", "0", "1"], ["1", "0", "0"]], [["0", "0"]]) == ""
    assert peers.compared("SageMath", "fixed points", [["1", "0", "1"]], [["0", "0"]]) == "**another list of 1 point**"
    assert peers.compared("PARI", "integrals", "0", "1") == "**0**"
