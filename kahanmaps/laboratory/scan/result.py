"""The result of a scan: components of parameter space, and a description of what was searched."""

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

_MAX_LISTED = 12  # maximal number of listed primes
STEPS = 40  # the number of steps for which singularities of a member are traced to determine its growth


@dataclass(frozen=True)
class Component:
    """A component of parameter space, given by `equations` over Q, which occurs modulo `primes`.

    `degrees` are the degrees d_1, ..., d_N of the iterates of a member on the component; `confirmed` of `tried` random
    members have these degrees. `values` are the parameters of a rational member; None if none is known. `growth` is the
    growth of degrees, and `verdict` the verdict of an analysis of the rational member (None: unknown).
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
        """Whether random members were tried and all of them have these degrees."""
        return 0 < self.tried == self.confirmed

    @property
    def is_rational_point(self) -> bool:
        """Whether the component is a single member with rational parameters."""
        return self.dimension == 0 and self.values is not None

    @property
    def member_text(self) -> str:
        """The parameters of the rational member, in parentheses if there are several; empty if no member is known."""
        values = [format_number(value) for value in (self.values or {}).values()]
        return f"({', '.join(values)})" if len(values) > 1 else "".join(values)

    @property
    def text(self) -> str:
        """The condition on the parameters as text: the parameters of a point, or equations."""
        if self.is_rational_point:
            return self.member_text
        return ", ".join(f"{format_polynomial(equation)} = 0" for equation in self.equations)

    def contains(self, point: Sequence[fmpq]) -> bool:
        """Return whether a rational point of parameter space lies on the component."""
        return not any(evaluate(equation, QQ, point) for equation in self.equations)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; equations are text."""
        growth = self.growth
        return {
            **attributes(self, "equations", "dimension", "primes", "confirmed", "tried", "is_confirmed", "values"),
            "growth": None if growth is None else str(growth.growth),
            "growth_text": None if growth is None else growth.growth_text,
            "verdict": None if self.verdict is None else attributes(self.verdict, "kind", "ground", "sentence"),
        }


def growth_on(components: Sequence[Component]) -> DegreeGrowth | None:
    """Return the first known growth of degrees among components with the same first degrees."""
    return next((component.growth for component in components if component.growth is not None), None)


def _abbreviate(texts: Sequence[str]) -> str:
    """Join the texts; of more than 12 texts, only the first three and the last one."""
    return ", ".join(texts if len(texts) <= _MAX_LISTED else [*texts[:3], "...", f"{texts[-1]} ({len(texts)} of them)"])


@dataclass(frozen=True)
class Scan(PrintableResult):
    """The result of a scan: components of parameter space, in the order of increasing growth.

    `over` are the scanned parameters, `generic` the degrees d_1, ..., d_N of the iterates of a generic member, and
    `sweeps` the special members modulo each prime. `unassigned` has, for each sweep, the number of special members on
    no component: points over number fields or of a height above `height`, or special by chance. `symmetric` contains
    changes of parameters that permute the special members, each given by the images of the parameters. `ended` is
    "complete", "budget" or "interrupted"; `omitted` names what was not done.
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
        """Return a row for each component, for example for `pandas.DataFrame(scan.rows())`."""
        return [
            {"where": component.text, "degrees": ", ".join(map(str, degrees))}
            for degrees, components in self.classes
            for component in components
        ]

    @property
    def height(self) -> int:
        """The bound for numerators and denominators of conditions that can be detected; 0 with too few primes."""
        bounds = [height_bound([sweep.prime for sweep in sweeps]) for sweeps in self._grouped_sweeps if len(sweeps) > 2]
        return min(bounds, default=0)

    @property
    def _grouped_sweeps(self) -> tuple[list[Sweep], ...]:
        """The lists of sweeps over all members, over random lines of parameter space, and over random planes."""
        return (
            [sweep for sweep in self.sweeps if sweep.complete],
            *([sweep for sweep in self.sweeps if not sweep.complete and sweep.subspace_dimension == k] for k in (1, 2)),
        )

    @property
    def degree(self) -> int:
        """The maximal total degree of hypersurfaces with the same degrees of iterates that can be detected."""
        count = len(self.over)
        degrees = [
            degree_reached(0.75 * min(sweep.member_count / sweep.prime for sweep in sweeps), count)
            for sweeps in self._grouped_sweeps
            if len(sweeps) > 2
        ]
        return max(degrees, default=0)

    @property
    def classes(self) -> list[tuple[Degrees, list[Component]]]:
        """The components, grouped by their degrees: pairs (degrees, components), in the order of `components`."""
        groups: dict[Degrees, list[Component]] = {}
        for component in self.components:
            groups.setdefault(component.degrees, []).append(component)
        return list(groups.items())

    @property
    def coverage(self) -> str:
        """A text on the members that were measured, and on the components that these measurements can detect."""
        return "; ".join(text if label == "searched" else f"{label}: {text}" for label, text in self._coverage_lines)

    @property
    def _coverage_lines(self) -> list[tuple[str, str]]:
        if not self.height:
            primes_text = counted(len(self.sweeps), "prime")
            text = f"conditions need members modulo three primes, and those modulo {primes_text} were tried"
            return [("searched", text)]
        complete, lines, planes = (
            _abbreviate([str(sweep.prime) for sweep in sweeps]) for sweeps in self._grouped_sweeps
        )
        phrases = [f"all members with parameters modulo {complete}"] if complete else []
        for k, subspaces, primes in ((1, "lines", lines), (2, "planes", planes)):
            if primes:
                subspace_count = round(min(sweep.member_count / sweep.prime**k for sweep in self._grouped_sweeps[k]))
                noun = "those" if phrases else "members"
                phrases.append(f"{noun} on {subspace_count} random {subspaces} of parameter space modulo {primes}")
        small_components = (
            "single points" if len(self.over) == 1 else "single points, affine spaces, hypersurfaces of these"
        )
        loci = [small_components] if complete else []
        if len(self.over) > 1:
            loci.append(f"hypersurfaces of a total degree up to {self.degree} for each sequence of degrees")
        condition = f"where one of the first {len(self.generic)} degrees is smaller"
        if planes:
            loci.append("affine spaces of codimension 2, and hypersurfaces of affine spaces that have codimension 2")
        if not complete:
            loci.append("nothing of smaller dimension, which would need all members")
        number_field_phrases = []
        if complete:
            number_field_phrases.append(
                f"points over number fields of degree d up to {MAX_FIELD_DEGREE}, with coefficients up to H where "
                f"2^{SPARE_BITS // len(self.over)} (2 H + 1)^(d + 1) is below the product of the primes modulo which "
                "they have residues"
            )
        if len(self.over) > 1:
            number_field_phrases.append("hypersurfaces over a quadratic field that splits modulo three of the primes")
        statements = [
            ("searched", ", and ".join(phrases)),
            ("special", f"members {condition}"),
            ("detectable", f"over Q, numerators and denominators up to {self.height}: {', and '.join(loci)}"),
        ]
        return [*statements, *(("detectable", phrase) for phrase in number_field_phrases)]

    @property
    def text(self) -> str:
        """The lines of the report; each line has a label, a tab and a value."""
        if not self.height:
            lines = [  # no condition was lifted: report the numbers of special members
                ("special", f"{', '.join(map(str, degrees))}\t{len(points)} members modulo {sweep.prime}")
                for sweep in self.sweeps
                for degrees, points in sorted(sweep.classes.items())
            ]
            lines += [*self._coverage_lines, *self._omitted_lines]
            return "\n".join(f"{label}\t{value}" for label, value in lines)
        names_text = f"({', '.join(self.over)})" if len(self.over) > 1 else self.over[0]
        lines = [("generic", ", ".join(map(str, self.generic)))]
        for degrees, components in self.classes:
            growth = growth_on(components)
            degrees_text = ", ".join("none" if d < 0 else str(d) for d in degrees)
            certainty_text = "" if growth is None or growth.recurrence is None else f", {growth.known}"
            lines.append(
                ("degrees", degrees_text + (f"\t{growth.kind_text}{certainty_text}" if growth is not None else ""))
            )
            for label, separator, is_point in (("where", "; ", False), (f"at {names_text} =", ", ", True)):
                for suffix, is_confirmed in (("", True), ("\tnot confirmed", False)):
                    texts = [
                        component.text
                        for component in components
                        if (component.is_rational_point, component.is_confirmed) == (is_point, is_confirmed)
                    ]
                    if texts:
                        lines.append((label, separator.join(texts) + suffix))
            lines += [
                ("verdict", f"{names_text} = {component.member_text}: {component.verdict.sentence}")
                for component in components
                if component.verdict is not None
            ]
        if self.components:
            lines.append(("growth", f"that of one member; singularities were traced for {STEPS} steps"))
        else:
            condition = f"where one of the first {len(self.generic)} degrees is smaller"
            lines.append(("found", f"no condition on the parameters {condition}"))
        for images in self.symmetric:
            image_text = f"({', '.join(images)})" if len(images) > 1 else images[0]
            lines.append(("symmetry", f"{names_text} -> {image_text} permutes the special members"))
        lines += self._coverage_lines
        if any(self.unassigned):
            pairs = list(zip(self.unassigned, self.sweeps, strict=True))
            count_texts = [f"{n} modulo {sweep.prime}" for n, sweep in pairs if n or len(pairs) <= _MAX_LISTED]
            missed_dimension = 0  # the largest dimension of a variety that has about n points or fewer
            for n, sweep in pairs:
                codimension, dim = 1, len(self.over)
                while codimension < dim - missed_dimension and n < 0.5 * sweep.member_count / sweep.prime**codimension:
                    codimension += 1
                missed_dimension = dim - codimension
            variety_text = "a curve" if missed_dimension == 1 else f"a variety of dimension {missed_dimension}"
            warning = f"; as many as {variety_text} has, so one may have been missed" if missed_dimension else ""
            lines.append(("unassigned", f"special members on no component: {_abbreviate(count_texts)}{warning}"))
        elif not self.omitted:
            lines.append(("unassigned", "none: every special member that was seen is on a component"))
        return "\n".join(f"{label}\t{value}" for label, value in [*lines, *self._omitted_lines])

    @property
    def _omitted_lines(self) -> list[tuple[str, str]]:
        reason = "the scan was interrupted" if self.ended == "interrupted" else SPENT
        return [("not done", f"{', '.join(self.omitted)}: {reason}")] if self.omitted else []

    def to_json(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            **attributes(self, "over", "seed", "generic"),
            "classes": [
                {"degrees": list(degrees), "components": [component.to_json() for component in components]}
                for degrees, components in self.classes
            ],
            "symmetric": [list(images) for images in self.symmetric],
            "sweeps": [
                {
                    **attributes(sweep, "prime", measured="member_count", complete="complete"),
                    **attributes(sweep, width="subspace_dimension", false_alarms="false_alarms"),
                    "special": sum(map(len, sweep.classes.values())),
                    "unassigned": unassigned,
                }
                for sweep, unassigned in zip(self.sweeps, self.unassigned, strict=True)
            ],
            **attributes(self, "height", "coverage", "ended", "omitted"),
        }

    def member(self, component: Component) -> SystemFile:
        """Return the system of a rational member on a component. Raises InputError if no such member is known."""
        if component.values is None:
            raise InputError(f"no rational member is known where {component.text}")
        return member_of(self.file, {name: x for name, x in component.values.items() if name != "eps"})
