"""The formats of an orbit: text for people, json, jsonl and csv streamed line by line, npz whole at the end.

All but json and npz are valid after every record, so that whatever ends an orbit leaves a file that can be read.
"""

from __future__ import annotations

import json
import re
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import IO, Any

from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.render import ending, envelope
from kahanmaps_cli.screen.terminal import tell

# An npz file of text holds every number padded to the longest one; beyond this size jsonl is the format to use.
MAX_PADDED_BYTES = 512_000_000
_LONG_LINE = 10_000  # characters, after which the next step may take minutes
_NARROWEST = 9  # a column of numbers with the middle left out


class OutputFull(Exception):
    """A format cannot hold the next point. Attribute: `steps`, the last step that it holds."""

    def __init__(self, message: str, steps: int) -> None:
        self.steps = steps
        super().__init__(message)


class Writer(ABC):
    """Receives a header, points and an end; columns are the variables and then the names of the integrals."""

    def __init__(self, stream: IO[Any], columns: Sequence[str], integrals: Sequence[str]) -> None:
        self.stream = stream
        self.columns = list(columns)
        self.integrals = list(integrals)
        self._flushed = time.monotonic()

    @abstractmethod
    def header(self, header: dict[str, Any]) -> None:
        """What the orbit is of."""

    @abstractmethod
    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        """One point, its coordinates and the values of the integrals (None at a pole)."""

    @abstractmethod
    def end(self, end: dict[str, Any]) -> None:
        """How it ended."""

    def _line(self, text: str) -> None:
        self.stream.write(text + "\n")
        # Now and then, so that a reader of the file sees it grow and a kill loses little; always before long steps.
        now = time.monotonic()
        if now - self._flushed > 0.5 or len(text) > _LONG_LINE:
            self.stream.flush()
            self._flushed = now


class JsonLines(Writer):
    """One JSON object a line, with "record" header, point or end."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({"record": "header", **header}))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(json.dumps({"record": "point", **_record(step, x, self.integrals, values)}))

    def end(self, end: dict[str, Any]) -> None:
        self._line(json.dumps({"record": "end", **end}))
        self.stream.flush()


class Json(Writer):
    """One JSON object with the header, all points and the end."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({**envelope("orbit"), **header})[:-1] + ', "points": [')
        self._separator = ""

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(self._separator + json.dumps(_record(step, x, self.integrals, values)))
        self._separator = ","

    def end(self, end: dict[str, Any]) -> None:
        self._line(f'], "end": {json.dumps(end)}}}')
        self.stream.flush()


def _record(step: int, x: Sequence[str], integrals: Sequence[str], values: Sequence[str | None]) -> dict[str, Any]:
    record: dict[str, Any] = {"step": step, "x": list(x)}
    return {**record, "integrals": dict(zip(integrals, values, strict=True))} if integrals else record


class Csv(Writer):
    """Comma-separated values below a row of names, and nothing else: header and end are in a file beside them.

    `beside` is its path, None where the table goes to standard output; it is there from the beginning.
    """

    def __init__(
        self, stream: IO[Any], columns: Sequence[str], integrals: Sequence[str], beside: str | None = None
    ) -> None:
        super().__init__(stream, columns, integrals)
        self._beside = beside

    def header(self, header: dict[str, Any]) -> None:
        self._header = header
        self._tell(None)
        self._line(",".join(["step", *self.columns, *(_quoted(lib.cell(name)) for name in self.integrals)]))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(",".join([str(step), *x, *("" if value is None else value for value in values)]))

    def end(self, end: dict[str, Any]) -> None:
        self.stream.flush()
        self._tell(end)

    def _tell(self, end: dict[str, Any] | None) -> None:
        if self._beside is not None:
            told = {**envelope("orbit"), "header": self._header, "end": end}
            lib.write_whole(self._beside, (json.dumps(told, indent=1) + "\n").encode())


def meta_of(path: str) -> str:
    """The file beside a .csv file that says what its table is of."""
    return f"{path}.meta.json"


def _eps(header: dict[str, Any]) -> str:
    """The eps of an orbit, with the time step where the map has one, in words."""
    if header["eps"] is None:
        return ""
    step = "" if header["time_step"] is None else f" (time step 2 eps = {header['time_step']})"
    return f"eps = {header['eps']}{step}, "


def _algebraic(header: dict[str, Any]) -> str:
    """Which number a parameter is, t in exact points, where it is an algebraic one."""
    t = "t = " if header["arithmetic"] == "exact" else ""
    return "".join(f", {t}{name} = {root}" for name, root in header.get("algebraic", {}).items())


class Text(Writer):
    """Tab-separated columns; on a terminal of that many columns numbers are shortened so that a row fits a line.

    Where that leaves too little of them a point takes a line for each coordinate.
    """

    def __init__(self, stream: IO[Any], columns: Sequence[str], integrals: Sequence[str], width: int | None) -> None:
        super().__init__(stream, columns, integrals)
        self._width = width
        self._first = 6
        self._cell = 0  # no table
        self._has_digits = False  # whether some number stands without the word digits

    def header(self, header: dict[str, Any]) -> None:
        names = [*self.columns, *self.integrals]
        title = (
            f"# {header['system']}, {_eps(header)}{header['arithmetic']} arithmetic{_algebraic(header)}"
            + (f" ({header['kernel']})" if "kernel" in header else "")
            + (", backward" if header["direction"] == "backward" else "")
        )
        if self._width is None:
            self._line(title)
            self._line("\t".join(["step", *names]))
            return
        tell(title)
        self._first = max(6, len(str(header["steps"])))
        cell = (self._width - self._first) // len(names) - 2
        if cell >= _NARROWEST:
            self._cell = cell
            self._line("step".rjust(self._first) + self._row(names))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        cells = [*x, *("pole" if value is None else value for value in values)]
        if self._width is None:
            self._line("\t".join([str(step), *cells]))
        elif self._cell:
            self._line(str(step).rjust(self._first) + self._row(cells))
        else:
            self._line(f"step {step}")
            for name, cell in zip((*self.columns, *self.integrals), cells, strict=True):
                room = max(_NARROWEST, self._width - len(name) - 5)
                self._line(f"  {name} = {_elided(cell, room)}")

    def end(self, end: dict[str, Any]) -> None:
        last = f"# {ending(end['status'], end['message'])}"
        if self._width is None:
            self._line(last)
        else:
            tell(last)
            if self._has_digits:
                tell("# (30/28): digits above and below the line; (30): the larger number of them")
        self.stream.flush()

    def _row(self, cells: Sequence[str]) -> str:
        shown = [_elided(cell, self._cell) for cell in cells]
        self._has_digits |= any(text.endswith(")") and "digits" not in text for text in shown)
        return "".join("  " + text.rjust(self._cell) for text in shown)


class Npz(Writer):
    """Arrays `step`, `x` and, if there are any, `integrals`, and the header and end as JSON text, all at the end.

    Floats and residues below 2^63 are machine numbers; exact numbers and balls are text, for a float would no longer be
    exact.
    """

    def __init__(self, stream: IO[Any], columns: Sequence[str], integrals: Sequence[str], kind: str) -> None:
        super().__init__(stream, columns, integrals)
        self._kind = kind  # "float", "int" or "text"
        self._steps: list[int] = []
        self._x: list[list[Any]] = []
        self._values: list[list[Any]] = []
        self._longest = 1

    def header(self, header: dict[str, Any]) -> None:
        self._header = header

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        longest = max(self._longest, *map(len, x), *(len(value or "") for value in values))
        if self._kind == "text" and longest * (len(x) + len(values)) * (len(self._x) + 1) > MAX_PADDED_BYTES:
            raise OutputFull(
                f"with step {step} an npz file of exact numbers would exceed {MAX_PADDED_BYTES} bytes: "
                "take --format jsonl, fewer steps or --every",
                self._steps[-1] if self._steps else 0,
            )
        self._longest = longest
        convert: Any = {"float": float, "int": int, "text": str.encode}[self._kind]
        pole = float("nan") if self._kind == "float" else None
        self._steps.append(step)
        self._x.append(list(map(convert, x)))
        self._values.append([pole if value is None else convert(value) for value in values])

    def end(self, end: dict[str, Any]) -> None:
        import numpy as np

        meta = {"header": self._header, "columns": self.columns, "integrals": self.integrals, "end": end}
        # Steps that were reached directly may be longer than machine integers.
        are_short = max(self._steps, default=0) < 2**63
        steps: list[Any] = self._steps if are_short else [str(step).encode() for step in self._steps]
        n = len(self._x)
        arrays = {"step": np.array(steps), "x": np.array(self._x).reshape(n, len(self.columns))}
        if self.integrals:
            if any(None in row for row in self._values):  # at a pole, which residues and text have no number for
                self._values = [[_bytes(value) for value in row] for row in self._values]
            arrays["integrals"] = np.array(self._values).reshape(n, len(self.integrals))
        save: Any = np.savez_compressed
        save(self.stream, meta=np.array(json.dumps(meta)), **arrays)


def _bytes(value: Any) -> bytes:
    return b"" if value is None else value if isinstance(value, bytes) else str(value).encode()


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"' if any(c in name for c in ',"\n') else name


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
