"""An orbit on a terminal: numbers are shortened so that a row fits a line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from kahanmaps import internals as lib
from kahanmaps.maps.orbits.writers import Writer, title
from kahanmaps_cli.screen.terminal import columns, echo, tell

_NARROWEST = 9  # a column of numbers with the middle left out
_NARROWEST_BALL = 22  # three digits and the radius


class OrbitTable(Writer):
    """Columns; where the terminal leaves too little of the numbers a point takes a line for each coordinate."""

    def header(self, header: dict[str, Any]) -> None:
        tell(title(header))
        names = [*self.variables, *self.integrals]
        self._width = columns()
        self._first = max(6, len(str(header["steps"])))
        self._cell = (self._width - self._first) // len(names) - 2
        self._has_digits = False  # whether some number stands without the word digits
        self._is_table = self._cell >= (_NARROWEST_BALL if header["arithmetic"].startswith("ball") else _NARROWEST)
        if self._is_table:
            echo("step".rjust(self._first) + self._row(names))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        cells = [*x, *("pole" if value is None else value for value in values)]
        if self._is_table:
            echo(str(step).rjust(self._first) + self._row(cells))
            return
        echo(f"step {step}")
        for name, cell in zip((*self.variables, *self.integrals), cells, strict=True):
            echo(f"  {name} = {_elided(cell, max(_NARROWEST, self._width - len(name) - 5))}")

    def end(self, end: lib.OrbitEnd, more: Mapping[str, Any]) -> None:
        tell(f"# {end.text}")
        if self._has_digits:
            tell("# (30/28): digits above and below the line; (30): the larger number of them")

    def _row(self, cells: Sequence[str]) -> str:
        shown = [_elided(cell, self._cell) for cell in cells]
        self._has_digits |= any(text.endswith(")") and "digits" not in text for text in shown)
        return "".join("  " + text.rjust(self._cell) for text in shown)


def _approximated(text: str) -> list[str]:
    """A long exact number as a decimal and its digits, those above and those below, from long to short; else nothing.

    >>> _approximated("-133567234372186342562607635605/125821231910581795318152718151")
    ['-1.06156 (30/30 digits)', '-1.06156 (30/30)', '-1.06 (30/30)', '-1.06 (30)']
    """
    exact = re.fullmatch(r"(-?)([0-9]+)(?:/([0-9]+))?", text)
    if exact is None:
        return []
    sign, above, below = exact[1], exact[2], exact[3] or "1"
    # of numbers with thousands of digits Python would make no integer, nor a double
    value = int(above[:18]) / int(below[:18])
    power = len(above[18:]) - len(below[18:])
    mantissa, exponent = f"{value:.5e}".split("e")
    power += int(exponent)

    is_small = abs(power) < 5
    long, short = (
        sign + (f"{float(mantissa) * 10**power:.{kept}g}" if is_small else f"{float(mantissa):.{kept}g}e{power:+03d}")
        for kept in (6, 3)
    )
    digits = f"{len(above)}/{len(below)}" if exact[3] else f"{len(above)}"
    most = max(len(above), len(below))
    return [f"{long} ({digits} digits)", f"{long} ({digits})", f"{short} ({digits})", f"{short} ({most})"]


def _elided(text: str, width: int) -> str:
    if len(text) <= width:
        return text
    middle, plus_minus, radius = text.partition(" +/- ")
    if plus_minus:
        return f"{middle[: max(3, width - len(radius) - 6)]}.. +/-{radius}"
    shown = next((one for one in _approximated(text) if len(one) <= width), None)
    if shown is not None:
        return shown
    keep = max(2, (width - 3) // 2)
    return f"{text[:keep]}...{text[-(width - 3 - keep) :]}"
