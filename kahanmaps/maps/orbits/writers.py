"""Writers of orbit files, one class for each format: text, json, jsonl, csv, npz and parquet.

Files of text, jsonl and csv are valid after every record, so that a file remains readable however the orbit ends. npz
and parquet files are written at the end. Their writers receive float orbits in portions: the rows of an npz file go to
a temporary file, and in a parquet file each portion is a row group.
"""

from __future__ import annotations

import io
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any

from kahanmaps.algebra.printing import csv_line, spreadsheet_safe
from kahanmaps.atomic_files import atomic_write, open_append, write_atomically
from kahanmaps.errors import InputError
from kahanmaps.maps.convention import eps_record_suffix
from kahanmaps.maps.orbits.iteration import OrbitEnd
from kahanmaps.processes import processors
from kahanmaps.version import __version__

# An npz file pads exact numbers to the length of the longest; larger orbits need jsonl.
MAX_PADDED_BYTES = 512_000_000
_CHUNK_SIZE = 1 << 18  # number of array entries copied in one operation
_MIN_ARROW_ROWS, _ARROW_ROWS = 2000, 50_000  # rows of a csv file from which on pyarrow is used; rows in one call of it
_FLUSH_AFTER = 4_000  # number of characters; a longer line is flushed at once, since the next step may take minutes
_COMMAND = {"command": "orbit", "version": __version__}  # the beginning of the JSON object of every command
_TEXT_SUFFIXES = ("", ".txt", ".tsv", ".out", ".dat", ".log")


class OutputFull(Exception):
    """The format cannot store the next point. Attribute: `steps`, the last step that was written."""

    def __init__(self, message: str, steps: int) -> None:
        self.steps = steps
        super().__init__(message)


class Writer(ABC):
    """Base class of writers of a header, points and an end. The columns are the variables, then the integrals."""

    def __init__(self, stream: IO[Any], variables: Sequence[str], integrals: Sequence[str]) -> None:
        self.stream = stream
        self.variables = list(variables)
        self.integrals = list(integrals)
        self._unflushed = 0

    @abstractmethod
    def header(self, header: dict[str, Any]) -> None:
        """Write the data that determine the orbit: system, eps, initial point, arithmetic."""

    @abstractmethod
    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        """Write a point: its coordinates and the values of the integrals (None at a pole)."""

    def portion(self, first: int, every: int, x: Any) -> None:
        """Write the points (count, dim) of a float orbit at the steps first, first + every, ..., without integrals."""
        for step, row in enumerate(x.tolist()):
            self.point(first + step * every, list(map(repr, row)), ())

    @abstractmethod
    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        """Write how the orbit ended, and for a float orbit the data `extra`."""

    def _line(self, text: str) -> None:
        self.stream.write(text + "\n")
        # Flush regularly, so that a killed process loses little; a long line is flushed before the next long step.
        self._unflushed += len(text)
        if self._unflushed > _FLUSH_AFTER:
            self.stream.flush()
            self._unflushed = 0


class Text(Writer):
    """Tab-separated columns; the first and the last line are comments."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(title(header))
        self._line("\t".join(["step", *self.variables, *self.integrals]))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line("\t".join([str(step), *x, *("pole" if value is None else value for value in values)]))

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        self._line(f"# {end.text}")
        self.stream.flush()


class JsonLines(Writer):
    """One JSON object per line; the value of the key "record" is "header", "point" or "end"."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({"record": "header", **header}))

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(json.dumps({"record": "point", **self._point(step, x, values)}))

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        self._line(json.dumps({"record": "end", **end.to_json(), **extra}))
        self.stream.flush()

    def _point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> dict[str, Any]:
        integrals = {"integrals": dict(zip(self.integrals, values, strict=True))} if self.integrals else {}
        return {"step": step, "x": list(x), **integrals}


class Json(JsonLines):
    """One JSON object with the header, all points and the end."""

    def header(self, header: dict[str, Any]) -> None:
        self._line(json.dumps({**_COMMAND, **header})[:-1] + ', "points": [')
        self._separator = ""

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(self._separator + json.dumps(self._point(step, x, values)))
        self._separator = ","

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        self._line(f'], "end": {json.dumps({**end.to_json(), **extra})}}}')
        self.stream.flush()


class Csv(Writer):
    """Comma-separated values with a row of column names; header and end are written to a separate JSON file.

    `metadata_path` is the path of the JSON file; None if the table is written to standard output.
    """

    metadata_path: str | None = None

    def header(self, header: dict[str, Any]) -> None:
        self._header = header
        self._write_metadata(None)
        self._line(csv_line(["step", *self.variables, *map(spreadsheet_safe, self.integrals)])[:-1])

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        self._line(",".join([str(step), *x, *("" if value is None else value for value in values)]))

    def portion(self, first: int, every: int, x: Any) -> None:
        steps = range(first, first + len(x) * every, every)
        if len(x) >= _MIN_ARROW_ROWS and find_spec("pyarrow"):
            from concurrent.futures import ThreadPoolExecutor

            import pyarrow as arrow
            from pyarrow import compute

            for k in range(0, len(x), _ARROW_ROWS):
                with ThreadPoolExecutor(min(2, processors())) as pool:
                    columns = list(pool.map(_arrow_texts, x[k : k + _ARROW_ROWS].T.copy()))
                step_column = arrow.array(steps[k : k + _ARROW_ROWS], arrow.int64()).cast(arrow.string())
                last_column = compute.binary_join_element_wise(columns.pop(), "", "\n")
                lines = compute.binary_join_element_wise(step_column, *columns, last_column, ",")
                self.stream.write(str(lines.buffers()[2], "ascii"))  # the lines, one after the other
            return
        # json writes the same digits as repr, and is several times as fast.
        table = json.dumps(list(zip(steps, *x.T.tolist(), strict=True)), separators=(",", ":"))
        if len(x):
            self._line(table[2:-2].replace("],[", "\n"))

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        self.stream.flush()
        self._write_metadata({**end.to_json(), **extra})

    def _write_metadata(self, end: dict[str, Any] | None) -> None:
        if self.metadata_path is not None:
            record = {**_COMMAND, "header": self._header, "end": end}
            write_atomically(self.metadata_path, (json.dumps(record, indent=1) + "\n").encode())


def _arrow_texts(column: Any) -> Any:
    """Return a column of floats as an array of pyarrow with the same characters as `repr`."""
    import numpy as np
    import pyarrow as arrow
    from pyarrow import compute

    texts, size = arrow.array(column).cast(arrow.string()), np.abs(column)
    # Numbers for which pyarrow writes 2, 0.00001, 1e-9, 1e+10 instead of 2.0, 1e-05, 1e-09, 10000000000.0.
    mask = (column == np.rint(column)) | ((size > 9e-11) & (size < 1e-4)) | ((size >= 1e10) & (size < 1e16))
    if mask.any():
        texts = compute.replace_with_mask(texts, mask, arrow.array(list(map(repr, column[mask].tolist()))))
    return texts


class Npz(Writer):
    """Arrays `step`, `x` and `integrals` (if any), and header and end as JSON text; written at the end of the orbit.

    Floats and residues below 2^63 are stored as float64 and int64, exact numbers and balls as text. The rows of a float
    orbit without integrals are first stored in a temporary file, and are not compressed.
    """

    def header(self, header: dict[str, Any]) -> None:
        self._header = header
        self._rows: IO[bytes] | None = None
        self._count, self._every = 0, 1
        kind, _, number = header["arithmetic"].partition(":")
        is_short = kind == "mod" and int(number) < 2**63
        self._convert: Any = float if kind == "float" else int if is_short else str.encode
        self._steps: list[int] = []
        self._x: list[list[Any]] = []
        self._values: list[list[Any]] = []
        self._max_length = 1

    def point(self, step: int, x: Sequence[str], values: Sequence[str | None]) -> None:
        max_length = max(self._max_length, *map(len, x), *(len(value or "") for value in values))
        size = max_length * (len(x) + len(values)) * (len(self._x) + 1)
        if self._convert is str.encode and size > MAX_PADDED_BYTES:
            raise OutputFull(
                f"with step {step} an npz file of exact numbers would exceed {MAX_PADDED_BYTES} bytes: "
                "use --format jsonl, fewer steps or --every",
                self._steps[-1] if self._steps else 0,
            )
        self._max_length = max_length
        pole_value = float("nan") if self._convert is float else None
        self._steps.append(step)
        self._x.append(list(map(self._convert, x)))
        self._values.append([pole_value if value is None else self._convert(value) for value in values])

    def portion(self, first: int, every: int, x: Any) -> None:
        if self._rows is None:
            name = getattr(self.stream, "name", "")  # the temporary file is next to this file, on the same disk
            folder = os.path.dirname(name) if isinstance(name, str) and name.startswith(os.sep) else None
            from tempfile import TemporaryFile

            self._rows = TemporaryFile(dir=folder)  # noqa: SIM115 (closed by `end`)
        self._rows.write(x.astype("<f8").tobytes())
        self._count, self._every = self._count + len(x), every

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        from zipfile import ZipFile

        import numpy as np

        end_record = {**end.to_json(), **extra}
        meta = {"header": self._header, "columns": self.variables, "integrals": self.integrals, "end": end_record}
        if self._rows is not None:
            self._rows.seek(0)
            n, read_chunk = self._count, partial(self._rows.read, 8 * _CHUNK_SIZE)
            step_chunks = (
                np.arange(k, min(k + _CHUNK_SIZE, n), dtype="<i8") * self._every for k in range(0, n, _CHUNK_SIZE)
            )
            with ZipFile(self.stream, "w") as members:
                with members.open("meta.npy", "w") as member:
                    np.lib.format.write_array(member, np.array(json.dumps(meta)))
                columns = (
                    ("step", "<i8", (n,), map(bytes, step_chunks)),
                    ("x", "<f8", (n, len(self.variables)), iter(read_chunk, b"")),
                )
                for name, kind, shape, chunks in columns:
                    with members.open(f"{name}.npy", "w", force_zip64=True) as member:
                        header_fields = {"descr": kind, "fortran_order": False, "shape": shape}
                        np.lib.format.write_array_header_1_0(member, header_fields)
                        member.writelines(chunks)
            self._rows.close()
            return
        # The numbers of iterates computed directly may exceed 64 bits.
        has_int64_steps = max(self._steps, default=0) < 2**63
        steps: list[Any] = self._steps if has_int64_steps else [str(step).encode() for step in self._steps]
        n = len(self._x)
        arrays = {"step": np.array(steps), "x": np.array(self._x).reshape(n, len(self.variables))}
        if self.integrals:
            if any(None in row for row in self._values):  # poles become empty text, since these types have no NaN
                filled_rows = [["" if x is None else x for x in row] for row in self._values]
                self._values = [[x if isinstance(x, bytes) else str(x).encode() for x in row] for row in filled_rows]
            arrays["integrals"] = np.array(self._values).reshape(n, len(self.integrals))
        save: Any = np.savez_compressed
        archive = io.BytesIO()  # zip archives need a seekable stream
        save(archive, meta=np.array(json.dumps(meta)), **arrays)
        self.stream.write(archive.getvalue())


class Parquet(Npz):
    """A table with the columns of csv, and header and end as JSON text in its metadata; written at the end.

    Floats and residues below 2^63 are stored as numbers, exact numbers and balls as text. Needs pyarrow.
    """

    def header(self, header: dict[str, Any]) -> None:
        super().header(header)
        self._file: Any = None
        if self._convert is str.encode:
            self._convert = str
        try:
            self._arrow: tuple[Any, Any] = import_module("pyarrow"), import_module("pyarrow.parquet")
        except ImportError as error:
            raise InputError(f"parquet needs pyarrow ({error}): pip install pyarrow, or write .csv or .npz") from error

    def portion(self, first: int, every: int, x: Any) -> None:
        arrow, parquet = self._arrow
        steps = arrow.array(range(first, first + len(x) * every, every), arrow.int64())
        table = arrow.table([steps, *map(arrow.array, x.T.copy())], names=["step", *self.variables])
        if self._file is None:
            # pyarrow does not show metadata that are added at the end if the schema has metadata of its own.
            self._file = parquet.ParquetWriter(self.stream, table.schema, store_schema=False)
        self._file.write_table(table)

    def end(self, end: OrbitEnd, extra: Mapping[str, Any]) -> None:
        arrow, parquet = self._arrow
        if self._file is not None:
            record = {**_COMMAND, "header": self._header, "end": {**end.to_json(), **extra}}
            self._file.add_key_value_metadata({"kahanmaps": json.dumps(record)})
            self._file.close()
            return
        steps: list[Any] = self._steps if max(self._steps, default=0) < 2**63 else list(map(str, self._steps))
        rows = [(*x, *values) for x, values in zip(self._x, self._values, strict=True)]
        names = (*self.variables, *self.integrals)
        columns = dict(zip(names, zip(*rows, strict=True) if rows else [()] * len(names), strict=True))
        table = arrow.table({"step": steps, **{name: list(column) for name, column in columns.items()}})
        record = {**_COMMAND, "header": self._header, "end": {**end.to_json(), **extra}}
        parquet.write_table(table.replace_schema_metadata({"kahanmaps": json.dumps(record)}), self.stream)


WRITERS: dict[str, type[Writer]] = {
    "text": Text,
    "json": Json,
    "jsonl": JsonLines,
    "csv": Csv,
    "npz": Npz,
    "parquet": Parquet,
}
FORMATS = (*WRITERS, "npy")
_BINARY_FORMATS = ("npz", "parquet")


@contextmanager
def writer_to(
    to: str | Path | IO[str], form: str, variables: Sequence[str], integrals: Sequence[str]
) -> Iterator[Writer]:
    """Open a writer, in one of the formats in `WRITERS`, for a path or a stream of text.

    Raises InputError if the format is binary and the stream has no buffer of bytes.
    """
    if not isinstance(to, str | Path):
        stream = getattr(to, "buffer", None) if form in _BINARY_FORMATS else to
        if stream is None:
            raise InputError(f"{form} is a binary format: give a path, or a stream with a buffer of bytes")
        yield WRITERS[form](stream, variables, integrals)
        return
    if form == "csv" and os.path.isdir(meta_of(to)):  # tested before an existing table is overwritten
        raise InputError(
            f"found a folder {meta_of(to)}, expected no folder of this name: the metadata is written there"
        )
    with atomic_write(to) if form in _BINARY_FORMATS else open_append(to) as stream:
        writer = WRITERS[form](stream, variables, integrals)
        if isinstance(writer, Csv):
            writer.metadata_path = meta_of(to)
        yield writer


def meta_of(path: str | Path) -> str:
    """Return the path of the file with the metadata of a .csv file."""
    return f"{path}.meta.json"


def form_of(path: str | Path) -> str:
    """Return the format given by the suffix of a file name. Raises InputError for unknown suffixes."""
    suffix = Path(path).suffix.lower()
    if suffix in _TEXT_SUFFIXES:
        return "text"
    if suffix[1:] not in FORMATS:
        suffixes_text = ", ".join(f".{form}" for form in FORMATS[1:])
        raise InputError(f"found the ending {suffix} of {path}, expected .txt, {suffixes_text}, or --format")
    return suffix[1:]


def title(header: Mapping[str, Any]) -> str:
    """Return the title line of an orbit: system, eps, arithmetic, algebraic numbers, direction."""
    t = "t = " if header["arithmetic"] == "exact" else ""
    return (
        f"# {header['system']}{eps_record_suffix(header)}, {header['arithmetic']} arithmetic"
        + "".join(f", {t if name != 't' else ''}{name} = {root}" for name, root in header.get("algebraic", {}).items())
        + (f" ({header['kernel']})" if "kernel" in header else "")
        + (", backward" if header["direction"] == "backward" else "")
    )
