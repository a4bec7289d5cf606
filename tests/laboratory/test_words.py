"""Compositions that are too long to be multiplied out are followed map by map, and their degrees are derived."""

import random

import pytest
from flint import fmpq, fmpz_poly

from kahanmaps.algebra.work import Budget
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.renewal import coefficients, degree_series, every_nth
from kahanmaps.laboratory.singular.following import Range
from kahanmaps.laboratory.singular.singularities import Patterns
from kahanmaps.laboratory.singular.written import Word, followed_map_by_map


def word(*letters, power=1):
    """The composition of systems of the catalogue, "-" for the inverse, or of inline maps of the plane."""
    entries = []
    for letter in letters:
        if ";" in letter:
            image = ", ".join(f'"{part}"' for part in letter.split(";"))
            entries.append(f'{{ map = {{ variables = ["x", "y"], map = {{ image = [{image}] }} }} }}')
        else:
            entries.append(f'{{ system = "{letter.strip("-")}", inverse = {str(letter[0] == "-").lower()} }}')
    return parse_system(f"[composition]\nof = [{', '.join(entries * power)}]").map


def derived(map_, terms, eps=None):
    """The word of a composition, and its degrees as its maps give them, followed one by one."""
    limits = Range(12, 60, 40, Budget(), 40)
    result, hypersurfaces = followed_map_by_map(map_, eps or fmpq(3, 11), random.Random(1), limits, lambda _: None)
    pairs = [(h.degree, h.orbit_data) for h in hypersurfaces]
    series = degree_series(result.degrees, pairs, [h.stage for h in hypersurfaces])
    return result, coefficients(every_nth(series, result.length), terms + 1)


@pytest.mark.parametrize(
    ("letters", "power", "terms", "expected"),
    [
        (["lotka_volterra", "-lyness"], 1, 6, Word((2, 2), 1)),
        (["weierstrass", "hietarinta_viallet"], 2, 2, Word((2, 3), 2)),
        (["zander_120", "-zander_120", "nahm_tetrahedral"], 2, 5, Word((2,), 2)),  # the first two are no step
        (["y;(2+y)/x", "y;-x+y+3/y^2"], 1, 6, Word((2, 3), 1)),  # meets what the other map contracts
        (["y;x+y^2-2", "y;2*x+3*y-1"], 1, 5, Word((2, 1), 1)),  # an affine map contracts nothing
        (["y;(y+1/3)/(x+2/5)"], 5, 5, Word((2,), 5)),
    ],
)
def test_words_give_the_measured_degrees(letters, power, terms, expected):
    map_ = word(*letters, power=power)
    result, degrees = derived(map_, terms)
    assert result == expected
    measured = degree_growth(
        map_, "3/11" if map_.has_eps else None, max_terms=terms, patterns=Patterns((), None, False)
    )
    assert tuple(degrees) == measured.degrees


def test_a_hypersurface_of_another_map_gives_other_degrees():
    """Negative control: with the maps in the other order the same hypersurfaces stand for another composition."""
    map_ = word("y;(2+y)/x", "y;-x+y+3/y^2")
    limits = Range(12, 60, 40, Budget(), 40)
    result, hypersurfaces = followed_map_by_map(map_, fmpq(1), random.Random(1), limits, lambda _: None)
    pairs = [(h.degree, h.orbit_data) for h in hypersurfaces]
    right, wrong = (
        coefficients(every_nth(degree_series(result.degrees, pairs, stages), 2), 6)
        for stages in ([h.stage for h in hypersurfaces], [1 - h.stage for h in hypersurfaces])
    )
    assert right == [1, 4, 13, 43, 141, 463]
    assert wrong != right


@pytest.mark.parametrize(("name", "k", "square"), [("mcmillan", 7, 2), ("euler_top", 2, 2)])
def test_powers_have_every_kth_degree(name, k, square):
    growth = degree_growth(word(name, power=k))
    assert (growth.ended, growth.derived.closed_form) == ("derived", f"{square * k * k}*n^2 + 1")
    assert growth.patterns.word == Word((3,), k)
    assert f"{k} maps make one iterate" in growth.text


def test_every_nth_coefficient_of_a_fraction():
    above, below = fmpz_poly([1, 2]), fmpz_poly([1, -3, 1, 5])
    values = coefficients((above, below), 40)
    for n, first in ((1, 0), (2, 0), (2, 1), (3, 2), (5, 7)):
        assert coefficients(every_nth((above, below), n, first), 6) == values[first::n][:6]
    with pytest.raises(ArithmeticError, match="coefficients that are too large"):
        every_nth((fmpz_poly([1]), fmpz_poly([1, -2, -3])), 600)
