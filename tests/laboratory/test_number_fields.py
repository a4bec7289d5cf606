"""Integrals, densities and heights of maps with an algebraic number: found modulo primes, proved over Q[t]/g."""

import pytest
from helpers import refuses

import kahanmaps as km
from kahanmaps import GF, Certainty, reconstruct
from kahanmaps.algebra.roots import parse_root
from kahanmaps.errors import BadPrime
from kahanmaps.laboratory.laboratory import reconstruct_at

TOP = "x' = a*y*z; y' = -x*z; z' = x*y"
CUBIC = "root of t^3 - t - 1"


@pytest.mark.parametrize(
    ("equations", "a", "count"), [(TOP, "root of t^2 + 1", 2), ("x' = y; y' = a*x^2 - 1", CUBIC, 1)]
)
def test_integrals_and_densities_are_found_and_proved_over_the_number_field(equations, a, count):
    file = km.System(equations, a=a)
    integrals, densities = km.find_integrals(file), km.find_density(file)
    assert [str(integral.verdict) for integral in integrals.integrals] == ["proved"] * count
    assert integrals.codimension == count
    assert densities.densities[0].verdict is Certainty.PROVED
    # What is printed is read back, and checked by another way.
    read = km.parse_system("\n".join([file.to_toml(), integrals.toml_section(), densities.toml_section()]))
    assert km.check_integrals(read).verdict is km.check_measure(read).verdict is Certainty.PROVED


def test_what_was_found_for_one_number_is_refuted_for_others():
    result = km.find_integrals(km.System(TOP, a="root of t^2 - 2")).toml_section()
    for other, expected in (("root of t^2 - 2", Certainty.PROVED), ("root of t^2 - 3", Certainty.REFUTED)):
        file = km.parse_system(km.System(TOP, a=other).to_toml() + result)
        assert km.check_integrals(file).verdict is expected


def test_coefficients_are_reconstructed_from_all_roots():
    root = parse_root(CUBIC)

    def box(p, point):
        t, eps = point
        return [(1 + 3 * t * t * eps) * pow(1 - t * eps, -1, p), 7]

    result = reconstruct_at(root, box, ["a", "eps"]).functions
    field = GF(2**61 - 1)
    with pytest.raises(BadPrime):
        parse_root("root of t^2 + 1").over(GF(2**61 - 1))  # so that this is no accident of the prime
    t, eps = root.over(field), field.convert(5)
    assert result[0].value(field, (t, eps)) == (1 + 3 * t * t * eps) / (1 - t * eps)
    assert result[1].value(field, (t, eps)) == 7

    # Another value at one of the roots only is no function of the root.
    def wrong(p, point):
        return [point[0] ** 2 * (min(root.residues(GF(p))) == point[0])]

    assert reconstruct_at(root, wrong, ["a"], max_samples=60).functions is None
    assert reconstruct_at(None, lambda p, point: [3], ()).functions == reconstruct(lambda p, point: [3], ()).functions


def test_commuting_systems_over_a_number_field_are_found_and_commute():
    def solved(equations: str, a: str, **options) -> km.CommutingSystems:
        return km.find_commuting(km.System(equations, a=a), **options)

    squares = solved("x' = a*x^2; y' = y^2", "root of t^2 - 2")
    assert (squares.complete, squares.dimension) == (True, 2)
    (family,) = squares.families
    assert {tuple(g.rhs) for g in family.directions} >= {("x^2*a", "0"), ("0", "y^2*a"), ("2*x^2", "0")}
    f = km.System("x' = a*x^2; y' = y^2", a="root of t^2 - 2")
    for g in family.directions:
        assert km.check_commute(f, km.System(dict(zip("xy", g.rhs, strict=True)), a="root of t^2 - 2")).holds
    assert [g.trivial for g in solved(TOP, CUBIC).solutions] == ["0", "f", "-f"]
    # x' = a^2 x, y' = 2 y: for a^2 = 2 the matrix of f is a multiple of 1, and every linear field commutes with it.
    assert solved("x' = a^2*x; y' = 2*y", "root of t^2 - 2").dimension == 4
    assert solved("x' = a^2*x; y' = 2*y", "root of t^2 - 3").dimension == 2
    refuses("found a variable t", solved, "t' = a*t^2", "root of t^2 - 2")
    refuses("expected a quadratic vector field without eps", km.find_commuting, "lyness")
