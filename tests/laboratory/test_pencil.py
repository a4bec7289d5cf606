"""The curves of a planar integral: their genus and base points, known from elsewhere, and what must not be said."""

import random
from dataclasses import replace

import pytest
from check_helpers import claim
from search_helpers import analysis_of

from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.conclusion import contradictions
from kahanmaps.laboratory.preserve.poisson import pencil as module
from kahanmaps.laboratory.preserve.poisson.pencil import Pencil, pencil_of


def curves(text: str) -> Pencil | None:
    return pencil_of("I", claim(text, "x y"), None)


def summary(pencil: Pencil) -> tuple[int, int, int, dict[int, tuple[int, int]]]:
    """Components, degree, genus, and by multiplicity how many base points, and how many of them infinitely near."""
    points = {point.multiplicity: (point.count, point.infinitely_near) for point in pencil.base_points}
    return pencil.components, pencil.degree, pencil.genus, points


KNOWN = [  # by hand
    ("x*y", (1, 2, 0, {1: (4, 2)})),  # two asymptotes, each a tangent at infinity
    ("x^3 - y", (1, 3, 0, {2: (1, 0), 1: (5, 5)})),  # cusps at infinity
    ("y^2 - x^3 - x", (1, 3, 1, {1: (9, 8)})),  # Weierstrass form: all at the flex at infinity
    ("(x^4 + y^4 + x)/(x^3*y + y^2 + 1)", (1, 4, 3, {1: (16, 0)})),  # as two generic quartics
    ("(x^2*y^2 + 2*x + 5*y^2 + 3)/(x^2*y^2 + 3*x*y^2 + 7*x^2 + 1)", (1, 4, 1, {2: (2, 0), 1: (8, 0)})),  # QRT
    ("x*y*(x + y - 1)", (1, 3, 1, {1: (9, 6)})),  # three lines with the exponents 1, 1, 1
    ("x^2*y*(x + y - 1)", (1, 4, 1, {2: (2, 1), 1: (8, 6)})),  # 2, 1, 1
]


@pytest.mark.parametrize(("text", "known"), KNOWN)
def test_curves_that_are_known(text, known):
    assert summary(curves(text)) == known


@pytest.mark.parametrize("a", [-3, -1, 3])
def test_points_over_an_extension_count_as_often_as_they_have_conjugates(a):
    # Two double points at infinity, as those of bicircular quartics; then a double point with two tangents that all
    # curves have, on each of which they meet once more.
    at_infinity = curves(f"((x^2 + {a}*y^2)^2 + 2*x + 7*y^2 + 3)/((x^2 + {a}*y^2)*x + 7*x^2 + 1)")
    assert summary(at_infinity) == (1, 4, 1, {2: (2, 0), 1: (8, 0)})
    assert summary(curves(f"(y^2 + {a}*x^2 + x^3)/(x^4 + y^4)")) == (1, 4, 2, {2: (1, 0), 1: (12, 4)})


@pytest.mark.parametrize(("outer", "components"), [("({})^2", 2), ("(({0})^2 + 1)/({0})", 2), ("1/({})", 1)])
@pytest.mark.parametrize("text", ["x^2 + y^2", "(x^2*y + y^2 + 1)/(x*y + 2)"])
def test_of_curves_with_several_components_one_is_taken(text, outer, components):
    alone, composed = summary(curves(text)), summary(curves(outer.format(text)))
    assert composed == (components, *alone[1:])


@pytest.mark.parametrize("seed", range(4))
def test_the_genus_is_the_number_of_lattice_points_within_the_newton_polygon(seed):
    # Of generic coefficients; the polygon has the origin as a corner, for c is one of them.
    rng = random.Random(seed)
    a, b = rng.randint(2, 7), rng.randint(2, 7)
    corners = [(0, 0), (a, 0), (rng.randint(1, 5), rng.randint(1, 5)), (0, b)]
    inside = [(i, j) for i in range(1, 8) for j in range(1, 8) if _is_inside(i, j, corners)]
    terms = [f"{rng.randint(2, 10**6)}*x^{i}*y^{j}" for i, j in corners[1:] + inside + [(1, 0), (0, 1)]]
    assert curves(" + ".join(terms)).genus == len(inside)


def _is_inside(i: int, j: int, points: list[tuple[int, int]]) -> bool:
    """Whether a point is within the convex hull, and not on its edge."""
    for p in points:
        for q in points:
            sides = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for x, y in [*points, (i, j)]]
            if p != q and min(sides[:-1]) >= 0 and sides[-1] <= 0:
                return False
    return True


@pytest.mark.parametrize("text", ["y^2 - x^3 - x", "y^2 - x^5 - x"])
def test_the_genus_stays_under_birational_maps(text):
    before = curves(text).genus
    for x, y in [("(x + y^2)", "y"), ("(2*x - y)", "(x + 3)"), ("x", "(1/(x*y))")]:
        assert curves(text.replace("x", "X").replace("y", y).replace("X", x)).genus == before


def test_nothing_is_said_where_a_base_point_is_missed(monkeypatch):
    monkeypatch.setattr(module._ModularPlane, "_add_simple", lambda *_, **__: None)
    assert curves("x*y") is None


@pytest.mark.parametrize("name", ["nahm_tetrahedral", "qrt_symmetric"])
def test_the_genus_of_maps_of_the_catalogue_goes_with_their_growth(name):
    analysis = analysis_of(name)
    assert analysis.pencil is not None
    assert (analysis.pencil.genus, analysis.degrees.growth) == (1, Growth.QUADRATIC)
    assert "the map is a translation" in analysis.to_json()["invariant_curves"]["motion"]
    assert not contradictions(analysis)


@pytest.mark.parametrize(
    ("genus", "possible", "impossible"),
    [
        (0, [Growth.BOUNDED, Growth.LINEAR], [Growth.QUADRATIC]),
        (1, [Growth.QUADRATIC], [Growth.LINEAR]),
        (2, [Growth.BOUNDED, Growth.UNKNOWN], [Growth.LINEAR, Growth.QUADRATIC]),
    ],
)
def test_the_genus_allows_one_kind_of_growth(genus, possible, impossible):
    result = replace(curves("x*y"), genus=genus)
    assert [result.contradiction(growth) for growth in possible] == [""] * len(possible)
    assert all(result.contradiction(growth) for growth in impossible)


def test_a_genus_that_the_degrees_exclude_is_no_finding():
    analysis = analysis_of("weierstrass")
    wrong = replace(analysis, pencil=replace(analysis.pencil, genus=0))
    assert wrong.conclusion.kind == "undecided"
    assert "quadratic growth is impossible where the generic curve has genus 0" in wrong.conclusion.sentence
    assert [line.status for _, lines in wrong.sections for line in lines if "has genus 0" in line.text] == ["undecided"]
    assert wrong.to_json()["invariant_curves"] is None


def test_what_the_map_does_on_the_curves_is_said_where_it_follows():
    elliptic, rational, other = (curves(text) for text in ("y^2 - x^3 - x", "x*y", "y^2 - x^5 - x"))
    assert elliptic.motion(Growth.QUADRATIC) == "on it the map is a translation, since the degrees grow"
    assert elliptic.motion(Growth.BOUNDED) == rational.motion(Growth.LINEAR) == ""
    assert "finite order" in other.motion(Growth.UNKNOWN)
    assert "an iterate" in replace(elliptic, components=2).motion(Growth.QUADRATIC)
