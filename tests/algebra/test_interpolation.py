"""Rational functions from values modulo primes: the right ones, with few values, or none and a reason."""

from __future__ import annotations

import random
import time
from collections.abc import Sequence
from math import comb

import pytest
from flint import fmpq
from hypothesis import given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.interpolation import (
    Reconstruction,
    rational_reconstruction,
    rational_vector,
    reconstruct,
)
from kahanmaps.algebra.modular_fit import Quotient, Shape
from kahanmaps.algebra.polynomials import RationalFunction, monomials, ring
from kahanmaps.algebra.residues import _common_denominator, chinese, random_prime
from kahanmaps.algebra.written.text import parse_rational_function
from kahanmaps.errors import InputError

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


def found(known: Sequence[RationalFunction], names: Sequence[str]) -> Reconstruction:
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


@pytest.mark.parametrize(("symbols", "degree"), [(1, 30), (2, 10), (3, 5), (3, 8), (4, 3), (4, 6)])
def test_a_dense_function_costs_its_number_of_coefficients(symbols: int, degree: int) -> None:
    names = ["eps", "a1", "a2", "a3"][:symbols]
    result = found([dense(names, degree, random.Random(symbols))], names)
    assert result.samples <= 2 * comb(symbols + degree, symbols) + 6 * (symbols + 1)


def test_functions_of_eps_squared_cost_half() -> None:
    even = functions(["eps"], "(1 + 3*eps^2 + eps^20)/(1 - 5*eps^18 + eps^4)")
    # Along its axis the degrees count, not the terms; nothing else is needed for one symbol.
    assert found(even, ["eps"]).samples <= 38 + SPARE
    two = functions(["eps", "a"], "(1 + a^2*eps^2 + a^8*eps^8 + a)/(7 + a^3*eps^6 - 2*eps^8)")
    assert found(two, ["eps", "a"]).samples <= 18 + 14 + 18 + SPARE


def test_sparse_functions_cost_less_than_dense_ones() -> None:
    names = ["x", "y", "z"]
    result = found(functions(names, "(x^8 + 5*y^3*z^5 - 2/3)/(x*y*z + z^7 + 1/2*y^2)"), names)
    assert result.samples < comb(11, 3)  # a third of the number for all monomials


def test_entries_with_one_denominator_share_its_coefficients() -> None:
    rng = random.Random(3)
    names = ["x", "y"]
    below = dense(names, 8, rng).denominator
    entries = [RationalFunction(dense(names, 8, rng).numerator, below) for _ in range(5)]
    alone = found(entries[:1], names).samples
    assert found(entries, names).samples < 0.9 * alone


def test_zero_and_constant_entries_are_cheap() -> None:
    names = ["a", "b"]
    result = found(functions(names, "0", "3/7", "-1", "a", "1/b", "a/b", "a + b"), names)
    assert result.samples <= 15


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
def test_no_more_values_are_taken_than_are_needed(names: str, texts: list[str], values: int, primes: int) -> None:
    known = functions(list(names), *texts)
    result = found(known, list(names))
    assert (result.samples, len(result.primes)) == (values, primes)
    enough, too_few = (reconstruct(Box(known), list(names), max_samples=most) for most in (values, values - 1))
    assert (enough, too_few.functions) == (result, None)
    assert f"the limit is {values - 1}" in too_few.reason


def test_high_coefficients_take_more_primes() -> None:
    rng = random.Random(8)
    result = found([dense(["a", "b"], 3, rng, height=10**40)], ["a", "b"])
    assert 5 < len(result.primes) < 20
    small = found([dense(["a", "b"], 3, rng)], ["a", "b"])
    assert len(small.primes) == 6  # one to find it, five to confirm


def test_no_symbols() -> None:
    numbers = functions([], "0", "1", "-22/7", "123456789123456789123456789/1000000007")
    assert len(found(numbers, []).primes) < 15
    assert reconstruct(lambda p, point: (), []).functions == ()


small = st.builds(fmpq, st.integers(-20, 20), st.integers(1, 9))


@st.composite
def random_functions(draw: st.DrawFn) -> tuple[list[str], list[RationalFunction]]:
    names = ["eps", "a", "b"][: draw(st.integers(0, 3))]
    context = ring(names)
    exponents = [m for d in range(4) for m in monomials(len(names), d)]
    polynomials = st.dictionaries(st.sampled_from(exponents), small, max_size=5).map(context.from_dict)
    nonzero = polynomials.filter(lambda polynomial: not polynomial.is_zero())
    count = draw(st.integers(1, 3))
    one = draw(nonzero)
    return names, [
        RationalFunction(draw(polynomials), one if draw(st.booleans()) else draw(nonzero)) for _ in range(count)
    ]


@settings(max_examples=60)
@given(random_functions())
def test_random_functions(case: tuple[list[str], list[RationalFunction]]) -> None:
    names, known = case
    limit = 2 * comb(len(names) + 3, 3) if names else 0
    assert found(known, names).samples <= limit + 9 * len(names) + SPARE


def test_bad_points_are_passed_over() -> None:
    box = Box(functions(["x", "y"], "(x + y^2)/(1 - x*y)"))

    def often_none(prime: int, point: tuple[int, ...]) -> tuple[int, ...] | None:
        return None if sum(point) % 3 == 0 else box(prime, point)

    result = reconstruct(often_none, ["x", "y"])
    assert result.functions == tuple(box.functions)
    assert result.samples > box.calls


def test_a_few_primes_may_fail_before_the_box_is_blamed() -> None:
    box, seen = Box(functions(["x"], "123456789123456789123456789*x")), list[int]()

    def modulo_one_prime(prime: int, point: tuple[int, ...]) -> tuple[int, ...] | None:
        seen.append(prime)
        return box(prime, point) if prime == seen[0] else None

    result = reconstruct(modulo_one_prime, ["x"])
    # the first one, three that do not lift it, and two more that are no better to begin with
    assert (result.functions, len(result.primes), len(set(seen))) == (None, 6, 6)


def test_a_box_without_values_gives_none() -> None:
    result = reconstruct(lambda p, point: None, ["x"])
    assert (result.functions, result.samples) == (None, 60)
    assert "no value" in result.reason
    assert reconstruct(lambda p, point: None, []).functions is None


@pytest.mark.parametrize("seed", range(10))
def test_a_box_that_is_not_rational_gives_none(seed: int) -> None:
    result = reconstruct(lambda p, x: [pow(x[0], (p - 1) // 2 + 3, p)], ["x"], seed=seed, max_degree=10)
    assert result.functions is None
    assert result.reason
    numbers = reconstruct(lambda p, point: [p], [], seed=seed, max_samples=50)
    assert numbers.functions == (RationalFunction(ring([]).constant(0), ring([]).constant(1)),)  # which p is modulo p
    # 2 is a square modulo every other prime: its root is not rational.
    roots = reconstruct(lambda p, point: [pow(2, (p + 1) // 4, p)], [], seed=seed, max_samples=50)
    assert roots.functions is None


def test_functions_that_are_rational_modulo_each_prime_only() -> None:
    """The coefficient p^2 // 10 mod p, with a different rational function modulo each prime."""
    result = reconstruct(lambda p, x: [(p * p // 10 % p) * x[0] % p], ["x"], max_samples=100)
    assert result.functions is None
    assert "the limit is 100" in result.reason


def test_primes_at_which_the_box_is_wrong_are_left_out() -> None:
    names = ["x", "y"]
    box = Box([dense(names, 2, random.Random(1), height=10**60)])
    first = reconstruct(box, names).primes
    for bad in first[:2] + first[3:5]:

        def wrong(prime: int, point: tuple[int, ...], bad: int = bad) -> tuple[int, ...] | None:
            values = box(prime, point)
            if prime != bad or values is None:
                return values
            return ((values[0] + 1) * pow(point[0] ** 3 + 5, -1, prime) % prime,)

        result = reconstruct(wrong, names)
        assert result.functions == tuple(box.functions)


def test_a_prime_that_divides_coefficients() -> None:
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


def test_limits() -> None:
    known = [dense(["x", "y"], 6, random.Random(2))]
    few = reconstruct(Box(known), ["x", "y"], max_samples=30)
    assert few.functions is None
    assert few.samples <= 30
    assert "the limit is 30" in few.reason
    low = reconstruct(Box(known), ["x", "y"], max_degree=5)
    assert low.reason == "not the values of a rational function of degree at most 5 along a line"
    late = reconstruct(Box(known), ["x", "y"], deadline=time.monotonic() - 1)
    assert (late.functions, late.samples) == (None, 0)
    assert "time" in late.reason

    def slow(prime: int, point: tuple[int, ...]) -> tuple[int, ...] | None:
        time.sleep(0.01)
        return Box(known)(prime, point)

    start = time.monotonic()
    assert reconstruct(slow, ["x", "y"], deadline=start + 0.1).functions is None
    assert time.monotonic() - start < 0.5


def test_the_seed_decides() -> None:
    known = functions(["x"], "(x^2 + 1)/(x - 3)")
    assert reconstruct(Box(known), ["x"], seed=4).primes == reconstruct(Box(known), ["x"], seed=4).primes
    assert reconstruct(Box(known), ["x"], seed=4).primes != reconstruct(Box(known), ["x"], seed=5).primes


def test_values_of_different_lengths_are_refused() -> None:
    with pytest.raises(InputError, match="lengths"):
        reconstruct(lambda p, point: [1] * (1 + point[0] % 2), ["x"])


@given(st.integers(-(10**9), 10**9), st.integers(1, 10**9))
def test_rational_reconstruction(n: int, d: int) -> None:
    modulus = 2**61 - 1
    x = fmpq(n, d)
    assert rational_reconstruction(int(x.p) * pow(int(x.q), -1, modulus), modulus) == x


@given(st.integers(2, 400), st.integers(0, 10**6))
def test_rational_reconstruction_is_unique_or_none(modulus: int, residue: int) -> None:
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


@given(st.lists(small, max_size=12), st.integers(1, 10**6))
def test_vectors_of_rationals(numbers: list[fmpq], below: int) -> None:
    modulus = 2**61 - 1
    numbers = [x / below for x in numbers]
    residues = [int(x.p) * pow(int(x.q), -1, modulus) % modulus for x in numbers]
    assert rational_vector(residues, modulus) == tuple(numbers)


@pytest.mark.parametrize("count", [2, 3, 7])
def test_few_numbers_over_one_denominator_may_be_higher_than_one_alone(count: int) -> None:
    """For k numbers the bound is about m^(k/(k+1)), so 2^40 for two of them, where one alone has to be below 2^30."""
    modulus, below = 2**61 - 1, 2**34 + 25
    numbers = tuple(fmpq(2**34 - 3**k, below) for k in range(5, 5 + count))
    residues = [int(x.p) * pow(int(x.q), -1, modulus) % modulus for x in numbers]
    assert all(rational_reconstruction(residue, modulus) != x for residue, x in zip(residues, numbers, strict=True))
    assert rational_vector(residues, modulus) == numbers


@pytest.mark.parametrize(("bits", "is_one"), [(40, True), (49, False)])
def test_a_number_above_the_bound_is_not_taken_over_the_denominator_of_the_others(bits: int, is_one: bool) -> None:
    """Every other of eight numbers says what the denominator is: the bound is m^(4/5)/2^4, about 2^44.8."""
    modulus, below = 2**61 - 1, 2**34 + 25
    numbers = [fmpq(2**34 - 3**k, below) for k in range(5, 13)]
    numbers[3] = fmpq(2**bits + 1, below)
    residues = [int(x.p) * pow(int(x.q), -1, modulus) % modulus for x in numbers]
    assert rational_vector(residues, modulus) == (tuple(numbers) if is_one else None)


@pytest.mark.parametrize("count", [2, 3, 7])
def test_chance_gives_no_common_denominator(count: int) -> None:
    rng, modulus, below = random.Random(count), 2**61 - 1, 2**20 + 7
    found = [_common_denominator([rng.randrange(modulus) for _ in range(count)], modulus) for _ in range(100)]
    assert found == [None] * 100
    assert _common_denominator([k * pow(below, -1, modulus) % modulus for k in range(3, 3 + count)], modulus) == below


def test_residues_without_simple_numbers() -> None:
    rng = random.Random(1)
    assert rational_vector([rng.randrange(2**61 - 1) for _ in range(9)], 2**61 - 1) is None


def test_chinese_remainders() -> None:
    assert chinese([2, 0], 3, [3, 4], 5) == [8, 9]


@pytest.mark.parametrize(("bits", "primes"), [(2, {2, 3}), (3, {5, 7}), (5, {17, 19, 23, 29, 31})])
def test_random_primes_are_all_those_of_so_many_bits(bits: int, primes: set[int]) -> None:
    assert {random_prime(random.Random(k), bits) for k in range(60)} == primes


@pytest.mark.parametrize("prime", [7, 101, 2**61 - 1])
def test_numerators_up_to_a_factor_are_equal_where_they_are_multiples(prime: int) -> None:
    shape = Shape(((1, 0), (0, 1), (0, 0)), ((0, 0),))
    numerators = [tuple(c * factor % prime for c in (3, 5, 2)) for factor in (1, 2, 6, prime - 1)]
    found = {Quotient(shape, above, (1,)).numerator_up_to_factor(prime) for above in numerators}
    (only,) = found
    assert (only[0], only[1] * 3 % prime, only[2] * 3 % prime) == (1, 5, 2)
    assert Quotient(Shape((), ((0, 0),)), (), (1,)).numerator_up_to_factor(prime) == ()
