"""What an orbit over Q comes to first: a pole, the end of its budget, or the step that was asked for.

Specified here: an iterate that is reached directly ends as the orbit that is stepped to it, whichever way either is
computed, at the same step, for starts near poles as for others; numbers that stay short are delivered however far the
step is.
"""

from itertools import product

import pytest
from flint import fmpq
from helpers import random_point
from planar_helpers import over_members, planar_system, structure_and_system

from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd

# Roots: three rational, one rational (in other coordinates), none rational, double, triple.
CUBICS = [(0, 3, -4, -4), (0, 1, 1, 0), (0, 3, 0, -1), (1, 0, 0, -2), (1, 0, -3, 2), (0, 1, 0, 0), (1, 3, 3, 1)]
EPS = ("1/2", "1", "1/3", "-1/2")
FAR = 10**12


def found_structure(system) -> SystemNormalForm:
    normal_form = system_normal_form(system)
    assert isinstance(normal_form, SystemNormalForm)
    return normal_form


def ended(orbit) -> OrbitEnd:
    for _ in orbit:
        pass
    return orbit.end


def event(system, normal_form, eps, start, steps, digits):
    """What comes first, with the step before it; by three ways, which have to agree."""
    kahan = KahanMap(system, eps)
    walks = [ended(Orbit(kahan, start, steps, normal_form=known, max_digits=digits)) for known in (None, normal_form)]
    assert walks[0] == walks[-1]
    far = ended(Orbit(kahan, start, at=[steps], normal_form=normal_form, max_digits=digits))
    walk = walks[0]
    if walk.is_complete:
        assert (far.status, far.steps) == ("completed", steps)
    elif walk.status == "singular":
        where = f"step {steps} cannot be reached: the map is not defined at step {walk.steps}"
        assert far == OrbitEnd("singular", 0, where)
    else:
        assert far.status == walk.status == "budget"
        assert far.message.endswith(walk.message)
    return walk


def seen_from(cubic, eps, sixths, runs):
    """The events of starts with coordinates in sixths, and that far steps end so, too."""
    system = planar_system(cubic)
    normal_form, seen = found_structure(system), []
    for u, v in product([fmpq(i, 6) for i in sixths], repeat=2):
        for steps, digits in runs:
            walk = event(system, normal_form, eps, [u, v], steps, digits)
            seen.append(walk.status)
            far = ended(Orbit(KahanMap(system, eps), [u, v], at=[FAR], normal_form=normal_form, max_digits=digits))
            if not walk.is_complete:
                assert far.status == walk.status
    return seen


@pytest.mark.parametrize("cubic", CUBICS[::3])
def test_small_starts_end_alike_by_steps_and_by_jumps(cubic):
    seen = [status for eps in EPS[:2] for status in seen_from(cubic, eps, range(-6, 7, 3), [(70, 12), (26, 3)])]
    assert {"singular", "budget"} & set(seen)


@pytest.mark.slow
@pytest.mark.parametrize("eps", EPS)
@pytest.mark.parametrize("cubic", [*CUBICS, (1, 3, 3, -4), (1, 0, 0, 1), (0, 2, -1, 2), (2, -1, 0, 3), (0, 0, 1, 5)])
def test_many_small_starts_end_alike_by_steps_and_by_jumps(cubic, eps):
    assert {"singular", "budget"} & set(seen_from(cubic, eps, range(-12, 13, 3), [(120, 30), (31, 3), (25, 1)]))


@over_members
def test_members_end_alike_by_steps_and_by_jumps(name):
    normal_form, system = structure_and_system(name)
    for seed, eps in enumerate(EPS[:2]):
        event(system, normal_form, eps, random_point(system.dim, seed, height=2), 30, 40)
