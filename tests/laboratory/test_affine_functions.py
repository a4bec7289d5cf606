"""Affine integrals and affine Darboux functions: known ones, none too many, and what the Kahan map makes of them."""

import pytest
from check_helpers import system_of
from flint import fmpq, fmpq_mat, fmpq_mpoly
from helpers import EULER_TOP, LORENZ, random_point, systems
from hypothesis import given
from hypothesis import strategies as st
from planar_helpers import diagonal

from kahanmaps import QQ, KahanMap, QuadraticSystem, SingularStep, load
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import evaluate, linear_combinations
from kahanmaps.laboratory.preserve.darboux import affine_functions
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux, affine_integrals, under_map

KNOWN = [
    (load("lotka_volterra").system, (), {"x": "-y + 1", "y": "x - 1"}),
    # (x1 + x3)' = x2 (x1 + x3), since the coefficients of x1' and x3' are equal.
    (EULER_TOP, (), {"x1 + x3": "x2", "x1 - x3": "-x2"}),
    # H = y (3 x^2 - y^2)/3: the two other lines of the triangle have slopes of sqrt(3).
    (load("nahm_tetrahedral").system, (), {"y": "-2*x"}),
    (system_of("x", "x^2 - 1"), (), {"x + 1": "x - 1", "x - 1": "x + 1"}),
    (LORENZ, (), {}),
    (load("riccati").system, (), {}),  # x' = x^2 + x - 1: they lie over Q(sqrt(5))
    # z is conserved, and then x and x - z are invariant: different hyperplanes, the same modulo z.
    (system_of("x y z", "x*(x - z)", "y^2 + x + 1", "0"), ((0, 0, 1),), {"x": "x - z", "x - z": "x"}),
    (system_of("x y", "0", "0"), ((1, 0), (0, 1)), {}),
]


@pytest.mark.parametrize(("system", "integrals", "functions"), KNOWN)
def test_known_affine_integrals_and_hyperplanes(system, integrals, functions):
    found = affine_darboux(system)
    assert (found.complete, found.reason, affine_integrals(system)) == (True, "", integrals)
    assert {str(d.function): str(d.cofactor) for d in found.functions} == functions


@pytest.mark.parametrize(
    ("system", "words", "functions"),
    [
        (system_of("x y", "x", "y"), "infinitely many", ["x", "y"]),
        # The flow does not move on x = 0, where others may hide.
        (system_of("x y z", "x*(1 + y)", "x*(z - 2)", "x*(y - 3*z)"), "degenerates", ["x"]),
    ],
)
def test_where_hyperplanes_are_not_counted(system, words, functions):
    found = affine_darboux(system)
    assert (found.complete, words in found.reason) == (False, True)
    assert [str(d.function) for d in found.functions] == functions


def test_in_a_large_dimension_hyperplanes_are_not_counted():
    names = [f"x{i}" for i in range(25)]
    large = affine_darboux(system_of(" ".join(names), *(f"{x}*({x} + x{i // 2})" for i, x in enumerate(names))))
    assert not large.complete
    assert {str(d.function) for d in large.functions} >= {"x0", "x24"}


@st.composite
def with_hyperplane(draw: st.DrawFn) -> tuple[QuadraticSystem, fmpq_mat]:
    """A system x_i' = x_i L_i and x_j' = anything, in random linear coordinates, and the forms x_i there."""
    system = draw(systems((2, 3)))
    n = system.dim
    entries = draw(st.lists(st.integers(-3, 3), min_size=n * n, max_size=n * n))
    T = fmpq_mat(n, n, entries)
    if T.det() == 0:
        T = QQ.identity(n)
    gens = system.rhs[0].context().gens()
    first = gens[0] * (system.rhs[0].derivative(1) + draw(st.integers(-3, 3)))
    rhs = (first, *system.rhs[1:])
    moved = linear_combinations(T, gens)  # y = T x
    context = gens[0].context()
    in_x = tuple(component.compose(*moved, ctx=context) for component in rhs)
    return QuadraticSystem(linear_combinations(T.inv(), in_x)), T


@given(with_hyperplane(), st.integers(0, 100))
def test_planted_hyperplanes_are_found_and_kept_by_the_kahan_map(case, seed):
    system, T = case
    n = system.dim
    planted = [T[0, j] for j in range(n)]
    polynomials = affine_darboux(system)
    integrals = affine_integrals(system)
    if polynomials.complete:
        # An integral, or one of those found up to integrals.
        forms = [[fmpq(entry) for entry in v] for v in integrals]
        normals = [[d.function.derivative(j).leading_coefficient() for j in range(n)] for d in polynomials.functions]
        assert any(
            rank(QQ, fmpq_mat([*forms, *extra, planted])) == len(forms) + len(extra)
            for extra in [[], *([v] for v in normals)]
        )
    phi = KahanMap(system, fmpq(1, 7))
    x = random_point(n, seed)
    if phi.determinant(x) != 0:
        image = phi.step(x)
        for v in integrals:
            assert sum(c * a for c, a in zip(v, x, strict=True)) == sum(c * a for c, a in zip(v, image, strict=True))
        for d in polynomials.functions:
            before, after = (evaluate(d.function, QQ, point) for point in (x, image))
            assert after * (1 - fmpq(1, 7) * evaluate(d.cofactor, QQ, x)) == before * (
                1 + fmpq(1, 7) * evaluate(d.cofactor, QQ, image)
            )


# At a named eps

LOTKA_VOLTERRA = load("lotka_volterra").system
CHAIN = system_of("x y z", "x*(2 + y)", "y*(1 + x - z)", "z*(y - 3)")


def images_of(system: QuadraticSystem, function: fmpq_mpoly, eps: fmpq) -> list[tuple[fmpq, ...] | None]:
    """The images of points of the line or plane function = 0, None for one that has none."""
    n = system.dim
    slopes = [fmpq(function[tuple(int(i == j) for i in range(n))]) for j in range(n)]
    k = next(j for j in range(n) if slopes[j] != 0)
    images: list[tuple[fmpq, ...] | None] = []
    for number in range(2, 8):
        x = [fmpq(number**2 + 3 * j + 1, number + j) for j in range(n)]
        x[k] -= evaluate(function, QQ, x) / slopes[k]
        assert evaluate(function, QQ, x) == 0
        try:
            images.append(KahanMap(system, eps).step(x))
        except SingularStep:
            images.append(None)
    return images


@pytest.mark.parametrize("eps", [fmpq(p, q) for p, q in ((1, 1), (-1, 1), (1, 2), (1, 3), (7, 1))])
@pytest.mark.parametrize("system", [LOTKA_VOLTERRA, CHAIN], ids=["plane", "space"])
@pytest.mark.parametrize("scales", [(1, 1, 1), (10**6, 1, fmpq(1, 7))], ids=str)
def test_what_the_map_makes_of_a_hyperplane_is_seen_at_its_points(system, eps, scales):
    n = system.dim
    D = diagonal(scales[:n])
    system = system.composed(D.inv(), [fmpq(0)] * n).transformed(D)
    for entry in affine_darboux(system).functions:
        fate, images = under_map(system, entry.function, eps), images_of(system, entry.function, eps)
        images = [image for image in images if image is not None]
        if fate == "undefined":
            assert images == []
            continue
        assert len(images) > n
        assert all(evaluate(entry.function, QQ, list(image)) == 0 for image in images)
        differences = [[a - b for a, b in zip(image, images[0], strict=True)] for image in images[1:]]
        spanned = rank(QQ, fmpq_mat(differences))
        assert spanned == n - 1 if fate == "invariant" else spanned < n - 1


def test_a_determinant_that_is_too_long_decides_nothing(monkeypatch):
    monkeypatch.setattr(affine_functions, "_BUDGET", 0)
    x, y = LOTKA_VOLTERRA.rhs[0].context().gens()
    assert [under_map(LOTKA_VOLTERRA, function, fmpq(1)) for function in (x, y)] == ["undecided", "undecided"]
    assert under_map(LOTKA_VOLTERRA, x, fmpq(2)) == "invariant"  # shown by a point
