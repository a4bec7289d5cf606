"""Solutions in balls: they contain closed forms and have the radius that was asked for."""

import pytest
from flint import arb, fmpq
from helpers import refuses

from kahanmaps.algebra.fields import RR
from kahanmaps.systems.quadratic import QuadraticSystem
from kahanmaps.systems.taylor import solution


@pytest.mark.parametrize("bits", [64, 200])
@pytest.mark.parametrize("time", ["3", "-7/2", "1/1000"])
def test_balls_contain_the_solution_and_are_as_small_as_requested(bits, time):
    rotation = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
    logistic = QuadraticSystem.from_text(["x"], ["x - x^2"])
    with RR(3 * bits).working():
        t = arb(fmpq(*map(int, (time + "/1").split("/")[:2])))
        growth = (t.exp() / 3) / (1 + (t.exp() - 1) / 3)  # of x' = x - x^2 from 1/3
        for system, start, exact in ((rotation, [1, 0], [t.cos(), -t.sin()]), (logistic, ["1/3"], [growth])):
            balls = solution(system, start, time, bits)
            for ball, value in zip(balls, exact, strict=True):
                assert ball.contains(value)
                assert not (ball + arb(2) ** (3 - bits)).contains(value)  # the control: they are no larger
    assert solution(rotation, [1, 0], time, bits)[0].rad() > 0


def test_a_solution_that_does_not_exist_is_none_and_constants_stay():
    square = QuadraticSystem.from_text(["x"], ["x^2"])
    assert solution(square, [1], 1) is None
    assert solution(square, [1], 5) is None
    assert [ball.contains(0) for ball in solution(square, [0], 5)] == [True]
    [ball] = solution(QuadraticSystem.from_text(["x"], ["3"]), ["1/7"], 2)
    with RR(200).working():
        assert ball.contains(arb(fmpq(43, 7)))
    refuses("found a point with 2 coordinates, expected 1", solution, square, [1, 2], 1)
