"""One database made of two: copies, shards in any order, results that contradict each other."""

from dataclasses import replace
from itertools import permutations
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_databases import LIMITS, MEMORY, failed, ok, planned, seed, small_chunks, task, tasks

from kahanmaps.experiments.results.records import Limits, digest
from kahanmaps.experiments.results.store import Merged, Store, StoreError

numbers = st.integers(0, 12)


def contents(path: Path) -> list[object]:
    with Store.open(path, readonly=True) as store:
        return [store.experiments(), list(store.rows(missing=True)), store.unplanned()]


def test_a_merge_into_an_empty_database_is_a_copy(path):
    source = path.with_name("source.db")
    with Store.open(source, create=True) as store:
        store.plan("a", "1", LIMITS, tasks(1, 2, 2, 3), {digest("d"): "d"})
        store.plan("b", "2", Limits(), tasks(3, 4), {})
        store.add([ok(1), failed(3), ok(4)])
        store.plan("b", "3", Limits(), tasks(3), {})
    with small_chunks(), Store.open(path, create=True) as store:
        assert store.merge(source) == Merged(tasks=4, results=3, replaced=0, conflicts=0)
        assert store.document(digest("d")) == "d"
        assert store.unplanned() == 1
        assert store.merge(source) == Merged(0, 0, 0, 0)
    assert contents(path) == contents(source)


MINE_AND_THEIRS = [
    (None, ok(1), ok(1), Merged(0, 1, 0, 0)),
    (ok(1), None, ok(1), Merged(0, 0, 0, 0)),
    (failed(1), ok(1), ok(1), Merged(0, 0, 1, 0)),
    (ok(1), failed(1), ok(1), Merged(0, 0, 0, 0)),
    (failed(1, "mine"), failed(1, "theirs"), failed(1, "mine"), Merged(0, 0, 0, 0)),
    (ok(1), replace(ok(1), seconds=9.0, host="there"), ok(1), Merged(0, 0, 0, 0)),
    (ok(1, "1/2"), ok(1, "1/3"), ok(1, "1/2"), Merged(0, 0, 0, 1, (task(1).key,))),
    (ok(1, verdict="proved"), ok(1, verdict="refuted"), ok(1, verdict="proved"), Merged(0, 0, 0, 1, (task(1).key,))),
]


@pytest.mark.parametrize(("mine", "theirs", "kept", "merged"), MINE_AND_THEIRS)
def test_of_two_results_of_a_task_the_right_one_is_kept(path, mine, theirs, kept, merged):
    source = planned(path.with_name("source.db"), 1, records=[r for r in [theirs] if r])
    planned(path, 1, records=[r for r in [mine] if r])
    with Store.open(path) as store:
        assert store.merge(source) == merged
        assert [row.record for row in store.rows(missing=True)] == [kept]
        again = store.merge(source)
        assert again == replace(merged, results=0, replaced=0)
        assert [row.record for row in store.rows(missing=True)] == [kept]


def test_attempts_come_along_and_do_not_grow_when_merged_again(path):
    source = planned(path.with_name("source.db"), 1, 2, records=[failed(1), failed(1), ok(1), failed(2), failed(2)])
    planned(path, 1, 2, records=[failed(1)])
    with Store.open(path) as store:
        for _ in range(2):
            store.merge(source)
            assert [store.find(task(number).key)[0].attempts for number in (1, 2)] == [4, 2]


def test_all_conflicts_are_counted_and_the_first_few_named(path):
    source = planned(path.with_name("source.db"), *range(9), records=[ok(number, "1") for number in range(9)])
    planned(path, *range(9), records=[ok(number, "2") for number in range(9)])
    with Store.open(path) as store:
        assert store.merge(source) == Merged(0, 0, 0, 9, tuple(task(number).key for number in range(5)))


def test_an_experiment_defined_in_two_ways_stops_the_merge_and_nothing_is_changed(path):
    source = path.with_name("source.db")
    with Store.open(source, create=True) as store:
        store.plan("new", "1", LIMITS, tasks(7, 8), {})
        store.plan("a", "other", LIMITS, tasks(1), {})
        store.add([ok(1), ok(7)])
    planned(path, 1)
    before = contents(path)
    with Store.open(path) as store, pytest.raises(StoreError, match="experiment a is defined in one way"):
        store.merge(source)
    assert contents(path) == before


def test_a_database_is_not_merged_with_itself_nor_with_anything_else(path, store):
    with pytest.raises(StoreError, match="is this database itself"):
        store.merge(path)
    with pytest.raises(StoreError, match="there is no database"):
        store.merge(path.with_name("nothing.db"))
    path.with_name("text").write_text("text" * 1000)
    with pytest.raises(StoreError, match="text is not an SQLite database"):
        store.merge(path.with_name("text"))


@settings(max_examples=8)
@given(plan=st.lists(numbers, max_size=15), bad=st.sets(numbers), parts=st.integers(1, 3))
def test_shards_merged_in_any_order_are_the_whole(plan, bad, parts):
    def run(path: Path, shard: tuple[int, int]) -> Path:
        with Store.open(path, create=True) as store:
            store.plan("a", "1", LIMITS, tasks(*plan), {})
            for job in store.pending(shard=shard):
                number = seed(job.task)
                store.add([failed(number) if number in bad else ok(number)])
        return path

    with TemporaryDirectory(dir=MEMORY) as name, small_chunks():
        folder = Path(name)
        whole = contents(run(folder / "whole.db", (1, 1)))
        shards = [run(folder / f"{part}.db", (part, parts)) for part in range(1, parts + 1)]
        for count, order in enumerate(permutations(shards)):
            with Store.open(folder / f"merged{count}.db", create=True) as store:
                for shard in (*order, order[0]):
                    store.merge(shard)
                assert store.count_pending() == 0
            assert contents(folder / f"merged{count}.db") == whole
