"""The n-th point of an orbit in a plane over any field, directly.

Specified here: it is the point that steps lead to, over prime fields, their extensions, Q, Q[t]/g and balls, for smooth
and for degenerate levels; on smooth levels, through poles and for n of any size, it is n times the translation, added
by chords and tangents.
"""

import random
from itertools import islice

import flint
import pytest
from helpers import quick
from planar_helpers import Finite, planes_over

from kahanmaps.errors import SingularStep
from kahanmaps.maps.normal_form import translation
from kahanmaps.maps.normal_form.level_curves import LevelCubic
from kahanmaps.maps.normal_form.planar_block import same_point
from kahanmaps.maps.normal_form.translation import NoTranslation, iterate


def is_zero(element) -> bool:
    return element == 0


def planes(field, seed, amount):
    """Random planes with starts of every kind that are not constant."""
    result = planes_over(field, random.Random(f"{field} {seed}"), 10**9)
    return islice((case for case in result if not case[0].is_zero and case[1][:2] != (0, 0)), amount)


def stepped(block, start, steps):
    """P_0, P_1, ... with W = 1, up to the last before a pole."""
    points = [start]
    for _ in range(steps):
        U, V, W = block.image(points[-1])
        if W == 0:
            break
        points.append((U / W, V / W, W / W))
    return points


def translated(block, start, n):
    """The n-th point, or what is said instead."""
    try:
        return iterate(block, start, n, is_zero, inexact=isinstance(start[0], flint.arb | flint.acb))
    except SingularStep as error:
        return str(error)
    except NoTranslation:
        return None


FINITE = [(Finite(7), 160), (Finite(101), 48), (Finite(10007), 18), (Finite(2**89 - 1), 12), (Finite(5, 2), 30)]
FINITE += [(Finite(5, 3), 60)]
over_finite = pytest.mark.parametrize(("field", "amount"), quick(FINITE, FINITE[:-1]), ids=repr)
NUMBERS = (0, 1, 2, 3, 7, 8, 11, 12, 15, 16, 17, 18, 19, 20, 23, 24, 25, 31, 32, 33, 47, 48, 49, 63)


@over_finite
def test_over_a_finite_field_it_is_the_point_that_steps_lead_to(field, amount):
    compared = 0
    for block, start in planes(field, 1, amount):
        points = stepped(block, start, NUMBERS[-1])
        for n in NUMBERS:
            image = translated(block, start, n)
            if n < len(points) and image is not None:
                assert same_point(image, points[n])
                compared += 1
    assert compared > amount


def smooth(field, seed, amount):
    for block, start in planes(field, seed, amount):
        above, below = block.level(start)
        if below != 0 and above != 0 and block.discriminant != 0:
            delta = block.discriminant * above * above / (below * below)
            if delta != 1:
                yield block, start, LevelCubic(block, above, below, start)


@over_finite
def test_on_a_smooth_level_it_is_a_multiple_of_the_translation(field, amount):
    # Chords and tangents, P_0 for zero: P_n = n P_1. Poles on the way do not matter to them.
    rng, passed = random.Random(field.q), 0
    for block, start, cubic in smooth(field, 4, min(amount, 40)):
        for n in (rng.randrange(17, 100), rng.randrange(field.q**2 + 100), rng.randrange(10**30)):
            image = translated(block, start, n)
            if isinstance(image, tuple):
                assert any(image)
                assert same_point(image, cubic.multiple(n, block.image(start)))
                passed += 1
    assert passed > 0


@pytest.mark.parametrize("wrong", ["gamma", "digits"])
def test_with_another_gamma_or_other_digits_the_point_is_another(wrong, monkeypatch):
    block, start = next(iter(planes(Finite(10007), 1, 1)))
    by_curve, digits = translation._by_curve, translation._digits
    if wrong == "gamma":
        monkeypatch.setattr(translation, "_by_curve", lambda P, gamma, *others: by_curve(P, gamma + 1, *others))
    else:
        monkeypatch.setattr(translation, "_digits", lambda n: digits(n + 1))
    assert not same_point(translated(block, start, 50), stepped(block, start, 50)[50])
