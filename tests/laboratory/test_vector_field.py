"""What a vector field tells by itself: fixed points, which are those of the map, and systems of the catalogue in it."""

import random

import pytest
from check_helpers import system_of as system
from flint import fmpq, fmpq_mat
from helpers import THOROUGH
from search_helpers import file_of, random_system

from kahanmaps import KahanMap, SingularStep, System, SystemFile, equivalent_system, load
from kahanmaps.laboratory.vector_field.fixed_points import FixedPointSearch, fixed_points


# Points and eigenvalues by hand.
@pytest.mark.parametrize(
    ("f", "texts"),
    [
        (system("x y", "y", "x - x^2"), ["fixed point (0, 0): (lambda - 1)*(lambda + 1)", "(1, 0): lambda^2 + 1"]),
        (system("x y", "1", "x"), []),
        (
            system("x y", "x*y", "x^2 - 2*x"),
            ["(2, 0): (lambda - 2)*(lambda + 2)", "line of fixed points (0, y): lambda*(lambda - y)"],
        ),
        (system("x", "x^2 - 2"), ["2 fixed points (x) with x^2 - 2 = 0: lambda - 2*x"]),
        (system("x y z", "x^2 + y^2 - 1", "0", "z"), ["dimension 1 of fixed points (x, y, 0) with x^2 + y^2 - 1"]),
        (system("x y", "0", "0"), ["plane of fixed points (x, y): lambda^2"]),
        (system("lambda y", "lambda^2 - 1", "y"), ["(-1, 0): (mu - 1)*(mu + 2)", "(1, 0): (mu - 2)*(mu - 1)"]),
    ],
)
def test_fixed_points_and_eigenvalues(f, texts):
    search = fixed_points(f)
    messages = [entry.text.replace(", eigenvalues of f'", "") for entry in search.fixed_points]
    assert (len(messages), search.undecided) == (len(texts), "")
    for text, expected in zip(messages, texts, strict=True):
        assert expected in text


# An equilibrium with the eigenvalue 1/eps is no fixed point of the map at eps.
@pytest.mark.parametrize(
    ("f", "eps", "expected"),
    [
        (system("x y", "x*(1 - y)", "y*(x - 1)"), "1", [False, True]),
        (system("x y", "x*(1 - y)", "y*(x - 1)"), "-1", [False, True]),
        (system("x y", "x*(1 - y)", "y*(x - 1)"), "1/2", [True, True]),
        (system("x y", "x*(1 - y)", "y*(x - 1)"), None, [True, True]),
        (system("x", "x^2 - 2"), "1/3", [True]),
        (system("x", "x^2 - 1/4"), "1", [True, False]),
        (system("x y", "x^2 - 2", "y"), "1", [False]),  # (x, 0) with x^2 = 2, eigenvalues 2 x and 1
        (system("x y", "x^2 - 2", "y*(x - 1)"), "1", [True]),
        (system("x y", "x^2 - 2", "y + x"), "2", [True]),
        (system("x y", "x*y", "x^2 - 2*x"), "1/2", [False, None]),  # det is 0 at one point of the line (0, y)
        (system("x y", "x*y", "x^2 - 2*x"), None, [True, None]),
        (system("x y", "y", "0"), None, [True]),
        (system("x y", "x*y", "y"), "1", [False]),  # f' has the eigenvalue 1 on the whole line
        (system("x y", "x*y", "y"), "1/2", [True]),
    ],
)
def test_where_an_equilibrium_is_a_fixed_point_of_the_map(f, eps, expected):
    eps = None if eps is None else fmpq(*map(int, eps.split("/")))
    result = fixed_points(f).fixed_points
    assert [entry.are_fixed_by_map(eps) for entry in result] == expected
    for item, is_fixed in zip(result, expected, strict=True):
        if eps is None or item.equations or item.dimension:
            continue
        x = [value.leading_coefficient() if value else fmpq(0) for value in item.coordinates]
        if is_fixed:
            assert list(KahanMap(f, eps).step(x)) == x
        else:
            with pytest.raises(SingularStep):
                KahanMap(f, eps).step(x)


def elsewhere(name, P, q, c):
    """A system of the catalogue in other coordinates and another time, without its name."""
    return SystemFile.from_system(load(name).system.composed(P, q).transformed(P.inv()).scaled(c), "elsewhere")


def holds(file, result):
    """g(P x + q) = c P f(x), and the same for the maps at a point: T Phi_f(x, eps) = Phi_g(T x, eps/c)."""
    g = load(result.name, result.parameters).system
    x, eps = [fmpq(k + 2, 7) for k in range(file.dim)], fmpq(1, 11)

    def moved(point):
        column = result.P * fmpq_mat(file.dim, 1, list(point))
        return [a + b for a, b in zip(column.entries(), result.q, strict=True)]

    there = KahanMap(g, eps / result.c).step(moved(x))
    g, f = g.renamed(file.variables).composed(result.P, result.q), file.system.transformed(result.P).scaled(result.c)
    return g.rhs == f.rhs and list(there) == moved(KahanMap(file.system, eps).step(x))


@pytest.mark.parametrize("name", ["riccati", "lotka_volterra", "weierstrass", "volterra_periodic_3"])
def test_a_system_is_known_again_after_any_affine_change(name):
    """In the plane, and where invariant hyperplanes are the axes of the catalogue."""
    rng = random.Random(name)
    n = load(name).dim
    P = fmpq_mat(n, n, [rng.randint(-2, 2) + 5 * (i % (n + 1) == 0) for i in range(n * n)])
    file = elsewhere(name, P, [fmpq(rng.randint(-2, 2)) for _ in range(n)], 3)
    equivalence = equivalent_system(file, effort=3)
    assert (equivalence.name, holds(file, equivalence)) == (name, True)


def test_lines_of_fixed_points_are_a_frame():
    """An Euler top with its axes turned: three lines of fixed points lead back to them."""
    file = elsewhere("euler_top", fmpq_mat([[1, 1, 0], [0, 1, 1], [1, 0, 3]]), [fmpq(0)] * 3, 1)
    equivalence = equivalent_system(file, effort=3)
    assert (equivalence.name, holds(file, equivalence)) == ("euler_top", True)
    assert equivalent_system(file, FixedPointSearch((), ""), 3) is None  # without them it is not seen


@pytest.mark.parametrize(
    "equations",
    [
        "x' = x^2 - y^2; y' = 2*x*y",  # not free of divergence, as the Nahm systems are; no parameter makes it another
        "x' = y; y' = -x",  # linear
        "x' = y*z + x; y' = z*x; z' = x*y",
    ],
)
def test_other_systems_are_not_taken_for_one(equations):
    assert equivalent_system(System(equations), effort=3) is None


def test_a_near_miss_is_no_equivalence():
    """The verification by itself: an Euler top with one term more of degree 1."""
    good, bad = System("x' = 3*y*z; y' = x*z; z' = -x*y"), System("x' = 3*y*z; y' = x*z; z' = -x*y + x/1000")
    equivalence = equivalent_system(good)
    assert equivalence.text == "equivalent to euler_top at a1 = 3, a2 = 1, a3 = -1 with its variables called x, y, z"
    assert holds(good, equivalence)
    assert not holds(bad, equivalence)


GENERIC = [random_system(3, 1), file_of("hamiltonian_6_generic")]


@pytest.mark.parametrize("file", [GENERIC[0], pytest.param(GENERIC[1], marks=THOROUGH)], ids=["3", "6"])
def test_the_conjugate_fixed_points_of_a_generic_system_are_counted(file):
    points = fixed_points(file)
    assert (points.undecided, [(entry.dimension, entry.count) for entry in points]) == ("", [(0, 2**file.dim)])
    short = fixed_points(file, effort=-20)
    assert (short.fixed_points, short.undecided) == ((), "work limit reached; raise --effort")
