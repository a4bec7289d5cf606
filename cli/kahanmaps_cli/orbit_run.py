"""One orbit in the arithmetic and by the method that were asked for: its points as text, its integrals, its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import gcd
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from kahanmaps.algebra.polynomials import RationalFunction
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.family.structure import NoStructure, Structure
    from kahanmaps.maps.orbits import OrbitEnd

Column = tuple[str, Callable[[Sequence[Any]], str | None]]
Point = tuple[int, "list[str] | None", "list[str | None]"]

_TOO_FAR = 10**13  # years
_FEW_STEPS = 3  # for which looking for a structure does not pay
_LONG_INPUT = 4000  # bits of start and eps, from which on setting up a normal form pays later
_LARGE_DIMENSION = 16
_BITS_AT_LEAST = 4096  # where no precision is enough


class OrbitRun:
    """An orbit, or some iterates of it, of the Kahan map of a system file.

    `method` says how it is computed and why; `steps` is the last step, `wanted` which are to be shown.
    """

    def __init__(self, file: SystemFile, eps: Any, options: dict[str, Any]) -> None:
        from kahanmaps.family.structure import NoStructure
        from kahanmaps.maps.methods import choose_method
        from kahanmaps.maps.orbits import require_short

        self.file = file
        self.eps = eps
        self.at: list[int] | None = options["at"]
        self.every: int = options["every"]
        self.steps: int = options["steps"] if self.at is None else max(self.at)
        self.start = options["start"]
        self.backward = options["backward"]
        self.kind, self.number = options["arithmetic"]
        self.columns: list[Column] = []
        self._not_accurate = ""
        if self.kind == "exact":
            require_short(eps, self.start, options["max_digits"])
        structure = self._structure(options["method"])
        self.method = choose_method(options["method"], self.kind, structure, self.at)
        if self.method.name != "jump" and self.steps > _TOO_FAR:
            raise click.UsageError(
                f"step {self.steps} is too far to be reached one step after the other (more than {_TOO_FAR:.0e}), "
                f"and there is no other way here: {self.method.reason}"
            )
        self.structure: Structure | None = None
        if self.method.name != "generic" and not isinstance(structure, NoStructure):
            self.structure = structure
        self.orbit: Any = self._float_orbit(options) if self.kind == "float" else self._exact_orbit(options)
        self._add_integrals(options["integrals"])
        names = ["step", *file.variables, *(name for name, _ in self.columns)]
        for name in names:
            if names.count(name) > 1:
                raise click.UsageError(f"found two columns of the name {name}: write --integral NAME=EXPR")

    @property
    def arithmetic(self) -> str:
        """As on the command line; balls with the bits that were used."""
        return self.kind if self.kind in ("exact", "float") else f"{self.kind}:{self.number}"

    @property
    def storage(self) -> str:
        """What an npz file holds: "float", "int" or "text"."""
        if self.kind == "float":
            return "float"
        return "int" if self.kind == "mod" and self.number < 2**63 else "text"

    def interrupt(self) -> None:
        """Ask a running orbit to end after the step in flight."""
        self.orbit.interrupt()

    @property
    def end(self) -> OrbitEnd:
        """How it ended."""
        from kahanmaps.maps.orbits import OrbitEnd

        end: OrbitEnd = self.orbit.end
        return OrbitEnd("precision", end.steps, self._not_accurate) if self._not_accurate and end.is_whole else end

    def header(self) -> dict[str, Any]:
        """What a result can be redone from."""
        from kahanmaps.algebra.text import format_number, format_polynomial
        from kahanmaps.checks.settings import CONVENTION
        from kahanmaps.version import __version__

        header = {
            "system": self.file.name,
            "variables": list(self.file.variables),
            "rhs": [format_polynomial(polynomial) for polynomial in self.file.system.rhs],
            "eps": format_number(self.eps),
            "time_step": format_number(2 * self.eps),
            "convention": CONVENTION,
            "arithmetic": self.arithmetic,
            "method": self.method.name,
            "start": [format_number(entry) for entry in self.start],
            "direction": "backward" if self.backward else "forward",
            "steps": self.steps,
            "seed": None,
            "version": __version__,
        }
        if self.kind == "float":
            header["kernel"] = self.orbit.kernel
        return header

    def wanted(self, step: int) -> bool:
        """Whether this step is to be shown."""
        return step in self._at if self._at is not None else step % self.every == 0

    def points(self) -> Iterator[Point]:
        """Every step that is computed; coordinates and integrals as text for the wanted ones only: they cost time."""
        self._at = None if self.at is None else set(self.at)
        if self.kind == "float":
            for step, x in self.orbit:
                if self.wanted(step):
                    yield step, [repr(float(entry)) for entry in x], [value(x) for _, value in self.columns]
                else:
                    yield step, None, []
            return
        for point in self.orbit:
            if self.wanted(point.step):
                yield point.step, point.text, [value(point.x) for _, value in self.columns]
            else:
                yield point.step, None, []

    def _structure(self, wish: str | None) -> Structure | NoStructure:
        from kahanmaps.family.structure import NoStructure, structure_of

        if wish == "generic":
            return NoStructure("not looked for")
        if wish is None and (reason := self._why_not_to_look()):
            return NoStructure(reason)
        structure = structure_of(self.file.system, self.file.hamiltonian, self.file.member)
        if isinstance(structure, NoStructure):
            return structure
        if self.kind == "float" and structure.T is not None and wish is None:
            return NoStructure("in machine numbers only J = [[0, I], [-I, 0]] has one")
        if self.kind == "ball":
            from kahanmaps.maps.jump import special_start

            reason = special_start(structure, self.eps, self.start)
            if reason:
                return NoStructure(reason)
        if self.kind == "mod":
            from kahanmaps.algebra.fields import GF
            from kahanmaps.maps.methods import why_no_reduction

            reason = why_no_reduction(structure, GF(self.number), self.eps)
            if reason:
                return NoStructure(reason)
        return structure

    def _why_not_to_look(self) -> str:
        """Empty, or why looking for a structure would cost more than it can save."""
        from kahanmaps.maps.methods import JUMP_FROM

        few = JUMP_FROM["mod"] - 1 if self.kind == "mod" else _FEW_STEPS
        bits = max(max(abs(number.p).bit_length(), number.q.bit_length()) for number in (self.eps, *self.start))
        if bits > _LONG_INPUT:
            few = max(few, 24)
        if self.steps <= few:
            return "not looked for, for so few steps"
        if self.eps == 0:
            return "eps = 0"
        if self.file.member is None and self.file.system.dim > _LARGE_DIMENSION:
            return f"not looked for in dimension {self.file.system.dim}"
        return ""

    def _float_orbit(self, options: dict[str, Any]) -> Any:
        from kahanmaps.maps.fast import FloatOrbit

        form = None if self.structure is None else self.structure.form
        every = self.every if self.at is None else max(1, gcd(*self.at))  # all others are not even delivered
        return FloatOrbit(
            self.file.system,
            self.eps,
            self.start,
            self.steps,
            backward=self.backward,
            form=form,
            kernel=options["kernel"],
            every=every,
        )

    def _exact_orbit(self, options: dict[str, Any]) -> Any:
        from kahanmaps.algebra.fields import GF, QQ, RR

        self._budget = options["max_digits"]
        if self.kind != "ball":
            self.field: Any = QQ if self.kind == "exact" else GF(self.number)
            return self._orbit()
        if self.number != 0:
            self.field = RR(self.number)
            return self._orbit()
        from kahanmaps.maps.accuracy import NotAccurate, bits_for

        def orbit_with(bits: int) -> Any:
            self.number, self.field = bits, RR(bits)
            return self._orbit()

        try:
            bits = bits_for(orbit_with, options["accuracy"], options["progress"])
        except NotAccurate as error:
            self._not_accurate = str(error)
            return orbit_with(_BITS_AT_LEAST)
        return orbit_with(bits)

    def _orbit(self) -> Any:
        from kahanmaps.maps.kahan import KahanMap
        from kahanmaps.maps.orbits import DEFAULT_MAX_DIGITS, Iterates, Orbit

        kahan = KahanMap(self.file.system, self.eps, self.field)
        budget = self._budget or DEFAULT_MAX_DIGITS
        if self.method.name == "jump" and self.structure is not None:
            return Iterates(
                kahan,
                self.start,
                self.at or [],
                structure=self.structure,
                backward=self.backward,
                max_digits=budget,
            )
        return Orbit(
            kahan,
            self.start,
            self.steps,
            backward=self.backward,
            max_digits=budget,
            structure=self.structure if self.method.name == "normal-form" else None,
        )

    def _add_integrals(self, requests: Sequence[tuple[str, str]]) -> None:
        from kahanmaps.algebra.text import parse_rational_function

        for k, (name, text) in enumerate(requests, start=1):
            if text == "known" and not name:
                self._add_known()
                continue
            if text in self.file.integrals:
                name, function = name or text, self.file.integrals[text]
            else:
                name = name or (" ".join(text.split()) if len(text) <= 30 else f"I{k}")
                function = parse_rational_function(text, (*self.file.variables, "eps"), self.file.parameters)
            self._add_function(name, function)

    def _add_known(self) -> None:
        from kahanmaps.checks.conserve import known_integrals
        from kahanmaps.errors import InputError

        known = [integral for integral, _, _ in known_integrals(self.file)]
        if not known and not self.file.integrals:
            raise InputError(f"--integral known: no integral of {self.file.name} is known or claimed")
        if known and self.kind == "float":
            raise InputError(
                "--integral known needs exact, mod:P or ball:BITS arithmetic; give an expression for float"
            )
        for integral in known:
            self.columns.append((integral.name, self._exact_column(integral)))
        for name, function in self.file.integrals.items():
            self._add_function(name, function)

    def _add_function(self, name: str, function: RationalFunction) -> None:
        from kahanmaps.invariants.integrals import ClaimedIntegral

        if self.kind == "float":
            from kahanmaps.maps.fast import float_function, to_float

            # eps itself, also where the orbit steps by -eps: integrals are those of the map.
            self.columns.append((name, _float_column(float_function(function), to_float(self.eps))))
        else:
            self.columns.append((name, self._exact_column(ClaimedIntegral(name, function))))

    def _exact_column(self, integral: Any) -> Callable[[Sequence[Any]], str | None]:
        from kahanmaps.errors import KahanmapsError

        def value(x: Sequence[Any]) -> str | None:
            try:
                found = integral.value(self.field, self.eps, x)
            except KahanmapsError:  # the integral is not defined where the map is not
                return None
            return None if found is None else self.field.format(found)

        return value


def _float_column(function: Callable[..., float | None], eps: float) -> Callable[[Sequence[Any]], str | None]:
    def value(x: Sequence[Any]) -> str | None:
        found = function([*map(float, x), eps])
        return None if found is None else repr(found)

    return value
