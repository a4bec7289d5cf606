"""Rational functions from values modulo primes: the right ones, with few values, or none and a reason."""

import random
from collections.abc import Sequence
from math import comb

import pytest
from flint import fmpq
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.interpolation import Reconstruction, rational_reconstruction, reconstruct
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, monomials, ring
from kahanmaps.algebra.residues import from_residues

SPARE = 12  # values that confirm, or cover a round number


class Box:
    """The values of known functions modulo primes, counting the calls."""

    def __init__(self, functions: Sequence[RationalFunction]) -> None:
        self.functions = functions
        self.calls = 0

    def __call__(self, prime: int, point: tuple[int, ...]) -> tuple[int, ...] | None:
        self.calls += 1
        field = GF(prime)
        values = [f.value(field, [field.convert(entry) for entry in point]) for f in self.functions]
        return None if None in values else tuple(int(field.convert(value)) for value in values)


def functions(names: Sequence[str], *texts: str) -> list[RationalFunction]:
    return [parse_rational_function(text, names) for text in texts]


def reconstructed(known: Sequence[RationalFunction], names: Sequence[str]) -> Reconstruction:
    """The reconstruction, after checking that it gives the known functions in lowest terms."""
    box = Box(known)
    result = reconstruct(box, names)
    assert result.functions is not None, result.reason
    assert list(result.functions) == list(known)
    assert all(f.numerator.gcd(f.denominator).is_constant() for f in result.functions)
    assert result.samples == box.calls
    return result


def dense(names: Sequence[str], degree: int, rng: random.Random, height: int = 9) -> RationalFunction:
    """A function whose numerator and denominator have all monomials up to a degree."""
    exponents = [m for d in range(degree + 1) for m in monomials(len(names), d)]
    N, D = ({m: fmpq(rng.randint(1, height), rng.randint(1, 3)) for m in exponents} for _ in range(2))
    return RationalFunction(ring(names).from_dict(N), ring(names).from_dict(D))


COSTS = [  # names, functions, values, five of them to confirm, and primes
    ("", ["5/7"], 6, 6),
    ("x", ["(2*x + 1)/(x - 3)"], 9, 6),
    ("x", ["(1 + 3*x^2)/(1 - 5*x^4)"], 13, 6),
    ("xy", ["(x^2*y - 1/3)/(x + y + 5)"], 19, 6),
    ("xy", [f"{above}/(x*y + 1)" for above in ("x", "y^2", "(x + y)", "1", "(x - y)")] + ["3"], 19, 6),
    ("xy", ["(123456789123456789*x + 1)/(y - 987654321987654321)"], 15, 7),
    ("xyz", ["x*y*z", "(x + y)/(y + z)"], 19, 6),
]


@pytest.mark.parametrize(("names", "texts", "values", "primes"), COSTS)
def test_no_more_values_are_taken_than_are_needed(names: str, texts: list[str], values: int, primes: int):
    known = functions(list(names), *texts)
    result = reconstructed(known, list(names))
    assert (result.samples, len(result.primes)) == (values, primes)
    enough, too_few = (reconstruct(Box(known), list(names), max_samples=most) for most in (values, values - 1))
    assert (enough, too_few.functions) == (result, None)
    assert f"the limit is {values - 1}" in too_few.reason


small = st.builds(fmpq, st.integers(-20, 20), st.integers(1, 9))


@st.composite
def random_functions(draw: st.DrawFn) -> tuple[list[str], list[RationalFunction]]:
    names = ["eps", "a", "b"][: draw(st.integers(0, 3))]
    context = ring(names)
    exponents = [m for d in range(4) for m in monomials(len(names), d)]
    polynomials = st.dictionaries(st.sampled_from(exponents), small, max_size=5).map(context.from_dict)
    nonzero = polynomials.filter(lambda polynomial: not polynomial.is_zero())
    count = draw(st.integers(1, 3))
    entry = draw(nonzero)
    return names, [
        RationalFunction(draw(polynomials), entry if draw(st.booleans()) else draw(nonzero)) for _ in range(count)
    ]


@given(random_functions())
def test_random_functions(case: tuple[list[str], list[RationalFunction]]):
    names, known = case
    limit = 2 * comb(len(names) + 3, 3) if names else 0
    assert reconstructed(known, names).samples <= limit + 9 * len(names) + SPARE


@pytest.mark.parametrize("seed", range(10))
def test_a_box_that_is_not_rational_gives_none(seed: int):
    result = reconstruct(lambda p, x: [pow(x[0], (p - 1) // 2 + 3, p)], ["x"], seed=seed, max_degree=10)
    assert result.functions is None
    assert result.reason
    numbers = reconstruct(lambda p, point: [p], [], seed=seed, max_samples=50)
    assert numbers.functions == (RationalFunction(ring([]).constant(0), ring([]).constant(1)),)  # which p is modulo p
    # 2 is a square modulo every other prime: its root is not rational.
    roots = reconstruct(lambda p, point: [pow(2, (p + 1) // 4, p)], [], seed=seed, max_samples=50)
    assert roots.functions is None


def test_primes_at_which_the_box_is_wrong_are_left_out():
    names = ["x", "y"]
    box = Box([dense(names, 2, random.Random(1), height=10**60)])
    first = reconstruct(box, names).primes
    for bad in first[:2] + first[3:5]:

        def wrong(prime: int, point: tuple[int, ...], bad: int = bad) -> tuple[int, ...] | None:
            values = box(prime, point)
            if prime != bad or values is None:
                return values
            return ((values[0] + 1) * pow(point[0] ** 3 + 5, -1, prime) % prime,)

        assert reconstruct(wrong, names).functions == tuple(box.functions)


def test_a_prime_that_divides_coefficients():
    """The first prime kills the leading terms: what it finds does not fit the other primes."""
    names = ["x", "y"]
    prime = reconstruct(lambda p, point: point, names).primes[0]
    for text in (f"({prime}*x^3 + y)/(1 + x)", f"(x + y)/({prime}*y^2 + x)", f"x/{prime} + 1"):
        known = functions(names, text)
        box = Box(known)
        if text.startswith("x/"):  # no value modulo this prime at all
            result = reconstruct(lambda p, x, box=box: None if p == prime else box(p, x), names)
        else:
            result = reconstruct(box, names)
        assert result.functions == tuple(known)
        assert result.primes[0] == prime


@given(st.integers(2, 400), st.integers(0, 10**6))
def test_rational_reconstruction_is_unique_or_none(modulus: int, residue: int):
    within = {
        fmpq(n, d)
        for d in range(1, 15)
        for n in range(-14, 15)
        if 2 * d * d <= modulus - 1
        and 2 * n * n <= modulus - 1
        and fmpq(n, d).q == d
        and (n - residue * d) % modulus == 0
    }
    assert within == {x for x in [rational_reconstruction(residue, modulus)] if x is not None}


def test_numbers_from_residues_modulo_primes_as_many_as_it_takes():
    def residue(x, p):
        return int(x.p % p) * pow(int(x.q), -1, p) % p

    short, long = (fmpq(3, 7), fmpq(2, 5)), (fmpq(-7, 3**40), fmpq(10**60 + 7, 3**50))
    for groups in ([short, long], [long, short]):
        assert (
            from_residues(lambda p, groups=groups: [[residue(x, p) for x in entry] for entry in groups], 12) == groups
        )
        assert from_residues(lambda p, groups=groups: [[residue(x, p) for x in entry] for entry in groups], 4) is None
    requested = []
    assert from_residues(requested.append, 5) is None
    assert len(requested) == 1
    assert from_residues(lambda p: requested.append(p) or [[residue(short[0], p)]], 3) == [short[:1]]
    assert len(requested) == 4
