"""Everything about one Kahan map as one report: what is preserved, how it grows, what it belongs to, and a verdict.

The analysis is given the right-hand sides only; what a file claims of its system is not read. Every statement carries
how it is known: proved or supported (formulas, as identities in x and eps), or measured (modulo primes, or on orbits).
The number of integrals and the growth are two separate findings: a map may have many integrals and grow exponentially.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from flint import fmpq

from kahanmaps.algebra.text import format_number, format_polynomial
from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.family.structure import NoStructure, Structure, structure_of
from kahanmaps.laboratory.affine_functions import affine_darboux
from kahanmaps.laboratory.commuting import CommutingField, CommutingSystems, commuting_systems
from kahanmaps.laboratory.degrees import DegreeGrowth, degree_growth
from kahanmaps.laboratory.densities import DensitySearch, find_densities
from kahanmaps.laboratory.hamiltonian_structure import MAX_DIMENSION as MAX_HAMILTONIAN_DIMENSION
from kahanmaps.laboratory.hamiltonian_structure import ConstantStructures, constant_structures
from kahanmaps.laboratory.height_survey import HeightSurvey, height_survey
from kahanmaps.laboratory.integrals import IntegralSearch, find_integrals
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.recurrences import GrowthClass
from kahanmaps.laboratory.singularities import MAX_DIMENSION as MAX_SINGULAR_DIMENSION
from kahanmaps.laboratory.singularities import SingularityRun, default_eps, singularities
from kahanmaps.laboratory.sparse_relations import SparseRelation, sparse_relations
from kahanmaps.laboratory.symmetries import Symmetries, linear_symmetries
from kahanmaps.maps.orbits import counted
from kahanmaps.systems.files import SystemFile

PROVED, SUPPORTED, MEASURED, UNDECIDED, NOTE = "proved", "supported", "measured", "undecided", "note"

# Seconds for everything, by dimension; about half of it is used where nothing is hard.
_SECONDS = {1: 16.0, 2: 16.0, 3: 30.0, 4: 60.0, 5: 110.0}
_MOST_SECONDS = 150.0
_MAX_DEGREE = 200_000
_SHOWN_DEGREES = 12


@dataclass(frozen=True)
class Statement:
    """One line of the report and how it is known: proved, supported, measured, undecided; or a note."""

    status: str
    text: str


@dataclass(frozen=True)
class Conclusion:
    """The verdict in words; `kind` is "linear", "linearisable", "integrable", "not integrable", "singular" (nowhere
    defined) or "undecided".

    `integrals` is the number of independent integrals known or shown by orbits, `growth` the kind of degree growth.
    """

    kind: str
    integrals: int
    growth: str
    sentence: str


@dataclass
class Analysis:
    """What `analyze` found: the results of the parts, None for those not reached, and statements about them."""

    file: SystemFile
    eps: fmpq | None
    seconds: float
    seed: int
    symbols: tuple[str, ...] = ()
    integrals: IntegralSearch | None = None
    relations: tuple[SparseRelation, ...] = ()
    densities: DensitySearch | None = None
    degrees: DegreeGrowth | None = None
    heights: HeightSurvey | None = None
    singularities: list[SingularityRun] = field(default_factory=list)
    symmetries: Symmetries | None = None
    commuting: CommutingSystems | None = None
    structure: Structure | NoStructure | None = None
    hamiltonian: ConstantStructures | None = None
    skipped: list[str] = field(default_factory=list)
    elapsed: float = 0.0

    @property
    def dim(self) -> int:
        """The dimension of the system."""
        return self.file.system.dim

    @property
    def integral_count(self) -> int:
        """The number of independent integrals: found, shown by orbits, or given by the commuting family."""
        measured = self.integrals.codimension if self.integrals is not None else 0
        family = self.structure.form.m if isinstance(self.structure, Structure) else 0
        return max(measured, family)

    @property
    def integrals_were_counted(self) -> bool:
        """Whether `integral_count` says anything: it is 0 as well where the orbits were not reached or not defined."""
        measured = self.integrals is not None and bool(self.integrals.profile.nullities or self.integrals.integrals)
        return measured or isinstance(self.structure, Structure)

    @property
    def conclusion(self) -> Conclusion:
        """The verdict; integrability and the number of integrals are told apart."""
        return _conclude(self)

    @property
    def sections(self) -> list[tuple[str, list[Statement]]]:
        """The report: titles and their statements."""
        return [(title, lines) for title, lines in _sections(self) if lines]

    def to_json(self) -> dict[str, Any]:
        """Plain data: the verdict, the statements, and all results."""
        from kahanmaps.checks.settings import CONVENTION
        from kahanmaps.version import __version__

        final = self.conclusion

        def part(result: Any) -> Any:
            return None if result is None else result.to_json()

        return {
            "command": "analyze",
            "version": __version__,
            "system": self.file.name,
            "parameters": {name: format_number(value) for name, value in self.file.parameters.items()},
            "symbols": list(self.symbols),
            "eps": "every" if self.eps is None else format_number(self.eps),
            "time_step": "every" if self.eps is None else format_number(2 * self.eps),
            "convention": CONVENTION,
            "seed": self.seed,
            "seconds": self.seconds,
            "dim": self.dim,
            "verdict": {
                "integrability": final.kind,
                "integrals": final.integrals if self.integrals_were_counted else None,
                "growth": final.growth,
                "sentence": final.sentence,
            },
            "statements": [
                {"section": title, "status": line.status, "text": line.text}
                for title, lines in self.sections
                for line in lines
            ],
            "integrals": part(self.integrals),
            "hirota_kimura": [relation.text for relation in self.relations],
            "densities": part(self.densities),
            "degrees": part(self.degrees),
            "heights": part(self.heights),
            "singularities": [{"eps": format_number(run.eps), "verdict": run.verdict} for run in self.singularities],
            "symmetries": part(self.symmetries),
            "commuting": part(self.commuting),
            "family": self.structure.text if isinstance(self.structure, Structure) else None,
            "skipped": self.skipped,
            "document": dict(self.file.document),
        }


def analyze(
    file: SystemFile,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    seconds: float | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> Analysis:
    """What the Kahan map of a system preserves and how it grows, within a time budget.

    Args:
        file: the system; its claims and facts are not looked at.
        symbols: names of parameters that formulas are to contain; all else is for the values of the file.
        eps: an exact number, to analyse the map at that eps only (time step 2 eps); None for every eps.
        seconds: time for everything, about; by default 16 for planar systems, up to 150 from dimension 6 on.
        seed: of everything random.
        progress: is told what is being done.

    Returns:
        An `Analysis`. Parts that there was no time for are named in `skipped`.

    Raises:
        InputError: for eps = 0, unknown symbols, and a time that is not positive.

    >>> from kahanmaps.systems.catalog import load
    >>> found = analyze(load("nahm_tetrahedral"))
    >>> found.conclusion.kind, found.conclusion.integrals, found.conclusion.growth
    ('integrable', 1, 'quadratic')
    """
    if seconds is not None and not (seconds > 0 and math.isfinite(seconds)):
        raise InputError(f"found {seconds} seconds, expected a positive number")
    laboratory = Laboratory(file, symbols, eps, seed)  # refuses what is wrong before any work is done
    # Without its claims, so that none can be read; with symbols the file itself is needed, and its claims are not read.
    bare = file if symbols else SystemFile.from_system(file.system, file.name)
    total = seconds if seconds is not None else _SECONDS.get(file.system.dim, _MOST_SECONDS)
    found = Analysis(file, laboratory.eps, total, seed, laboratory.symbols)
    began = time.monotonic()
    system = bare.system

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
        profile = found.integrals.profile
        if profile.first_degree is not None and profile.period is None:
            maps = Laboratory(bare, (), found.eps, seed).maps
            top = profile.degree if profile.dim - profile.codimension <= 1 else profile.first_degree + 1
            for degree in range(profile.first_degree, min(top, profile.degree, 4) + 1):
                first = 1 + len({name for relation in found.relations for name in relation.names})
                found.relations += sparse_relations(maps, degree, system.variables, first=first) or ()

    def hamiltonian() -> None:
        if system.dim <= MAX_HAMILTONIAN_DIMENSION:
            found.hamiltonian = constant_structures(system, seed=seed)

    def family() -> None:
        found.structure = structure_of(system)

    def degrees() -> None:
        found.degrees = degree_growth(
            system,
            found.eps,
            seconds=share(0.25),
            max_degree=_MAX_DEGREE,
            seed=seed,
            progress=told("degrees"),
        )

    def densities() -> None:
        found.densities = find_densities(
            bare, symbols=symbols, eps=found.eps, seconds=share(0.25), seed=seed, progress=told("densities")
        )

    def heights() -> None:
        found.heights = height_survey(
            system, found.eps, starts=2, max_digits=5_000, seconds=share(0.08), seed=seed, progress=told("heights")
        )

    def symmetries() -> None:
        found.symmetries = linear_symmetries(system, seconds=share(0.1), progress=told("symmetries"))

    def commuting() -> None:
        if found.eps is None:
            found.commuting = commuting_systems(system, seed=seed, seconds=share(0.1), progress=told("commuting"))

    def confinement() -> None:
        if system.dim <= MAX_SINGULAR_DIMENSION:
            values = default_eps(seed) if found.eps is None else (found.eps,)
            part = share(0.1)
            found.singularities = [
                singularities(system, value, seed=seed, seconds=part / len(values), progress=told("singularities"))
                for value in values
            ]

    parts: list[tuple[str, Callable[[], None]]] = [
        ("hamiltonian structure", hamiltonian),
        ("the commuting family", family),
        ("degrees", degrees),
        ("integrals", integrals),
        ("densities", densities),
        ("symmetries", symmetries),
        ("commuting systems", commuting),
        ("heights", heights),
        ("singularities", confinement),
    ]
    for name, part in parts:
        if left() <= 0:
            found.skipped.append(f"{name}: the time was over")
            continue
        progress(name)
        try:
            part()
        except KahanmapsError as error:
            found.skipped.append(f"{name}: {error}")
    found.elapsed = time.monotonic() - began
    return found


# -- the verdict ----------------------------------------------------------------------------------------------------


def _conclude(found: Analysis) -> Conclusion:
    n, count = found.dim, found.integral_count
    growth = found.degrees.growth if found.degrees is not None else GrowthClass.UNKNOWN
    phrase = found.degrees.growth_text if found.degrees is not None else "degrees not measured"
    if found.integrals_were_counted:
        integrals = "no integral" if count == 0 else counted(count, "independent integral")
        integrals += f" in dimension {n}"
    else:
        integrals = "the integrals were not counted"
    period = found.integrals.profile.period if found.integrals is not None else None
    suffix = "" if found.eps is None else f" All this at eps = {found.eps} only: other eps may differ."
    if found.symbols:
        suffix += f" The integrals are for every {', '.join(found.symbols)}, all else for the values of the file."

    def conclude(kind: str, sentence: str) -> Conclusion:
        return Conclusion(kind, count, str(growth), sentence + suffix)

    if found.degrees is not None and found.degrees.ended == "singular" and len(found.degrees.degrees) == 1:
        return conclude("singular", f"The map is nowhere defined: {found.degrees.message}.")
    if _is_affine(found):
        closes = "" if period is None else f"; orbits close after {counted(period, 'step')} (measured)"
        return conclude("linear", f"The system is linear, and so is its Kahan map; {integrals}{closes}.")
    if period is not None:
        closes = f"Orbits close after {counted(period, 'step')} (measured)"
        return conclude("linearisable", f"{closes}: the map is periodic there; {phrase}.")
    if growth is GrowthClass.ZERO:
        return conclude("linearisable", "An iterate of the map is a constant map (measured): orbits end in one point.")
    if growth is GrowthClass.BOUNDED:
        return conclude(
            "linearisable",
            f"The degrees of the iterates are bounded (measured): the map is linearisable in the sense of "
            f"complexity; {integrals}.",
        )
    if growth is GrowthClass.EXPONENTIAL or (found.degrees is not None and found.degrees.looks_exponential):
        measured = " (measured)" if growth is GrowthClass.EXPONENTIAL else ""  # the phrase says that it is estimated
        growth = GrowthClass.EXPONENTIAL
        return conclude(
            "not integrable",
            f"Not integrable in the sense of complexity: {phrase}{measured}"
            + (f", although there {'is' if count == 1 else 'are'} {integrals}." if count else f"; {integrals}."),
        )
    if growth in (GrowthClass.LINEAR, GrowthClass.QUADRATIC, GrowthClass.POLYNOMIAL):
        return conclude("integrable", f"Integrable in the sense of complexity: {phrase} (measured); {integrals}.")
    return conclude("undecided", f"The growth is undecided: {phrase}; {integrals}.")


def _is_affine(found: Analysis) -> bool:
    return all(int(p.total_degree()) <= 1 for p in found.file.system.rhs)


# -- the statements -------------------------------------------------------------------------------------------------


def _sections(found: Analysis) -> list[tuple[str, list[Statement]]]:
    return [
        ("integrals", _integral_lines(found)),
        ("measure", _measure_lines(found)),
        ("growth", _growth_lines(found)),
        ("singularities", _singularity_lines(found)),
        ("symmetry", _symmetry_lines(found)),
        ("structure", _structure_lines(found)),
        ("commuting systems", _commuting_lines(found)),
        ("not done", [Statement(NOTE, text) for text in found.skipped]),
    ]


def _integral_lines(found: Analysis) -> list[Statement]:
    search = found.integrals
    if search is None:
        return []
    lines = [Statement(str(one.verdict), f"{one.name} = {one.text}  [{one.origin}]") for one in search.integrals]
    profile = search.profile
    if not profile.nullities:
        lines.append(Statement(UNDECIDED, f"how many integrals there are was not measured: {search.reason}"))
    elif profile.period is not None:
        lines.append(Statement(MEASURED, f"all orbits tried close after {counted(profile.period, 'step')}"))
    else:
        nullities = ", ".join(map(str, profile.nullities))
        lines.append(
            Statement(
                MEASURED,
                f"orbits have codimension {profile.codimension}: so many independent integrals; polynomials of degree "
                f"at most 1, 2, ... that vanish along an orbit: {nullities} dimensions",
            )
        )
        if not profile.agree:
            lines.append(Statement(NOTE, "the orbits that were compared do not agree"))
    lines += [Statement(MEASURED, f"along orbits {relation.text}") for relation in found.relations]
    integrals = [name for relation in found.relations for name in relation.integrals]
    if integrals:
        letter = integrals[0].rstrip("0123456789")
        lines.append(Statement(NOTE, f"the {letter} are integrals: numbers that depend on the orbit only"))
    functions = [name for relation in found.relations for name in relation.functions_of_eps]
    if functions:
        lines.append(Statement(NOTE, f"the {functions[0].rstrip('0123456789')} are numbers that depend on eps only"))
    if search.reason and profile.nullities:
        lines.append(Statement(NOTE, search.reason))
    if isinstance(found.structure, Structure):
        m = found.structure.form.m
        lines.append(Statement(PROVED, f"{counted(m, 'independent integral')}, as a member of the commuting family"))
    return lines


def _measure_lines(found: Analysis) -> list[Statement]:
    search = found.densities
    if search is None:
        return []
    lines = [Statement(str(one.verdict), f"dx/phi is invariant, phi = {one.text}") for one in search.densities]
    if not search.densities:
        lines.append(Statement(MEASURED if "no polynomial" in search.reason else UNDECIDED, search.reason))
    return lines


def _growth_lines(found: Analysis) -> list[Statement]:
    lines = []
    if found.degrees is not None:
        shown = ", ".join(map(str, found.degrees.degrees[1 : _SHOWN_DEGREES + 1]))
        more = ", ..." if len(found.degrees.degrees) > _SHOWN_DEGREES + 1 else ""
        if shown:
            lines.append(Statement(MEASURED, f"degrees of the iterates: {shown}{more}"))
        unknown = found.degrees.growth is GrowthClass.UNKNOWN and not found.degrees.looks_exponential
        lines.append(Statement(UNDECIDED if unknown else MEASURED, found.degrees.growth_text))
        recurrence = found.degrees.recurrence
        if recurrence is not None:
            lines.append(Statement(MEASURED, f"recurrence: {recurrence.text}"))
            if recurrence.closed_form:
                lines.append(Statement(MEASURED, f"d_n = {recurrence.closed_form}"))
    if found.heights is not None:
        status = UNDECIDED if found.heights.text.startswith("undecided") else MEASURED
        lines.append(Statement(status, f"heights of exact orbits: {found.heights.text}"))
    return lines


def _singularity_lines(found: Analysis) -> list[Statement]:
    if not found.singularities:
        return []
    verdicts = {run.verdict for run in found.singularities}
    values = ", ".join(format_number(run.eps) for run in found.singularities)
    if len(verdicts) > 1:
        return [Statement(UNDECIDED, f"the eps {values} disagree: {', '.join(sorted(verdicts))}")]
    verdict = verdicts.pop()
    return [Statement(UNDECIDED if verdict == "undecided" else MEASURED, f"{verdict} (eps = {values})")]


def _symmetry_lines(found: Analysis) -> list[Statement]:
    search = found.symmetries
    if search is None:
        return []
    lines = []
    linear = len(search.infinitesimal)
    if linear:
        lines.append(Statement(PROVED, f"a Lie algebra of affine symmetries, of dimension {linear}"))
    if search.order is not None and search.order > 1:
        generators = "; ".join(one.text for one in search.generators)
        lines.append(Statement(PROVED, f"{search.order} signed permutations, generated by {generators}"))
    lines += [Statement(PROVED, one.text) for one in search.others]
    lines += [Statement(UNDECIDED, text) for text in search.undecided]
    return lines or [Statement(NOTE, "no affine symmetry of the kinds searched, apart from the identity")]


def _structure_lines(found: Analysis) -> list[Statement]:
    lines = []
    structures = found.hamiltonian
    if structures is not None and structures.hamiltonian is not None:
        H = format_polynomial(structures.hamiltonian.H)
        kind = "the standard J" if structures.hamiltonian.is_standard else "a constant skew J"
        lines.append(Statement(PROVED, f"Hamiltonian with {kind}, H = {H}"))
    elif structures is not None and structures.proved:
        lines.append(Statement(PROVED, f"not Hamiltonian with a constant J: {structures.reason}"))
    darboux = affine_darboux(found.file.system)
    if darboux.functions:
        planes = ", ".join(format_polynomial(one.function) for one in darboux.functions)
        lines.append(Statement(PROVED, f"invariant hyperplanes of flow and map: {planes} = 0"))
    if isinstance(found.structure, Structure):
        form = found.structure.form
        lines.append(Statement(PROVED, f"belongs to the commuting family: {found.structure.text}"))
        lines.append(
            Statement(
                PROVED,
                f"normal form: the planar map of h(X, Y) = {form.h_text} over Q[t]/({form.chi_text}), "
                "a block for each root t",
            )
        )
    return lines


def _commuting_lines(found: Analysis) -> list[Statement]:
    search = found.commuting
    if search is None:
        return []
    lines = []
    if search.every_g_commutes:
        lines.append(Statement(PROVED, "the map is the identity and commutes with every other"))
    told: list[CommutingField] = []
    for one in search.nontrivial:  # with g there is -g, whose map is the inverse
        if not any(one.system == other.system.scaled(-1) for other in told):
            told.append(one)
            text = f"commutes with the Kahan maps of g and -g, g = ({', '.join(one.rhs)})"
            lines.append(Statement(str(one.finding.verdict), text))
    for family in search.families:
        lines.append(
            Statement(
                str(family.finding.verdict), f"commutes with a linear family of {len(family.directions)} parameters"
            )
        )
    lines += [Statement(NOTE, text) for text in search.irrational]
    lines += [Statement(UNDECIDED, text) for text in search.undecided]
    if not lines:
        lines.append(Statement(PROVED, "no g = B f with a constant rational matrix B other than 0, f and -f commutes"))
    return lines
