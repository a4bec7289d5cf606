"""Deciding identities at random points over GF(p), p random: supported with a stated error bound, or refuted.

Witnesses are computed a second time.
"""

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import pytest
from check_helpers import exact, verify_witness
from flint import fmpq
from helpers import fraction, rationals
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.bounds import BoundField, CoefficientSize
from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.decide import Identity, decide, log2_error, small_points
from kahanmaps.errors import SingularMatrix, SingularStep

SUPPORTED, REFUTED, UNDECIDED = Certainty.SUPPORTED, Certainty.REFUTED, Certainty.UNDECIDED


@dataclass(frozen=True)
class Stated(Identity):
    """An identity with any bound for its equation and its poles."""

    stated: tuple[CoefficientSize, int] = (CoefficientSize(1, 1.0), 0)

    @property
    def bound(self):
        return self.stated


def identity_of(
    left: Callable[[Any, Any, Field], Any],
    right: Callable[[Any, Any, Field], Any],
    *,
    degree: int = 4,
    bits: float = 10.0,
    poles: int = 0,
    eps: fmpq | None = None,
    defined: Callable[[Any, Field], bool] = lambda x, field: True,
) -> Identity:
    """left(x, eps) = right(x, eps) in one variable, where `defined`."""

    def sides(field, point, eps_value):
        (x,) = point
        return ([left(x, eps_value, field)], [right(x, eps_value, field)]) if defined(x, field) else None

    return Stated(1, sides, eps, seed_data=(), stated=(CoefficientSize(degree, bits), poles))


def counted(identity: Identity) -> tuple[Identity, list[Field]]:
    """The identity, and a list that fills with the fields it is evaluated over."""
    fields: list[Field] = []

    def sides(field, point, eps_value):
        fields.append(field)
        return identity.sides(field, point, eps_value)

    return replace(identity, sides=sides), fields


def square_left(x: Any, e: Any, K: Field) -> Any:
    return (x + e) * (x - e)


def square_right(x: Any, e: Any, K: Field) -> Any:
    return x * x - e * e


TRUE = identity_of(square_left, square_right)


@pytest.mark.parametrize("error_bits", [1, 100, 300])
def test_as_many_points_are_tried_as_the_bound_needs_and_all_are_reported(error_bits):
    identity, fields = counted(TRUE)
    data = decide(identity, 0, error_bits).evidence.data
    assert len(fields) == data["points"] == math.ceil(error_bits / -log2_error(*TRUE.bound))
    assert [str(field.prime) for field in fields] == data["primes"]


# The error of one trial, from the sources: bad primes among more than 3N/(5 ln N), roots at most degree/p


@given(st.integers(0, 10**9), st.integers(1, 10**9), st.integers(0, 10**9))
def test_the_error_of_a_trial_covers_bad_primes_and_roots(degree, bits, poles):
    N = Fraction(2**62)
    primes = Fraction(3, 5) * N / Fraction(math.log(2**62))
    bad = Fraction(max(1, math.ceil(bits / 62)), 1) / primes
    roots = Fraction(degree) / N
    result = log2_error(CoefficientSize(degree, float(bits)), poles)
    # At most floor(bits/62) primes divide a coefficient; ceil is one more at the most.
    # Doubled: given that no denominator vanishes, which is more likely than not.
    assert result <= math.log2(2 * (bad + roots)) + 1e-9
    assert result >= math.log2(2 * (max(1, bits // 62) / primes + roots)) - 1e-9


@pytest.mark.parametrize(("conjugates", "bits"), [(2, 62), (24, 6200.0)])
def test_coefficients_in_a_number_field_of_degree_c_multiply_the_bad_primes_by_2_c_squared(conjugates, bits):
    """A norm is c times as long, and at least 1/(2 c) of the primes split: half of what Chebotarev's density gives."""
    size = CoefficientSize(0, float(bits))
    assert log2_error(size, 0, conjugates) - log2_error(size, 0) == pytest.approx(math.log2(2 * conjugates**2))


@given(
    st.lists(rationals(50), min_size=1, max_size=6), st.lists(rationals(50), min_size=1, max_size=6), st.integers(0, 5)
)
def test_two_polynomials_are_refuted_exactly_when_they_differ(first, second, seed):
    def value(coefficients):
        return lambda x, e, K: sum((K.convert(c) * x**k for k, c in enumerate(coefficients)), K.zero)

    decision = decide(identity_of(value(first), value(second), degree=6, bits=200.0), seed)
    padded = [list(c) + [fmpq(0)] * (6 - len(c)) for c in (first, second)]
    assert decision.verdict is (SUPPORTED if padded[0] == padded[1] else REFUTED)
    if decision.witness is not None:
        (x,) = exact(*decision.witness.point)
        sides = [[sum(fraction(c) * x**k for k, c in enumerate(coefficients))] for coefficients in (first, second)]
        verify_witness(decision.witness, *sides)


def test_an_identity_that_holds_at_every_small_point_that_is_tried_is_refuted_by_a_high_one():
    # The points that are tried follow `seed_data`, which is () here: whoever knows them can hide the failure from them.
    seed = 3
    place = identity_of(square_left, square_right).seed(seed)
    hidden = {point[0] for point in small_points(1, random.Random(f"witness {place}"), 400)}

    def product(x, e, K):
        value = K.one
        for a in hidden:
            value = value * (x - K.convert(a))
        return value

    decision = decide(identity_of(product, lambda x, e, K: K.zero, degree=len(hidden), bits=5000.0), seed)
    assert decision.verdict is REFUTED
    (x,) = exact(*decision.witness.point)
    assert abs(x) > 10**9
    verify_witness(decision.witness, [math.prod(x - fraction(a) for a in hidden)], [Fraction(0)])


def test_where_no_rational_point_shows_it_the_witness_is_modular():
    identity = identity_of(lambda x, e, K: x, lambda x, e, K: -x, defined=lambda x, field: field is not QQ)
    decision = decide(identity, 0)
    assert decision.verdict is REFUTED
    p = int(decision.evidence.data["prime"])
    assert decision.witness.field == f"GF({p})"
    x = int(decision.witness.point[0])
    assert (decision.witness.left, decision.witness.right) == ((str(x),), (str(p - x),))


def one_eps(eps: fmpq | None) -> Identity:
    """x eps = x/3: true at eps = 1/3 alone."""
    return identity_of(lambda x, e, K: x * e, lambda x, e, K: x / K.convert(3), eps=eps)


@pytest.mark.parametrize("eps", [None, fmpq(1, 3) + fmpq(1, 10**60)])
def test_an_identity_that_holds_at_one_eps_is_supported_there_and_refuted_elsewhere(eps):
    assert decide(one_eps(fmpq(1, 3)), 0).verdict is SUPPORTED
    decision = decide(one_eps(eps), 0)
    assert decision.verdict is REFUTED
    (x,), (at,) = exact(*decision.witness.point), exact(decision.witness.eps)
    assert eps is None or at == fraction(eps)
    verify_witness(decision.witness, [x * at], [x / 3])


def raises(error):
    def sides(field, point, eps):
        raise error("no value")

    return sides


@pytest.mark.parametrize(
    "sides",
    [lambda field, point, eps: None, raises(SingularStep), raises(SingularMatrix)],
    ids=["pole", "singular step", "singular matrix"],
)
def test_an_identity_defined_nowhere_is_undecided(sides):
    decision = decide(Identity(1, sides, None, seed_data=()), 0)
    assert decision.verdict is UNDECIDED
    assert decision.witness is None
    assert "a denominator seems to vanish identically" in decision.evidence.summary


@pytest.mark.parametrize(("factor", "verdict"), [(1, UNDECIDED), (2, REFUTED)])
def test_an_identity_without_values_over_bounds_has_no_bound_and_is_not_supported(factor, verdict):
    def sides(field, point, eps):
        return None if isinstance(field, BoundField) else (list(point), [factor * point[0]])

    decision = decide(Identity(1, sides, None, seed_data=()), 0)
    assert decision.verdict is verdict
    assert ("no values over bounds" in decision.evidence.summary) == (verdict is UNDECIDED)


def test_an_identity_defined_at_half_of_the_points_is_decided_there():
    def is_square(x, field):
        return field is QQ or pow(int(x), (field.prime - 1) // 2, field.prime) == 1

    decision = decide(identity_of(square_left, square_right, defined=is_square), 1, 1000)
    assert decision.verdict is SUPPORTED
    assert decision.evidence.data["poles_met"] > 0


@pytest.mark.parametrize("degree", [2**61, 10**400])
def test_an_identity_of_too_large_a_degree_is_undecided(degree):
    identity, fields = counted(identity_of(square_left, square_right, degree=degree))
    decision = decide(identity, 0)
    assert decision.verdict is UNDECIDED
    assert fields == []
    assert decision.evidence.data["degree_bound"] == degree
    # With as many poles the few points that are left may all be roots.
    assert decide(identity_of(square_left, square_right, degree=1, poles=degree), 0).verdict is UNDECIDED
