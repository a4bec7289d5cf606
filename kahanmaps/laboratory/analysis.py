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

from kahanmaps.algebra.plain import attributes
from kahanmaps.algebra.text import format_polynomial
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
from kahanmaps.laboratory.preserve.hamiltonian_structure import MAX_DIMENSION as MAX_HAMILTONIAN_DIMENSION
from kahanmaps.laboratory.preserve.hamiltonian_structure import constant_structures
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.limits import flow_and_map
from kahanmaps.laboratory.preserve.pencil import pencil_of
from kahanmaps.laboratory.preserve.poisson_tensors import find_poisson
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
    laboratory = Laboratory(file, symbols, eps, seed, algebraic=True)  # refuses what is wrong before any work is done
    map_, dim = file.map, file.dim
    system = file.system if file.is_quadratic else None
    # Without its claims, so that none can be read; with symbols the file itself is needed, and its claims are not read.
    bare = file if symbols or system is None else SystemFile.from_system(system, file.name)
    total = seconds if seconds is not None else _SECONDS.get(dim, _MOST_SECONDS)
    found = Analysis(file, laboratory.eps, total, seed, laboratory.free_symbols)
    began = time.monotonic()

    def left() -> float:
        return total - (time.monotonic() - began)

    def share(part: float) -> float:
        return max(0.5, min(part * total, left()))

    def told(what: str) -> Callable[[str], None]:
        return lambda text: progress(f"{what}: {text}")

    def integrals() -> None:
        found.integrals = find_integrals(
            bare, symbols=symbols, eps=found.eps, seconds=share(0.45), seed=seed, progress=told("integrals")
        )
        proved = [one for one in found.integrals.integrals if one.verdict is Verdict.PROVED]
        if dim == 2 and len(proved) == 1 and not laboratory.symbols:
            found.pencil = pencil_of(proved[0].name, proved[0].function, found.eps, seed=seed, seconds=share(0.1))
        profile = found.integrals.profile
        if profile.first_degree is not None and profile.period is None:
            maps = Laboratory(bare, (), found.eps, seed, algebraic=True).maps
            top = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
            for degree in range(profile.first_degree, min(top, profile.degree, 4) + 1):
                first = 1 + len({name for relation in found.relations for name in relation.names})
                found.relations += sparse_relations(maps, degree, map_.variables, first=first) or ()

    def vector_field() -> None:
        if system is not None:
            found.fixed_points = fixed_points(system, share(0.1))
            found.equivalent = equivalent_system(file, found.fixed_points, share(0.1))

    def hamiltonian() -> None:
        if system is not None and dim <= MAX_HAMILTONIAN_DIMENSION:
            found.hamiltonian = constant_structures(system, seed=seed)

    def family() -> None:
        hamiltonian = None if found.hamiltonian is None else found.hamiltonian.hamiltonian
        if hamiltonian is not None:
            found.centre = hamiltonian.centre
            moved = hamiltonian if found.centre is None else hamiltonian.about(found.centre)
            found.structure = structure_of(moved.system, moved)
        elif system is not None:
            found.centre = (fmpq(0),) * dim
            found.structure = structure_of(system)
        if system is not None and not isinstance(found.structure, Structure):  # of a member its normal form says more
            found.tensor = tensor_structure(system)

    def degrees() -> None:
        # Where they are known to the end and are those that `degrees` would ask for itself.
        known = patterns_of(found.singularities) if found.singularities and dim <= WRITTEN_DIMENSION else None
        patterns = None if known is None or known.running else known
        found.degrees = degree_growth(
            map_,
            found.eps,
            seconds=share(0.25),
            max_degree=_MAX_DEGREE,
            seed=seed,
            patterns=patterns,
            progress=told("degrees"),
        )

    def densities() -> None:
        found.densities = find_densities(
            bare,
            symbols=symbols,
            eps=found.eps,
            integrals=() if found.integrals is None else found.integrals.integrals,
            seconds=share(0.25),
            seed=seed,
            progress=told("densities"),
        )

    def flow() -> None:
        if found.integrals is not None:
            found.flow = flow_and_map(
                found.integrals,
                found.densities,
                known=found.integral_count,
                seconds=share(0.03),
                progress=told("integrals of the flow"),
            )

    def poisson() -> None:
        if dim in _TENSORS:
            known = found.integrals.integrals if found.integrals is not None else ()
            found.poisson = find_poisson(
                bare,
                _TENSORS[dim],
                symbols=symbols,
                eps=found.eps,
                integrals=known,
                seconds=share(0.1),
                seed=seed,
                progress=told("Poisson tensors"),
            )

    def heights() -> None:
        found.heights = height_survey(
            map_, found.eps, starts=2, max_digits=5_000, seconds=share(0.08), seed=seed, progress=told("heights")
        )

    def symmetries() -> None:
        if system is not None:
            found.symmetries = linear_symmetries(system, seconds=share(0.1), progress=told("symmetries"))

    def commuting() -> None:
        if (system is not None or laboratory.root is not None) and found.eps is None:
            seconds = share(0.1)
            found.commuting = find_commuting(system or map_, seed=seed, seconds=seconds, progress=told("commuting"))

    def confinement() -> None:
        values = default_eps(map_, seed) if found.eps is None else (found.eps,)
        part = share(0.4 if dim <= WRITTEN_DIMENSION else 0.1) / len(values)
        if all(can_be_written(map_, value, part) for value in values):
            found.singularities = [
                singularities(map_, value, seed=seed, seconds=part, progress=told("singularities")) for value in values
            ]

    parts: list[tuple[str, Callable[[], None]]] = [
        ("hamiltonian structure", hamiltonian),
        ("the commuting family", family),
        ("the vector field", vector_field),
        ("degrees", degrees),
        ("integrals", integrals),
        ("densities", densities),
        ("the flow", flow),
        ("Poisson tensors", poisson),
        ("heights", heights),
        ("symmetries", symmetries),
        ("commuting systems", commuting),
    ]
    # Where degrees make use of them singularities come first; in more dimensions they are slow, and come last.
    parts.insert(3 if dim <= WRITTEN_DIMENSION else len(parts), ("singularities", confinement))
    if laboratory.root is not None:
        parts = [part for part in parts if part[0] in _OVER_NUMBER_FIELDS]
    found.pending = [name for name, _ in parts]
    reached(found)
    for name, part in parts:
        if left() <= 0:
            found.skipped.append(f"{name}: the time was over")
        else:
            progress(name)
            try:
                part()
            except KahanmapsError as error:
                found.skipped.append(f"{name}: {error}")
        found.pending.remove(name)
        reached(found)
    if laboratory.root is not None:
        found.skipped.append(
            f"over the number field {laboratory.root.number_field}: fixed points, invariant curves, integrals in "
            "iterates, the flow, Poisson tensors, singularities, symmetries, Hamiltonian structure, the family"
        )
    elif system is None:
        found.skipped.append(
            "fixed points, Hamiltonian structure, the commuting family, symmetries, commuting systems: for fields only"
        )
    found.elapsed = time.monotonic() - began
    return found
