"""Which way an orbit is computed, for every arithmetic and wish, and what cannot be had."""

import pytest
from planar_helpers import structure_and_system

from kahanmaps.family.system_normal_form import NoNormalForm
from kahanmaps.maps.orbits.methods import choose_method

SPLIT, _ = structure_and_system("m = 2")
UNSPLIT, _ = structure_and_system("m = 2, sqrt 2")
NONE = NoNormalForm("H is not a homogeneous cubic")


@pytest.mark.parametrize(
    ("requested", "arithmetic", "normal_form", "at", "expected"),
    [
        (None, "exact", NONE, None, "generic"),
        (None, "mod", NONE, (10**9,), "generic"),
        ("generic", "exact", SPLIT, (10**9,), "generic"),
        (None, "exact", SPLIT, None, "normal-form"),
        (None, "exact", UNSPLIT, None, "normal-form"),
        (None, "float", UNSPLIT, None, "normal-form"),
        (None, "float", SPLIT, (10**9,), "normal-form"),
        (None, "ball", UNSPLIT, None, "normal-form"),
        (None, "mod", SPLIT, None, "generic"),
        ("normal-form", "exact", SPLIT, None, "normal-form"),
        ("normal-form", "ball", UNSPLIT, None, "normal-form"),
        ("doubling", "exact", UNSPLIT, (3,), "doubling"),
        ("doubling", "mod", SPLIT, (3,), "doubling"),
        # Iterates wanted alone are reached directly from a certain step on, where they are few.
        (None, "exact", SPLIT, (23,), "normal-form"),
        (None, "exact", SPLIT, (24,), "doubling"),
        (None, "exact", SPLIT, (1, 2, 40), "doubling"),
        (None, "exact", SPLIT, (1, 2, 3, 4, 5, 40), "normal-form"),
        (None, "exact", SPLIT, (1, 2, 3, 40), "doubling"),
        (None, "exact", UNSPLIT, (24,), "doubling"),
        (None, "exact", UNSPLIT, tuple(range(10, 25)), "normal-form"),
        (None, "mod", UNSPLIT, (9_999,), "generic"),
        (None, "mod", UNSPLIT, (10_000,), "doubling"),
        (None, "mod", UNSPLIT, tuple(range(10_001)), "doubling"),
        (None, "ball", SPLIT, (0,), "normal-form"),
        (None, "ball", SPLIT, (1,), "doubling"),
        (None, "exact", SPLIT, (), "normal-form"),
    ],
)
def test_the_method_follows_from_what_is_asked_for(requested, arithmetic, normal_form, at, expected):
    result = choose_method(requested, arithmetic, normal_form, at)
    assert result.name == expected
    assert result.text == f"method {expected}: {result.reason}"
