"""Records and tasks, plans, results, what is pending, and one store made of two."""

import json
from dataclasses import replace
from itertools import permutations
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from helpers import CHARACTERS, refuses
from hypothesis import given, settings
from hypothesis import strategies as st
from small_databases import LIMITS, MEMORY, failed, ok, planned, seed, seeds, small_chunks, task, tasks

from kahanmaps.experiments.results.records import Outcome, Record, Row, Task, TaskLimits, canonical, digest
from kahanmaps.experiments.results.store import Merged, Planned, Store, StoreError


def test_a_stored_record_is_read_back_unchanged(store):
    record = Record(
        task(1).key,
        Outcome.OK,
        {"b": ["1/3", 0.1, None, True], "a": {"ä": "\x00'\""}},
        verdict="supported",
        message="a message",
        stderr=b"the end\nof caf\xe9".decode(errors="surrogateescape"),  # a child may print what is no text
        seconds=1.25,
        peak_memory=1 << 40,
        host="a host",
        versions={"kahanmaps": "1.0", "flint": "3.3"},
        finished="2026-01-02T03:04:05+00:00",
    )
    store.plan("a", "1", LIMITS, tasks(1), {})
    store.add([record])
    assert list(store.rows()) == [Row("a", 0, task(1), replace(record, stderr="the end\nof caf\\udce9"))]


@pytest.mark.parametrize("bad", [{"result": {"x": float("inf")}}, {"seconds": float("nan")}])
def test_numbers_that_are_not_finite_stay_outside_with_all_that_came_along(store, bad):
    store.plan("a", "1", LIMITS, tasks(1, 2), {})
    refuses(r"JSON compliant|nan seconds", store.add, [ok(1), replace(ok(2), **bad)], error=ValueError)
    assert list(store.rows()) == []


def test_a_result_without_a_task_is_refused_with_all_that_came_along(store):
    store.plan("a", "1", LIMITS, tasks(1), {})
    refuses(f"has no task {task(9).key}: plan it", store.add, [ok(1), ok(9)], error=StoreError)
    assert list(store.rows()) == []


@pytest.mark.parametrize(
    ("records", "kept", "attempts"),
    [
        ([failed(1, "first"), failed(1, "second")], failed(1, "second"), 2),
        ([ok(1, "old"), ok(1, "new")], ok(1, "new"), 2),
        ([failed(1), ok(1), failed(1)], ok(1), 3),
    ],
)
def test_the_later_record_counts_but_no_failure_replaces_a_result(store, records, kept, attempts):
    store.plan("a", "1", LIMITS, tasks(1), {})
    for record in records:
        store.add([record])
    (result,) = store.find(task(1).key)
    assert (result.record, result.attempts) == (kept, attempts)
    store.add(records)
    (result,) = store.find(task(1).key)
    assert (result.record, result.attempts) == (kept, 2 * attempts)


def test_the_same_definition_is_resumed_without_making_a_single_task(store):
    def never():
        raise AssertionError
        yield

    store.plan("a", "1", LIMITS, tasks(1, 2, 2), {})
    other = TaskLimits(time=9)
    assert store.plan("a", "1", other, never(), {}) == Planned(3, 2, 0, 0, is_resumed=True)
    assert [job.limits for job in store.pending()] == [other, other]


def test_another_definition_replaces_the_plan_in_its_place_and_keeps_results(store):
    store.plan("a", "1", LIMITS, tasks(1, 2, 3), {})
    store.plan("b", "1", LIMITS, tasks(3, 4), {})
    store.add([ok(1), ok(2)])
    assert store.plan("a", "2", LIMITS, tasks(2, 5), {}) == Planned(total=2, known=1, new_tasks=1, dropped=2)
    assert [(row.experiment, row.number, seed(row.task)) for row in store.rows(missing=True)] == [
        ("a", 0, 2),
        ("a", 1, 5),
        ("b", 0, 3),
        ("b", 1, 4),
    ]
    assert store.unplanned() == 1
    assert store.plan("a", "1", LIMITS, tasks(1, 2, 3), {}) == Planned(total=3, known=3, new_tasks=0, dropped=1)
    assert store.unplanned() == 0
    assert [seed(row.task) for row in store.rows(["a"])] == [1, 2]


def test_a_plan_that_cannot_be_finished_leaves_the_old_one(store):
    def broken():
        yield from tasks(*range(5000))
        raise RuntimeError("the 5000th")

    store.plan("a", "1", LIMITS, tasks(1, 2), {})
    refuses("the 5000th", store.plan, "a", "2", LIMITS, broken(), {}, error=RuntimeError)
    assert seeds(store.pending()) == [1, 2]
    assert store.plan("a", "1", LIMITS, [], {}).is_resumed
    assert store.plan("a", "2", LIMITS, tasks(3), {}) == Planned(1, 0, 1, 2)  # and the store can go on


def test_documents_are_kept_and_may_come_up_while_tasks_are_made(store):
    documents: dict[str, str] = {}

    def made():
        documents[digest("x' = x^2")] = "x' = x^2"
        yield task(1)

    store.plan("a", "1", LIMITS, made(), documents)
    assert store.document(digest("x' = x^2")) == "x' = x^2"
    refuses("no document 0123", store.document, "0123", error=StoreError)
    refuses("not the one with this digest", store.plan, "b", "1", LIMITS, [], {"0123": "text"}, error=StoreError)
    assert [entry.name for entry in store.experiments()] == ["a"]


def test_each_task_is_handed_out_once_whatever_is_added_meanwhile(store):
    with small_chunks():
        store.plan("a", "1", LIMITS, tasks(*range(8), *range(8)), {})
        store.plan("b", "1", LIMITS, tasks(*range(8)), {})
        store.add([failed(number) for number in range(0, 8, 2)])
        store.add([ok(1)])
        seen = []
        for job in store.pending(retry_failed=True):
            seen.append(seed(job.task))
            assert len(seen) < 20
            store.add([failed(seen[-1], "again")])
        assert seen == [0, 2, 3, 4, 5, 6, 7]
        assert (store.count_pending(), store.count_pending(retry_failed=True)) == (0, 7)


numbers = st.integers(0, 12)
plans = st.lists(st.lists(numbers, max_size=15), min_size=1, max_size=3)


@settings(max_examples=20)
@given(plans=plans, done=st.dictionaries(numbers, st.booleans()), parts=st.integers(1, 4), data=st.data())
def test_pending_rows_and_status_agree_with_a_model(plans, done, parts, data):
    names = [f"e{place}" for place in range(len(plans))]
    requested = data.draw(st.none() | st.lists(st.sampled_from(names), unique=True))
    retry = data.draw(st.booleans())
    chosen = [(name, plan) for name, plan in zip(names, plans, strict=True) if requested is None or name in requested]
    rows = [(name, place, number) for name, plan in chosen for place, number in enumerate(plan)]
    everything = {number for plan in plans for number in plan}
    done = {number: is_ok for number, is_ok in done.items() if number in everything}

    expected: list[list[int]] = [[] for _ in range(parts)]
    seen = set()
    for count, (_, _, number) in enumerate(rows):
        if number not in seen and (number not in done or (retry and not done[number])):
            expected[count % parts].append(number)
        seen.add(number)

    with TemporaryDirectory(dir=MEMORY) as folder, small_chunks(), Store.open(f"{folder}/r.db", create=True) as store:
        for name, plan in zip(names, plans, strict=True):
            store.plan(name, "1", LIMITS, tasks(*plan), {})
        store.add([ok(number, verdict="proved") if is_ok else failed(number) for number, is_ok in done.items()])

        for part in range(parts):
            shard = (part + 1, parts)
            assert seeds(store.pending(requested, retry_failed=retry, shard=shard)) == expected[part]
            assert store.count_pending(requested, retry_failed=retry, shard=shard) == len(expected[part])
        complete = seeds(store.pending(requested, retry_failed=retry))
        assert sorted(complete) == sorted(number for part in expected for number in part)

        assert [(r.experiment, r.number, seed(r.task)) for r in store.rows(requested, missing=True)] == rows
        assert [(r.experiment, r.number, seed(r.task)) for r in store.rows(requested)] == [
            r for r in rows if r[2] in done
        ]
        for status, plan in zip(store.status(), plans, strict=True):
            good = sum(done.get(number, False) for number in set(plan))
            bad = sum(not done.get(number, True) for number in set(plan))
            outcomes = {outcome: n for outcome, n in ((Outcome.OK, good), (Outcome.FAILED, bad)) if n}
            assert (status.total, status.tasks) == (len(plan), len(set(plan)))
            assert (status.missing, status.outcomes) == (len(set(plan)) - good - bad, outcomes)
            assert status.verdicts == ({"proved": good} if good else {})
            assert status.seconds == 0.25 * good + 0.5 * bad

        store.plan(names[0], "2", LIMITS, [], {})
        left = {number for plan in plans[1:] for number in plan}
        assert store.unplanned() == len(set(done) - left)
        # Tasks are forgotten when neither a plan nor a result needs them.
        assert {number for number in everything if store.find(task(number).key)} == left | set(done)


def test_a_task_is_found_by_the_beginning_of_its_key(store):
    store.plan("a", "1", LIMITS, tasks(1, 2, 1), {})
    store.plan("b", "1", LIMITS, tasks(1), {})
    store.add([failed(1), ok(1)])
    expected = [(task(1), ok(1), [("a", 0), ("a", 2), ("b", 0)], 2)]
    assert store.find(task(1).key) == expected
    assert store.find(task(1).key[:5].upper()) == expected
    assert store.find(task(2).key[:4]) == [(task(2), None, [("a", 1)], 0)]
    assert store.find(task(3).key) == []


@pytest.mark.parametrize("prefix", ["abc", "xyzw", "a" * 33])
def test_what_is_no_beginning_of_a_key_is_refused(store, prefix):
    refuses("at least 4 of its 32 hexadecimal digits", store.find, prefix, error=StoreError)


def contents(path: Path) -> list[object]:
    with Store.open(path, readonly=True) as store:
        return [store.experiments(), list(store.rows(missing=True)), store.unplanned()]


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
        assert store.merge(source) == replace(merged, results=0, replaced=0)
        assert [row.record for row in store.rows(missing=True)] == [kept]


def test_an_experiment_defined_in_two_ways_stops_the_merge_and_nothing_is_changed(path):
    source = path.with_name("source.db")
    with Store.open(source, create=True) as store:
        store.plan("new", "1", LIMITS, tasks(7, 8), {})
        store.plan("a", "other", LIMITS, tasks(1), {})
        store.add([ok(1), ok(7)])
    planned(path, 1)
    before = contents(path)
    with Store.open(path) as store:
        refuses("experiment a is defined in one way", store.merge, source, error=StoreError)
    assert contents(path) == before


@settings(max_examples=8)
@given(plan=st.lists(numbers, max_size=9), bad=st.sets(numbers), parts=st.integers(1, 3))
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
        complete = contents(run(folder / "whole.db", (1, 1)))
        shards = [run(folder / f"{part}.db", (part, parts)) for part in range(1, parts + 1)]
        for count, order in enumerate(permutations(shards)):
            with Store.open(folder / f"merged{count}.db", create=True) as store:
                for shard in (*order, order[0]):
                    store.merge(shard)
                assert store.count_pending() == 0
            assert contents(folder / f"merged{count}.db") == complete


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(CHARACTERS, max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(CHARACTERS, max_size=3), inner, max_size=3),
    max_leaves=8,
)
tables = st.dictionaries(st.text(CHARACTERS, max_size=5), plain, max_size=4)
any_task = st.builds(Task, st.text(CHARACTERS, max_size=8), st.none() | tables, tables)

ORBIT = Task("orbit", {"family": {"m": 2, "seed": 7}}, {"eps": "1/10", "steps": 5, "start": None})
FILE = Task("orbit", {"document": "d", "name": "top", "parameters": {"a": "2"}}, {"eps": "1/10"})


@given(tables)
def test_canonical_text_says_what_the_data_say_and_does_not_depend_on_the_order_of_names(table):
    assert json.loads(canonical(table)) == table
    assert canonical(dict(reversed(table.items()))) == canonical(table)


@given(any_task)
def test_a_task_is_made_again_from_its_text(task):
    again = Task.from_text(task.text)
    assert (again, again.key) == (task, task.key)


def test_keys_stay_the_same_from_version_to_version():
    # printf of the canonical text | sha256sum, GNU coreutils 9.1, the first 32 digits. Databases hold keys: when this
    # fails, every old result is lost to its task.
    assert digest("abc") == "ba7816bf8f01cfea414140de5dae2223"
    assert (ORBIT.key, FILE.key) == ("9bb970790bd9ee91d5fab53e891129a2", "c6de480710a5912168ac18d97b312d9f")
