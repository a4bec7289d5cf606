"""Parameters with ranges of values: -p a=-2..2 or -p a=-2..2:1/4, all combinations of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import prod
from typing import Any

import click

_MOST = 10_000

Row = tuple[tuple[str, str], ...]


def rows_of(parameters: Sequence[tuple[str, str]], system: str | None) -> list[Row] | None:
    """The parameters for each combination of values, the last range running fastest; None without a range."""
    from kahanmaps.algebra.text import format_number
    from kahanmaps.experiments.grid import RationalRange, is_range

    if not any(is_range(value) for _, value in parameters):
        return None
    if system == "-":
        raise click.UsageError("found a range of values and the system on standard input: write it to a file")
    axes: list[Sequence[Any]] = []
    for _, value in parameters:
        text, colon, step = value.partition(":")
        axes.append(RationalRange.from_text(f"{text} step {step}" if colon else text) if is_range(value) else [value])
    if (size := prod(map(len, axes))) > _MOST:
        raise click.UsageError(f"found {size} combinations of values, expected at most {_MOST}")
    names = [name for name, _ in parameters]
    return [
        tuple((name, x if isinstance(x, str) else format_number(x)) for name, x in zip(names, row, strict=True))
        for row in product(*axes)
    ]
