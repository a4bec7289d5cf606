"""Many orbits at once in the arithmetic that was asked for: how they went, what moved, and the records of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

from kahanmaps.errors import InputError
from kahanmaps_cli import library as lib
from kahanmaps_cli.numbers import json_float, json_number, short_float

FAILURES_SHOWN = 20
_WORTH_COMPILING = 5_000_000  # orbits times steps, below which numpy is done before compiled code is loaded
_LOOKS = 100  # at integrals that were asked for, unless --every says when
_VALUES = 200_000  # of them at most
_PIECE = 0.1  # seconds between looks at Ctrl-C

Told = Callable[[int], None]


def structure_for(file: lib.SystemFile, wish: str | None) -> lib.Structure | lib.NoStructure:
    """The normal form that steps are made in, or why there is none."""
    if wish == "generic":
        return lib.NoStructure("generic, as asked for")
    structure = file.structure
    if not isinstance(structure, lib.NoStructure) and structure.T is not None:
        structure = lib.NoStructure("ensembles use normal forms for J = [[0, I], [-I, 0]] only")
    if isinstance(structure, lib.NoStructure) and wish == "normal-form":
        raise InputError(f"the method normal-form needs a normal form, and there is none: {structure.reason}")
    return structure


def _kernel(wish: str | None, work: int) -> str | None:
    return "numpy" if wish is None and work < _WORTH_COMPILING else wish


class _Walk:
    """How far a run has come; what it tells is `counts`, `failures`, `moved` and `near`, for people and JSON."""

    reached = 0
    records = 0
    interrupted = False

    def interrupt(self) -> None:
        """Ask to end after the portion in hand."""
        self.interrupted = True


class FloatRun(_Walk):
    """In machine numbers."""

    def __init__(
        self,
        file: lib.SystemFile,
        eps: Any,
        starts: lib.NDArray[Any],
        form: lib.NormalForm | None,
        integrals: Mapping[str, lib.RationalFunction],
        steps: int,
        options: dict[str, Any],
    ) -> None:
        value = lib.to_float(eps)  # backward too: the inverse conserves what the map conserves

        def of_point(function: lib.RationalFunction) -> Callable[[Sequence[float]], float | None]:
            found = lib.float_function(function)
            return lambda x: found([*x, value])

        self.asked = len(integrals)
        self.ensemble = lib.FloatEnsemble(
            file.map,
            eps,
            starts,
            backward=options["backward"],
            form=form,
            kernel=_kernel(options["kernel"], len(starts) * steps),
            threads=options["threads"],
            integrals={name: of_point(function) for name, function in integrals.items()},
        )
        self.method = "generic" if form is None else "normal-form"
        self.kernel = self.ensemble.kernel

    def interrupt(self) -> None:
        super().interrupt()
        self.ensemble.interrupt()

    @property
    def shape(self) -> tuple[int, int]:
        """Orbits and dimension."""
        return self.ensemble.n, self.ensemble.system.dim

    def walk(self, steps: int, every: int, output: str | None, told: Told) -> None:
        """Take the steps; with `output` the starts and multiples of `every` go to that .npy file."""

        def progress(step: int) -> None:
            told(step)
            if self.interrupted:
                self.ensemble.interrupt()

        looks = max(1, min(_LOOKS, _VALUES // self.ensemble.n))
        look = every or max(1, -(-steps // looks))
        if output is not None and (every or not self.asked):
            self.records = self.ensemble.stream(output, steps, every or max(1, steps), progress=progress)
        elif output is not None:
            self._first_and_last(steps, look, output, progress)
        elif self.asked:
            for _ in self.ensemble.records(steps, look, progress=progress):
                pass
        else:
            self.ensemble.advance(steps, progress=progress)
        self.reached = self.ensemble.step

    def _first_and_last(self, steps: int, look: int, output: str, progress: Told) -> None:
        """Look at integrals more often than points are kept."""
        with lib.NpyFile(output, self.shape) as file:
            file.append(self.ensemble.x[None])
            for _ in self.ensemble.records(steps, look, progress=progress):
                pass
            if steps and self.ensemble.step == steps:
                file.append(self.ensemble.x[None])
            self.records = file.rows

    @property
    def counts(self) -> dict[str, int]:
        status = self.ensemble.status
        return {word: int((status == word).sum()) for word in ("completed", "overflow", "singular")}

    def failures(self) -> Iterator[dict[str, Any]]:
        for orbit in (self.ensemble.failed_at >= 0).nonzero()[0].tolist():
            end = self.ensemble.end(orbit)
            yield {"orbit": orbit, "status": end.status, "steps": end.steps, "message": end.message}

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
                record["largest"] = json_float(drift.largest[worst])
                record["orbit"] = worst
                record["initial"] = json_number(drift.initial[worst])
            found.append(record)
        return found

    def moved_lines(self) -> list[str]:
        lines = []
        for record in self.moved():
            if "largest" in record:
                initial = record["initial"]
                start = (
                    short_float(initial)
                    if not isinstance(initial, list)
                    else "+-".join(map(short_float, initial)) + "i"
                )
                largest = short_float(record["largest"])
                lines.append(f"{record['name']}\tat most {largest} (orbit {record['orbit']}, from {start})")
            else:
                lines.append(f"{record['name']}\tno orbit was completed")
        return lines


class ModularRun(_Walk):
    """Modulo a prime, where an integral either holds or does not."""

    def __init__(
        self,
        file: lib.SystemFile,
        eps: Any,
        starts: lib.NDArray[Any],
        form: lib.NormalForm | None,
        integrals: Mapping[str, lib.RationalFunction],
        steps: int,
        options: dict[str, Any],
    ) -> None:
        self.file = file
        self.eps = eps
        self.backward: bool = options["backward"]
        self.ensemble = lib.ModularEnsemble(
            file.map,
            eps,
            starts,
            options["arithmetic"][1],
            form=form,
            kernel=_kernel(options["kernel"], len(starts) * steps),
            threads=options["threads"] or 1,
            backward=options["backward"],
        )
        if options["method"] == "normal-form" and self.ensemble.method != "planes":
            raise InputError("the method normal-form needs a chi that splits modulo P: take generic, or another prime")
        self.method = "normal-form" if self.ensemble.method == "planes" else "generic"
        self.kernel = f"{self.ensemble.kernel} {self.ensemble.method}"
        self._integrals = integrals
        self._initial = self._values()

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.ensemble), self.ensemble.system.dim

    def walk(self, steps: int, every: int, output: str | None, told: Told) -> None:
        if output is None:
            self._advance(steps, told)
            return
        every = every or max(1, steps)
        with lib.NpyFile(output, self.shape, "<i8") as file:
            file.append(self.ensemble.x[None])
            while self.reached + every <= steps and self._advance(self.reached + every, told):
                file.append(self.ensemble.x[None])
            self._advance(steps, told)
            self.records = file.rows

    def _advance(self, stop: int, told: Told) -> bool:
        """To step `stop`, in pieces that take a moment; whether it was reached."""
        piece = 1
        while self.reached < stop and not self.interrupted:
            began = time.monotonic()
            count = min(piece, stop - self.reached)
            self.ensemble.advance(count)
            self.reached += count
            if count == piece and time.monotonic() - began < _PIECE:
                piece *= 2
            told(self.reached)
        return self.reached >= stop

    def _values(self) -> dict[str, list[Any]]:
        field = self.ensemble.field
        claims = {name: lib.ClaimedIntegral(name, function) for name, function in self._integrals.items()}
        points = self.ensemble.x.tolist() if claims else []
        return {
            name: [claim.value(field, self.eps, [field.convert(entry) for entry in x]) for x in points]
            for name, claim in claims.items()
        }

    @property
    def counts(self) -> dict[str, int]:
        singular = int((self.ensemble.singular_at >= 0).sum())
        return {"completed": len(self.ensemble) - singular, "singular": singular}

    def failures(self) -> Iterator[dict[str, Any]]:
        over = self.file.map.at(self.eps, self.ensemble.field)
        det = lib.det_of(over.denominator_name(self.backward))
        for orbit in (self.ensemble.singular_at >= 0).nonzero()[0].tolist():
            at = int(self.ensemble.singular_at[orbit])
            message = f"{det} = 0 at step {at}: the map has no value there"
            yield {"orbit": orbit, "status": "singular", "steps": at, "message": message}

    def moved(self) -> list[dict[str, Any]]:
        now = self._values()
        found = []
        for name, initial in self._initial.items():
            pairs = list(zip(initial, now[name], strict=True))
            defined = [k for k, (before, after) in enumerate(pairs) if before is not None and after is not None]
            moved = [k for k in defined if pairs[k][0] != pairs[k][1]]
            record = {"name": name, "orbits": len(defined), "changed": len(moved)}
            found.append({**record, "orbit": moved[0] if moved else None})
        return found

    def moved_lines(self) -> list[str]:
        lines = []
        for record in self.moved():
            first = f", the first of them orbit {record['orbit']}" if record["changed"] else ""
            lines.append(f"{record['name']}\tchanged in {record['changed']} of {record['orbits']} orbits{first}")
        return lines

    def near(self) -> None:
        """Residues are exact: no step is nearly singular."""


Run: TypeAlias = FloatRun | ModularRun
