"""Many results in a few lines: grouped, counted, with the quantiles of their numbers.

Quantiles are order statistics by nearest rank: the p-quantile of n values is the one with rank ceil(p n) from below. So
each is a value that occurs, found by exact comparison and told as it was written: "7/3" stays "7/3". The median of an
even number of values is the lower of the two in the middle.
"""

from __future__ import annotations

import difflib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from math import inf, isfinite
from typing import Any

from kahanmaps.algebra.written.cells import NUMBER
from kahanmaps.displayed import Displayed
from kahanmaps.errors import InputError, quoted
from kahanmaps.experiments.results.export import Entry, entries, known, plain
from kahanmaps.experiments.results.records import KEPT, Row, canonical, system_words

QUANTILES = {"min": 0, "p5": 5, "p25": 25, "median": 50, "p75": 75, "p95": 95, "max": 100}  # in percent
VERDICTS = ("proved", "supported", "refuted", "undecided")
OF_THE_RUN = ("seconds", "peak_memory")

_SHOWN = {"min": "min", "p5": "5 %", "median": "median", "p95": "95 %", "max": "max"}  # in tables, and their headings
_LONGEST_NUMBER = 2_000  # characters of a text: longer ones are no numbers to sort, but texts
# Names whose values are words, also when they look like numbers: an experiment may be called 007, a digest be 12e34567.
_WORDS = ("task", "experiment", "system", "document", "outcome", "verdict", "message")
_FEW = 5  # different values, whose counts are kept
_RELATED = 3  # names suggested for a mistaken one
_LISTED = 60
# Characters in tables for the eye; texts are what failures say, and what systems are.
_LONGEST_DECIMAL = 16
_LONGEST_SHOWN_NUMBER, _LONGEST_SHOWN_TEXT = 24, 160

Number = int | float | str


@dataclass(frozen=True)
class Numbers:
    """The values of one number in a group: how many (`n`), and `quantiles` by the names of `QUANTILES`."""

    n: int
    quantiles: Mapping[str, Number]
    is_same: bool  # all n of them are equal
    counts: Mapping[str, int] = field(default_factory=dict)  # of each value; empty where many are different

    def to_json(self) -> dict[str, Any]:
        """The numbers as plain data."""
        return {"n": self.n, "same": self.is_same, **self.quantiles}


@dataclass(frozen=True)
class Group:
    """The tasks that have the same values of what was grouped by, `values`, in that order.

    `outcomes` and `verdicts` count records, `flags` how often an entry is (true, false).
    """

    values: tuple[Any, ...]
    tasks: int
    missing: int
    outcomes: Mapping[str, int]
    verdicts: Mapping[str, int]
    numbers: Mapping[str, Numbers]
    flags: Mapping[str, tuple[int, int]]


@dataclass(frozen=True)
class Table:
    """A table of texts. The first `words` columns are words, the others numbers, to be aligned on the right."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int

    def lines(self) -> Iterator[str]:
        """Lines with tabs between the cells, the names of the columns first."""
        for row in (self.columns, *self.rows):
            yield "\t".join(" ".join(cell.split()) for cell in row)


@dataclass(frozen=True)
class Summary(Displayed):
    """Groups in the order of their values, numbers as numbers before texts, and None (not known) at the end."""

    by: tuple[str, ...]
    groups: tuple[Group, ...]

    def to_json(self) -> dict[str, Any]:
        """The summary as plain data: numbers as they were, all quantiles, all outcomes and verdicts."""
        return {
            "by": list(self.by),
            "groups": [
                {
                    "group": dict(zip(self.by, group.values, strict=True)),
                    "tasks": group.tasks,
                    "missing": group.missing,
                    "outcomes": dict(group.outcomes),
                    "verdicts": dict(group.verdicts),
                    "numbers": {name: numbers.to_json() for name, numbers in group.numbers.items()},
                    "flags": {name: {"true": true, "false": false} for name, (true, false) in group.flags.items()},
                }
                for group in self.groups
            ],
        }

    def counts(self, digits: int | None = None) -> Table:
        """What became of the tasks of each group; what never happened has no column. For `digits`, see `tables`."""
        kinds: dict[str, list[int]] = {"missing": [group.missing for group in self.groups]}
        for outcome in KEPT:
            kinds[outcome] = [group.outcomes[outcome] for group in self.groups]
        for verdict in sorted({verdict for group in self.groups for verdict in group.verdicts}, key=_place_of_verdict):
            kinds[verdict] = [group.verdicts.get(verdict, 0) for group in self.groups]
        seen = {name: counts for name, counts in kinds.items() if any(counts)}
        rows = (
            (*_texts(group.values, digits), str(group.tasks), *(str(counts[place]) for counts in seen.values()))
            for place, group in enumerate(self.groups)
        )
        return Table("tasks", (*self.by, "tasks", *seen), tuple(rows), len(self.by))

    def numbers(self, digits: int | None = None) -> Table:
        """Five quantiles of each number in each group; `same` says that all values are equal."""
        rows = (
            (
                *_texts((*group.values, name), digits),
                str(numbers.n),
                "yes" if numbers.is_same else "no",
                *_texts([numbers.quantiles[key] for key in _SHOWN], digits),
            )
            for group in self.groups
            for name, numbers in group.numbers.items()
        )
        return Table("numbers", (*self.by, "number", "n", "same", *_SHOWN.values()), tuple(rows), len(self.by) + 1)

    def flags(self, digits: int | None = None) -> Table:
        """How often each entry that is true or false was which, in each group."""
        rows = (
            (*_texts((*group.values, name), digits), str(true), str(false))
            for group in self.groups
            for name, (true, false) in group.flags.items()
        )
        return Table("true or false", (*self.by, "flag", "true", "false"), tuple(rows), len(self.by) + 1)

    def tables(self, digits: int | None = None) -> list[Table]:
        """The tables that have rows, the counts always. With `digits`, for the eye: floats have so many significant
        digits, numbers of more than 24 characters are approximated (~), texts of more than 160 are cut.
        """
        return [self.counts(digits), *(table for table in (self.numbers(digits), self.flags(digits)) if table.rows)]

    def lines(self) -> Iterator[str]:
        """The tables, tabs between the cells and an empty line between the tables; floats have six digits."""
        for place, table in enumerate(self.tables(6)):
            if place:
                yield ""
            yield from table.lines()


def summarise(
    rows: Iterable[Row], by: Sequence[str] = (), values: Sequence[str] | None = None, *, stable: bool = False
) -> Summary:
    """Group rows by the values of what `by` names, count, and take the quantiles of the numbers.

    A name in `by` is one of task, experiment, system, document, outcome, verdict, message; an option; a part of the
    recipe (m, parameters.a); an entry of the result (dimension, heights.max): the first of these that the row has.
    option.seed, family.seed and result.seed say which. Rows without it make a group of their own, with the value None.

    Numbers are the integers, floats and texts such as "7/3" or "21.2031" of the results, and seconds and peak_memory of
    all records unless `stable`; not those that `by` names, which are the same throughout a group. `values` names those
    to be kept. An entry of a result with a name of these two is result.seconds.

    Rows are read once. Exact quantiles need all values, so these are kept, some hundred bytes each, equal ones once.

    >>> from kahanmaps.experiments.results.records import Outcome, Record, Task
    >>> def row(number, m, height):
    ...     task = Task("orbit", {"family": {"m": m}}, {})
    ...     return Row("e", number, task, Record(task.key, Outcome.OK, {"height": height}))
    >>> found = summarise([row(0, 10, "7/3"), row(1, 2, 3), row(2, 10, "2.5")], ["m"], stable=True)
    >>> print("\\n".join(found.lines()).expandtabs(8))
    m       tasks   ok
    2       1       1
    10      2       2
    <BLANKLINE>
    m       number  n       same    min     5 %     median  95 %    max
    2       height  1       yes     3       3       3       3       3
    10      height  2       no      7/3     7/3     7/3     2.5     2.5
    """
    by = tuple(dict.fromkeys(by))
    wanted = None if values is None else frozenset(values)
    gathering: dict[tuple[Any, ...], _Gathering] = {}
    seen, numeric = set[Entry](), set(() if stable else OF_THE_RUN)
    has_results = False
    for row in rows:
        found = list(entries(row))
        seen.update(entry for entry, _ in found)
        place = _place(row, by, found)
        identity = tuple(key for key, _ in place)
        group = gathering.get(identity)
        if group is None:
            group = gathering[identity] = _Gathering(tuple(value for _, value in place))
        group.add(row)
        if row.record is None:
            continue
        has_results = has_results or row.record.result is not None
        measured = [] if stable else [(name, getattr(row.record, name)) for name in OF_THE_RUN]
        for entry, value in found:
            if entry.section == "result":
                short, full = names_of_entry(entry)
                measured.append((full if short in OF_THE_RUN else short, value))
        for name, value in measured:
            if _is_number(value):
                numeric.add(name)
                if name not in by if wanted is None else name in wanted:
                    group.measure(name, value)
    if gathering:  # nobody can tell a mistaken name in nothing
        names, longer = {*_WORDS, *(entry.name for entry in seen)}, {entry.full_name for entry in seen}
        for name in by:
            if name not in longer:
                _must_exist(name, names, "to group by" if has_results else "to group by (there is no result yet)")
        for name in values or ():
            _must_exist(name, numeric, "of numbers")
    ordered = sorted(gathering.items(), key=lambda item: item[0])
    return Summary(by, tuple(group.finish() for _, group in ordered))


class _Values:
    """All values of one number in a group, equal ones once."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[type, Number]] = Counter()  # 1 and 1.0 are told as they were written

    def add(self, value: Number) -> None:
        self._counts[type(value), value] += 1

    def finish(self) -> Numbers:
        """The quantiles, by one sort.

        Values are sorted by their floats, for speed: rounding never turns an order round, and the exact numbers decide
        between equal floats. Of several texts for one number the shortest comes first.
        """
        ordered = []
        for (_, value), count in self._counts.items():
            exact, text = Fraction(value), str(value)
            ordered.append((nearest(exact), exact, len(text), text, value, count))
        ordered.sort(key=lambda one: one[:4])
        n = self._counts.total()
        ahead = [(name, -(-percent * n // 100)) for name, percent in reversed(QUANTILES.items())]
        quantiles: dict[str, Number] = {}
        passed = 0
        for *_, value, count in ordered:
            passed += count
            while ahead and ahead[-1][1] <= passed:
                quantiles[ahead.pop()[0]] = value
        counts = {text: count for *_, text, _, count in ordered} if len(ordered) <= _FEW else {}
        return Numbers(n, quantiles, Fraction(quantiles["min"]) == Fraction(quantiles["max"]), counts)


@dataclass
class _Gathering:
    """A group while rows come in."""

    values: tuple[Any, ...]
    tasks: int = 0
    missing: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    verdicts: Counter[str] = field(default_factory=Counter)
    numbers: defaultdict[str, _Values] = field(default_factory=lambda: defaultdict(_Values))
    flags: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(lambda: [0, 0]))

    def add(self, row: Row) -> None:
        self.tasks += 1
        if row.record is None:
            self.missing += 1
            return
        self.outcomes[row.record.outcome] += 1
        if row.record.verdict is not None:
            self.verdicts[row.record.verdict] += 1

    def measure(self, name: str, value: Any) -> None:
        if isinstance(value, bool):
            self.flags[name][not value] += 1
        else:
            self.numbers[name].add(value)

    def finish(self) -> Group:
        verdicts = sorted({*VERDICTS, *self.verdicts}, key=_place_of_verdict)
        return Group(
            self.values,
            self.tasks,
            self.missing,
            {str(outcome): self.outcomes[outcome] for outcome in KEPT},
            {verdict: self.verdicts[verdict] for verdict in verdicts},
            {name: self.numbers[name].finish() for name in sorted(self.numbers, key=lambda n: (n in OF_THE_RUN, n))},
            {name: (true, false) for name, (true, false) in sorted(self.flags.items())},
        )


@lru_cache(10_000)  # thousands of rows have the same few entries
def names_of_entry(entry: Entry) -> tuple[str, str]:
    """What an entry may be called, the short name first."""
    return entry.name, entry.full_name


def _place(row: Row, by: Sequence[str], found: Sequence[tuple[Entry, Any]]) -> list[tuple[Any, Any]]:
    """For each name in `by`: what the row is sorted and recognised by, and its value."""
    if not by:
        return []
    values: dict[str, Any] = {}
    # Backwards, so that the first to have a name keeps it: options, the recipe, the result.
    for section in ("result", "system", "option"):
        for entry, value in found:
            if entry.section == section:
                values.update((name, value) for name in names_of_entry(entry) if name in by)
    place: list[tuple[Any, Any]] = []
    for name in by:
        if name == "system":
            word: str | None = system_words(row.task.system)  # other files may have the same name
            place.append(((2, word, canonical(row.task.system)), word))
        elif name in _WORDS:
            word = _word(row, name)
            place.append(((2, word) if word is not None else (3,), word))
        else:
            place.append((_order(values.get(name)), values.get(name)))
    return place


def _word(row: Row, name: str) -> str | None:
    if name == "document":
        return (row.task.system or {}).get(name)
    value = known(row)[name]
    return canonical(value) if isinstance(value, Mapping) else (value or None) if name == "message" else value


def _order(value: Any) -> tuple[Any, ...]:
    """A key by which values are sorted, the same for equal values only: numbers, false and true, texts, None.

    >>> sorted([None, "x", 10, "1/7", True, "0.5", 2, "1/10"], key=_order)
    ['1/10', '1/7', '0.5', 2, 10, True, 'x', None]
    """
    if value is None:
        return (3,)
    if isinstance(value, bool):
        return 1, value
    if _is_number(value):
        return 0, Fraction(value)
    return 2, plain(value)


def _is_number(value: Any) -> bool:
    if isinstance(value, str):
        return len(value) <= _LONGEST_NUMBER and NUMBER.fullmatch(value) is not None
    if isinstance(value, float):
        return isfinite(value)
    return isinstance(value, int)  # true and false among them: who cares asks for them first


def nearest(value: Any) -> float:
    """The double nearest to an exact number, infinite where it is beyond their range."""
    exact = Fraction(value)
    try:
        return float(exact)
    except OverflowError:
        return inf if exact > 0 else -inf


def _must_exist(name: str, known: set[str], what: str) -> None:
    if name in known:
        return
    close = difflib.get_close_matches(name, sorted(known), _RELATED)
    meant = f", did you mean {' or '.join(close)}?" if close else ";"
    listed = sorted(known)
    more = f" and {len(listed) - _LISTED} more" if len(listed) > _LISTED else ""
    raise InputError(f"found the unknown name {quoted(name)}{meant} names {what}: {', '.join(listed[:_LISTED])}{more}")


def _place_of_verdict(verdict: str) -> tuple[int, str]:
    return (VERDICTS.index(verdict) if verdict in VERDICTS else len(VERDICTS)), verdict


def _texts(values: Iterable[Any], digits: int | None) -> list[str]:
    return [plain(value) if digits is None else _shortened(value, digits) for value in values]


def _shortened(value: Any, digits: int) -> str:
    """A value as text for the eye.

    >>> _shortened(0.123456789, 4), _shortened("7/3", 4), _shortened("1" * 30 + "/7", 4)
    ('0.1235', '7/3', '~1.587e+28')
    >>> _shortened("2.29663026288653824570", 4), _shortened("0.125", 2)
    ('2.297', '0.125')
    """
    is_decimal = isinstance(value, str) and "." in value and _is_number(value)
    if isinstance(value, float) or (is_decimal and len(value) > _LONGEST_DECIMAL):
        return f"{float(value):.{digits}g}"
    text = plain(value)
    is_number = _is_number(value)
    longest = _LONGEST_SHOWN_NUMBER if is_number else _LONGEST_SHOWN_TEXT
    if len(text) <= longest:
        return text
    if is_number and 0 < abs(approximation := nearest(value)) < inf:
        return f"~{approximation:.{digits}g}"
    return text[: longest - 3] + "..."
