"""Steps and n-th iterates in a plane over Q from one table of two integer sequences.

Specified here: the points are those of plain gcds, for every kind of start and every n, and no number on the way is
longer than the result; a pole is passed over; where the table does not apply the answer is None.
"""

from itertools import islice

import pytest
from flint import fmpq
from planar_helpers import STARTS, before, by_gcds, image, integer_block, over_starts, preimage, reduced

from kahanmaps.maps.normal_form import planar_integers, tau
from kahanmaps.maps.normal_form.planar_block import same_point


def walked(block, steps):
    return [reduced(triple) for triple in islice(tau.triples(block), steps + 1)]


SMOOTH = [
    name
    for name, case in STARTS.items()
    if not (block := integer_block(*case)).is_constant
    and block.level is not None
    and not block.is_degenerate
    and len(by_gcds(block, 25)) == 26
]
over_smooth = pytest.mark.parametrize("name", SMOOTH)
FIRST = 2  # as long as psi_{n-1} would be zero one steps


def stepped(block, count):
    return [reduced(triple) for triple in islice(block.triples(), count)]


@over_starts
def test_the_points_are_those_of_plain_gcds(cubic, start):
    block = integer_block(cubic, start)
    assert walked(block, 25) == by_gcds(block, 25)


@over_smooth
def test_every_point_up_to_60_is_that_of_steps(name):
    block = integer_block(*STARTS[name])
    expected = stepped(block, 61)
    base = tau.table_near(block).base
    assert [reduced(tau.iterate(block, n)) for n in range(FIRST + base, 61)] == expected[FIRST + base :]


@pytest.mark.parametrize("steps", [7, 8, 9, 16, 30])
def test_a_pole_is_passed_over(steps):
    # The two neighbours of a pole are the same on every level; from P_{pole + 2} on one can step again.
    cubic, start = STARTS["a pole at step 2"]
    block = integer_block(cubic, before(cubic, start, steps))
    pole = steps + 2
    results = {n: reduced(tau.iterate(block, n)) for n in range(pole - 1, 2 * pole)}
    U, V, W = by_gcds(block, 2 * pole)[-1]
    assert results[pole - 1] == (U, V, W)
    assert same_point(results[pole], (U, V, 0))
    assert results[pole + 1] == reduced((U, V, -W))
    assert reduced(preimage(cubic, results[pole + 2])) == results[pole + 1]
    for n in range(pole + 2, 2 * pole - 1):
        above, below = block.block.level(results[n])
        assert fmpq(above, below) == block.level
        assert reduced(image(cubic, results[n])) == results[n + 1]


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("n", [127, 180])
def test_no_number_is_longer_than_the_result(name, n, monkeypatch):
    lengths = []
    divide = planar_integers.divide_exactly

    def watched(values, divisor):
        lengths.extend(value.bit_length() for value in values)
        return divide(values, divisor)

    monkeypatch.setattr(planar_integers, "divide_exactly", watched)
    result = tau.iterate(integer_block(*STARTS[name]), n)
    # A tenth, for bad primes and the three points around the base.
    assert max(lengths) < 1.1 * max(entry.bit_length() for entry in result)
    assert len(lengths) < 20 * n.bit_length()


@pytest.mark.parametrize("change", [1, -1])
def test_with_another_gamma_divisions_leave_a_remainder(change):
    block = integer_block(*STARTS["one real root, irrational"])
    block.delta += change
    with pytest.raises(ArithmeticError, match="left a remainder"):
        tau.iterate(block, 100)
