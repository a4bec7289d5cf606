"""Shortest recurrences of integer sequences: known ones come back, and nothing is made of what has none."""

import pytest
from flint import fmpz_poly
from hypothesis import given
from hypothesis import strategies as st

from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.recurrences import find_recurrence, needed_checks

PRIMES = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53]


def terms(below: list[int], start: list[int], length: int) -> list[int]:
    """The sequence with a_n = sum below[k] a_{n-1-k} from its first terms."""
    values = list(start)
    while len(values) < length:
        values.append(sum(c * values[-1 - k] for k, c in enumerate(below)))
    return values


LARGE = 2**520 - 1
PERIODIC = "; ".join(f"{2 - (r == 5)} for n = {r} mod 12" for r in range(12))
# Terms; how many of them are exempt, the order, the kind of growth, closed form, power of n, rate.
KNOWN = [
    ([1] * 5, (0, 1, "bounded", "1", 0, "1")),
    ([0] * 4, (0, 0, "zero", "0", 0, None)),
    ([1, 0, 0, 0, 0, 0], (1, 1, "zero", "0 for n >= 1", 0, None)),
    ([-n for n in range(7)], (0, 2, "linear", "-n", 1, "1")),
    ([n * (-1) ** n for n in range(8)], (0, 2, "linear", "n for n = 0 mod 2; -n for n = 1 mod 2", 1, "1")),
    ([2 * n * n + 1 for n in range(9)], (0, 3, "quadratic", "2*n^2 + 1", 2, "1")),
    ([n * (n - 1) // 2 for n in range(9)], (0, 3, "quadratic", "1/2*n^2 - 1/2*n", 2, "1")),
    (
        [-(-3 * n * n // 4) + 1 for n in range(12)],
        (0, 4, "quadratic", "3/4*n^2 + 1 for n = 0 mod 2; 3/4*n^2 + 5/4 for n = 1 mod 2", 2, "1"),
    ),
    ([n**3 - n for n in range(12)], (0, 4, "polynomial", "n^3 - n", 3, "1")),
    ([6**n for n in range(5)], (0, 1, "exponential", None, 0, "6")),
    ([2**n + (-2) ** n for n in range(8)], (0, 2, "exponential", None, 0, "2")),
    ([n * (-2) ** n for n in range(8)], (0, 2, "exponential", None, 1, None)),
    # The first terms may be exempt.
    ([7, 5, *(2**n for n in range(10))], (2, 3, "exponential", None, 0, "2")),
    ([9, *([4] * 8)], (1, 2, "bounded", "4 for n >= 1", 0, "1")),
    ([7, *(3 * n - 1 for n in range(1, 9))], (1, 3, "linear", "3*n - 1 for n >= 1", 1, "1")),
    ([9, 9, *([1, 2] * 5)], (2, 4, "bounded", "1 for n = 0 mod 2; 2 for n = 1 mod 2, all for n >= 2", 0, "1")),
    # Long periods and long numbers
    ([2 - (n % 12 == 5) for n in range(30)], (0, 12, "bounded", PERIODIC, 0, "1")),
    ([2 - (n % 13 == 5) for n in range(40)], (0, 13, "bounded", None, 0, "1")),
    ([LARGE] * 4, (0, 1, "bounded", str(LARGE), 0, "1")),
    ([LARGE**n for n in range(4)], (0, 1, "exponential", None, 0, str(LARGE))),
    ([(-LARGE) ** n for n in range(4)], (0, 1, "exponential", None, 0, None)),
]


@pytest.mark.parametrize(("values", "expected"), KNOWN, ids=lambda value: str(value)[:12])
def test_known_sequences(values, expected):
    found = find_recurrence(values)
    rate = found.rate and found.rate.text
    results = found.preperiod, found.order, str(found.growth), found.closed_form_text, found.power, rate
    assert results == expected
    assert found.checked == len(values) - 2 * found.order >= needed_checks(found.order)


def test_the_growth_rate_is_an_algebraic_number_with_certain_digits():
    # 1 + sqrt 2: 3, 9, 23, 57, 139, 337, 815, 1969 are the degrees of zhukovski_volterra_2
    recurrence = find_recurrence([1, 3, 9, 23, 57, 139, 337, 815, 1969, 4755])
    assert recurrence.growth is Growth.EXPONENTIAL
    assert recurrence.rate.minimal_polynomial == fmpz_poly([-1, -2, 1])
    assert recurrence.rate.digits.startswith("2.41421356237309504880")
    assert recurrence.rate.enclosure.startswith("[2.41421356237309504880168872420969807")
    assert recurrence.to_json()["rate"]["minimal_polynomial"] == ["-1", "-2", "1"]


ONE_WRONG = [2 * n * n + 1 + (n == 9) for n in range(12)]


@pytest.mark.parametrize("values", [[], [1, 2, 4], PRIMES, [1, 2, 4, 8, 15], ONE_WRONG])
def test_nothing_is_made_of_too_few_terms_or_of_no_recurrence(values):
    assert find_recurrence(values) is None


@given(st.lists(st.integers(-5, 5), min_size=1, max_size=4), st.data())
def test_the_recurrence_found_continues_the_sequence(below, data):
    start = data.draw(st.lists(st.integers(-9, 9), min_size=len(below), max_size=len(below)))
    size = 2 * len(below) + needed_checks(len(below))
    values = terms(below, start, size + 10)
    recurrence = find_recurrence(values[:size])
    assert recurrence is not None
    assert recurrence.order <= len(below)
    assert [recurrence.predict(n) for n in range(size + 10)] == values
