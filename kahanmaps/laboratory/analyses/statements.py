"""What the report says of each result: the lines of its sections, in the order of the report."""

from __future__ import annotations

from collections.abc import Sequence

from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.checks.claims import Certainty
from kahanmaps.errors import counted
from kahanmaps.family.skew_hamiltonian import factors_of_chi
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.conclusion import doubt_of_heights
from kahanmaps.laboratory.findings import Findings, Statement
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, under_map
from kahanmaps.laboratory.singular.outcomes import SingularityOutcome
from kahanmaps.laboratory.symmetry.commuting import CommutingField
from kahanmaps.laboratory.symmetry.symmetries import MATRICES

_POINTS = 8  # as many fixed points as three quadratic equations have
_NAMES = 6  # that are listed one by one
_DEGREES = 12  # that are shown
_FIELDS = 6  # that are listed one by one
_LONG = 300  # characters of a sentence with a formula


def of_vector_field(found: Findings) -> list[Statement]:
    """div f and the fixed points, the first of them only where there are many."""
    search = found.fixed_points
    if search is None:
        return []
    divergence = format_polynomial(found.file.system.divergence)
    lines = [
        Statement(
            Certainty.PROVED, f"div f = {divergence}" + (": the flow preserves volume" if divergence == "0" else "")
        )
    ]
    lines += [Statement(Certainty.PROVED, one.text) for one in search.found[:_POINTS]]
    if len(search.found) > _POINTS:
        more = counted(len(search.found) - _POINTS, "more set")
        lines.append(Statement(Certainty.NOTE, f"and {more} of fixed points: --json lists them"))
    if search.undecided:
        lines.append(Statement(Certainty.UNDECIDED, f"not all fixed points were found: {search.undecided}"))
    elif not search.found:
        lines.append(
            Statement(Certainty.PROVED, "f = 0 has no solution, not over the complex numbers either: no fixed point")
        )
    else:
        # Fixed points of the flow are those of the map where det(I - eps f'(x)) is not 0.
        known = [one.are_fixed_by_map(found.eps) for one in search.found]
        lost = [one.where for one, is_fixed in zip(search.found, known, strict=True) if is_fixed is False]
        where = "" if all(known) else " where det(I - eps f'(x)) is not 0"
        if lost:
            where += f"; at eps = {found.eps} it is 0 at the {', the '.join(lost)}, where the map has no value"
        multiplier = "an eigenvalue lambda of f' becomes the multiplier (1 + eps*lambda)/(1 - eps*lambda) of the map"
        text = f"flow and map have the same fixed points{where}; {multiplier}"
        if len(lost) == len(known):
            text = f"at eps = {found.eps} det(I - eps f'(x)) is 0 at all of them: the map has no value there"
        lines.append(Statement(Certainty.NOTE, text))
    if found.equivalent is not None:
        lines.append(Statement(Certainty.PROVED, found.equivalent.text))
    return lines


def of_integrals(found: Findings) -> list[Statement]:
    """Formulas, what is measured along orbits, relations there, and the curves of a planar integral."""
    search, family = found.integrals, []
    if isinstance(found.normal_form, SystemNormalForm):
        number = counted(found.normal_form.form.m, "independent integral")
        family = [Statement(Certainty.PROVED, f"{number}, as a member of the commuting family")]
    if search is None:
        return [*family, *_curve_lines(found)]
    texts = [(one, one.short_text) for one in search.integrals] + [(one, one.text) for one in search.in_iterates]
    lines = [Statement(one.verdict, f"{one.name} = {text}  [{one.origin}]") for one, text in texts]
    for timed in search.in_time:
        text = f"{timed.name} = {timed.text} at the n-th point, an integral that depends on n"
        lines.append(Statement(timed.integral.verdict, text))
    profile = search.profile
    if search.by_theorems:
        number = counted(search.by_theorems, "independent integral")
        status = Certainty.MEASURED if search.symbols else Certainty.PROVED  # of symbols random values are looked at
        lines.append(Statement(status, f"{number} by theorems: {search.theorems}"))
    if not profile.nullities:
        lines.append(Statement(Certainty.UNDECIDED, f"how many integrals there are was not measured: {search.reason}"))
    elif profile.period is not None:
        lines.append(Statement(Certainty.MEASURED, f"all orbits tried close after {counted(profile.period, 'step')}"))
    else:
        if search.codimension:
            seen = "" if search.is_exact else "at least "
            number = f"{seen}{counted(search.codimension, 'independent integral')}"
            text = f"generic orbits lie on varieties of codimension {seen}{search.codimension}, which means {number}"
        else:
            text = "orbits show no integral"
        none = max((degree for degree, k in enumerate(profile.nullities, 1) if not k), default=0)
        relations = [f"none up to degree {none}" if none > 1 else "none of degree 1"] if none else []
        spaces = [(degree, k) for degree, k in enumerate(profile.nullities, 1) if k]
        relations += [f"a {k}-dimensional space up to degree {degree}" for degree, k in spaces]
        lines.append(Statement(Certainty.MEASURED, f"{text}; relations along an orbit: {', '.join(relations)}"))
        if not profile.agree:
            lines.append(Statement(Certainty.NOTE, "the orbits that were compared do not agree"))
    lines += [Statement(Certainty.MEASURED, f"along orbits {relation.text}") for relation in found.relations]
    integrals = list(dict.fromkeys(name for relation in found.relations for name in relation.integrals))
    if integrals:
        if len(integrals) == 1:
            text = "is constant on each orbit and differs between orbits, so it is an integral"
        else:
            text = "are constant on each orbit and differ between orbits, so they are integrals"
        lines.append(Statement(Certainty.NOTE, f"{_listed(integrals)} {text}"))
    functions = list(dict.fromkeys(name for relation in found.relations for name in relation.functions_of_eps))
    if functions:
        depend = "depends" if len(functions) == 1 else "depend"
        lines.append(Statement(Certainty.NOTE, f"{_listed(functions)} {depend} on eps only"))
    if search.reason and profile.nullities:
        lines.append(Statement(Certainty.NOTE, search.reason))
    return [*lines, *family, *_curve_lines(found)]


def _listed(names: Sequence[str]) -> str:
    """The names, only the first and the last one of many."""
    return ", ".join(names) if len(names) <= _NAMES else f"{names[0]}, ..., {names[-1]}"


def _curve_lines(found: Findings) -> list[Statement]:
    if found.pencil is None:
        return []
    growth = found.degrees.growth if found.degrees is not None else Growth.UNKNOWN
    against = found.pencil.against(growth)
    follows = f"but {against}" if against else found.pencil.motion(growth)
    text = "; ".join(filter(None, [found.pencil.text, follows]))
    return [Statement(Certainty.UNDECIDED if against else Certainty.MEASURED, text)]


def of_densities(found: Findings) -> list[Statement]:
    """The densities, or why none was found."""
    search = found.densities
    if search is None:
        return []
    lines = []
    if search.densities:
        lines += [Statement(one.verdict, f"dx/phi is invariant, phi = {one.text}") for one in search.shown]
        if len(search.densities) > 1:
            names = [] if found.integrals is None else [one.name for one in found.integrals.integrals]
            times = f"any function of {_listed(names)}" if names else "any integral"
            lines.append(Statement(Certainty.NOTE, f"so is dx/phi for this phi times {times}"))
    else:
        lines.append(Statement(Certainty.MEASURED if search.none_there else Certainty.UNDECIDED, search.reason))
    if search.turning is not None:
        text = f"|dx/phi| is invariant, and dx/phi changes its sign, phi = {search.turning.text}"
        lines.append(Statement(search.turning.verdict, text))
    return lines


def of_flow(found: Findings) -> list[Statement]:
    """A line for each thing kept, deformed or lost."""
    return [] if found.flow is None else [Statement(Certainty(known), text) for known, text in found.flow.lines()]


def of_poisson_tensors(found: Findings) -> list[Statement]:
    """The tensor of a member of the family, and those found."""
    search, lines = found.poisson, []
    if isinstance(found.normal_form, SystemNormalForm) and found.normal_form.form.m > 1:
        text = f"with {found.normal_form.form.m} integrals in involution, as a member of the commuting family"
        lines.append(Statement(Certainty.PROVED, f"J - eps^2 f'(x)^2 J is an invariant Poisson tensor, {text}"))
    if search is None:
        return lines
    lines += [Statement(one.verdict, f"{one.name}: {one.short_text}; {one.statement}") for one in search.tensors]
    return [*lines, *([Statement(Certainty.NOTE, search.note)] if search.note else [])]


def of_growth(found: Findings) -> list[Statement]:
    """Degrees with their recurrence, then heights."""
    lines = []
    if found.degrees is not None:
        shown = ", ".join(map(str, found.degrees.degrees[1 : _DEGREES + 1]))
        more = ", ..." if len(found.degrees.degrees) > _DEGREES + 1 else ""
        if shown:
            status = Certainty.MEASURED if found.degrees.primes else Certainty.PROVED  # by powers of a matrix
            lines.append(Statement(status, f"degrees of the iterates: {shown}{more}"))
        known = found.degrees.known
        lines.append(Statement(known, found.degrees.growth_text))
        recurrence = found.degrees.recurrence
        if recurrence is not None:
            known = Certainty.MEASURED if found.degrees.explained is None else Certainty.EXPLAINED
            lines.append(Statement(known, f"recurrence: {recurrence.text}"))
            if recurrence.closed_form_text:
                lines.append(Statement(known, f"d_n = {recurrence.closed_form_text}"))
        if found.degrees.enclosure is not None:
            lines.append(Statement(Certainty.PROVED, found.degrees.enclosure.text))
    if found.heights is not None:
        doubt = doubt_of_heights(found)
        status = Certainty.UNDECIDED if doubt or found.heights.kind is Growth.UNDECIDED else Certainty.MEASURED
        text = found.heights.text
        lines.append(Statement(status, f"{text}, but {doubt}" if doubt else text))
    return lines


def of_singularities(found: Findings) -> list[Statement]:
    """The outcome at all values of eps, where they agree."""
    if not found.singularities:
        return []
    verdicts = {run.verdict for run in found.singularities}
    values = ", ".join(format_number(run.eps) for run in found.singularities)
    if len(verdicts) > 1:
        return [Statement(Certainty.UNDECIDED, f"the eps {values} disagree: {', '.join(sorted(verdicts))}")]
    first = min(found.singularities, key=lambda run: run.followed or 0)
    at = f" (eps = {values})" if found.file.map.has_eps else ""
    lines = [
        Statement(
            Certainty.UNDECIDED if first.verdict == SingularityOutcome.UNDECIDED else Certainty.MEASURED,
            f"{first.text}{at}",
        )
    ]
    ends = [h.confined_at for run in found.singularities for h in run.hypersurfaces if h.confined_at is not None]
    if ends:
        lines.append(
            Statement(Certainty.MEASURED, f"the last confinement comes after {counted(max(ends), first.unit)}")
        )
    return lines


def of_symmetries(found: Findings) -> list[Statement]:
    """Groups with their generators."""
    search = found.symmetries
    if search is None:
        return []
    linear = len(search.infinitesimal)
    lines = [Statement(Certainty.NOTE, f"of the vector field only: {found.defect}")] if found.defect else []
    if linear > _FIELDS:
        lines.append(Statement(Certainty.PROVED, f"a Lie algebra of affine symmetries, of dimension {linear}"))
    else:
        fields = [f"({', '.join(x.rhs)})" for x in search.infinitesimal]
        lines += [
            Statement(Certainty.PROVED, f"a one-parameter group of symmetries, the flow of {field}") for field in fields
        ]
    if search.group_text:
        generators = "; ".join(f"the {one.kind} {one.text}" for one in search.generators)
        lines.append(Statement(Certainty.PROVED, f"{search.group_text}, generated by {generators}"))
    if search.group_of != MATRICES:
        lines += [Statement(Certainty.PROVED, f"{one.kind} {one.text}") for one in search.others]
    lines += [Statement(Certainty.UNDECIDED, text) for text in search.undecided]
    return lines or [Statement(Certainty.NOTE, "no affine symmetry of the kinds searched, apart from the identity")]


def of_structure(found: Findings) -> list[Statement]:
    """H, invariant hyperplanes, the commuting family and the normal form."""
    lines = []
    structures = found.hamiltonian
    if structures is not None and structures.hamiltonian is not None:
        H = format_polynomial(structures.hamiltonian.H)
        kind = "the standard J" if structures.hamiltonian.is_standard else "a constant skew J"
        lines.append(Statement(Certainty.PROVED, f"Hamiltonian with {kind}, H = {H}"))
    elif structures is not None and structures.proved:
        lines.append(Statement(Certainty.PROVED, f"not Hamiltonian with a constant J: {structures.reason}"))
    lines += _hyperplanes(found)
    if found.normal_form is not None and found.normal_form.text:
        text = f"belongs to the commuting family: {found.normal_form.text}"
        centre = f"({', '.join(map(format_number, found.centre))})" if found.centre and any(found.centre) else ""
        if found.normal_form.T is not None or centre:
            moved = "y" if found.normal_form.T is None else "T y"
            text += f", in coordinates y with x = {' + '.join(filter(None, [centre, moved]))}"
        lines.append(Statement(Certainty.PROVED, text))
    if found.tensor is not None:
        text = "" if found.defect else ": the map is that over K, and inherits what it has (docs/beyond.md)"
        lines.append(Statement(Certainty.PROVED, f"{found.tensor.text}{text}"))
    if isinstance(found.normal_form, SystemNormalForm):
        form = found.normal_form.form
        lines.append(
            Statement(
                Certainty.PROVED,
                f"normal form: the planar map of h(X, Y) = {form.h_text} over Q[t]/({form.chi_text}), "
                "a block for each root t",
            )
        )
    return lines


def _hyperplanes(found: Findings) -> list[Statement]:
    """Those that the flow keeps, by what becomes of them under the map at the eps in force."""
    if not found.file.is_quadratic:
        return []
    system, eps = found.file.system, found.eps
    fates: dict[str, list[str]] = {}
    for one in affine_darboux(system).functions:
        fate = "not birational" if found.defect else "invariant"
        if eps is not None and not found.defect:
            fate = under_map(system, one.function, eps)
        fates.setdefault(fate, []).append(f"{format_polynomial(one.function)} = 0")
    kind = {1: "point", 2: "line", 3: "plane"}.get(found.dim, "hyperplane")
    lines = []
    for fate, planes in fates.items():
        are, it = f"the {kind} {planes[0]} is", "it"
        if len(planes) > 1:
            are, it = f"the {kind}s {', '.join(planes[:-1])} and {planes[-1]} are", "them"
        of_map = {
            "invariant": ", for flow and map",
            "contracted": f" for the flow; at eps = {eps} the map contracts {it}: det(I + eps f'(x)) is 0 there",
            "undefined": f" for the flow; at eps = {eps} the map has no value on {it}: det(I - eps f'(x)) is 0 there",
            "undecided": f" for the flow; what the map makes of {it} at eps = {eps} would take too long to decide",
            "not birational": " for the flow",
        }
        lines.append(Statement(Certainty.PROVED, f"{are} invariant{of_map[fate]}"))
    return lines


def of_commuting_systems(found: Findings) -> list[Statement]:
    """The g that commute, with g there is -g."""
    lines = []
    if isinstance(found.normal_form, SystemNormalForm) and (m := found.normal_form.form.m) > 1:
        text = f"the Kahan maps of its {2 ** (m - 1)} associated systems, f itself among them, commute"
        split = all(factor.degree == 1 for factor in factors_of_chi(found.normal_form.form.A))
        lines.append(Statement(Certainty.PROVED, text if split else f"{text} over the splitting field of chi"))
    search = found.commuting
    if search is None:
        return lines
    if search.every_g_commutes:
        lines.append(Statement(Certainty.PROVED, "the map is the identity and commutes with every other"))
    told: list[CommutingField] = []
    for one in search.nontrivial:  # with g there is -g, whose map is the inverse
        if not any(one.system == other.system.scaled(-1) for other in told):
            told.append(one)
            text = f"commutes with the Kahan maps of g and -g, g = ({', '.join(one.rhs)})"
            lines.append(Statement(one.finding.verdict, text))
    for k, family in enumerate(search.families):
        opposite = family.base.system.scaled(-1), [g.system for g in family.directions]
        if opposite not in [(other.base.system, [g.system for g in other.directions]) for other in search.families[:k]]:
            # All g of it, or how many parameters it has where that is long.
            base = [] if family.base.trivial == "0" else [f"({', '.join(family.base.rhs)})"]
            moved = [f"t{j}*({', '.join(g.rhs)})" for j, g in enumerate(family.directions, 1)]
            which = "g and -g, g" if base else "all g"  # the negatives of these are among them
            letters = ", ".join(f"t{j}" for j in range(1, len(moved) + 1))
            text = f"commutes with the Kahan maps of {which} = {' + '.join([*base, *moved])}, for all {letters}"
            if len(text) > _LONG:
                number = counted(len(moved), "parameter")
                text = f"commutes with a linear family of {number}, which find-commuting writes out"
            lines.append(Statement(family.finding.verdict, text))
    lines += [Statement(Certainty.NOTE, text) for text in (*search.irrational, search.note) if text]
    lines += [Statement(Certainty.UNDECIDED, text) for text in search.undecided]
    if not (told or search.every_g_commutes or search.families or search.irrational or search.undecided):
        lines.append(Statement(Certainty.PROVED, f"among the {search.kind_text} only 0, f and -f commute with f"))
    return lines
