"""The result of a scan: components of parameter space, and which part of it was searched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import evaluate
from kahanmaps.algebra.printing import attributes, format_number, format_polynomial
from kahanmaps.algebra.work import SPENT
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.symbols import member_of
from kahanmaps.errors import InputError, counted
from kahanmaps.laboratory.conclusion import Conclusion
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.scan.lift import MAX_FIELD_DEGREE, SPARE_BITS, height_bound
from kahanmaps.laboratory.scan.modular_components import degree_reached
from kahanmaps.laboratory.scan.sweep import Degrees, Sweep

_LISTED = 12  # primes
STEPS = 40  # for which singularities are followed where the growth at a member is asked


@dataclass(frozen=True)
class Component:
    """A condition on the parameters: `equations`, polynomials over Q that vanish on it, found modulo `primes`.

    `degrees` are d_1, ..., d_N there. `confirmed` of `tried` random members have them. `values` are those of a rational
    member, None where none was found; `growth` is the growth of its degrees, and `verdict` the verdict of its analysis,
    None where none was requested.
    """

    equations: tuple[fmpq_mpoly, ...]
    dimension: int
    degrees: Degrees
    primes: tuple[int, ...]
    confirmed: int = 0
    tried: int = 0
    values: dict[str, fmpq] | None = None
    growth: DegreeGrowth | None = None
    verdict: Conclusion | None = None

    @property
    def is_confirmed(self) -> bool:
        """Whether all members that were tried have these degrees."""
        return 0 < self.tried == self.confirmed

    @property
    def is_rational_point(self) -> bool:
        """Whether it is one member, with rational parameters."""
        return self.dimension == 0 and self.values is not None

    @property
    def member_text(self) -> str:
        """The values of the rational member, as a point where there are several; empty where none is known."""
        values = [format_number(value) for value in (self.values or {}).values()]
        return f"({', '.join(values)})" if len(values) > 1 else "".join(values)

    @property
    def text(self) -> str:
        """The condition: values of a point, else equations."""
        if self.is_rational_point:
            return self.member_text
        return ", ".join(f"{format_polynomial(equation)} = 0" for equation in self.equations)

    def contains(self, point: Sequence[fmpq]) -> bool:
        """Whether the equations hold at a rational point."""
        return not any(evaluate(equation, QQ, point) for equation in self.equations)

    def to_json(self) -> dict[str, Any]:
        """Plain data; equations as text."""
        growth = self.growth
        return {
            **attributes(self, "equations", "dimension", "primes", "confirmed", "tried", "is_confirmed", "values"),
            "growth": None if growth is None else str(growth.growth),
            "growth_text": None if growth is None else growth.growth_text,
            "verdict": None if self.verdict is None else attributes(self.verdict, "kind", "ground", "sentence"),
        }


def growth_on(some: Sequence[Component]) -> DegreeGrowth | None:
    """The growth on components with the same degrees: that of the first of them where it is known."""
    return next((one.growth for one in some if one.growth is not None), None)


def _listed(texts: Sequence[str]) -> str:
    """All the texts, or the first three and the last one of many."""
    return ", ".join(texts if len(texts) <= _LISTED else [*texts[:3], "...", f"{texts[-1]} ({len(texts)} of them)"])


@dataclass(frozen=True)
class Scan(PrintableResult):
    """The result of a scan: components, those with the slowest growth first.

    `generic` are the degrees d_1, ..., d_N of a generic member, `sweeps` the special members modulo each prime.
    `unassigned` is the number of special members on no component modulo each of them: points over number fields, of a
    height above `height`, or members that are special modulo this prime by chance. `symmetric` are changes of
    parameters that permute the special members, by their images. `ended` is "complete", "budget" or "interrupted";
    `omitted` names what was not done.
    """

    file: SystemFile
    over: tuple[str, ...]
    eps: fmpq | None
    seed: int
    generic: Degrees
    components: tuple[Component, ...]
    sweeps: tuple[Sweep, ...]
    unassigned: tuple[int, ...]
    symmetric: tuple[tuple[str, ...], ...]
    ended: str
    omitted: tuple[str, ...] = ()

    def rows(self) -> list[dict[str, str]]:
        """A row for each component, for `pandas.DataFrame(found.rows())` and the like."""
        pairs = [(one, degrees) for degrees, some in self.classes for one in some]
        return [{"where": one.text, "degrees": ", ".join(map(str, degrees))} for one, degrees in pairs]

    @property
    def height(self) -> int:
        """The bound of numerators and denominators up to which conditions are found; 0 with too few primes."""
        bounds = [height_bound([one.prime for one in some]) for some in self._kinds if len(some) > 2]
        return min(bounds, default=0)

    @property
    def _kinds(self) -> tuple[list[Sweep], ...]:
        """The sweeps over all members, and those over members on random lines of parameter space, and planes."""
        return (
            [one for one in self.sweeps if one.complete],
            *([one for one in self.sweeps if not one.complete and one.width == width] for width in (1, 2)),
        )

    @property
    def degree(self) -> int:
        """The total degree up to which hypersurfaces with the same degrees of iterates are found."""
        count = len(self.over)
        enough = [
            degree_reached(0.75 * min(one.seen / one.prime for one in some), count)
            for some in self._kinds
            if len(some) > 2
        ]
        return max(enough, default=0)

    @property
    def classes(self) -> list[tuple[Degrees, list[Component]]]:
        """The components by degrees, in their order."""
        found: dict[Degrees, list[Component]] = {}
        for one in self.components:
            found.setdefault(one.degrees, []).append(one)
        return list(found.items())

    @property
    def coverage(self) -> str:
        """A sentence on what was searched, and what is found by such a search."""
        if not self.height:
            tried = counted(len(self.sweeps), "prime")
            return f"conditions need members modulo three primes, and those modulo {tried} were tried"
        whole, lines, planes = (_listed([str(one.prime) for one in some]) for some in self._kinds)
        parts = [f"all members with parameters modulo {whole}"] if whole else []
        for width, what, some in ((1, "lines", lines), (2, "planes", planes)):
            if some:
                count = round(min(one.seen / one.prime**width for one in self._kinds[width]))
                parts.append(
                    f"{'those' if parts else 'members'} on {count} random {what} of parameter space modulo {some}"
                )
        small = "single points" if len(self.over) == 1 else "single points, affine spaces, hypersurfaces of these"
        kinds = [small] if whole else []
        if len(self.over) > 1:
            kinds.append(f"hypersurfaces of a total degree up to {self.degree} for each sequence of degrees")
        where = f"where one of the first {len(self.generic)} degrees is smaller"
        if planes:
            kinds.append("affine spaces of codimension 2, and hypersurfaces of affine spaces that have codimension 2")
        if not whole:
            kinds.append("nothing of smaller dimension, which would need all members")
        fields = []
        if whole:
            fields.append(
                f"points over number fields of degree d up to {MAX_FIELD_DEGREE}, with coefficients up to H where "
                f"2^{SPARE_BITS // len(self.over)} (2 H + 1)^(d + 1) is below the product of the primes modulo which "
                "they have residues"
            )
        if len(self.over) > 1:
            fields.append("hypersurfaces over a quadratic field that splits modulo three of the primes")
        return (
            f"{', and '.join(parts)}; found are {', and '.join(kinds)}, {where}, over Q with numerators and "
            f"denominators up to {self.height}; {', and '.join(fields)}"
        )

    @property
    def text(self) -> str:
        """The lines of the report, each a label, a tab and its value."""
        if not self.height:
            lines = [  # where nothing was lifted, the numbers of special members by degrees
                ("special", f"{', '.join(map(str, degrees))}\t{len(points)} members modulo {one.prime}")
                for one in self.sweeps
                for degrees, points in sorted(one.classes.items())
            ]
            return "\n".join(f"{word}\t{rest}" for word, rest in [*lines, ("searched", self.coverage), *self._open])
        names = f"({', '.join(self.over)})" if len(self.over) > 1 else self.over[0]
        lines = [("generic", ", ".join(map(str, self.generic)))]
        for degrees, members in self.classes:
            growth = growth_on(members)
            told = ", ".join("none" if d < 0 else str(d) for d in degrees)
            known = "" if growth is None or growth.recurrence is None else f", {growth.known}"
            lines.append(("degrees", told + (f"\t{growth.kind_text}{known}" if growth is not None else "")))
            for where, sign, here in (
                ("where", "; ", [one for one in members if not one.is_rational_point]),
                (f"at {names} =", ", ", [one for one in members if one.is_rational_point]),
            ):
                for some, mark in (
                    ([one.text for one in here if one.is_confirmed], ""),
                    ([one.text for one in here if not one.is_confirmed], "\tnot confirmed"),
                ):
                    lines += [(where, sign.join(some) + mark)] if some else []
            lines += [
                ("verdict", f"{names} = {one.member_text}: {one.verdict.sentence}")
                for one in members
                if one.verdict is not None
            ]
        if self.components:
            lines.append(("growth", f"that of one member; singularities were followed for {STEPS} steps"))
        else:
            where = f"where one of the first {len(self.generic)} degrees is smaller"
            lines.append(("found", f"no condition on the parameters {where}"))
        for images in self.symmetric:
            image = f"({', '.join(images)})" if len(images) > 1 else images[0]
            lines.append(("symmetry", f"{names} -> {image} permutes the special members"))
        lines.append(("searched", self.coverage))
        if any(self.unassigned):
            counts = zip(self.unassigned, self.sweeps, strict=True)
            listed = _listed([f"{n} modulo {one.prime}" for n, one in counts if n or len(self.unassigned) <= _LISTED])
            most = 0  # the dimension of a variety with so many members
            for n, one in zip(self.unassigned, self.sweeps, strict=True):
                dimension = len(self.over) - 1
                while dimension > most and n < 0.5 * one.seen / one.prime ** (len(self.over) - dimension):
                    dimension -= 1
                most = dimension
            what = "a curve" if most == 1 else f"a variety of dimension {most}"
            missed = f"; as many as {what} has, so one may have been missed" if most else ""
            lines.append(("unassigned", f"special members on no component: {listed}{missed}"))
        elif not self.omitted:
            lines.append(("unassigned", "none: every special member that was seen is on a component"))
        return "\n".join(f"{word}\t{rest}" for word, rest in [*lines, *self._open])

    @property
    def _open(self) -> list[tuple[str, str]]:
        why = "the scan was interrupted" if self.ended == "interrupted" else SPENT
        return [("not done", f"{', '.join(self.omitted)}: {why}")] if self.omitted else []

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "over", "seed", "generic"),
            "classes": [
                {"degrees": list(degrees), "components": [one.to_json() for one in some]}
                for degrees, some in self.classes
            ],
            "symmetric": [list(images) for images in self.symmetric],
            "sweeps": [
                {
                    **attributes(one, "prime", "seen", "complete", "width", "accidents"),
                    "special": sum(map(len, one.classes.values())),
                    "unassigned": unassigned,
                }
                for one, unassigned in zip(self.sweeps, self.unassigned, strict=True)
            ],
            **attributes(self, "height", "coverage", "ended", "omitted"),
        }

    def member(self, component: Component) -> SystemFile:
        """The system of a rational member on a component. Raises InputError where none is known."""
        if component.values is None:
            raise InputError(f"no rational member is known where {component.text}")
        return member_of(self.file, {name: x for name, x in component.values.items() if name != "eps"})
