"""Exports: nothing is lost in JSON lines, tables have the columns and types that are promised, memory stays small."""

import csv
import io
import json
import math
import sys
import tracemalloc
from dataclasses import replace

import pytest
from helpers import CHARACTERS, refuses
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.experiments.results.export import cell, flatten, write_csv, write_jsonl, write_parquet
from kahanmaps.experiments.results.records import Outcome, Record, Row, Task

FAMILY = Task("check-commute", {"family": {"m": 3, "seed": 7}}, {"eps": "1/10", "steps": 5})
FILE = Task("check-commute", {"document": "d1", "parameters": {"a": "1/2"}}, {"eps": None, "steps": 5})


def row(number=0, task=FAMILY, result=None, **more):
    run = {"seconds": 1.5, "peak_memory": 4096, "host": "hilbert", "finished": "2025-01-01", "stderr": "a warning"}
    return Row("e", number, task, Record(task.key, Outcome.OK, result, **run, versions={"python": "3.11"}, **more))


def jsonl(rows, **options):
    stream = io.StringIO()
    write_jsonl(rows, stream, **options)
    return stream.getvalue()


def csv_text(rows, **options):
    stream = io.StringIO(newline="")
    write_csv(lambda: iter(rows), stream, **options)
    return stream.getvalue()


def table(rows, **options):
    """A CSV export, as a reader of its rows as dicts."""
    return csv.DictReader(io.StringIO(csv_text(rows, **options), newline=""), strict=True)


TEXTS = st.text(CHARACTERS, max_size=8) | st.sampled_from(
    ["=A1", "-1/2", "+x", "'=1", "a\rb", "a\nb", 'a"b', "\udc80", "\0", "-1e5"]
)
SCALARS = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | TEXTS
DATA = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3), max_leaves=5
)
DICTS = st.dictionaries(TEXTS, DATA, max_size=3)
OPTIONS = st.dictionaries(TEXTS, SCALARS, max_size=3)
TASKS = st.builds(Task, TEXTS, st.none() | st.fixed_dictionaries({"family": DICTS}), OPTIONS)
RECORDS = st.builds(
    Record,
    key=st.just(""),
    outcome=st.sampled_from(Outcome),
    result=st.none() | DICTS,
    verdict=st.none() | st.sampled_from(["proved", "refuted"]),
    message=TEXTS,
    stderr=TEXTS,
    seconds=st.floats(0, 1e6),
    peak_memory=st.none() | st.integers(0, 2**40),
    host=TEXTS,
    versions=st.dictionaries(TEXTS, TEXTS, max_size=2),
    finished=TEXTS,
)


@st.composite
def many_rows(draw):
    tasks = draw(st.lists(TASKS, max_size=3))
    records = [draw(st.none() | RECORDS) for _ in tasks]
    return [
        Row("e", number, task, record and replace(record, key=task.key))
        for number, (task, record) in enumerate(zip(tasks, records, strict=True))
    ]


@given(many_rows())
def test_lines_parse_back_to_what_was_put_in(rows):
    header, *results, end = [json.loads(line) for line in jsonl(rows).split("\n")[:-1]]
    assert (header["record"], end) == ("header", {"record": "end", "results": len(rows)})
    for data, source in zip(results, rows, strict=True):
        assert (data["experiment"], data["number"], data["key"]) == (source.experiment, source.number, source.task.key)
        assert Task(data["task"], data["system"], data["options"]) == source.task
        of_record = {name: data[name] for name in Record("", Outcome.OK).to_json()}
        if source.record is None:
            assert {value for name, value in of_record.items() if name != "key"} == {None}
        else:
            assert Record.from_json(of_record) == source.record


def test_columns_come_in_the_documented_order():
    rows = [row(0, FAMILY, {"heights": {"max": 8}, "claims": 3}), row(1, FILE)]
    expected = "experiment number key task document m seed parameters.a eps steps outcome verdict claims heights.max"
    assert table(rows).fieldnames == [*expected.split(), "message", "seconds", "peak_memory", "host", "finished"]


def test_a_clash_of_names_is_settled_for_options_then_the_recipe_then_the_result():
    task = Task("orbit", {"family": {"seed": 1, "m": 2}}, {"seed": 2, "verdict": "v", "host": "h"})
    (result,) = table([row(task=task, result={"seed": 3, "m": 4, "system": 5, "verdict": 6}, verdict="proved")])
    names = ["seed", "family.seed", "result.seed", "m", "result.m", "result.system"]
    assert [result[name] for name in names] == ["2", "1", "3", "2", "4", "5"]
    names = ["verdict", "option.verdict", "result.verdict", "host", "option.host"]
    assert [result[name] for name in names] == ["proved", "v", "6", "hilbert", "h"]
    (result,) = table([row(result={"a": {"b": 1}, "a.b": 2, "result.a.b": 3})])
    assert [result[name] for name in ("a.b", "result.a.b", "result.result.a.b")] == ["1", "2", "3"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (True, "true"),
        (10**40 + 1, "1" + "0" * 39 + "1"),
        (-0.1, "-0.1"),
        ("-7/3", "-7/3"),
        ("-1.5e-3", "-1.5e-3"),
        ([1, "a", None], '[1, "a", null]'),
        ("=1+1", "'=1+1"),
        ("@x", "'@x"),
        ("+x", "'+x"),
        ("-1/0", "'-1/0"),  # no number
        ("\t=1", "'\t=1"),
        ("'=1", "''=1"),
        ("'quoted'", "'quoted'"),
        ("\udc80", "\\udc80"),
    ],
)
def test_a_cell_says_the_value(value, text):
    assert cell(value) == text


@given(many_rows())
def test_a_table_reads_back_cell_by_cell(rows):
    outcome = list(table(rows))
    assert len(outcome) == len(rows)
    for cells, source in zip(outcome, rows, strict=True):
        record = source.record
        result = dict(flatten(record.result or {})) if record else {}
        parts = [*dict(flatten(source.task.system or {})).values(), *source.task.options.values(), *result.values()]
        always = [source.experiment, source.number, source.task.key, source.task.kind]
        if record:
            always += [record.outcome, record.verdict, record.message]
            always += [record.seconds, record.peak_memory, record.host, record.finished]
        expected = sorted(filter(None, map(cell, [*parts, *always])))
        assert sorted(filter(None, cells.values())) == expected


@given(many_rows())
def test_stable_exports_are_the_same_bytes_wherever_the_work_was_done(rows):
    run = {"seconds": 9.0, "peak_memory": None, "host": "noether", "stderr": "x", "versions": {}, "finished": "later"}
    others = [replace(row, record=row.record and replace(row.record, **run)) for row in rows]
    assert jsonl(rows, stable=True) == jsonl(others, stable=True)
    assert csv_text(rows, stable=True) == csv_text(others, stable=True)


class Sink:
    """A stream that keeps nothing but the count."""

    lines = 0

    def write(self, text):
        self.lines += text.count("\n")
        return len(text)


def stream_of_rows(count):
    """Rows that differ, made one at a time."""
    for number in range(count):
        yield row(number, result={"claims": number, "constant": f"{number}/7"})


@pytest.mark.parametrize(
    ("write", "extra_lines"),
    [
        (lambda count, sink: write_jsonl(stream_of_rows(count), sink), 2),
        (lambda count, sink: write_csv(lambda: stream_of_rows(count), sink), 1),
    ],
    ids=["jsonl", "csv"],
)
def test_many_rows_are_never_held_together(write, extra_lines):
    write(1, Sink())  # what is loaded late does not count
    sink = Sink()
    tracemalloc.start()
    try:
        write(1_000, sink)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sink.lines == 1_000 + extra_lines
    assert peak < 300_000  # measured: 4 kB and 140 kB, for any count; 1,000 rows in a list take 700 kB


@pytest.fixture
def parquet(tmp_path):
    """Writes rows, and reads the file back."""
    reader = pytest.importorskip("pyarrow.parquet")

    def written(rows, **options):
        path = tmp_path / "results.parquet"
        write_parquet(lambda: iter(rows), path, **options)
        assert [entry.name for entry in tmp_path.iterdir()] == ["results.parquet"]
        return reader.ParquetFile(path)

    return written


@pytest.mark.parametrize(
    ("values", "kind", "expected"),
    [
        ([1, None, -(2**63)], "int64", [1, None, -(2**63)]),
        ([1, 2**63], "string", ["1", str(2**63)]),
        ([True, 1], "string", ["true", "1"]),
        ([1, 0.5], "double", [1.0, 0.5]),
        ([2**53 + 1, 0.5], "string", [str(2**53 + 1), "0.5"]),  # a float would lose the last digit
        (["=1", "\udc80"], "string", ["=1", "\\udc80"]),  # no spreadsheet here
        ([None, None], "string", [None, None]),
    ],
)
def test_a_column_of_parquet_has_the_type_that_fits_all_its_values(parquet, values, kind, expected):
    result = parquet([row(number, result={"x": value}) for number, value in enumerate(values)]).read()
    assert str(result.schema.field("x").type) == kind
    assert result["x"].to_pylist() == expected


def test_parquet_has_the_columns_of_the_csv_file(parquet):
    rows = [row(0, result={"seed": 1, "a": {"b": 2}}), row(1, FILE), Row("e", 2, FAMILY, None)]
    for stable in (False, True):
        result = parquet(rows, stable=stable).read()
        beside = [name for name in result.column_names if name.endswith(".number")]
        assert beside == ["parameters.a.number", "eps.number"]
        assert result["parameters.a.number"].to_pylist() == [None, 0.5, None]
        result, expected = result.drop_columns(beside), table(rows, stable=stable)
        assert result.column_names == expected.fieldnames
        assert [{name: cell(value) for name, value in line.items()} for line in result.to_pylist()] == list(expected)


def test_numbers_of_parquet_stand_beside_the_exact_text(parquet):
    values = ["7/3", None, 2, f"1{'0' * 400}", "-1e5"]
    result = parquet([row(number, result={"x": value}) for number, value in enumerate(values)]).read()
    assert result["x"].to_pylist() == ["7/3", None, "2", f"1{'0' * 400}", "-1e5"]
    assert result["x.number"].to_pylist() == [7 / 3, None, 2.0, math.inf, -1e5]
    result = parquet([row(0, result={"x": "7/3"}), row(1, result={"x": "more"})]).read()
    assert "x.number" not in result.column_names
    result = parquet([row(0, result={"x": "7/3", "x.number": 5})]).read()
    assert result["x.number"].to_pylist() == [5]


def test_without_pyarrow_the_error_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    refuses(r"need pyarrow .*: pip install 'kahanmaps\[tables\]'", write_parquet, list, tmp_path / "x.parquet")
