"""The benchmarks measure the same thing: all contestants that are present compute the same numbers, on a tiny case."""

import sys
from pathlib import Path

import pytest
from helpers import quick

from kahanmaps import KahanMap

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
STEPS = 4


@pytest.fixture(autouse=True)
def _scripts(monkeypatch):
    """The scripts import each other by name, as they do when they are run."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    yield
    for name in [entry for entry in sys.modules if entry in ("work", "run") or entry.startswith("bench_")]:
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
