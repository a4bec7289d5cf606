"""Maps whose first degrees are those of another map: what is said of them is true of the degrees far beyond.

A contracted hypersurface may come back only after dozens of steps, and no degree shows it before. The degrees of the
tables are computed here once more, with polynomials and gcds, for as long as the statements reach.
"""

import random
from dataclasses import replace
from types import SimpleNamespace

import pytest
from check_helpers import system_of
from flint import fmpq
from helpers import quick
from search_helpers import analysis_of, polynomial_degrees
from search_helpers import system as file_from

from kahanmaps import Budget, DegreeGrowth, QuadraticSystem, analyze, degree_growth, load
from kahanmaps.algebra.polynomials import ring
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.conclusion import contradictions, doubt_of_heights
from kahanmaps.laboratory.singular.following import StepLimits
from kahanmaps.laboratory.singular.outcomes import (
    BUDGET_SPENT,
    CONFINED,
    NOT_CONTRACTED,
    UNDECIDED,
    Hypersurface,
    HypersurfaceForm,
    outcome_of,
)
from kahanmaps.laboratory.singular.singularities import Patterns, _merge_patterns, patterns_of, singularities


def resonant(k: object) -> QuadraticSystem:
    """x' = x^2, y' = k x y: 1/x moves by -2 eps, and the poles of y are cancelled after k steps for integers k."""
    return system_of("x y", "x^2", f"{k}*x*y")


def three_lines(*exponents: int) -> QuadraticSystem:
    """x' = l1^(1-g1) l2^(1-g2) l3^(1-g3) J grad l1^g1 l2^g2 l3^g3 for the lines x, y, x + 2 y."""
    a, b, c = exponents
    return system_of("x y", f"{b}*x*(x + 2*y) + 2*{c}*x*y", f"-({a}*y*(x + 2*y) + {c}*x*y)")


# System, eps, growth and closed form of its degrees, and for how many steps the latter has to be tried.
SLOW_GROWTH = [
    (resonant(12), None, "bounded", "12 for n >= 11", 20),
    (resonant("41/2"), None, "linear", "n + 1", 60),
    (system_of("x y", "1", "x*y"), "1/7", "bounded", "51 for n >= 50", 54),
    (system_of("x y z", "x^2", "12*x*y", "y*z"), None, "linear", "12*n - 54 for n >= 10", 30),
]
# Systems whose first d_n are 2^n, and the first n with fewer.
THREE_LINES = [((1, 3, 3), 8), ((1, 2, 6), 10), ((2, 5, 3), 3)]


@pytest.mark.parametrize(("system", "eps", "growth", "closed_form", "steps"), SLOW_GROWTH)
def test_where_growth_is_slow_the_law_holds_far_beyond_the_last_confinement(system, eps, growth, closed_form, steps):
    result = degree_growth(system, eps)
    assert (str(result.growth), result.recurrence.closed_form_text) == (growth, closed_form)
    true = [1, *polynomial_degrees(system, steps, 5, eps)]
    assert [result.recurrence.predict(n) for n in range(steps + 1)] == true
    assert len(result.degrees) > 2 * max(result.patterns.lengths)


@pytest.mark.parametrize(("exponents", "first"), THREE_LINES)
def test_three_lines_of_late_confinement_have_no_dynamical_degree_2(exponents, first):
    system = three_lines(*exponents)
    growth = degree_growth(system, max_degree=3 * 2**first)
    steps = first + 1
    true = polynomial_degrees(system, steps, 5)
    assert next(n for n, d in enumerate(true, 1) if d < 2**n) == first
    assert list(growth.degrees[1 : steps + 1]) == true[: len(growth.degrees) - 1]
    assert growth.recurrence.predict(steps) == true[-1]
    assert growth.dynamical_degree is None or growth.dynamical_degree.text != "2"


def test_seven_degrees_are_derived_by_a_pattern_that_is_longer():
    """So few terms are all 2^n; the pattern that lowers those after them is seen by the singularities."""
    system = three_lines(1, 2, 6)
    growth = degree_growth(system, max_terms=7)
    assert growth.degrees == tuple(2**n for n in range(8))
    assert [growth.derived.predict(n) for n in range(1, 12)] == polynomial_degrees(system, 11, 5)
    assert (growth.basis, growth.unconfirmed) == ("derived: no other confinement within 1000 steps", "")
    # Without what follows from the singularities there is an estimate only.
    length = max(growth.patterns.lengths)
    measured = replace(growth, patterns=replace(growth.patterns, series=()))
    assert (measured.recurrence, measured.dynamical_degree) == (None, None)
    assert measured.growth == Growth.EXPONENTIAL  # proved by its bounds
    assert measured.growth_text == (
        "exponential growth (proved), by a factor of about 2 (estimated: the last quotients are 2 to 2; "
        f"a singularity pattern of {length} steps calls for {length + 2} "
        "iterates; raise --effort or --max-degree)"
    )
    assert measured.to_json()["unconfirmed"] == measured.unconfirmed != ""


def test_degrees_that_contradict_the_singularities_are_no_result():
    growth = degree_growth(load("euler_top").system)
    other = replace(growth, degrees=(*growth.degrees[:8], growth.degrees[8] + 1, *growth.degrees[9:]))
    assert (growth.disagreement, other.disagreement) == (None, 8)
    assert (other.derived, other.recurrence, other.growth) == (None, None, Growth.UNKNOWN)
    assert "the measured degree of iterate 8 contradicts" in other.unconfirmed


def test_the_pole_of_a_resonant_system_is_confined_after_k_steps():
    k = 13
    run = singularities(resonant(k), "1/7")
    assert [(h.confined_at, h.settled_at) for h in run.hypersurfaces if h.status == CONFINED] == [(k, k)]
    assert run.text == "some confined, others not within 1000 steps"
    assert singularities(resonant(k), "1/7", steps=k - 1).text == f"not confined within {k - 1} steps"
    assert len(next(h for h in run.hypersurfaces if h.status == CONFINED).steps) == k + 2


def test_two_eps_that_differ_leave_the_patterns_open():
    runs = [singularities(system_of("x y", "1", "x*y"), eps, steps=80) for eps in ("1/7", "2/7")]
    assert patterns_of(runs).running == "the singularities at the two values of eps differ; choose one with --eps"
    assert patterns_of(runs[:1]).running == ""
    assert "work limit" in patterns_of([replace(runs[0], is_stopped=True)]).running
    assert "not dominant" in patterns_of([replace(runs[0], is_dominant=False)]).running


def growth_with(known: Patterns | None, *degrees: int) -> DegreeGrowth:
    return DegreeGrowth(degrees, None, "terms", "", 0, (), (), patterns=known)


def test_a_recurrence_needs_terms_beyond_all_patterns():
    linear = tuple(range(1, 14))
    assert growth_with(None, *linear).recurrence.closed_form == "n + 1"
    assert growth_with(Patterns((9,), None, True), *linear).recurrence.closed_form == "n + 1"
    for known in (Patterns((10,), None, True), Patterns((4, 6), 100, True), Patterns((), None, False, "no time")):
        growth = growth_with(known, *linear)
        assert (growth.recurrence, growth.growth) == (None, Growth.UNKNOWN)
        assert growth.growth_text.startswith("13 terms fit linear growth, an estimate only: ")
    # 13 terms, no hypersurface that could lower a degree, and yet the degrees are not 2^n
    assert "degrees drop although" in growth_with(Patterns((), 100, False), *linear).unconfirmed
    assert growth_with(Patterns((), 100, False), *(2**n for n in range(8))).dynamical_degree.text == "2"


LATE = [
    (("x y", "x^2", "9*x*y"), "linearisable", "bounded"),
    (("x y", "2*x*(x + 2*y) + 12*x*y", "-(y*(x + 2*y) + 6*x*y)"), "not integrable", "exponential"),
]


@pytest.mark.parametrize(("given", "kind", "growth"), quick(LATE, LATE[:1]))
def test_the_parts_of_a_report_do_not_contradict_each_other(given, kind, growth):
    analysis = analyze(file_from(*given))
    assert (analysis.conclusion.kind, analysis.conclusion.growth) == (kind, growth)
    assert contradictions(analysis) == []
    true = polynomial_degrees(analysis.file.system, 14 if growth == "exponential" else 20, 3)
    law = analysis.degrees.recurrence
    assert law is None or [law.predict(n) for n in range(1, len(true) + 1)] == true
    assert "estimated" in analysis.conclusion.sentence or law is not None
    assert analysis.degrees.patterns == patterns_of(analysis.singularities)
    lines = [line for _, section in analysis.sections for line in section]
    last = max(h.confined_at or 0 for run in analysis.singularities for h in run.hypersurfaces)
    assert f"the longest confined pattern has {last} steps" in [line.text for line in lines]
    assert last < len(analysis.degrees.degrees) - 1


def test_what_excludes_each_other_is_undecided():
    analysis = analysis_of("weierstrass")
    exponential = replace(analysis.degrees, degrees=tuple(2**n for n in range(12)), patterns=None)
    both = replace(analysis, degrees=exponential)
    why = "the degrees seem to grow exponentially, which they cannot if integrals confine orbits to curves"
    assert (both.conclusion.kind, contradictions(both)) == ("undecided", [why])
    # An estimate gives way to what is proved.
    estimate = replace(analysis, degrees=replace(exponential, patterns=Patterns((30,), None, True)))
    assert estimate.conclusion.kind == "integrable"
    closed = replace(analysis.integrals, profile=replace(analysis.integrals.profile, period=4))
    why = "orbits close after 4 steps, but the degrees seem to grow"
    assert contradictions(replace(analysis, integrals=closed)) == [why]


def beside(kind, growth, lengths=None, heights=(21, 5)):
    """The doubt of heights of this kind, of orbits with so many heights, beside degrees with such patterns."""
    orbits = [SimpleNamespace(growth=SimpleNamespace(heights=(0,) * count)) for count in heights]
    patterns = None if lengths is None else SimpleNamespace(lengths=lengths)
    degrees = SimpleNamespace(growth=growth, patterns=patterns)
    return doubt_of_heights(SimpleNamespace(heights=SimpleNamespace(kind=kind, orbits=orbits), degrees=degrees))


def test_heights_and_degrees_that_disagree_are_reported():
    exponential, quadratic = Growth.EXPONENTIAL, Growth.QUADRATIC
    assert beside(exponential, Growth.LINEAR) == "the degrees grow linearly"
    assert beside(exponential, Growth.QUADRATIC) == "the degrees grow polynomially"
    assert beside(quadratic, Growth.QUADRATIC) == beside(exponential, Growth.EXPONENTIAL) == ""
    assert beside(quadratic, Growth.BOUNDED) == beside(quadratic, Growth.ZERO) == "the degrees are bounded"
    assert beside(exponential, Growth.UNKNOWN) == beside(Growth.UNDECIDED, Growth.EXPONENTIAL) == ""
    # Half of the longest orbit has to reach beyond the last pattern; 21 heights are those of 20 steps.
    late = "orbits of 20 steps are too short, singularity patterns settle only at step 11"
    assert beside(quadratic, quadratic, (4, 10)) == ""
    assert beside(quadratic, quadratic, (4, 11)) == late
    assert beside(quadratic, Growth.BOUNDED, (4, 11)) == f"the degrees are bounded: {late}"
    assert beside(Growth.UNDECIDED, quadratic, (4, 11)) == beside(quadratic, quadratic, None, (2,)) == ""
    analysis = analysis_of("weierstrass")
    other = replace(analysis, degrees=replace(analysis.degrees, degrees=(20,) * 30, patterns=None))
    (line,) = [line for line in dict(other.sections)["growth"] if line.text.startswith("bit lengths")]
    assert (line.status, "are bounded" in line.text) == ("undecided", True)


def test_a_surface_without_points_modulo_some_primes_is_followed_modulo_others():
    # x^2 = 2 z^2 has points in GF(p) for every other prime only.
    x, _, z, _ = ring(["x", "y", "z", "w"]).gens()
    form = HypersurfaceForm(x**2 - 2 * z**2, False, None)
    for seed, units in enumerate((1e6, 1e6, 1e6, 1e6, 0)):
        limits = StepLimits(4, 4, 4, Budget(units), 4)
        outcome = outcome_of(load("lorenz").map, fmpq(1, 7), form, "?", random.Random(seed), limits)
        if units == 0:
            assert (outcome.status, outcome.note) == (UNDECIDED, BUDGET_SPENT)
            continue
        assert (outcome.status, outcome.degree, len(set(outcome.primes))) == (NOT_CONTRACTED, 2, 2)
        assert [(step.common, step.rank) for step in outcome.steps] == [(0, 2)] * 4


def test_a_map_into_a_hypersurface_is_defined_and_one_without_values_is_not():
    # At eps = -1 the first coordinate of all images is 0; at eps = 1 det(I - eps f') = 0.
    runs = [singularities(system_of("x y", "x", "y^2"), eps, steps=3) for eps in (-1, 1)]
    assert [(run.is_dominant, run.is_undefined) for run in runs] == [(False, False), (False, True)]


@pytest.mark.parametrize(
    ("hypersurfaces", "expected"),
    [
        ([], Patterns((), None, False)),
        ([("confined", 7), ("confined", 3), ("confined", 7)], Patterns((3, 7), None, True)),
        ([("confined", 3), ("not confined", 0, 1, 50), ("not confined", 2, 1, 40)], Patterns((2, 3), 40, True)),
        ([("not confined", 0, 1, 50)], Patterns((), 50, False)),
        ([("not contracted", None), ("undecided", None, 0)], Patterns((), None, False)),
        ([("undecided", 3, 2, 9, "why")], Patterns((), None, None, "the pattern of x - 1 = 0 is undecided: why")),
        (
            [("not confined", None, 1, 90)],
            Patterns((), None, None, "the pattern of x - 1 = 0 has not settled after 90 steps; raise --steps"),
        ),
    ],
)
def test_patterns_are_the_fates_of_what_is_contracted(hypersurfaces, expected):
    known = []
    for status, settled_at, *more in hypersurfaces:
        multiplicity, followed, note = (*more, *(1, 100, "")[len(more) :])
        known.append(Hypersurface("x - 1", 1, False, multiplicity, status, 1, None, (), (), note, followed, settled_at))
    assert replace(_merge_patterns(1, known), series=()) == expected
