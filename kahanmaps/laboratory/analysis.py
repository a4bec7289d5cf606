"""Everything about one map as one report: what is preserved, how it grows, what it belongs to, and a verdict.

The analysis is given the map only; what a file claims of its system is not read. Every statement carries
how it is known: proved or supported (formulas, as identities in x and eps), or measured (modulo primes, or on orbits).
The number of integrals and the growth are two separate findings: a map may have many integrals and grow exponentially.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

from flint import fmpq

from kahanmaps.algebra.written.plain import attributes
from kahanmaps.algebra.written.text import format_polynomial
from kahanmaps.checks.claims import Verdict
from kahanmaps.displayed import Printed
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.family.structure import Structure, structure_of
from kahanmaps.family.tensor import tensor_structure
from kahanmaps.laboratory.conclusion import Conclusion, conclude
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, find_integrals
from kahanmaps.laboratory.preserve.limit.limits import flow_and_map
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import MAX_DIMENSION as MAX_HAMILTONIAN_DIMENSION
from kahanmaps.laboratory.preserve.poisson.hamiltonian_structure import constant_structures
from kahanmaps.laboratory.preserve.poisson.pencil import pencil_of
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.preserve.sparse_relations import sparse_relations
from kahanmaps.laboratory.report import Statement, sections
from kahanmaps.laboratory.singular.singularities import (
    WRITTEN_DIMENSION,
    can_be_written,
    default_eps,
    patterns_of,
    singularities,
)
from kahanmaps.laboratory.symmetry.commuting_over import find_commuting
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries
from kahanmaps.laboratory.vector_field.equivalence import equivalent_system
from kahanmaps.laboratory.vector_field.fixed_points import fixed_points

# Seconds for everything, by dimension; about half of it is used where nothing is hard.
_SECONDS = {1: 16.0, 2: 16.0, 3: 30.0, 4: 60.0, 5: 110.0}
_MOST_SECONDS = 150.0
_MAX_DEGREE = 200_000
_OVER_NUMBER_FIELDS = ("degrees", "integrals", "densities", "heights", "commuting systems")
_TENSORS = {3: 3, 4: 2}  # degrees of Poisson tensors by dimension; in the plane they are densities


class Analysis(Findings, Printed):
    """What `analyze` found, and statements about it."""

    @property
    def conclusion(self) -> Conclusion:
        """The verdict; integrability and the number of integrals are told apart."""
        return conclude(self)

    @property
    def sections(self) -> list[tuple[str, list[Statement]]]:
        """The report: titles and their statements."""
        return sections(self)

    def rows(self) -> list[dict[str, str]]:
        """A row for each statement, for `pandas.DataFrame(found.rows())` and the like."""
        told = ((name, line) for name, lines in self.sections for line in lines)
        return [{"section": name, "status": line.status, "text": line.text} for name, line in told]

    @property
    def final_sections(self) -> list[tuple[str, list[Statement]]]:
        """The first of them, up to the one that is not complete yet."""
        return sections(self, until_pending=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data: the verdict, the statements, and all results."""
        from kahanmaps.checks.settings import eps_record
        from kahanmaps.version import __version__

        final = self.conclusion
        runs = [attributes(run, "eps", "verdict", "followed", "text") for run in self.singularities]
        return {
            "command": "analyze",
            "version": __version__,
            "system": self.file.name,
            **attributes(self.file, "parameters"),
            **attributes(self, "symbols"),
            **eps_record(self.eps, self.file.map),
            "arithmetic": "exact formulas, from residues modulo primes",
            **attributes(self, "seed", "seconds", "dim"),
            "verdict": {
                "integrability": final.kind,
                "integrals": final.integrals if self.integrals_were_counted else None,
                "integrals_exact": self.count_is_exact,
                "growth": final.growth,
                **attributes(final, "sense", "ground", "sentence"),
            },
            "statements": [
                {"section": title, **attributes(line, "status", "text")}
                for title, lines in self.sections
                for line in lines
            ],
            "divergence": format_polynomial(self.file.system.divergence) if self.file.is_quadratic else None,
            **attributes(self, "fixed_points", "equivalent", "integrals"),
            "invariant_curves": self._invariant_curves(),
            "hirota_kimura": [relation.text for relation in self.relations],
            **attributes(self, "densities", "flow", "poisson", "degrees", "heights"),
            "singularities": runs,
            **attributes(self, "symmetries", "commuting"),
            "family": (self.structure.text or None) if self.structure is not None else None,
            "member": self._member(),
            "algebra": None if self.tensor is None else attributes(self.tensor, "text", "C", "rank", chi="chi_text"),
            "skipped": self.skipped,
            "document": dict(self.file.document),
        }

    def _invariant_curves(self) -> dict[str, Any] | None:
        """The curves of a planar integral, and what the map is on them; None where the degrees contradict them."""
        growth = self.degrees.growth if self.degrees is not None else GrowthClass.UNKNOWN
        if self.pencil is None or self.pencil.against(growth):
            return None
        return {**self.pencil.to_json(), "motion": self.pencil.motion(growth)}

    def _member(self) -> dict[str, Any] | None:
        """What a member of the family is one by, and what follows: x = centre + T y, J = T [[0, I], [-I, 0]] T^T."""
        if not isinstance(self.structure, Structure):
            return None
        form = self.structure.form
        known = {"chi": form.chi_text, "integrals_in_involution": form.m, "associated_maps": 2 ** (form.m - 1)}
        return {**known, **attributes(self.structure, "A", "T"), **attributes(self, "centre")}


def analyze(
    file: SystemFile,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    seconds: float | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    reached: Callable[[Analysis], None] = lambda _: None,
) -> Analysis:
    """What a map preserves and how it grows, within a time budget.

    Args:
        file: the map, of a differential equation its Kahan map; its claims and facts are not looked at. With an
            algebraic parameter what is not done over a number field is named in `skipped`.
        symbols: names of parameters that integrals and densities are to contain; all else is for the given values.
        eps: an exact number, to analyse the map at that eps only (time step 2 eps); None for every eps.
        seconds: time for everything, about; by default 16 for planar systems, up to 150 from dimension 6 on.
        seed: of everything random.
        progress: is told what is being done.
        reached: gets what is known, at the beginning and after each part.

    Returns:
        An `Analysis`. Parts that there was no time for are named in `skipped`.

    Raises:
        InputError: for eps = 0, unknown symbols, and a time that is not positive.

    >>> from kahanmaps.documents.catalog import load
    >>> found = analyze(load("nahm_tetrahedral"))
    >>> found.conclusion.kind, found.conclusion.integrals, found.conclusion.growth
    ('integrable', 1, 'quadratic')
    """
    if seconds is not None and not (seconds > 0 and math.isfinite(seconds)):
        raise InputError(f"found {seconds} seconds, expected a positive number")
    run = _Run(file, symbols, eps, seconds, seed, progress)
    found, parts = run.found, run.parts
    found.pending = list(parts)
    reached(found)
    for name, part in parts.items():
        if run.left <= 0:
            found.skipped.append(f"{name}: the time was over")
        else:
            progress(name)
            try:
                part()
            except KahanmapsError as error:
                found.skipped.append(f"{name}: {error}")
        found.pending.remove(name)
        reached(found)
    if run.root is not None:
        found.skipped.append(
            f"over the number field {run.root.number_field}: fixed points, invariant curves, integrals in "
            "iterates, the flow, Poisson tensors, singularities, symmetries, Hamiltonian structure, the family"
        )
    elif run.system is None:
        found.skipped.append(
            "fixed points, Hamiltonian structure, the commuting family, symmetries, commuting systems: for fields only"
        )
    found.elapsed = run.total - run.left
    return found


class _Run:
    """The analyses of one map, each with a share of the time; what they tell is in `found`."""

    def __init__(
        self,
        file: SystemFile,
        symbols: Sequence[str],
        eps: Any,
        seconds: float | None,
        seed: int,
        progress: Callable[[str], None],
    ) -> None:
        laboratory = Laboratory(file, symbols, eps, seed, algebraic=True)  # refuses what is wrong before any work
        self.map, self.dim, self.root, self.seed = file.map, file.dim, laboratory.root, seed
        self.system = file.system if file.is_quadratic else None
        # Without its claims, so that none can be read; with symbols the file itself is needed, and its claims are not
        # read.
        self.bare = file if symbols or self.system is None else SystemFile.from_system(self.system, file.name)
        self.total = seconds if seconds is not None else _SECONDS.get(self.dim, _MOST_SECONDS)
        self.found = Analysis(file, laboratory.eps, self.total, seed, laboratory.free_symbols)
        self.asked: dict[str, Any] = {"symbols": symbols, "eps": laboratory.eps, "seed": seed}
        self._has_symbols, self._progress, self._began = bool(laboratory.symbols), progress, time.monotonic()

    @property
    def parts(self) -> dict[str, Callable[[], None]]:
        """The analyses by their names, in their order: each may use what those before it have found."""
        every: dict[str, Callable[[], None]] = {
            "hamiltonian structure": self._hamiltonian,
            "the commuting family": self._family,
            "the vector field": self._vector_field,
            "singularities": self._singularities,
            "degrees": self._degrees,
            "integrals": self._integrals,
            "densities": self._densities,
            "the flow": self._flow,
            "Poisson tensors": self._poisson,
            "heights": self._heights,
            "symmetries": self._symmetries,
            "commuting systems": self._commuting,
        }
        # Degrees make use of singularities; but in more dimensions these are slow, and come last.
        if self.dim > WRITTEN_DIMENSION:
            every["singularities"] = every.pop("singularities")
        return {name: part for name, part in every.items() if self.root is None or name in _OVER_NUMBER_FIELDS}

    @property
    def left(self) -> float:
        """The seconds that are left."""
        return self.total - (time.monotonic() - self._began)

    def _share(self, part: float, what: str = "") -> dict[str, Any]:
        """The seconds for a part of what is to be done and, where it has something to tell, whom."""
        seconds = {"seconds": max(0.5, min(part * self.total, self.left))}
        return {**seconds, "progress": lambda text: self._progress(f"{what}: {text}")} if what else seconds

    def _hamiltonian(self) -> None:
        if self.system is not None and self.dim <= MAX_HAMILTONIAN_DIMENSION:
            self.found.hamiltonian = constant_structures(self.system, seed=self.seed)

    def _family(self) -> None:
        found, system = self.found, self.system
        hamiltonian = None if found.hamiltonian is None else found.hamiltonian.hamiltonian
        if hamiltonian is not None:
            found.centre = hamiltonian.centre
            moved = hamiltonian if found.centre is None else hamiltonian.about(found.centre)
            found.structure = structure_of(moved.system, moved)
        elif system is not None:
            found.centre = (fmpq(0),) * self.dim
            found.structure = structure_of(system)
        if system is not None and not isinstance(found.structure, Structure):  # of a member its normal form says more
            found.tensor = tensor_structure(system)

    def _vector_field(self) -> None:
        found = self.found
        if self.system is not None:
            found.fixed_points = fixed_points(self.system, **self._share(0.1))
            found.equivalent = equivalent_system(found.file, found.fixed_points, **self._share(0.1))

    def _singularities(self) -> None:
        values = default_eps(self.map, self.seed) if self.found.eps is None else (self.found.eps,)
        share = self._share(0.4 if self.dim <= WRITTEN_DIMENSION else 0.1, "singularities")
        share["seconds"] /= len(values)
        if all(can_be_written(self.map, value, share["seconds"]) for value in values):
            self.found.singularities = [singularities(self.map, value, seed=self.seed, **share) for value in values]

    def _degrees(self) -> None:
        found = self.found
        # Where they are known to the end and are those that `degrees` would ask for itself.
        known = patterns_of(found.singularities) if found.singularities and self.dim <= WRITTEN_DIMENSION else None
        given: dict[str, Any] = {"patterns": None if known is None or known.running else known, "seed": self.seed}
        share = self._share(0.25, "degrees")
        found.degrees = degree_growth(self.map, found.eps, max_degree=_MAX_DEGREE, **given, **share)

    def _integrals(self) -> None:
        found = self.found
        search = found.integrals = find_integrals(self.bare, **self.asked, **self._share(0.45, "integrals"))
        proved = [one for one in search.integrals if one.verdict is Verdict.PROVED]
        if self.dim == 2 and len(proved) == 1 and not self._has_symbols:
            share = self._share(0.1)
            found.pencil = pencil_of(proved[0].name, proved[0].function, found.eps, seed=self.seed, **share)
        profile = search.profile
        if profile.first_degree is not None and profile.period is None:
            maps = Laboratory(self.bare, (), found.eps, self.seed, algebraic=True).maps
            top = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
            for degree in range(profile.first_degree, min(top, profile.degree, 4) + 1):
                first = 1 + len({name for relation in found.relations for name in relation.names})
                found.relations += sparse_relations(maps, degree, self.map.variables, first=first) or ()

    @property
    def _known(self) -> tuple[FoundIntegral, ...]:
        """The integrals that were found in closed form."""
        return () if self.found.integrals is None else self.found.integrals.integrals

    def _densities(self) -> None:
        share = self._share(0.25, "densities")
        self.found.densities = find_densities(self.bare, **self.asked, integrals=self._known, **share)

    def _flow(self) -> None:
        found = self.found
        if found.integrals is not None:
            share = self._share(0.03, "integrals of the flow")
            found.flow = flow_and_map(found.integrals, found.densities, known=found.integral_count, **share)

    def _poisson(self) -> None:
        if self.dim in _TENSORS:
            given = {**self.asked, **self._share(0.1, "Poisson tensors")}
            self.found.poisson = find_poisson(self.bare, _TENSORS[self.dim], integrals=self._known, **given)

    def _heights(self) -> None:
        given = {"starts": 2, "max_digits": 5_000, "seed": self.seed, **self._share(0.08, "heights")}
        self.found.heights = height_survey(self.map, self.found.eps, **given)

    def _symmetries(self) -> None:
        if self.system is not None:
            self.found.symmetries = linear_symmetries(self.system, **self._share(0.1, "symmetries"))

    def _commuting(self) -> None:
        if (self.system is not None or self.root is not None) and self.found.eps is None:
            share = self._share(0.1, "commuting")
            self.found.commuting = find_commuting(self.system or self.map, seed=self.seed, **share)
