"""The words of a report: statements, each with how it is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import takewhile

from flint import fmpq_mat

from kahanmaps.algebra.written.text import format_number, format_polynomial
from kahanmaps.errors import counted
from kahanmaps.family.skew_hamiltonian import factors_of_chi
from kahanmaps.family.structure import Structure
from kahanmaps.invariants.heights import Growth
from kahanmaps.laboratory.consistency import doubt_of_heights
from kahanmaps.laboratory.findings import Findings
from kahanmaps.laboratory.growth.recurrences import GrowthClass
from kahanmaps.laboratory.known import Known
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux
from kahanmaps.laboratory.preserve.hirota_kimura import Profile
from kahanmaps.laboratory.singular.outcomes import Outcome
from kahanmaps.laboratory.symmetry.commuting import CommutingFamily, CommutingField
from kahanmaps.laboratory.symmetry.symmetries import SIGNED

PROVED, MEASURED = Known.PROVED, Known.MEASURED
UNDECIDED, NOTE = Known.UNDECIDED, Known.NOTE
_SHOWN_DEGREES = 12
_NAMES = 6  # that are listed one by one
_POINTS = 8  # as many fixed points as three quadratic equations have
_LONG = 300  # characters of a sentence with a formula


@dataclass(frozen=True)
class Statement:
    """One line of the report and how it is known."""

    status: Known
    text: str


def sections(found: Findings, until_pending: bool = False) -> list[tuple[str, list[Statement]]]:
    """Titles with their statements, those that have some; perhaps only those before the first one that is not final."""
    ready = takewhile(lambda section: not (until_pending and section[1].intersection(found.pending)), _sections())
    return [(title, lines) for title, _, tell in ready if (lines := tell(found))]


def _sections() -> list[tuple[str, set[str], Callable[[Findings], list[Statement]]]]:
    """Titles, the parts of the analysis that their statements come from, and what makes these."""
    return [
        ("vector field", {"the vector field"}, _field_lines),
        (
            "integrals",
            {"the commuting family", "degrees", "integrals"},
            lambda found: [*_integral_lines(found), *_curve_lines(found)],
        ),
        ("measure", {"densities"}, _measure_lines),
        ("the flow", {"the flow"}, _flow_lines),
        ("Poisson tensors", {"Poisson tensors"}, _poisson_lines),
        ("growth", {"degrees", "heights"}, _growth_lines),
        ("singularities", {"singularities"}, _singularity_lines),
        ("symmetry", {"symmetries"}, _symmetry_lines),
        ("structure", {"hamiltonian structure", "the commuting family"}, _structure_lines),
        ("commuting systems", {"commuting systems"}, _commuting_lines),
        ("not done", set(), lambda found: [Statement(NOTE, text) for text in found.skipped if not found.pending]),
    ]


def _field_lines(found: Findings) -> list[Statement]:
    search = found.fixed_points
    if search is None:
        return []
    divergence = format_polynomial(found.file.system.divergence)
    lines = [Statement(PROVED, f"div f = {divergence}" + (": the flow preserves volume" if divergence == "0" else ""))]
    lines += [Statement(PROVED, one.text) for one in search.found[:_POINTS]]
    if len(search.found) > _POINTS:
        more = counted(len(search.found) - _POINTS, "more set")
        lines.append(Statement(NOTE, f"and {more} of fixed points: --json lists them"))
    if search.undecided:
        lines.append(Statement(UNDECIDED, f"not all fixed points were found: {search.undecided}"))
    elif not search.found:
        lines.append(Statement(PROVED, "f = 0 has no solution, not over the complex numbers either: no fixed point"))
    else:
        text = "flow and map have the same fixed points; an eigenvalue lambda of f' becomes the multiplier"
        lines.append(Statement(NOTE, f"{text} (1 + eps*lambda)/(1 - eps*lambda) of the map"))
    if found.equivalent is not None:
        lines.append(Statement(PROVED, found.equivalent.text))
    return lines


def _integral_lines(found: Findings) -> list[Statement]:
    search, family = found.integrals, []
    if isinstance(found.structure, Structure):
        number = counted(found.structure.form.m, "independent integral")
        family = [Statement(PROVED, f"{number}, as a member of the commuting family")]
    if search is None:
        return family
    texts = [(one, one.short_text) for one in search.integrals] + [(one, one.text) for one in search.in_iterates]
    lines = [Statement(Known(one.verdict), f"{one.name} = {text}  [{one.origin}]") for one, text in texts]
    for timed in search.in_time:
        text = f"{timed.name} = {timed.text} at the n-th point, an integral that depends on n"
        lines.append(Statement(Known(timed.integral.verdict), text))
    profile = search.profile
    if search.by_theorems:
        number = counted(search.by_theorems, "independent integral")
        status = MEASURED if search.symbols else PROVED  # of symbols random values are looked at
        lines.append(Statement(status, f"{number} by theorems: {search.theorems}"))
    if not profile.nullities:
        lines.append(Statement(UNDECIDED, f"how many integrals there are was not measured: {search.reason}"))
    elif profile.period is not None:
        lines.append(Statement(MEASURED, f"all orbits tried close after {counted(profile.period, 'step')}"))
    else:
        if search.codimension:
            seen = "" if search.is_exact else "at least "
            number = f"{seen}{counted(search.codimension, 'independent integral')}"
            text = f"generic orbits lie on varieties of codimension {seen}{search.codimension}, which means {number}"
        else:
            text = "orbits show no integral"
        lines.append(Statement(MEASURED, f"{text}; relations along an orbit: {_relations(profile)}"))
        if not profile.agree:
            lines.append(Statement(NOTE, "the orbits that were compared do not agree"))
    lines += [Statement(MEASURED, f"along orbits {relation.text}") for relation in found.relations]
    integrals = list(dict.fromkeys(name for relation in found.relations for name in relation.integrals))
    if integrals:
        if len(integrals) == 1:
            text = "is constant on each orbit and differs between orbits, so it is an integral"
        else:
            text = "are constant on each orbit and differ between orbits, so they are integrals"
        lines.append(Statement(NOTE, f"{_listed(integrals)} {text}"))
    functions = list(dict.fromkeys(name for relation in found.relations for name in relation.functions_of_eps))
    if functions:
        depend = "depends" if len(functions) == 1 else "depend"
        lines.append(Statement(NOTE, f"{_listed(functions)} {depend} on eps only"))
    if search.reason and profile.nullities:
        lines.append(Statement(NOTE, search.reason))
    return lines + family


def _relations(profile: Profile) -> str:
    """How many independent ones there are of each degree from the first that has some."""
    degrees = list(enumerate(profile.nullities, 1))
    some = [f"a {k}-dimensional space up to degree {degree}" for degree, k in degrees if k]
    none = max((degree for degree, k in degrees if not k), default=0)
    before = [f"none up to degree {none}" if none > 1 else "none of degree 1"] if none else []
    return ", ".join(before + some)


def _listed(names: Sequence[str]) -> str:
    """The names, only the first and the last one of many."""
    return ", ".join(names) if len(names) <= _NAMES else f"{names[0]}, ..., {names[-1]}"


def _curve_lines(found: Findings) -> list[Statement]:
    if found.pencil is None:
        return []
    growth = found.degrees.growth if found.degrees is not None else GrowthClass.UNKNOWN
    against = found.pencil.against(growth)
    follows = f"but {against}" if against else found.pencil.motion(growth)
    text = "; ".join(filter(None, [found.pencil.text, follows]))
    return [Statement(UNDECIDED if against else MEASURED, text)]


def _measure_lines(found: Findings) -> list[Statement]:
    search = found.densities
    if search is None:
        return []
    lines = []
    if search.densities:
        lines += [Statement(Known(one.verdict), f"dx/phi is invariant, phi = {one.text}") for one in search.shown]
        if len(search.densities) > 1:
            names = [] if found.integrals is None else [one.name for one in found.integrals.integrals]
            times = f"any function of {_listed(names)}" if names else "any integral"
            lines.append(Statement(NOTE, f"so is dx/phi for this phi times {times}"))
    else:
        lines.append(Statement(MEASURED if search.none_there else UNDECIDED, search.reason))
    if search.turning is not None:
        text = f"|dx/phi| is invariant, and dx/phi changes its sign, phi = {search.turning.text}"
        lines.append(Statement(Known(search.turning.verdict), text))
    return lines


def _flow_lines(found: Findings) -> list[Statement]:
    return [] if found.flow is None else [Statement(Known(known), text) for known, text in found.flow.lines()]


def _poisson_lines(found: Findings) -> list[Statement]:
    search, lines = found.poisson, []
    if isinstance(found.structure, Structure) and found.structure.form.m > 1:
        text = f"with {found.structure.form.m} integrals in involution, as a member of the commuting family"
        lines.append(Statement(PROVED, f"J - eps^2 f'(x)^2 J is an invariant Poisson tensor, {text}"))
    if search is None:
        return lines
    lines += [Statement(Known(one.verdict), f"{one.name}: {one.short_text}; {one.statement}") for one in search.tensors]
    return [*lines, *([Statement(NOTE, search.note)] if search.note else [])]


def _growth_lines(found: Findings) -> list[Statement]:
    lines = []
    if found.degrees is not None:
        shown = ", ".join(map(str, found.degrees.degrees[1 : _SHOWN_DEGREES + 1]))
        more = ", ..." if len(found.degrees.degrees) > _SHOWN_DEGREES + 1 else ""
        if shown:
            lines.append(Statement(MEASURED, f"degrees of the iterates: {shown}{more}"))
        unknown = found.degrees.growth is GrowthClass.UNKNOWN and not found.degrees.looks_exponential
        known = found.degrees.known
        lines.append(Statement(UNDECIDED if unknown else known, found.degrees.growth_text))
        recurrence = found.degrees.recurrence
        if recurrence is not None:
            lines.append(Statement(known, f"recurrence: {recurrence.text}"))
            if recurrence.closed_form_text:
                lines.append(Statement(known, f"d_n = {recurrence.closed_form_text}"))
        if found.degrees.enclosure is not None:
            lines.append(Statement(PROVED, found.degrees.enclosure.text))
    if found.heights is not None:
        doubt = doubt_of_heights(found)
        status = UNDECIDED if doubt or found.heights.kind is Growth.UNDECIDED else MEASURED
        text = found.heights.text
        lines.append(Statement(status, f"{text}, but {doubt}" if doubt else text))
    return lines


def _singularity_lines(found: Findings) -> list[Statement]:
    if not found.singularities:
        return []
    verdicts = {run.verdict for run in found.singularities}
    values = ", ".join(format_number(run.eps) for run in found.singularities)
    if len(verdicts) > 1:
        return [Statement(UNDECIDED, f"the eps {values} disagree: {', '.join(sorted(verdicts))}")]
    first = min(found.singularities, key=lambda run: run.followed or 0)
    at = f" (eps = {values})" if found.file.map.has_eps else ""
    lines = [Statement(UNDECIDED if first.verdict == Outcome.UNDECIDED else MEASURED, f"{first.text}{at}")]
    ends = [h.confined_at for run in found.singularities for h in run.hypersurfaces if h.confined_at is not None]
    if ends:
        lines.append(Statement(MEASURED, f"the last confinement comes after {counted(max(ends), first.unit)}"))
    return lines


def _symmetry_lines(found: Findings) -> list[Statement]:
    search = found.symmetries
    if search is None:
        return []
    linear = len(search.infinitesimal)
    lines = []
    if linear > _NAMES:
        lines.append(Statement(PROVED, f"a Lie algebra of affine symmetries, of dimension {linear}"))
    else:
        fields = [f"({', '.join(x.rhs)})" for x in search.infinitesimal]
        lines += [Statement(PROVED, f"a one-parameter group of symmetries, the flow of {field}") for field in fields]
    if search.group_text:
        generators = "; ".join(f"the {one.kind} {one.text}" for one in search.generators)
        lines.append(Statement(PROVED, f"{search.group_text}, generated by {generators}"))
    if search.group_of == SIGNED:
        lines += [Statement(PROVED, f"{one.kind} {one.text}") for one in search.others]
    lines += [Statement(UNDECIDED, text) for text in search.undecided]
    return lines or [Statement(NOTE, "no affine symmetry of the kinds searched, apart from the identity")]


def _structure_lines(found: Findings) -> list[Statement]:
    lines = []
    structures = found.hamiltonian
    if structures is not None and structures.hamiltonian is not None:
        H = format_polynomial(structures.hamiltonian.H)
        kind = "the standard J" if structures.hamiltonian.is_standard else "a constant skew J"
        lines.append(Statement(PROVED, f"Hamiltonian with {kind}, H = {H}"))
    elif structures is not None and structures.proved:
        lines.append(Statement(PROVED, f"not Hamiltonian with a constant J: {structures.reason}"))
    darboux = affine_darboux(found.file.system) if found.file.is_quadratic else None
    if darboux is not None and darboux.functions:
        planes = [f"{format_polynomial(one.function)} = 0" for one in darboux.functions]
        kind = {1: "point", 2: "line", 3: "plane"}.get(found.dim, "hyperplane")
        are = f"the {kind} {planes[0]} is" if len(planes) == 1 else f"the {kind}s {_enumerated(planes)} are"
        lines.append(Statement(PROVED, f"{are} invariant, for flow and map"))
    if found.structure is not None and found.structure.text:
        text = f"belongs to the commuting family: {found.structure.text}{_coordinates(found, found.structure.T)}"
        lines.append(Statement(PROVED, text))
    if found.tensor is not None:
        text = "the map is that over K, and inherits what it has (docs/beyond.md)"
        lines.append(Statement(PROVED, f"{found.tensor.text}: {text}"))
    if isinstance(found.structure, Structure):
        form = found.structure.form
        lines.append(
            Statement(
                PROVED,
                f"normal form: the planar map of h(X, Y) = {form.h_text} over Q[t]/({form.chi_text}), "
                "a block for each root t",
            )
        )
    return lines


def _enumerated(texts: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))


def _are_opposite(family: CommutingFamily, other: CommutingFamily) -> bool:
    """Whether the negatives of the one are the other."""
    directions, others = ([g.system for g in one.directions] for one in (family, other))
    return directions == others and family.base.system == other.base.system.scaled(-1)


def _family_text(family: CommutingFamily) -> str:
    """All g of a linear family, or how many parameters it has where that is long."""
    base = [] if family.base.trivial == "0" else [f"({', '.join(family.base.rhs)})"]
    moved = [f"t{k}*({', '.join(g.rhs)})" for k, g in enumerate(family.directions, 1)]
    which = "g and -g, g" if base else "all g"  # the negatives of these are among them
    letters = ", ".join(f"t{k}" for k in range(1, len(moved) + 1))
    text = f"commutes with the Kahan maps of {which} = {' + '.join([*base, *moved])}, for all {letters}"
    if len(text) > _LONG:
        return f"commutes with a linear family of {counted(len(moved), 'parameter')}, which find-commuting writes out"
    return text


def _coordinates(found: Findings, T: fmpq_mat | None) -> str:
    """In which coordinates the system is a member of the family, x = centre + T y; empty where these are its own."""
    centre = f"({', '.join(map(format_number, found.centre))})" if found.centre and any(found.centre) else ""
    if T is None and not centre:
        return ""
    return f", in coordinates y with x = {' + '.join(filter(None, [centre, 'y' if T is None else 'T y']))}"


def _commuting_lines(found: Findings) -> list[Statement]:
    lines = []
    if isinstance(found.structure, Structure) and (m := found.structure.form.m) > 1:
        text = f"the Kahan maps of its {2 ** (m - 1)} associated systems, f itself among them, commute"
        split = all(factor.degree == 1 for factor in factors_of_chi(found.structure.form.A))
        lines.append(Statement(PROVED, text if split else f"{text} over the splitting field of chi"))
    search = found.commuting
    if search is None:
        return lines
    if search.every_g_commutes:
        lines.append(Statement(PROVED, "the map is the identity and commutes with every other"))
    told: list[CommutingField] = []
    for one in search.nontrivial:  # with g there is -g, whose map is the inverse
        if not any(one.system == other.system.scaled(-1) for other in told):
            told.append(one)
            text = f"commutes with the Kahan maps of g and -g, g = ({', '.join(one.rhs)})"
            lines.append(Statement(Known(one.finding.verdict), text))
    for k, family in enumerate(search.families):
        if not any(_are_opposite(family, other) for other in search.families[:k]):
            lines.append(Statement(Known(family.finding.verdict), _family_text(family)))
    lines += [Statement(NOTE, text) for text in search.irrational]
    lines += [Statement(UNDECIDED, text) for text in search.undecided]
    if not (told or search.every_g_commutes or search.families or search.irrational or search.undecided):
        lines.append(Statement(PROVED, f"among the {search.kind_text} only 0, f and -f commute with f"))
    return lines
