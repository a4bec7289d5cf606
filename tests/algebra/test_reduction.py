"""Bad primes of elliptic curves over Q against PARI's minimal models, and numbers that are not factored."""

import random

from flint import fmpq, fmpq_poly, fmpz
from helpers import gp

from kahanmaps.algebra.elliptic_curves import EllipticCurve
from kahanmaps.algebra.reduction import bad_primes, bad_primes_of_plane, factor_within_bound, newton_slopes

LARGE = fmpz(10**40 + 121) * (10**60 + 7)  # two primes


def curves():
    """Random curves, also with sixth powers, which a minimal model removes."""
    rng = random.Random(3)
    for _ in range(60):
        scale = rng.choice((1, 2, 3, 4, 5, 6, 12))
        yield EllipticCurve(
            *(fmpq(rng.randint(-50, 50) * scale ** (2 * k), rng.choice((1, 1, 2, 3))) for k in (1, 2, 3))
        )


def test_bad_primes_and_minimal_discriminants_agree_with_pari():
    smooth = [curve for curve in curves() if curve.discriminant != 0]
    found = [bad_primes(curve) for curve in smooth]
    rng = random.Random(4)
    for _ in range(60):
        delta = fmpq(rng.randint(1, 99), rng.randint(1, 99)) * rng.choice((1, -(6**6), 5**6, 35))
        if delta != 1:
            gamma = 1 - delta
            smooth.append(EllipticCurve(9 + 3 * gamma, 48 * gamma, 64 * gamma**2))
            found.append(bad_primes_of_plane(gamma))
    script = "\n".join(f"print(ellminimalmodel(ellinit([0,{E.a2},0,{E.a4},{E.a6}])).disc)" for E in smooth)
    lines = gp(script)
    assert len(lines) == len(smooth)
    for result, line in zip(found, lines, strict=True):
        assert result.minimal_discriminant == int(line)
        assert list(result.bad) == sorted(int(p) for p, _ in abs(fmpz(int(line))).factor())


def test_what_is_not_factored_is_reported():
    assert factor_within_bound(-12 * LARGE) == ({2, 3}, {int(LARGE)})
    assert factor_within_bound(fmpz(1)) == (set(), set())
    multiplicative = bad_primes_of_plane(1 + fmpq(7) / LARGE)
    assert int(LARGE) in multiplicative.bad_cofactors
    assert "and all primes of" in multiplicative.text
    additive = bad_primes_of_plane(1 + fmpq(LARGE) / 7)
    assert int(LARGE) in additive.undecided_cofactors
    assert additive.minimal_discriminant is None
    assert "undecided: primes of" in additive.text


def test_slopes_of_a_product_are_those_of_its_factors():
    polynomial = fmpq_poly([-3, 1]) * fmpq_poly([fmpq(-1, 9), 1]) * fmpq_poly([-27, 0, 1]) * fmpq_poly([2, 1])
    assert newton_slopes(polynomial, 3) == {fmpq(1), fmpq(-2), fmpq(3, 2), fmpq(0)}
