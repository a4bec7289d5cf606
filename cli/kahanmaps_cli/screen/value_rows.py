"""Tables over ranges of parameters: -p a=-2..2 (step 1) or -p a=-2..2:1/4; several ranges are combined."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps.errors import KahanmapsError
from kahanmaps_cli.options import load_system
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import print_stdout

_MAX_ROWS = 10_000  # maximal number of combinations of parameter values

Row = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Cell:
    """The result for one parameter combination: table line, JSON record, full display, why it is undecided (or "")."""

    line: str
    record: Callable[[], dict[str, Any]]
    show: Callable[[], None]
    undecided: str = ""


def table(
    system: str | None, options: dict[str, Any], compute: Callable[[lib.SystemFile, SearchProgress], Cell]
) -> int:
    """Print a line (or a JSON record) for each combination of parameter values; without ranges, print the full result.

    An error for one combination is printed on standard error at the end; if all combinations fail, the first error is
    raised. --seconds limits the total time. Returns the exit status.
    """
    quiet, begin = options["quiet"], time.monotonic()
    rows = rows_of(options["parameters"], system)
    if rows is None:
        file = load_system(system, options)
        with SearchProgress(options) as search:
            cell = compute(file, search)
        if options["as_json"]:
            print_json(cell.record())
        else:
            cell.show()
        if cell.undecided and not quiet and not search.is_over:
            print_stderr(cell.undecided)
        return 3 if cell.undecided or search.is_over else 0
    decided, failures = 0, list[tuple[str, KahanmapsError]]()
    for row in rows:
        name = ", ".join(f"{name} = {value}" for name, value in row)
        try:
            file = load_system(system, {**options, "parameters": row, "quiet": True})
            with SearchProgress(options, begin) as search:
                cell = compute(file, search)
        except KahanmapsError as error:
            failures.append((name, error))
            continue
        if options["as_json"]:
            print_json(cell.record())
        else:
            print_stdout(f"{name}\t{cell.line}")
        if search.is_over:
            return 3
        decided += not cell.undecided
    if len(failures) == len(rows):
        raise failures[0][1]
    for name, reason in failures:
        print_stderr(f"{name}: {reason}")
    if decided < len(rows) and not quiet:
        print_stderr(f"undecided, or stopped early: {len(rows) - decided} of {len(rows)}")
    return 0 if decided == len(rows) else 3


def rows_of(parameters: Sequence[tuple[str, str]], system: str | None) -> list[Row] | None:
    """Return a row of pairs (name, value) for each combination, the last range varying fastest; None without ranges."""
    if not any(lib.is_range(value) for _, value in parameters):
        return None
    if system == "-":
        raise click.UsageError("found a range of values and the system on standard input: write it to a file")
    axes: list[Sequence[Any]] = [
        lib.RationalRange.from_text(value) if lib.is_range(value) else [value] for _, value in parameters
    ]
    if (size := prod(map(len, axes))) > _MAX_ROWS:
        raise click.UsageError(f"found {size} combinations of values, expected at most {_MAX_ROWS}")
    names = [name for name, _ in parameters]
    return [
        tuple((name, x if isinstance(x, str) else lib.format_number(x)) for name, x in zip(names, row, strict=True))
        for row in product(*axes)
    ]
