"""Orbits on a terminal: numbers are shortened so that each row of the table fits on one line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from kahanmaps import internals as lib
from kahanmaps.maps.orbits.writers import Writer, title
from kahanmaps_cli.screen.terminal import columns, print_raw, print_stdout

_MIN_WIDTH = 9  # minimal width of a column of shortened numbers
_MIN_BALL_WIDTH = 22  # minimal width of a column of balls: three digits and the radius


class OrbitTable(Writer):
    """Print the points of an orbit as rows of a table; on a narrow terminal print each coordinate on its own line."""

    def header(self, header: dict[str, Any]) -> None:
        print_stdout(title(header))
        names = [*self.variables, *self.integrals]
        self._width = columns()
        self._step_width = max(6, len(str(header["steps"])))
        self._cell_width = (self._width - self._step_width) // len(names) - 2
        self._has_digits = False  # whether some digit counts lack the word "digits"
        min_width = _MIN_BALL_WIDTH if header["arithmetic"].startswith("ball") else _MIN_WIDTH
        self._is_table = self._cell_width >= min_width
        if self._is_table:
            print_raw("step".rjust(self._step_width) + self._row(names))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        cells = [*x, *("pole" if value is None else value for value in values)]
        if self._is_table:
            print_raw(str(step).rjust(self._step_width) + self._row(cells))
            return
        print_raw(f"step {step}")
        for name, cell in zip((*self.variables, *self.integrals), cells, strict=True):
            print_raw(f"  {name} = {_shorten_cell(cell, max(_MIN_WIDTH, self._width - len(name) - 5))}")

    def end(self, end: lib.OrbitEnd, details: Mapping[str, Any]) -> None:
        print_stdout(f"# {end.text}")
        if self._has_digits:
            print_stdout("# (30/28): digits of numerator and denominator; (30): the larger of the two")

    def _row(self, cells: Sequence[str]) -> str:
        texts = [_shorten_cell(cell, self._cell_width) for cell in cells]
        self._has_digits |= any(text.endswith(")") and "digits" not in text for text in texts)
        return "".join("  " + text.rjust(self._cell_width) for text in texts)


def _decimal_forms(text: str) -> list[str]:
    """Return decimal forms of a long rational number with the digit counts of numerator and denominator, longest first.

    >>> _decimal_forms("-133567234372186342562607635605/125821231910581795318152718151")
    ['-1.06156 (30/30 digits)', '-1.06156 (30/30)', '-1.06 (30/30)', '-1.06 (30)']
    """
    match = re.fullmatch(r"(-?)([0-9]+)(?:/([0-9]+))?", text)
    if match is None:
        return []
    sign, numerator, denominator = match[1], match[2], match[3] or "1"
    # The leading 18 digits suffice; Python refuses to convert thousands of digits, and a double would overflow.
    value = int(numerator[:18]) / int(denominator[:18])
    power = len(numerator[18:]) - len(denominator[18:])
    mantissa, exponent = f"{value:.5e}".split("e")
    power += int(exponent)

    is_small = abs(power) < 5
    long_text, short_text = (
        sign
        + (f"{float(mantissa) * 10**power:.{figures}g}" if is_small else f"{float(mantissa):.{figures}g}e{power:+03d}")
        for figures in (6, 3)
    )
    digits = f"{len(numerator)}/{len(denominator)}" if match[3] else f"{len(numerator)}"
    max_digits = max(len(numerator), len(denominator))
    forms = [f"{long_text} ({digits} digits)", f"{long_text} ({digits})", f"{short_text} ({digits})"]
    return [*forms, f"{short_text} ({max_digits})"]


def _shorten_cell(text: str, width: int) -> str:
    if len(text) <= width:
        return text
    middle, plus_minus, radius = text.partition(" +/- ")
    if plus_minus:
        return f"{middle[: max(3, width - len(radius) - 6)]}.. +/-{radius}"
    short_text = next((candidate for candidate in _decimal_forms(text) if len(candidate) <= width), None)
    if short_text is not None:
        return short_text
    kept_length = max(2, (width - 3) // 2)
    return f"{text[:kept_length]}...{text[-(width - 3 - kept_length) :]}"
