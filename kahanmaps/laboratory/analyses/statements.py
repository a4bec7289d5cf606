"""The statements of the report of an analysis: each function yields the lines of one section of the report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from kahanmaps.algebra.printing import format_number, format_polynomial
from kahanmaps.checks.claims import Certainty
from kahanmaps.errors import counted
from kahanmaps.family.skew_hamiltonian import factors_of_chi
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.analysis_result import AnalysisResult, Statement
from kahanmaps.laboratory.conclusion import doubt_of_heights
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, under_map
from kahanmaps.laboratory.singular.outcomes import SingularityOutcome
from kahanmaps.laboratory.symmetry.commuting import CommutingField
from kahanmaps.laboratory.symmetry.symmetries import MATRICES

PROVED, MEASURED, UNDECIDED, NOTE = Certainty.PROVED, Certainty.MEASURED, Certainty.UNDECIDED, Certainty.NOTE

MAX_POINTS = 8  # maximal number of listed sets of fixed points; three quadratic equations have up to 8 solutions
MAX_NAMES = 6  # maximal number of names that are listed one by one
MAX_DEGREES = 12  # maximal number of printed degrees of iterates
MAX_FIELDS = 6  # maximal number of vector fields that are listed one by one
MAX_CHARACTERS = 300  # maximal length of a sentence with a formula


def of_vector_field(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on div f, on the fixed points (if many, the first ones) and on an equivalent system."""
    search = result.fixed_points
    if search is None:
        return
    divergence = format_polynomial(result.file.system.divergence)
    yield Statement(PROVED, f"div f = {divergence}{': the flow preserves volume' if divergence == '0' else ''}")
    yield from (Statement(PROVED, points.text) for points in search.fixed_points[:MAX_POINTS])
    if len(search.fixed_points) > MAX_POINTS:
        count_text = counted(len(search.fixed_points) - MAX_POINTS, "more set")
        yield Statement(NOTE, f"and {count_text} of fixed points, which --json lists")
    if search.undecided:
        yield Statement(UNDECIDED, f"not all fixed points were found: {search.undecided}")
    elif not search.fixed_points:
        yield Statement(PROVED, "f = 0 has no solution over the complex numbers: there is no fixed point")
    else:
        # A fixed point x of the flow is a fixed point of the map if det(I - eps f'(x)) is not 0.
        are_fixed = [points.are_fixed_by_map(result.eps) for points in search.fixed_points]
        undefined = [
            points.where for points, is_fixed in zip(search.fixed_points, are_fixed, strict=True) if is_fixed is False
        ]
        where = "" if all(are_fixed) else " where det(I - eps f'(x)) is not 0"
        if undefined:
            where += f"; at eps = {result.eps} it is 0 at the {', the '.join(undefined)}, where the map is not defined"
        multiplier = "an eigenvalue lambda of f' becomes the multiplier (1 + eps*lambda)/(1 - eps*lambda) of the map"
        text = f"flow and map have the same fixed points{where}; {multiplier}"
        if len(undefined) == len(are_fixed):
            text = f"at eps = {result.eps} det(I - eps f'(x)) is 0 at all of them, where the map is not defined"
        yield Statement(NOTE, text)
    if result.equivalent is not None:
        yield Statement(PROVED, result.equivalent.text)


def of_integrals(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on integrals, on relations along orbits, and on the level curves of a planar integral."""
    if (search := result.integrals) is not None:
        for integral in search.integrals:
            yield Statement(integral.verdict, f"{integral.name} = {integral.short_text}  [{integral.origin}]")
        for iterated in search.in_iterates:
            yield Statement(iterated.verdict, f"{iterated.name} = {iterated.text}  [{iterated.origin}]")
        for time_dependent in search.time_dependent:
            text = f"{time_dependent.name} = {time_dependent.text} at the n-th point, an integral that depends on n"
            yield Statement(time_dependent.integral.verdict, text)
        profile = search.profile
        if search.by_theorems:
            count_text = counted(search.by_theorems, "independent integral")
            status = MEASURED if search.symbols else PROVED  # the theorems were applied at random values of the symbols
            yield Statement(status, f"{count_text} by theorems: {search.theorems}")
        if not profile.nullities:
            yield Statement(UNDECIDED, f"the number of integrals was not measured: {search.reason}")
        elif profile.period is not None:
            yield Statement(MEASURED, f"all orbits tried close after {counted(profile.period, 'step')}")
        else:
            text = "orbits show no integral"
            if search.codimension:
                at_least = "" if search.is_exact else "at least "
                count_text = f"{at_least}{counted(search.codimension, 'independent integral')}"
                codimension = f"{at_least}{search.codimension}"
                text = f"generic orbits lie on varieties of codimension {codimension}, which means {count_text}"
            empty_degree = max((degree for degree, k in enumerate(profile.nullities, 1) if not k), default=0)
            relation_texts = (
                [f"none up to degree {empty_degree}" if empty_degree > 1 else "none of degree 1"]
                if empty_degree
                else []
            )
            spaces = [(degree, k) for degree, k in enumerate(profile.nullities, 1) if k]
            relation_texts += [f"a {k}-dimensional space up to degree {degree}" for degree, k in spaces]
            yield Statement(MEASURED, f"{text}; relations along an orbit: {', '.join(relation_texts)}")
            if not profile.maps_agree:
                yield Statement(NOTE, "the orbits that were compared disagree")
        yield from (Statement(MEASURED, f"along orbits {relation.text}") for relation in result.relations)
        if integrals := list(dict.fromkeys(name for relation in result.relations for name in relation.integrals)):
            text = "are constant on each orbit and differ between orbits, so they are integrals"
            if len(integrals) == 1:
                text = "is constant on each orbit and differs between orbits, so it is an integral"
            yield Statement(NOTE, f"{_join_names(integrals)} {text}")
        if functions := list(
            dict.fromkeys(name for relation in result.relations for name in relation.functions_of_eps)
        ):
            verb = "depends" if len(functions) == 1 else "depend"
            yield Statement(NOTE, f"{_join_names(functions)} {verb} on eps only")
        if search.reason and profile.nullities:
            yield Statement(NOTE, search.reason)
    if isinstance(result.normal_form, SystemNormalForm):
        count_text = counted(result.normal_form.form.m, "independent integral")
        yield Statement(PROVED, f"{count_text}, as a member of the commuting family")
    if result.pencil is not None:
        growth = result.degrees.growth if result.degrees is not None else Growth.UNKNOWN
        contradiction = result.pencil.contradiction(growth)
        consequence = f"but {contradiction}" if contradiction else result.pencil.motion(growth)
        text = "; ".join(filter(None, [result.pencil.text, consequence]))
        yield Statement(UNDECIDED if contradiction else MEASURED, text)


def _join_names(names: Sequence[str]) -> str:
    """Return the names, separated by commas; of more than 6 names, only the first and the last."""
    return ", ".join(names) if len(names) <= MAX_NAMES else f"{names[0]}, ..., {names[-1]}"


def of_densities(result: AnalysisResult) -> Iterator[Statement]:
    """Yield a statement on each density, or the reason why the search found none."""
    search = result.densities
    if search is None:
        return
    if search.densities:
        yield from (Statement(phi.verdict, f"dx/phi is invariant, phi = {phi.text}") for phi in search.shown)
        if len(search.densities) > 1:
            names = [] if result.integrals is None else [integral.name for integral in result.integrals.integrals]
            factor_text = f"any function of {_join_names(names)}" if names else "any integral"
            yield Statement(NOTE, f"dx/phi is also invariant for this phi times {factor_text}")
    else:
        yield Statement(MEASURED if search.shows_none else UNDECIDED, search.reason)
    if search.anti_invariant is not None:
        text = f"|dx/phi| is invariant, and the map changes the sign of dx/phi, phi = {search.anti_invariant.text}"
        yield Statement(search.anti_invariant.verdict, text)


def of_flow(result: AnalysisResult) -> Iterator[Statement]:
    """Yield a statement for each structure of the flow that the map conserves, deforms or loses."""
    if result.flow is not None:
        yield from (Statement(Certainty(certainty), text) for certainty, text in result.flow.lines())


def of_poisson_tensors(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on the Poisson tensor of a member of the commuting family, and on those of the search."""
    search = result.poisson
    if isinstance(result.normal_form, SystemNormalForm) and result.normal_form.form.m > 1:
        text = f"with {result.normal_form.form.m} integrals in involution, as a member of the commuting family"
        yield Statement(PROVED, f"J - eps^2 f'(x)^2 J is an invariant Poisson tensor, {text}")
    if search is not None:
        yield from (Statement(P.verdict, f"{P.name}: {P.short_text}; {P.statement}") for P in search.tensors)
        if search.note:
            yield Statement(NOTE, search.note)


def of_growth(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on the degrees of the iterates and their recurrence, then on the heights along orbits."""
    degrees, heights = result.degrees, result.heights
    if degrees is not None:
        degrees_text = ", ".join(map(str, degrees.degrees[1 : MAX_DEGREES + 1]))
        ellipsis = ", ..." if len(degrees.degrees) > MAX_DEGREES + 1 else ""
        if degrees_text:
            status = MEASURED if degrees.primes else PROVED  # without primes, powers of a matrix give the degrees
            yield Statement(status, f"degrees of the iterates: {degrees_text}{ellipsis}")
        yield Statement(degrees.known, degrees.growth_text)
        if degrees.recurrence is not None:
            certainty = MEASURED if degrees.derived is None else Certainty.DERIVED
            yield Statement(certainty, f"recurrence: {degrees.recurrence.text}")
            if degrees.recurrence.closed_form_text:
                yield Statement(certainty, f"d_n = {degrees.recurrence.closed_form_text}")
        if degrees.dynamical_degree_bounds is not None:
            yield Statement(PROVED, degrees.dynamical_degree_bounds.text)
    if heights is not None:
        doubt = doubt_of_heights(result)
        status = UNDECIDED if doubt or heights.kind is Growth.UNDECIDED else MEASURED
        yield Statement(status, f"{heights.text}; inconclusive: {doubt}" if doubt else heights.text)


def of_singularities(result: AnalysisResult) -> Iterator[Statement]:
    """Yield the verdict on the singularities and the longest confined pattern, or that different eps disagree."""
    if not result.singularities:
        return
    verdicts = {run.verdict for run in result.singularities}
    values = ", ".join(format_number(run.eps) for run in result.singularities)
    if len(verdicts) > 1:
        yield Statement(UNDECIDED, f"the values {values} of eps disagree: {', '.join(sorted(verdicts))}")
        return
    shortest_run = min(result.singularities, key=lambda run: run.followed or 0)
    eps_text = f" (eps = {values})" if result.file.map.has_eps else ""
    status = UNDECIDED if shortest_run.verdict == SingularityOutcome.UNDECIDED else MEASURED
    yield Statement(status, f"{shortest_run.text}{eps_text}")
    lengths = [h.confined_at for run in result.singularities for h in run.hypersurfaces if h.confined_at is not None]
    if lengths:
        yield Statement(MEASURED, f"the longest confined pattern has {counted(max(lengths), shortest_run.unit)}")


def of_symmetries(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on the affine symmetries: one-parameter groups, and generators of a finite group."""
    search = result.symmetries
    if search is None:
        return
    texts = []
    if (dimension := len(search.infinitesimal)) > MAX_FIELDS:
        texts.append(f"a Lie algebra of affine symmetries, of dimension {dimension}")
    else:
        fields = [f"({', '.join(x.rhs)})" for x in search.infinitesimal]
        texts += [f"a one-parameter group of symmetries, the flow of {field}" for field in fields]
    if search.group_text:
        generators = "; ".join(f"the {t.kind} {t.text}" for t in search.generators)
        texts.append(f"{search.group_text}, generated by {generators}")
    if search.group_of != MATRICES:
        texts += [f"{t.kind} {t.text}" for t in search.others]
    if result.defect:
        yield Statement(NOTE, f"these are symmetries of the vector field only: {result.defect}")
    yield from (Statement(PROVED, text) for text in texts)
    yield from (Statement(UNDECIDED, text) for text in search.undecided)
    if not (result.defect or texts or search.undecided):
        yield Statement(NOTE, "the search found no affine symmetry but the identity")


def of_structure(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on the Hamiltonian, invariant hyperplanes, the commuting family and the normal form."""
    structures = result.hamiltonian
    if structures is not None and structures.hamiltonian is not None:
        H = format_polynomial(structures.hamiltonian.H)
        kind = "the standard J" if structures.hamiltonian.is_standard else "a constant skew J"
        yield Statement(PROVED, f"Hamiltonian with {kind}, H = {H}")
    elif structures is not None and structures.proved:
        yield Statement(PROVED, f"not Hamiltonian with a constant J: {structures.reason}")
    if result.file.is_quadratic:
        # Hyperplanes that are invariant under the flow, grouped by what the map does with them.
        system, eps = result.file.system, result.eps
        planes_by_image: dict[str, list[str]] = {}
        for darboux in affine_darboux(system).functions:
            image = "not birational" if result.defect else "invariant"
            if eps is not None and not result.defect:
                image = under_map(system, darboux.function, eps)
            planes_by_image.setdefault(image, []).append(f"{format_polynomial(darboux.function)} = 0")
        kind = {1: "point", 2: "line", 3: "plane"}.get(result.dim, "hyperplane")
        for image, planes in planes_by_image.items():
            subject_text, it = f"the {kind} {planes[0]} is", "it"
            if len(planes) > 1:
                subject_text, it = f"the {kind}s {', '.join(planes[:-1])} and {planes[-1]} are", "them"
            at_eps = f" for the flow; at eps = {eps} the map"
            endings = {
                "invariant": ", for flow and map",
                "contracted": f"{at_eps} contracts {it}: det(I + eps f'(x)) is 0 there",
                "undefined": f"{at_eps} is not defined on {it}: det(I - eps f'(x)) is 0 there",
                "undecided": f" for the flow; deciding the image of {it} under the map at eps = {eps} "
                "would take too long",
                "not birational": " for the flow",
            }
            yield Statement(PROVED, f"{subject_text} invariant{endings[image]}")
    if result.normal_form is not None and result.normal_form.text:
        text = f"belongs to the commuting family: {result.normal_form.text}"
        centre = f"({', '.join(map(format_number, result.centre))})" if result.centre and any(result.centre) else ""
        if result.normal_form.T is not None or centre:
            linear_text = "y" if result.normal_form.T is None else "T y"
            text += f", in coordinates y with x = {' + '.join(filter(None, [centre, linear_text]))}"
        yield Statement(PROVED, text)
    if result.tensor is not None:
        text = "" if result.defect else ": the map is the Kahan map over K, to which docs/beyond.md applies"
        yield Statement(PROVED, f"{result.tensor.text}{text}")
    if isinstance(result.normal_form, SystemNormalForm):
        form = result.normal_form.form
        text = f"normal form: the planar map of h(X, Y) = {form.h_text} over Q[t]/({form.chi_text}), one block for"
        yield Statement(PROVED, f"{text} each root t")


def of_commuting_systems(result: AnalysisResult) -> Iterator[Statement]:
    """Yield statements on the systems g whose Kahan maps commute with that of f; g and -g share a statement."""
    if isinstance(result.normal_form, SystemNormalForm) and (m := result.normal_form.form.m) > 1:
        text = f"the Kahan maps of its {2 ** (m - 1)} associated systems, f itself among them, commute"
        is_split = all(factor.degree == 1 for factor in factors_of_chi(result.normal_form.form.A))
        yield Statement(PROVED, text if is_split else f"{text} over the splitting field of chi")
    search = result.commuting
    if search is None:
        return
    if search.every_g_commutes:
        yield Statement(PROVED, "the map is the identity and commutes with every other")
    listed_fields: list[CommutingField] = []
    for g in search.nontrivial:  # -g commutes as well, since its map is the inverse of that of g
        if not any(g.system == other.system.scaled(-1) for other in listed_fields):
            listed_fields.append(g)
            text = f"commutes with the Kahan maps of g and -g, g = ({', '.join(g.rhs)})"
            yield Statement(g.finding.verdict, text)
    for k, family in enumerate(search.families):
        opposite = family.base.system.scaled(-1), [g.system for g in family.directions]
        if opposite not in [(other.base.system, [g.system for g in other.directions]) for other in search.families[:k]]:
            # The formula of all fields g of the family; if it is long, the number of parameters.
            base = [] if family.base.trivial == "0" else [f"({', '.join(family.base.rhs)})"]
            terms = [f"t{j}*({', '.join(g.rhs)})" for j, g in enumerate(family.directions, 1)]
            fields_text = "g and -g, g" if base else "all g"  # a linear space of fields contains -g
            parameters = ", ".join(f"t{j}" for j in range(1, len(terms) + 1))
            text = (
                f"commutes with the Kahan maps of {fields_text} = {' + '.join([*base, *terms])}, for all {parameters}"
            )
            if len(text) > MAX_CHARACTERS:
                count_text = counted(len(terms), "parameter")
                text = f"commutes with a linear family of {count_text}, which find-commuting writes out"
            yield Statement(family.finding.verdict, text)
    yield from (Statement(NOTE, text) for text in (*search.irrational, search.note) if text)
    yield from (Statement(UNDECIDED, text) for text in search.undecided)
    if not (listed_fields or search.every_g_commutes or search.families or search.irrational or search.undecided):
        yield Statement(PROVED, f"among the {search.kind_text} only 0, f and -f commute with f")
