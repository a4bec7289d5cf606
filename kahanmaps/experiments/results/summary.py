"""Summaries of results: groups of tasks with counts and quantiles of numbers.

The values that define groups are compared exactly: "1/3" and 0.333 define two groups. The numbers that are summarized
are rounded to doubles. Quantiles are of nearest rank: the p-quantile of n values is the ceil(p n)-th smallest of them,
so that the median of an even number of values is the smaller of the two middle ones.
"""

from __future__ import annotations

import difflib
from array import array
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from math import isfinite
from typing import Any, NamedTuple

from kahanmaps.display_protocols import HtmlDisplay, shorten
from kahanmaps.errors import InputError, quoted
from kahanmaps.experiments.results.export import Entry, entries, is_number, names_of, nearest_double, row_data, to_text
from kahanmaps.experiments.results.records import STORED_OUTCOMES, VERDICTS, Row, canonical, system_words

QUANTILES = {"min": 0, "p5": 5, "p25": 25, "median": 50, "p75": 75, "p95": 95, "max": 100}  # in percent
_HEADINGS = {"min": "min", "p5": "5 %", "median": "median", "p95": "95 %", "max": "max"}  # headings of columns
RUN_COLUMNS = ("seconds", "peak_memory")

# Entries that are text even if they look like a number: an experiment may be called 007, and a digest may be 12e34567.
_TEXT_NAMES = ("task", "experiment", "system", "document", "outcome", "verdict", "message")
_MAX_SUGGESTIONS = 3  # maximal number of names suggested for an unknown name
_MAX_LISTED = 60  # maximal number of names in a message
_MAX_WIDTH = 160  # maximal number of characters of a printed cell


class SummaryTable(NamedTuple):
    """A table of texts: its first `words` columns contain words, the other columns numbers (right-aligned)."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int


@dataclass(frozen=True)
class Group:
    """A group of tasks with equal `values` of the grouping entries; `outcomes` and `verdicts` are dicts of counts.

    `numbers` maps the name of a numeric entry to a dict: the count `n` of its values, `same` (whether they are all the
    same double), and their `QUANTILES`. `flags` maps the name of a boolean entry to its counts of true and false.
    """

    values: tuple[Any, ...]
    tasks: int
    missing: int
    outcomes: Mapping[str, int]
    verdicts: Mapping[str, int]
    numbers: Mapping[str, Mapping[str, float]]
    flags: Mapping[str, Mapping[str, int]]


@dataclass(frozen=True)
class Summary(HtmlDisplay):
    """Groups of tasks, sorted by the values that define the groups: numbers before texts, and None last."""

    by: tuple[str, ...]
    groups: tuple[Group, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain data; a quantile that exceeds all doubles is None."""
        groups = []
        for group in self.groups:
            data = {"group": dict(zip(self.by, group.values, strict=True)), **asdict(group)}
            del data["values"]
            for numbers in data["numbers"].values():
                numbers.update({name: None for name in QUANTILES if not isfinite(numbers[name])})
            groups.append(data)
        return {"by": list(self.by), "groups": groups}

    def tables(self, digits: int = 6) -> list[SummaryTable]:
        """Return tables of counts, numbers and flags; tables without rows and columns of zeros are omitted.

        All cells are text: floats have `digits` significant digits, and long text is shortened.
        """
        counts = [{"tasks": g.tasks, "missing": g.missing, **g.outcomes, **g.verdicts} for g in self.groups]
        names = [name for name in dict.fromkeys(name for c in counts for name in c) if any(c.get(name) for c in counts)]
        lines = [(*g.values, *(c.get(name, 0) for name in names)) for g, c in zip(self.groups, counts, strict=True)]
        pieces: list[tuple[str, list[str], list[tuple[Any, ...]]]] = [("tasks", names, lines)]
        lines = [
            (*g.values, name, cells["n"], "yes" if cells["same"] else "no", *map(cells.get, _HEADINGS))
            for g in self.groups
            for name, cells in g.numbers.items()
        ]
        pieces += [("numbers", ["number", "n", "same", *_HEADINGS.values()], lines)] if lines else []
        lines = [(*g.values, name, *cells.values()) for g in self.groups for name, cells in g.flags.items()]
        pieces += [("true or false", ["flag", "true", "false"], lines)] if lines else []

        def cell(value: Any) -> str:
            return f"{value:.{digits}g}" if isinstance(value, float) else shorten(to_text(value), _MAX_WIDTH)

        return [
            SummaryTable(
                title,
                (*self.by, *columns),
                tuple(tuple(cell(value) for value in line) for line in lines),
                len(self.by) + (title != "tasks"),
            )
            for title, columns, lines in pieces
        ]

    def lines(self) -> Iterator[str]:
        """Yield the lines of the tables, with tabs between cells and an empty line between tables."""
        for number, table in enumerate(self.tables()):
            if number:
                yield ""
            for row in (table.columns, *table.rows):
                yield "\t".join(" ".join(cell.split()) for cell in row)


class _GroupBuilder:
    """Collects the counts and numbers of a group while rows are read; each number takes eight bytes."""

    def __init__(self, values: tuple[Any, ...]) -> None:
        self.values = values
        self.counts: Counter[str] = Counter()
        self.verdicts: Counter[str] = Counter(dict.fromkeys(VERDICTS, 0))
        self.numbers: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))
        self.flags: defaultdict[str, Counter[str]] = defaultdict(lambda: Counter(true=0, false=0))

    def group(self) -> Group:
        numbers: dict[str, dict[str, float]] = {}
        for name in sorted(self.numbers, key=lambda name: (name in RUN_COLUMNS, name)):
            ordered = sorted(self.numbers[name])
            n = len(ordered)
            numbers[name] = {"n": n, "same": ordered[0] == ordered[-1]}
            for quantile, percent in QUANTILES.items():
                value = ordered[max(-(-percent * n // 100) - 1, 0)]
                numbers[name][quantile] = int(value) if value.is_integer() and abs(value) < 2**53 else value
        outcomes = {str(outcome): self.counts[outcome] for outcome in STORED_OUTCOMES}
        counts = (self.counts.total(), self.counts["missing"], outcomes, dict(self.verdicts))
        return Group(self.values, *counts, numbers, {name: dict(self.flags[name]) for name in sorted(self.flags)})


def summarise(
    rows: Iterable[Row], by: Sequence[str] = (), values: Sequence[str] | None = None, *, stable: bool = False
) -> Summary:
    """Return counts and quantiles for each group of rows; rows with equal entries `by` form a group.

    A name in `by` is one of task, experiment, system, document, outcome, verdict, message; or the name of an option, of
    an entry of the system spec (m, parameters.a), or of an entry of the result (dimension, heights.max). If a name has
    several of these meanings, the first applies; option.seed, family.seed and result.seed are unambiguous. The rows
    without an entry `by` form a group with the value None.

    The numbers in results (integers, floats, texts such as "7/3" or "21.2031") are summarized, and so are seconds and
    peak_memory of all records unless `stable`. Entries in `by` are constant in a group and not summarized. `values`, if
    given, names the entries to summarize. An entry of a result that is called seconds is named result.seconds.

    Rows are read once, and only their numbers are stored. Raises InputError for a name that no row has.

    >>> from kahanmaps.experiments.results.records import Outcome, Record, Task
    >>> def row(number, m, height):
    ...     task = Task("orbit", {"family": {"m": m}}, {})
    ...     return Row("e", number, task, Record(task.key, Outcome.OK, {"height": height}))
    >>> summary = summarise([row(0, 10, "7/2"), row(1, 2, 3), row(2, 10, "2.5")], ["m"], stable=True)
    >>> print("\\n".join(summary.lines()).expandtabs(8))
    m       tasks   ok
    2       1       1
    10      2       2
    <BLANKLINE>
    m       number  n       same    min     5 %     median  95 %    max
    2       height  1       yes     3       3       3       3       3
    10      height  2       no      2.5     2.5     2.5     3.5     3.5
    """
    by = tuple(dict.fromkeys(by))
    groups: dict[tuple[Any, ...], _GroupBuilder] = {}  # sort keys of the values in `by` -> group
    seen_entries, numeric_names = set[Entry](), set(() if stable else RUN_COLUMNS)
    has_results = False
    for row in rows:
        entry_values: dict[str, Any] = {}
        numbers = {} if stable or row.record is None else {name: getattr(row.record, name) for name in RUN_COLUMNS}
        for entry, value in entries(row):
            seen_entries.add(entry)
            short_name, long_name = names_of(entry)
            for name in (short_name, long_name):
                if name in by:
                    entry_values.setdefault(name, value)  # of several entries with this name, the first counts
            if entry[0] == "result":
                has_results = True
                numbers[long_name if short_name in RUN_COLUMNS else short_name] = value
        keys_and_values = [_sort_key_and_value(row, name, entry_values.get(name)) for name in by]
        group_key = tuple(key for key, _ in keys_and_values)
        group = groups.get(group_key)
        if group is None:
            group = groups[group_key] = _GroupBuilder(tuple(value for _, value in keys_and_values))
        group.counts["missing" if row.record is None else row.record.outcome] += 1
        if row.record is not None and row.record.verdict is not None:
            group.verdicts[row.record.verdict] += 1
        for name, value in numbers.items():
            if is_number(value):
                numeric_names.add(name)
                if name in by if values is None else name not in values:
                    continue
                if isinstance(value, bool):
                    group.flags[name][to_text(value)] += 1
                else:
                    group.numbers[name].append(nearest_double(value))
    if groups:  # without rows every name would be unknown
        short_names, full_names = ({names_of(entry)[k] for entry in seen_entries} for k in (0, 1))
        for name in by:
            if name not in full_names:
                purpose = "to group by" if has_results else "to group by (there is no result yet)"
                _require_known(name, short_names.union(_TEXT_NAMES), purpose)
        for name in values or ():
            _require_known(name, numeric_names, "of numbers")
    return Summary(by, tuple(groups[group_key].group() for group_key in sorted(groups)))


def _sort_key_and_value(row: Row, name: str, value: Any) -> tuple[Any, Any]:
    """Return (sort key, value) of a row for a name in `by`; `value` is the entry of the row with this name, or None.

    The keys sort numbers first, then false and true, texts, None. Keys are equal only if the values are equal.
    """
    if name == "system":
        text: str | None = system_words(row.task.system)
        return (2, text, canonical(row.task.system)), text  # the spec distinguishes systems with equal names
    if name not in _TEXT_NAMES:
        if value is None:
            return (3,), value
        if isinstance(value, bool):
            return (1, value), value
        return ((0, Fraction(value)) if is_number(value) else (2, to_text(value))), value
    text = (row.task.system or {}).get(name) if name == "document" else row_data(row)[name] or None
    return ((3,) if text is None else (2, text)), text


def _require_known(name: str, known_names: set[str], purpose: str) -> None:
    if name in known_names:
        return
    similar_names = difflib.get_close_matches(name, sorted(known_names), _MAX_SUGGESTIONS)
    question = f", did you mean {' or '.join(similar_names)}?" if similar_names else ";"
    names = sorted(known_names)
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    raise InputError(
        f"found the unknown name {quoted(name)}{question} names {purpose}: {', '.join(names[:_MAX_LISTED])}{more}"
    )
