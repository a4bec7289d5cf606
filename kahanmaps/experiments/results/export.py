"""Export of results as JSON lines with all data, or as CSV and Parquet tables with one column for every entry.

JSON lines are lossless. In a table a dict becomes several columns (heights.max), a list becomes JSON text, and None or
an absent entry becomes an empty cell. The columns of a table, in this order:

    experiment number key task      always
    document m seed parameters.a    the entries of the system spec; entries of "family" without prefix
    eps steps                       options
    outcome verdict                 always; a missing task has no outcome
    dimension heights.max           entries of the result
    message                         always
    seconds peak_memory host finished   unless the export is stable

If entries have the same name, one of them keeps it, in this order: fixed columns, options, system spec, result. The
other entries are called option.seed, family.seed (system.document) or result.seed in all rows of the export.

A stable export omits everything that depends on where, when and how the tasks were run, so that two exports of the same
tasks have the same bytes.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache
from importlib import import_module
from math import inf
from typing import IO, Any

from kahanmaps.algebra.printing import NUMBER, csv_line, spreadsheet_safe
from kahanmaps.atomic_files import atomic_write
from kahanmaps.errors import InputError, quoted
from kahanmaps.experiments.results.records import Row, encodable
from kahanmaps.version import __version__

FIRST_COLUMNS = ("experiment", "number", "key", "task")
MIDDLE_COLUMNS = ("outcome", "verdict")
LAST_COLUMNS = ("message",)
RUN_COLUMNS = ("seconds", "peak_memory", "host", "finished")  # a stable export omits these, and stderr and versions
_COLUMNS = (*FIRST_COLUMNS, *MIDDLE_COLUMNS, *LAST_COLUMNS, *RUN_COLUMNS)
RESERVED = frozenset((*_COLUMNS, "system", "options", "result", "stderr", "versions"))

_ENCODER = json.JSONEncoder(sort_keys=True, allow_nan=False)
_MAX_DIGITS = 2_000  # maximal length of text that is recognized as a number
_MAX_ROWS = 10_000  # number of rows in one row group of Parquet
_MAX_CHARACTERS = 50_000_000  # number of characters in one row group: rows with long lists may take gigabytes


# The path of a value in a row: "option", "system" or "result", followed by keys.
Entry = tuple[str, ...]


def flatten(data: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield the path of keys and the value of each entry in nested dicts; a list is a single value.

    >>> list(flatten({"a": 1, "b": {"c": [2, 3]}}))
    [(('a',), 1), (('b', 'c'), [2, 3])]
    """
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from flatten(value, (*path, key))
        else:
            yield (*path, key), value


def entries(row: Row) -> Iterator[tuple[Entry, Any]]:
    """Yield paths and values of the entries of a row: its options, its system spec, its result."""
    result = row.record.result if row.record is not None else None
    for section, data in (("option", row.task.options), ("system", row.task.system), ("result", result)):
        yield from flatten(data or {}, (section,))


@lru_cache(10_000)  # thousands of rows have the same few entries
def names_of(entry: Entry) -> tuple[str, str]:
    """Return the short name of an entry, and the long name used if another entry has the same short name.

    >>> names_of(("system", "family", "m")), names_of(("result", "heights", "max"))
    (('m', 'family.m'), ('heights.max', 'result.heights.max'))
    """
    section, *keys = entry[entry[:2] == ("system", "family") and len(entry) > 2 :]
    name = ".".join(keys)
    return name, f"{section}.{name}"


def to_text(value: Any) -> str:
    """Return a value as text: integers and texts unchanged, the empty text for None, lists as JSON.

    >>> [to_text(value) for value in (None, True, 10**20, 0.1, "7/3", [1, 8])]
    ['', 'true', '100000000000000000000', '0.1', '7/3', '[1, 8]']
    """
    if value is None:
        return ""
    if isinstance(value, str):
        return encodable(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    return _ENCODER.encode(value)


def cell(value: Any) -> str:
    """Return a value as text for a CSV file; text that a spreadsheet would execute is escaped by an apostrophe."""
    return spreadsheet_safe(to_text(value)) if isinstance(value, str) else to_text(value)


def is_number(value: Any) -> bool:
    """Whether a value is a finite number, True or False, or the text of an exact number: 7/3, 21.2031."""
    if isinstance(value, str):
        return len(value) <= _MAX_DIGITS and NUMBER.fullmatch(value) is not None
    return isinstance(value, int | float) and -inf < value < inf


def nearest_double(value: Any) -> float:
    """Return the double nearest to an exact number; infinite if the number exceeds all doubles.

    >>> nearest_double("7/3"), nearest_double("0.1"), nearest_double(-(10**400))
    (2.3333333333333335, 0.1, -inf)
    """
    numerator, _, denominator = str(value).partition("/") if isinstance(value, str) else (value, "", "")
    try:  # Python rounds decimals and quotients of integers correctly
        return int(numerator) / int(denominator) if denominator else float(numerator)
    except OverflowError:
        return inf if int(numerator) > 0 else -inf


def write_jsonl(rows: Iterable[Row], stream: IO[str], *, stable: bool = False) -> None:
    """Write one JSON object per line: a header, a result for each row, and a last line with the number of results.

    Entries that a task without a record lacks are null. Dicts inside a line are sorted by their keys.
    """
    from kahanmaps.maps.convention import CONVENTION  # loads FLINT: only when results are written

    omitted = {*RUN_COLUMNS, "stderr", "versions"} if stable else set()
    header = {"record": "header"} if stable else {"record": "header", "version": __version__}
    stream.write(_json_line({**header, "convention": CONVENTION}))
    count = 0
    for row in rows:
        stream.write(_json_line({"record": "result", **{k: v for k, v in row_data(row).items() if k not in omitted}}))
        count += 1
    stream.write(_json_line({"record": "end", "results": count}))


def write_csv(rows: Callable[[], Iterable[Row]], stream: IO[str], *, stable: bool = False) -> None:
    """Write a table with a header row. `rows` is called twice: first for the names of the columns, then for the values.

    Open files with newline="": without it some systems translate "\\n".
    """
    layout = _Layout(rows(), stable)
    stream.write(csv_line(map(cell, layout.names)))
    for row in rows():
        cells = layout.cells(row)
        stream.write(csv_line(cell(cells.get(name)) for name in layout.names))


def write_parquet(rows: Callable[[], Iterable[Row]], path: str | os.PathLike[str], *, stable: bool = False) -> None:
    """Write the same table as `write_csv` in the format Parquet, which needs pyarrow.

    `rows` is called twice, and the complete file replaces `path`. A column has the type int64, bool or float64 if this
    type represents all its values exactly (a float64 column may contain integers up to 2^53), and text otherwise. A
    text column NAME whose values are all exact numbers such as 7/3 is followed by NAME.number with the nearest doubles.
    The bytes of a stable export also depend on the version of pyarrow.
    """
    try:
        arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError as error:
        raise InputError(f"Parquet files need pyarrow ({error}): pip install 'kahanmaps[tables]'") from error
    from kahanmaps.maps.convention import CONVENTION

    layout = _Layout(rows(), stable, typed=True)
    number_columns = {name: f"{name}.number" for name in layout.numbers if f"{name}.number" not in layout.types}
    types = {"int64": arrow.int64(), "bool": arrow.bool_(), "float64": arrow.float64(), "string": arrow.string()}
    fields = {**layout.types, **dict.fromkeys(number_columns.values(), "float64")}
    schema = arrow.schema(
        [arrow.field(to_text(name), types[kind]) for name, kind in fields.items()],
        metadata={"convention": CONVENTION} if stable else {"convention": CONVENTION, "version": __version__},
    )
    with atomic_write(path) as stream, parquet.ParquetWriter(stream, schema) as writer:

        def write(row_group: list[dict[str, Any]]) -> None:
            try:
                writer.write_table(arrow.Table.from_pylist(row_group, schema))
            except (arrow.ArrowInvalid, arrow.ArrowTypeError) as error:
                raise InputError(_CHANGED.format("a value", "")) from error

        row_group: list[dict[str, Any]] = []
        characters = 0
        for row in rows():
            cells = {}
            for name, value in layout.cells(row).items():
                if value is not None and layout.types[name] == "string":
                    if name in number_columns:
                        cells[number_columns[name]] = nearest_double(value)
                    value = to_text(value)
                    characters += len(value)
                cells[to_text(name)] = value
            row_group.append(cells)
            if len(row_group) == _MAX_ROWS or characters > _MAX_CHARACTERS:
                write(row_group)
                row_group, characters = [], 0
        if row_group:
            write(row_group)


class _Layout:
    """The `names` of the columns of a table; if `typed`, their `types`, and the columns `numbers` of exact numbers."""

    def __init__(self, rows: Iterable[Row], stable: bool, typed: bool = False) -> None:
        kinds: defaultdict[Entry, set[str]] = defaultdict(set)
        for row in rows:
            for entry, value in entries(row):
                kinds[entry].add(_kind_of_value(value) if typed else "text")
        self._column_of: dict[Entry, str] = {}
        used_names = set(RESERVED)
        names_by_section: dict[str, list[str]] = {"option": [], "system": [], "result": []}
        for section, names in names_by_section.items():
            for entry in sorted(entry for entry in kinds if entry[0] == section):
                name, long_name = names_of(entry)
                name = long_name if name in used_names else name
                while name in used_names:  # {"a": {"b": 1}, "a.b": 2}, or a result that is called result.seed
                    name = f"{section}.{name}"
                used_names.add(name)
                names.append(name)
                self._column_of[entry] = name
        last_columns = LAST_COLUMNS if stable else (*LAST_COLUMNS, *RUN_COLUMNS)
        self._fixed_columns = (*FIRST_COLUMNS, *MIDDLE_COLUMNS, *last_columns)
        systems, options, results = (names_by_section[section] for section in ("system", "option", "result"))
        self.names = (*FIRST_COLUMNS, *systems, *options, *MIDDLE_COLUMNS, *results, *last_columns)
        self.types = {name: _FIXED_TYPES.get(name, "string") for name in self.names}
        self.numbers = []
        entry_of = {name: entry for entry, name in self._column_of.items()}
        for name in (name for name in self.names if name in entry_of):
            value_kinds = kinds[entry_of[name]] - {"none"}
            if value_kinds:  # the first type that fits; a column without values has the type string
                self.types[name] = next(type_ for type_, fitting in _KINDS_OF_TYPE.items() if value_kinds <= fitting)
            if {"number"} <= value_kinds <= _NUMBER_KINDS:
                self.numbers.append(name)

    def cells(self, row: Row) -> dict[str, Any]:
        """Return the values of a row by the names of their columns."""
        fixed = row_data(row)
        cells = {name: fixed[name] for name in self._fixed_columns}
        for entry, value in entries(row):
            if entry not in self._column_of:
                raise InputError(_CHANGED.format(f"the value {quoted(names_of(entry)[0])}", f" of task {row.number}"))
            cells[self._column_of[entry]] = value
        return cells


_CHANGED = "found {}{} changed while the table was written: export again when nobody works on the batch"
# For each type of Parquet the kinds of values that it represents (small: integers up to 2^53); the first fit is used.
_KINDS_OF_TYPE = {
    "bool": {"bool", "none"},
    "int64": {"small", "int64", "none"},
    "float64": {"small", "float64", "none"},
    "string": {"bool", "small", "int64", "float64", "number", "text", "none"},
}
_NUMBER_KINDS = {"small", "int64", "float64", "number"}
_FIXED_TYPES = {"number": "int64", "seconds": "float64", "peak_memory": "int64"}


def _kind_of_value(value: Any) -> str:
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, int):
        return "small" if abs(value) <= 2**53 else "int64" if -(2**63) <= value < 2**63 else "text"
    if isinstance(value, float):
        return "float64"
    return "none" if value is None else "number" if isinstance(value, str) and is_number(value) else "text"


def row_data(row: Row) -> dict[str, Any]:
    """Return the entries that every row has, in the order of JSON lines; entries of a missing record are None."""
    task, record = row.task, row.record
    of_record = ("verdict", "result", "message", "stderr", "seconds", "peak_memory", "host", "versions", "finished")
    return {
        "experiment": row.experiment,
        "number": row.number,
        "key": task.key,
        "task": task.kind,
        "system": task.system,
        "options": task.options,
        "outcome": record and str(record.outcome),
        **{name: getattr(record, name, None) for name in of_record},
    }


def _json_line(record: Mapping[str, Any]) -> str:
    """Return a line of JSON; only dicts inside the record are sorted by keys."""
    return "{" + ", ".join(f"{json.dumps(name)}: {_ENCODER.encode(value)}" for name, value in record.items()) + "}\n"
