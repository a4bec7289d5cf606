"""Small systems of polynomial equations: every rational solution, and honest words about the rest."""

import itertools
from math import prod

import pytest
from flint import Ordering, fmpq, fmpz_mpoly_ctx, fmpz_mpoly_vec
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.small_systems import decoupling, echelon_basis, groebner, normal_form, solve_system
from kahanmaps.algebra.work import SPENT, Budget, counted

RING = ring(["x", "y", "z"])
x, y, z = RING.gens()


def solve(*equations, units=1e7):
    return solve_system(equations, (x, y, z), Budget(units))


def points(result):
    return {tuple(int(e) for e in c.point) for c in result.components if not c.free}


@given(st.sets(st.tuples(*[st.integers(-3, 3)] * 3), min_size=1, max_size=4), st.integers(0, 5))
def test_all_points_of_a_finite_set_are_found(expected, shear):
    """The ideal of a finite set: all products of one linear form for each point."""
    forms = [[x - a + shear * (y - b), y - b + shear * (z - c), z - c] for a, b, c in expected]
    solution = solve(*(prod(choice, start=RING.constant(1)) for choice in itertools.product(*forms)))
    assert points(solution) == expected
    assert solution.complete
    assert not solution.irrational


def test_products_are_branched_on_though_combinations_of_them_are_none():
    equations = [x * (2 - 3 * y - z), y * (5 * x - 7 + z), z * (x - y)]
    assert not any(len(p.factor()[1]) > 1 for p in echelon_basis(equations))
    solution = solve(*equations)
    assert solution.complete
    expected = [(fmpq(5, 2), fmpq(5, 2), fmpq(-11, 2)), (fmpq(7, 5), fmpq(2, 3), 0), (0, 0, z)]
    assert [component.values for component in solution.components] == expected


def test_irrational_solutions_are_reported():
    solution = solve(x**2 - 2, y, z)
    assert (solution.components, solution.irrational, solution.complete) == ([], ["x^2 - 2"], True)
    # x^2 = y, y^2 = 2 x: (0, 0) and three conjugate points with x^3 = 2
    solution = solve(x**2 - y, y**2 - 2 * x, z)
    assert points(solution) == {(0, 0, 0)}
    assert solution.irrational


def test_a_curve_is_not_solved_and_not_dropped():
    solution = solve(x**2 + y**2 - 1, z - x)
    assert not solution.complete
    assert solution.unsolved[0].equations == (x**2 + y**2 - 1,)
    assert "not isolated points" in solution.reason


@pytest.mark.parametrize(
    ("equations", "expected"),
    [
        ([x**2 * fmpq(1, 4) + y**2 * fmpq(1, 9) - 5, x * y - 12, z], {(2, 6, 0), (4, 3, 0), (-2, -6, 0), (-4, -3, 0)}),
        ([x**2 + y**2 - 5, x * y - 2, z - x - y], {(1, 2, 3), (2, 1, 3), (-1, -2, -3), (-2, -1, -3)}),
        ([x + y + z - 6, x * y + y * z + z * x - 11, x * y * z - 6], set(itertools.permutations((1, 2, 3)))),
        ([x**2 - y, y**2 - z, z**2 - x], {(0, 0, 0), (1, 1, 1)}),  # x^8 = x: two rational solutions and six others
        ([x**2 + y**2 + z**2 - 3, x + y + z - 3, x * y - z], {(1, 1, 1)}),  # a double one
    ],
)
def test_rational_points_of_irreducible_equations_are_found(equations, expected):
    solution = solve(*equations)
    assert (points(solution), solution.complete) == (expected, True)
    assert not any(component.free for component in solution.components)


def test_planes_of_cubics_are_decoupled():
    """Cubics in (u, v) and in (s, t), four linear forms of x, y, z, w, mixed with each other."""
    four = ring(["x", "y", "z", "w"])
    gens = four.gens()
    a, b, c, d = gens
    u, v, s, t = a + 2 * b - d, b + c, a - c + 3 * d, 2 * a + b + d
    apart = [u**3 + u * v**2, u**2 * v - 2 * v**3, s**2 * t, s**3 - t**3]
    mixed = [sum((f * (i * j + i + 1) ** 2 for j, f in enumerate(apart)), four.constant(0)) for i in range(1, 5)]
    T = decoupling(mixed, 4)
    moved = [sum((g * T[i, j] for j, g in enumerate(gens)), four.constant(0)) for i in range(4)]
    spanned = [p.compose(*moved, ctx=four) for p in apart]
    used = [{i for i, e in enumerate(p.degrees()) if e} for p in spanned]
    assert T.det() != 0
    assert not (used[0] | used[1]) & (used[2] | used[3])
    assert [len(part) for part in used] == [2, 2, 2, 2]


@pytest.mark.parametrize("form", [x**3 + y**3 + z**3 + x * y * z, x**3 + x * y**2 + y * z**2 + 3 * x**2 * z])
def test_a_cubic_that_is_no_sum_over_blocks_is_not_decoupled(form):
    assert decoupling([form], 3) is None


CYCLIC = [x + y + z, x * y + y * z + z * x, x * y * z - 1]
SPHERES = [x**2 + y**2 + z**2 - 3, x * y + 2 * z**2 - x - 2, 3 * x * z - y**2 - 2 * y]


@pytest.mark.parametrize("equations", [CYCLIC, SPHERES, [x**3 - y * z, y**3 - x * z, z**3 - x * y], [x * y, 2 * x * y]])
def test_groebner_bases_are_ones_of_the_same_ideal(equations):
    basis = groebner(equations, Budget())
    integers = fmpz_mpoly_ctx.get(("x", "y", "z"), Ordering.degrevlex)
    vector = fmpz_mpoly_vec([integers.from_dict({m: int(c) for m, c in p.terms()}) for p in basis], integers)
    assert vector.is_groebner()
    given = fmpz_mpoly_vec([integers.from_dict({m: int(c) for m, c in p.terms()}) for p in equations], integers)
    assert sorted(map(str, vector)) == sorted(map(str, given.buchberger_naive().autoreduction()))
    assert not any(normal_form(p, basis) for p in equations)


def test_a_groebner_basis_is_given_up_at_the_end_of_the_budget_and_at_its_limits():
    before = counted()
    assert groebner(SPHERES, Budget(1)) is None
    assert counted() - before < 100
    assert groebner([x**401 - 1, sum((x**k for k in range(401)), y)], Budget()) is None  # more than 400 terms


def test_what_the_budget_did_not_suffice_for_is_unsolved():
    solution = solve(*SPHERES, units=1)
    assert (solution.complete, solution.reason) == (False, SPENT)
    assert solve(*SPHERES).complete


def test_conjugate_solutions_of_a_large_degree_are_reduced():
    solution = solve(x**4 + y * z - 3, y**4 + x + z - 1, z**4 - x * y + 2)
    assert solution.complete
    assert not solution.components
    assert solution.irrational == ["groups of 64 conjugate solutions"]
    assert all(sum(m) <= 12 for p in solution.conjugate[0].equations for m in p.monoms())
