"""What a map makes of the integrals of its differential equation: conserves, deforms, loses."""

from dataclasses import replace
from functools import cache

import pytest
from helpers import quick
from search_helpers import integrals_of, system

from kahanmaps import find_densities, find_integrals, flow_and_map, load, parse_rational_function, parse_system
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.printing import format_rational_function
from kahanmaps.laboratory.laboratory import Laboratory, flow_preserves

THREE_LINES = system("x y", "3*x*(x+2*y) + 6*x*y", "-(y*(x+2*y) + 3*x*y)")

SUM, PRODUCT = "(x1 + x2 + x3)", "(x1*x2*x3)"


def beside(name, *symbols):
    return flow_and_map(integrals_of(name, *symbols))


def order_in_eps(function):
    above, below = (min(int(m[-1]) for m in part.monoms()) for part in (function.numerator, function.denominator))
    return above - below


def with_integrals(search, *texts):
    """The search with these functions for integrals."""
    [model, *_] = search.integrals
    names = [*search.file.variables, "eps"]
    made = [replace(model, name=f"I{k}", function=parse_rational_function(t, names)) for k, t in enumerate(texts, 1)]
    return replace(search, integrals=tuple(made))


@pytest.mark.parametrize(
    ("name", "leading", "kept"),
    [
        ("euler_top", ["2*x1^2 + x2^2", "x1^2 - x3^2"], [False, False]),  # the energies
        ("nahm_tetrahedral", ["3*x^2*y - y^3"], [False]),  # H
        ("volterra_periodic_4", ["x1 + x2 + x3 + x4", "x1*x3", "x2*x4"], [True, False, False]),
        ("harmonic", ["x^2 + y^2"], [True]),
    ],
)
def test_integrals_of_the_map_tend_to_integrals_of_the_flow(name, leading, kept):
    result = beside(name)
    assert [format_rational_function(limit.leading) for limit in result.limits] == leading
    assert [limit.conserved.holds for limit in result.limits] == kept
    assert (result.other_integrals, result.lost, result.without_limit) == ((), 0, 0)
    assert all(flow_preserves(load(name).system, limit.leading) for limit in result.limits)


@pytest.mark.parametrize("name", ["euler_top", "weierstrass"])
def test_the_combination_has_the_reported_series(name):
    """combination - leading - eps^k second, by rational functions, is of a higher order in eps than k."""
    search = integrals_of(name)
    names = [*search.file.variables, "eps"]
    field = FunctionField(names, reduces=True)
    for limit in flow_and_map(search).limits:
        formula = parse_rational_function(limit.combination, [*(each.name for each in search.integrals), "eps"])
        values = [each.function.value(field, field.variables) for each in search.integrals]
        *x, eps = field.variables
        remainder = formula.value(field, [*values, eps]) - limit.leading.value(field, x)
        if limit.second is None:
            assert field.is_zero(remainder)
            continue
        assert order_in_eps(remainder) == limit.order
        remainder = remainder - eps**limit.order * limit.second.value(field, x)
        assert field.is_zero(remainder) or order_in_eps(remainder) > limit.order


def test_a_flow_integral_that_no_integral_tends_to_is_lost_and_that_is_measured():
    for search, formula in ((find_integrals(THREE_LINES), "x*y^3*(x + 2*y)^3"), (integrals_of("zander_120"), "x*y^2")):
        comparison = flow_and_map(search)
        assert [integral.text for integral in comparison.other_integrals] == [formula]
        assert comparison.lost == 1
        assert ("measured", "F1 is lost up to degree 14: the map shows no integral") in comparison.lines()


def test_where_integrals_have_no_limit_nothing_is_said_to_be_lost():
    search = integrals_of("euler_top")
    known = flow_and_map(replace(search, integrals=search.integrals[:1]))
    assert (len(known.limits), len(known.other_integrals), known.without_limit, known.lost) == (1, 1, 1, 0)
    assert ("undecided", "what the map makes of F2: the limits of 1 integral are not known") in known.lines()
    uncounted = replace(search.profile, nullities=(), codimensions=(), with_known=0)
    uncounted = flow_and_map(replace(search, integrals=(), profile=uncounted, by_theorems=0))
    assert (len(uncounted.other_integrals), uncounted.lost) == (2, 0)
    assert ("undecided", "what the map makes of F1, F2: its integrals were not counted") in uncounted.lines()


def test_a_transcendental_integral_is_neither_seen_nor_lost():
    result = beside("lotka_volterra")
    assert (result.limits, result.other_integrals, result.lost) == ((), (), 0)
    assert not any("lost" in text for _, text in result.lines())
    assert result.lines()[0] == (
        "measured",
        "no rational integral of the flow shows in relations along solutions up to degree 10",
    )


@pytest.mark.parametrize(
    "second", [f"{SUM}^2 + 3*{SUM} + eps^3*{PRODUCT}", f"5 + eps*{SUM} + eps^2*{SUM}^2 + eps^4*{PRODUCT}"]
)
def test_leading_terms_that_depend_on_each_other_are_combined(second):
    search = with_integrals(integrals_of("volterra_periodic_3"), f"1 + eps*{SUM}", second)
    comparison = flow_and_map(search)
    assert format_rational_function(comparison.limits[0].leading) == "x1 + x2 + x3"
    assert (len(comparison.limits), comparison.other_integrals, comparison.without_limit) == (2, (), 0)


def test_a_function_that_is_no_integral_has_no_limit_among_those_of_the_flow():
    comparison = flow_and_map(with_integrals(integrals_of("harmonic"), "x + eps*y"))
    assert comparison.limits == ()
    assert comparison.without_limit == 1


DENSITIES = [("zander_120", ["x*y*(x + 2*y)"]), ("euler_top", ["1"]), ("lotka_volterra", ["x*y"]), ("lorenz", [])]


@pytest.mark.parametrize(("name", "phi"), quick(DENSITIES, DENSITIES[2:3]))
def test_the_density_of_the_map_tends_to_one_of_the_flow(name, phi):
    found = flow_and_map(integrals_of(name), find_densities(load(name))).density
    assert [one.text for one in (found, *find_densities(load(name), flow=True).densities[:1]) if one] == phi * 2


def test_an_adjusted_map_has_the_flow_of_the_field_at_eps_0():
    file = system("x y", "y + eps^2*x*y", "-x + eps^2*x^2")
    [entry] = find_integrals(file, flow=True).integrals
    assert entry.text == "x^2 + y^2"
    assert flow_and_map(find_integrals(file)).lost == 1


def polarised(*rhs):
    """A file of the polarised map of a cubic field in the plane."""
    return parse_system(f'variables = ["x", "y"]\n[system]\nrhs = {list(rhs)}\ndiscretization = "polarised"')


DUFFING = ("y", "-x^3")
FOUR_LINES = ("2*x^3 + 4*x^2*y - 4*x*y^2 + 2*x^2 + 5*x*y", "-3*x^2*y + 4*x*y^2 + y^3 - 4*x*y - y^2")


@cache
def integrals_of_duffing():
    return find_integrals(polarised(*DUFFING))


def test_a_polarised_map_deforms_the_energy_of_a_cubic_field():
    """Its integral depends on two points, and tends to the energy where they are those of a solution (cmoq-2015)."""
    comparison = flow_and_map(integrals_of_duffing())
    [entry] = comparison.limits
    assert (format_rational_function(entry.leading), entry.conserved.holds) == ("x^4 + 2*y^2", False)
    assert entry.text.endswith("the map deforms: I1/3 tends to L1 at successive points of one solution")
    assert (comparison.other_integrals, comparison.lost, comparison.density.text) == ((), 0, "1")


def test_a_polarised_map_may_lose_an_integral():
    """x y^2 (x + y)^3/(x - y + 1), a product of lines that the field keeps zero."""
    comparison = flow_and_map(find_integrals(polarised(*FOUR_LINES)))
    assert [integral.text for integral in comparison.other_integrals] == ["x*y^2*(x + y)^3/(x - y + 1)"]
    assert (comparison.limits, comparison.lost) == ((), 1)
    assert flow_preserves(Laboratory(polarised(*FOUR_LINES), flow=True).field, comparison.other_integrals[0].function)
    assert not flow_preserves(Laboratory(polarised(*DUFFING), flow=True).field, comparison.other_integrals[0].function)
