"""An orbit in a file: text, jsonl and csv line by line, json as well, npz whole at the end; stored.py reads them.

All but json and npz are valid after every record, so that whatever ends an orbit leaves a file that can be read.
"""

from __future__ import annotations

import io
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from kahanmaps.algebra.printing import csv_line, guarded
from kahanmaps.atomic_files import atomic_write, open_append, write_atomically
from kahanmaps.errors import InputError
from kahanmaps.maps.convention import eps_words
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.version import __version__

# An npz file of text holds every number padded to the longest one; beyond this size jsonl is the format to use.
MAX_PADDED_BYTES = 512_000_000
_UNFLUSHED = 4_000  # characters; a longer line is flushed at once, since the next step may take minutes
_ENVELOPE = {"command": "orbit", "version": __version__}  # what every JSON object of a command begins with
_TEXT = ("", ".txt", ".tsv", ".out", ".dat", ".log")  # endings of files of text


class OutputFull(Exception):
    """A format cannot hold the next point. Attribute: `steps`, the last step that it holds."""

    def __init__(self, message: str, steps: int) -> None:
        self.steps = steps
        super().__init__(message)


class Writer(ABC):
    """Receives a header, points and an end; columns are those of the variables and then of the integrals, by name."""

    def __init__(self, stream: IO[Any], variables: Sequence[str], integrals: Sequence[str]) -> None:
        self.stream = stream
        self.variables = list(variables)
        self.integrals = list(integrals)
        self._unflushed = 0

    @abstractmethod
    def header(self, header: dict[str, Any]) -> None:
        """What the orbit is of."""

    @abstractmethod
    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        """One point, its coordinates and the values of the integrals (None at a pole)."""

    @abstractmethod
    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        """How it ended, and what else is known of a float orbit."""

    def _line(self, text: str) -> None:
        self.stream.write(text + "\n")
        # Now and then, so that a reader of the file sees it grow and a kill loses little; always before long steps.
        self._unflushed += len(text)
        if self._unflushed > _UNFLUSHED:
            self.stream.flush()
            self._unflushed = 0


class Text(Writer):
    """Columns separated by tabs between two comments."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(title(header))
        self._line("\t".join(["step", *self.variables, *self.integrals]))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line("\t".join([str(step), *x, *("pole" if value is None else value for value in values)]))

    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        self._line(f"# {end.text}")
        self.stream.flush()


class JsonLines(Writer):
    """One JSON object a line, with "record" header, point or end."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({"record": "header", **header}))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(json.dumps({"record": "point", **self._point(step, x, values)}))

    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        self._line(json.dumps({"record": "end", **end.to_json(), **more}))
        self.stream.flush()

    def _point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> dict[str, Any]:
        beside = {"integrals": dict(zip(self.integrals, values, strict=True))} if self.integrals else {}
        return {"step": step, "x": list(x), **beside}


class Json(JsonLines):
    """One JSON object with the header, all points and the end."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({**_ENVELOPE, **header})[:-1] + ', "points": [')
        self._separator = ""

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(self._separator + json.dumps(self._point(step, x, values)))
        self._separator = ","

    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        self._line(f'], "end": {json.dumps({**end.to_json(), **more})}}}')
        self.stream.flush()


class Csv(Writer):
    """Comma-separated values below a row of names, and nothing else: header and end are in a file beside them.

    `beside` is its path, None where the table goes to standard output; it is there from the beginning.
    """

    beside: str | None = None

    def header(self, header: dict[str, Any]) -> None:
        self._header = header
        self._tell(None)
        self._line(csv_line(["step", *self.variables, *map(guarded, self.integrals)])[:-1])

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(",".join([str(step), *x, *("" if value is None else value for value in values)]))

    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        self.stream.flush()
        self._tell({**end.to_json(), **more})

    def _tell(self, end: dict[str, Any] | None) -> None:
        if self.beside is not None:
            told = {**_ENVELOPE, "header": self._header, "end": end}
            write_atomically(self.beside, (json.dumps(told, indent=1) + "\n").encode())


class Npz(Writer):
    """Arrays `step`, `x` and, if there are any, `integrals`, and the header and end as JSON text, all at the end.

    Floats and residues below 2^63 are machine numbers; exact numbers and balls are text, for a float would no longer be
    exact.
    """

    def header(self, header: dict[str, Any]) -> None:
        self._header = header
        kind, _, number = header["arithmetic"].partition(":")
        is_short = kind == "mod" and int(number) < 2**63
        self._convert: Any = float if kind == "float" else int if is_short else str.encode
        self._steps: list[int] = []
        self._x: list[list[Any]] = []
        self._values: list[list[Any]] = []
        self._longest = 1

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        longest = max(self._longest, *map(len, x), *(len(value or "") for value in values))
        size = longest * (len(x) + len(values)) * (len(self._x) + 1)
        if self._convert is str.encode and size > MAX_PADDED_BYTES:
            raise OutputFull(
                f"with step {step} an npz file of exact numbers would exceed {MAX_PADDED_BYTES} bytes: "
                "take --format jsonl, fewer steps or --every",
                self._steps[-1] if self._steps else 0,
            )
        self._longest = longest
        pole = float("nan") if self._convert is float else None
        self._steps.append(step)
        self._x.append(list(map(self._convert, x)))
        self._values.append([pole if value is None else self._convert(value) for value in values])

    def end(self, end: OrbitEnd, more: Mapping[str, Any]) -> None:
        import numpy as np

        told = {**end.to_json(), **more}
        meta = {"header": self._header, "columns": self.variables, "integrals": self.integrals, "end": told}
        # Steps that were reached directly may be longer than machine integers.
        are_short = max(self._steps, default=0) < 2**63
        steps: list[Any] = self._steps if are_short else [str(step).encode() for step in self._steps]
        n = len(self._x)
        arrays = {"step": np.array(steps), "x": np.array(self._x).reshape(n, len(self.variables))}
        if self.integrals:
            if any(None in row for row in self._values):  # at a pole, which residues and text have no number for
                filled = [["" if x is None else x for x in row] for row in self._values]
                self._values = [[x if isinstance(x, bytes) else str(x).encode() for x in row] for row in filled]
            arrays["integrals"] = np.array(self._values).reshape(n, len(self.integrals))
        save: Any = np.savez_compressed
        held = io.BytesIO()  # a zip archive needs a stream that can seek
        save(held, meta=np.array(json.dumps(meta)), **arrays)
        self.stream.write(held.getvalue())


WRITERS: dict[str, type[Writer]] = {"text": Text, "json": Json, "jsonl": JsonLines, "csv": Csv, "npz": Npz}
FORMATS = (*WRITERS, "npy")


@contextmanager
def writer_to(
    to: str | Path | IO[str], form: str, variables: Sequence[str], integrals: Sequence[str]
) -> Iterator[Writer]:
    """What writes points in one of the formats `WRITERS` to a path, on the disk at the end, or a stream of text."""
    if not isinstance(to, str | Path):
        stream = getattr(to, "buffer", None) if form == "npz" else to  # bytes, behind a stream that is not in memory
        if stream is None:
            raise InputError("npz is not text: found a stream without a buffer of bytes, expected a path")
        yield WRITERS[form](stream, variables, integrals)
        return
    if form == "csv" and os.path.isdir(meta_of(to)):  # said before an older table is lost
        raise InputError(f"found a folder {meta_of(to)}, where what the table is of is written")
    with atomic_write(to) if form == "npz" else open_append(to) as stream:
        writer = WRITERS[form](stream, variables, integrals)
        if isinstance(writer, Csv):
            writer.beside = meta_of(to)
        yield writer


def meta_of(path: str | Path) -> str:
    """The file beside a .csv file that says what its table is of."""
    return f"{path}.meta.json"


def form_of(path: str | Path) -> str:
    """The format that the name of a file stands for. Raises InputError for other endings."""
    suffix = Path(path).suffix.lower()
    if suffix in _TEXT:
        return "text"
    if suffix[1:] not in FORMATS:
        endings = ", ".join(f".{form}" for form in FORMATS[1:])
        raise InputError(f"found the ending {suffix} of {path}, expected .txt, {endings}, or --format")
    return suffix[1:]


def title(header: Mapping[str, Any]) -> str:
    """What an orbit is of, on a line: the system, eps, the arithmetic, the number that a parameter is."""
    t = "t = " if header["arithmetic"] == "exact" else ""
    return (
        f"# {header['system']}{eps_words(header)}, {header['arithmetic']} arithmetic"
        + "".join(f", {t if name != 't' else ''}{name} = {root}" for name, root in header.get("algebraic", {}).items())
        + (f" ({header['kernel']})" if "kernel" in header else "")
        + (", backward" if header["direction"] == "backward" else "")
    )
