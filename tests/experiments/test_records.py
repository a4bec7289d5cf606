"""Records and tasks are plain data that JSON gives back; the key of a task is a hash of what is asked, no more."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.experiments.results.records import Outcome, Record, Task, canonical, digest

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)
tables = st.dictionaries(st.text(max_size=5), plain, max_size=4)
tasks = st.builds(Task, st.text(max_size=8), st.none() | tables, tables)

TASK = Task("orbit", {"family": {"m": 2, "seed": 7}}, {"eps": "1/10", "steps": 5, "start": None})
FILE = Task("orbit", {"document": "d", "name": "top", "parameters": {"a": "2"}}, {"eps": "1/10"})


@given(tables)
def test_canonical_text_says_what_the_data_say_and_does_not_depend_on_the_order_of_names(table):
    assert json.loads(canonical(table)) == table
    assert canonical(dict(reversed(table.items()))) == canonical(table)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), object(), b"x", {1, 2}])
def test_what_is_not_plain_has_no_canonical_text(value):
    with pytest.raises((TypeError, ValueError)):
        canonical({"a": value})


@given(tasks)
def test_a_task_is_made_again_from_its_text(task):
    again = Task.from_text(task.text)
    assert (again, again.key) == (task, task.key)


def test_keys_stay_the_same_from_version_to_version():
    # printf of the canonical text | sha256sum, GNU coreutils 9.1, the first 32 digits. Databases hold keys: when this
    # fails, every old result is lost to its task.
    assert digest("abc") == "ba7816bf8f01cfea414140de5dae2223"
    assert (TASK.key, FILE.key) == ("9bb970790bd9ee91d5fab53e891129a2", "c6de480710a5912168ac18d97b312d9f")


@given(tables, st.none() | tables, st.sampled_from(Outcome))
def test_a_record_is_made_again_from_its_json(versions, result, outcome):
    record = Record("key", outcome, result, "proved", "message", "stderr", 0.1, 10**12, "host", versions, "2026-01-02")
    assert Record.from_json(json.loads(json.dumps(record.to_json()))) == record
