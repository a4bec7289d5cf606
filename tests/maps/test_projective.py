"""The forms of a map on projective space over Q and GF(p), against the defining equation in Python's fractions."""

import itertools
import random
from fractions import Fraction

import pytest
from check_helpers import kahan_step, polynomial_value

from kahanmaps.algebra.fields import GF, QQ
from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.projective import homogeneous_map
from kahanmaps.systems.quadratic import QuadraticSystem

NAMES = ["x", "y", "z", "w"]


def dense(n, seed):
    """A system with all terms, those of degree 1 and 0 too."""
    rng = random.Random(f"dense {n} {seed}")
    names = NAMES[:n]
    terms = ["1", *names, *(f"{a}*{b}" for i, a in enumerate(names) for b in names[i:])]
    rhs = [
        " + ".join(f"({rng.choice((-1, 1)) * rng.randint(1, 9)}/{2 ** rng.randint(0, 2)})*{t}" for t in terms)
        for _ in names
    ]
    return QuadraticSystem.from_text(names, rhs)


@pytest.mark.parametrize(("n", "seed"), [(1, 0), (2, 0), (2, 1), (3, 0), (4, 0)])
def test_the_forms_at_an_affine_point_are_proportional_to_its_image(n, seed):
    system, rng = dense(n, seed), random.Random(seed)
    forms, factor, _ = homogeneous_map(KahanMap(system, "2/7", QQ))
    assert factor.is_constant()
    assert {int(form.total_degree()) for form in forms} == {n}
    for _ in range(3):
        x = [Fraction(rng.randint(-9, 9), rng.randint(1, 9)) for _ in range(n)]
        *above, below = (polynomial_value(form, [*x, 1]) for form in forms)
        assert below != 0
        assert tuple(entry / below for entry in above) == kahan_step(system, Fraction(2, 7), x)


@pytest.mark.parametrize(
    ("image", "degree"),
    [(["y", "-x + 3*y/(y^2 - 1)"], 3), (["y/x", "(x*z + 1)/(x*y)", "x/(y + 1)"], 3), (["1/x", "x*y", "z + y"], 3)],
)
def test_the_forms_of_an_explicit_map_are_its_minors_without_common_factor(image, degree):
    names, over = NAMES[: len(image)], GF(1000003)
    functions = [parse_rational_function(text, [*names, "eps"]) for text in image]
    equation = explicit_map(names, functions).at(1, over).equation
    assert equation.image_degree == degree
    rng = random.Random(degree)
    for last in (1, 1, 0):
        X = [over.convert(k) for k in (*(rng.randint(1, 9) for _ in names), last)]
        result = equation.image(X, over.zero)
        minors = kernel_minors(equation.rows(equation.monomials(X), over.zero))
        assert any(result) or not last
        assert all(a * d == b * c for (a, b), (c, d) in itertools.pairwise(zip(result, minors, strict=True)))
