"""Many orbits in floating point at once: how they went, what moved, and the records of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from typing import Any, NamedTuple

from kahanmaps.errors import InputError
from kahanmaps_cli import library as lib
from kahanmaps_cli.screen.numbers import json_number, short_float

FAILURES_SHOWN = 20
_WORTH_COMPILING = 5_000_000  # orbits times steps, below which numpy is done before compiled code is loaded
_LOOKS = 100  # at integrals that were asked for, unless --every says when
_VALUES = 200_000  # of them at most

Told = Callable[[int], None]


def normal_form_for(file: lib.SystemFile, wish: str | None) -> lib.SystemNormalForm | lib.NoNormalForm:
    """The normal form that steps are made in, or why there is none."""
    if wish == "generic":
        return lib.NoNormalForm("generic, as asked for")
    normal_form = file.normal_form
    if not isinstance(normal_form, lib.NoNormalForm) and normal_form.T is not None:
        normal_form = lib.NoNormalForm("ensembles use normal forms for J = [[0, I], [-I, 0]] only")
    if isinstance(normal_form, lib.NoNormalForm) and wish == "normal-form":
        raise InputError(f"the method normal-form needs a normal form, and there is none: {normal_form.reason}")
    return normal_form


class Asked(NamedTuple):
    """What is asked of a run: `options` are those of the command."""

    file: lib.SystemFile
    eps: Any
    starts: lib.NDArray[Any]
    form: lib.NormalForm | None
    integrals: Mapping[str, lib.PhaseFunction]
    options: Mapping[str, Any]


class EnsembleRun:
    """Many orbits in floating point; results are `counts`, `failures`, `moved` and `near`, for people and JSON."""

    def __init__(self, asked: Asked) -> None:
        self.asked = asked
        self.steps: int = asked.options["steps"]
        self.shape: tuple[int, ...] = asked.starts.shape  # orbits and dimension
        self.reached = 0
        self.records = 0
        self.interrupted = False
        value = lib.to_float(asked.eps)  # backward too: the inverse conserves what the map conserves

        def of_point(claimed: Any) -> Callable[[Sequence[float]], float | None]:
            found = lib.float_function(claimed.function)
            return lambda x: found([*x, value])

        wish = asked.options["kernel"]
        kernel = "numpy" if wish is None and len(asked.starts) * self.steps < _WORTH_COMPILING else wish
        self.ensemble: lib.FloatEnsemble = lib.FloatEnsemble(
            asked.file.map,
            asked.eps,
            asked.starts,
            form=asked.form,
            kernel=kernel,
            backward=asked.options["backward"],
            threads=asked.options["threads"],
            integrals={name: of_point(function) for name, function in asked.integrals.items()},
        )
        self.method = "generic" if asked.form is None else "normal-form"
        self.kernel = self.ensemble.kernel
        self.look = 0  # steps between two looks at integrals, if these want more than the first and the last
        if asked.integrals:
            self.look = max(1, -(-self.steps // max(1, min(_LOOKS, _VALUES // self.shape[0]))))

    def interrupt(self) -> None:
        """Ask to end after the portion in hand."""
        self.interrupted = True
        self.ensemble.interrupt()

    def walk(self, told: Told) -> None:
        """Take the steps; the starts and multiples of --every, or the first and the last, go to a .npy file."""
        output, every = self.asked.options["output"], self.asked.options["every"]
        whole = every or max(1, self.steps)
        interval = every or self.look or whole
        with nullcontext() if output is None else lib.NpyFile(output, self.shape, "<f8") as file:
            for k, points in enumerate(self.portions(interval, told)):
                if file is not None and (interval == whole or k == 0):
                    file.append(points)
            if file is not None and interval != whole and self.reached == self.steps:
                file.append(self.ensemble.x[None])
            self.records = 0 if file is None else file.rows

    def portions(self, interval: int, told: Told) -> Iterator[lib.NDArray[Any]]:
        """Take the steps; the starts, then points at multiples of the interval, some at a time."""

        def progress(step: int) -> None:
            told(step)
            if self.interrupted:
                self.ensemble.interrupt()

        yield from self.ensemble.records(self.steps, interval, progress=progress)
        self.reached = self.ensemble.step

    @property
    def counts(self) -> dict[str, int]:
        status = self.ensemble.status
        return {word: int((status == word).sum()) for word in ("completed", "overflow", "singular")}

    def failures(self) -> Iterator[dict[str, Any]]:
        for orbit in (self.ensemble.failed_at >= 0).nonzero()[0].tolist():
            yield {"orbit": orbit, **self.ensemble.end(orbit).to_json()}

    def near(self) -> dict[str, Any]:
        near = self.ensemble.near_singular
        orbits = near.nonzero()[0].tolist()
        first = None
        if orbits:
            at = self.ensemble.near_singular_at
            orbit = min(orbits, key=lambda k: int(at[k]))
            first = {"orbit": orbit, "step": int(at[orbit])}
        return {"steps": int(near.sum()), "orbits": len(orbits), "first": first}

    def moved(self) -> list[dict[str, Any]]:
        going = (self.ensemble.failed_at < 0).nonzero()[0]
        found = []
        for drift in self.ensemble.drift:
            record: dict[str, Any] = {"name": drift.name, "orbits": len(going)}
            if len(going):
                worst = int(going[drift.largest[going].argmax()])
                record["largest"] = lib.json_float(drift.largest[worst])
                record["orbit"] = worst
                record["initial"] = json_number(drift.initial[worst])
            found.append(record)
        return found

    def moved_lines(self) -> list[str]:
        lines = []
        for record in self.moved():
            told = "no orbit was completed"
            if "largest" in record:
                initial, largest = record["initial"], short_float(record["largest"])
                is_complex = isinstance(initial, list)
                start = "+-".join(map(short_float, initial)) + "i" if is_complex else short_float(initial)
                told = f"at most {largest} (orbit {record['orbit']}, from {start})"
            lines.append(f"{record['name']}\t{told}")
        return lines
