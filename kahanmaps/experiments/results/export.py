"""Export of results: JSON lines with all data, or a CSV or Parquet table with a column for every entry.

JSON lines are lossless. In a table the entries of a dict are separate columns (heights.max), a list is a cell of JSON
text, and None or an absent entry is an empty cell. A table has the following columns in this order:

    experiment number key task      always
    document m seed parameters.a    the entries of the system spec; entries of "family" without prefix
    eps steps                       options
    outcome verdict                 always; empty for a task without a result
    dimension heights.max           entries of the result
    message                         always
    seconds peak_memory host finished   unless the export is stable

If several entries have the same name, the first of them in this order keeps it: fixed column, option, system spec,
result. The names of the others get a prefix in all rows: option.seed, family.seed (system.document), result.seed.

A stable export omits all that depends on where, when and how the tasks were run: two stable exports of the same tasks
are equal byte by byte.
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
RUN_COLUMNS = ("seconds", "peak_memory", "host", "finished")  # omitted in a stable export, like stderr and versions
_COLUMNS = (*FIRST_COLUMNS, *MIDDLE_COLUMNS, *LAST_COLUMNS, *RUN_COLUMNS)
RESERVED = frozenset((*_COLUMNS, "system", "options", "result", "stderr", "versions"))

_ENCODER = json.JSONEncoder(sort_keys=True, allow_nan=False)
_MAX_DIGITS = 2_000  # maximal length of a text that may be recognized as a number
_MAX_ROWS = 10_000  # maximal number of rows in one row group of a Parquet file
_MAX_CHARACTERS = 50_000_000  # maximal number of characters in a row group: rows with long lists take much memory


# The path of an entry of a row: "option", "system" or "result", followed by nested keys.
Entry = tuple[str, ...]


def flatten(data: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield (path of keys, value) for each entry of nested dicts; a list is one value.

    >>> list(flatten({"a": 1, "b": {"c": [2, 3]}}))
    [(('a',), 1), (('b', 'c'), [2, 3])]
    """
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from flatten(value, (*path, key))
        else:
            yield (*path, key), value


def entries(row: Row) -> Iterator[tuple[Entry, Any]]:
    """Yield (path, value) for each entry of a row: its options, the entries of its system spec, those of its result."""
    result = row.record.result if row.record is not None else None
    for section, data in (("option", row.task.options), ("system", row.task.system), ("result", result)):
        yield from flatten(data or {}, (section,))


@lru_cache(10_000)  # thousands of rows have the same few entries
def names_of(entry: Entry) -> tuple[str, str]:
    """Return the short name of an entry, and its long name, which is used if another entry has the same short name.

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
    """Return a value as the text of a CSV cell; an apostrophe precedes a text that a spreadsheet would execute."""
    return spreadsheet_safe(to_text(value)) if isinstance(value, str) else to_text(value)


def is_number(value: Any) -> bool:
    """Whether a value is a finite number, True or False, or a text that denotes an exact number, such as 7/3."""
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
    """Write one JSON object per line: a header, each row, and finally the number of rows.

    A value that is missing because a task has no record is null. The keys of dicts inside a line are sorted.
    """
    from kahanmaps.maps.convention import CONVENTION  # imported here, since it loads FLINT

    omitted = {*RUN_COLUMNS, "stderr", "versions"} if stable else set()
    header = {"record": "header"} if stable else {"record": "header", "version": __version__}
    stream.write(_json_line({**header, "convention": CONVENTION}))
    count = 0
    for row in rows:
        stream.write(_json_line({"record": "result", **{k: v for k, v in row_data(row).items() if k not in omitted}}))
        count += 1
    stream.write(_json_line({"record": "end", "results": count}))


def write_csv(rows: Callable[[], Iterable[Row]], stream: IO[str], *, stable: bool = False) -> None:
    """Write a CSV table with a header. `rows` is called twice: first to find the columns, then to write the values.

    `stream` should be opened with newline="": otherwise some systems replace "\\n" by two characters.
    """
    layout = _Layout(rows(), stable)
    stream.write(csv_line(map(cell, layout.names)))
    for row in rows():
        cells = layout.cells(row)
        stream.write(csv_line(cell(cells.get(name)) for name in layout.names))


def write_parquet(rows: Callable[[], Iterable[Row]], path: str | os.PathLike[str], *, stable: bool = False) -> None:
    """Write the table of `write_csv` as a Parquet file, which needs pyarrow.

    `rows` is called twice, and the complete file replaces `path`. The type of a column is int64, bool or float64 if
    this type represents all its values exactly (for float64 integers up to 2^53), and text otherwise. If all values of
    a text column NAME are exact numbers such as 7/3, a column NAME.number of the nearest doubles follows. The bytes of
    a stable export also depend on the version of pyarrow.
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
    """The columns of a table: `names`; if `typed`, also their `types` and `numbers`, the columns of exact numbers."""

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
                while name in used_names:  # two entries can have equal long names: {"a": {"b": 1}, "a.b": 2}
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
            if value_kinds:  # the first suitable type; a column of empty cells has the type string
                self.types[name] = next(type_ for type_, fitting in _KINDS_OF_TYPE.items() if value_kinds <= fitting)
            if {"number"} <= value_kinds <= _NUMBER_KINDS:
                self.numbers.append(name)

    def cells(self, row: Row) -> dict[str, Any]:
        """Return a dict from the names of the columns to the values of a row."""
        fixed = row_data(row)
        cells = {name: fixed[name] for name in self._fixed_columns}
        for entry, value in entries(row):
            if entry not in self._column_of:
                raise InputError(_CHANGED.format(f"the value {quoted(names_of(entry)[0])}", f" of task {row.number}"))
            cells[self._column_of[entry]] = value
        return cells


_CHANGED = "found {}{} changed while the table was written: export again when nobody works on the batch"
# Type of a Parquet column -> kinds of values it represents exactly ("small": integers up to 2^53); the first is chosen.
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
    """Return the entries that all rows have, in the order of JSON lines; those of a missing record are None."""
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
    """Return a dict as a line of JSON; its keys remain in their order, the keys of dicts inside it are sorted."""
    return "{" + ", ".join(f"{json.dumps(name)}: {_ENCODER.encode(value)}" for name, value in record.items()) + "}\n"
