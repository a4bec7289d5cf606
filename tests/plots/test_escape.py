"""Escape times and basins: against exact arithmetic, poles, and the picture."""

import numpy as np
import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps.algebra.fields import QQ
from kahanmaps.documents.catalog import load
from kahanmaps.documents.inline import System
from kahanmaps.errors import KahanmapsError
from kahanmaps.plots.escape import ENDS, STAYS, plot_escape, survey_escape

WINDOW = ((-2.0, 2.0), (-1.0, 1.0))


@pytest.mark.parametrize("name", ["henon_heiles", "lotka_volterra"])
def test_times_and_directions_are_those_of_exact_orbits(name):
    file, cells, steps = load(name), 4, 12
    at = ["0", "0", "1/3", "-1/5"][: file.dim]
    found = survey_escape(file.map, "1/4", WINDOW, (1, 0), at, cells=cells, steps=steps, radius=2.5)
    phi = file.map.at("1/4")
    for row in range(cells):
        for column in range(cells):
            x = [QQ.convert(entry) for entry in at]
            x[1], x[0] = fmpq(2 * column + 1, 2) - 2, fmpq(2 * row + 1, 4) - 1
            time, direction = -1, STAYS
            for step in range(steps + 1):
                largest = max(range(file.dim), key=lambda k: abs(x[k]))
                if abs(x[largest]) > fmpq(5, 2):
                    time, direction = step, 2 * largest + (x[largest] < 0)
                    break
                try:
                    x = list(phi.step(x))
                except KahanmapsError:
                    time, direction = step + 1, ENDS
                    break
            assert (found.times[row, column], found.directions[row, column]) == (time, direction)


def test_an_orbit_that_meets_a_pole_without_being_seen_outside_ends():
    square = System("x' = x^2; y' = 0").map
    found = survey_escape(square, "1/2", ((-2.0, 2.0), (-2.0, 2.0)), cells=2, steps=5)
    assert found.directions.tolist() == [[STAYS, ENDS]] * 2  # x~ = x/(1 - x) has its pole at 1
    assert found.times.tolist() == [[-1, 1]] * 2


def test_pictures_show_times_on_a_scale_and_directions_with_a_legend():
    found = survey_escape(load("lotka_volterra").map, "1/4", ((-3.0, 3.0), (-3.0, 3.0)), cells=20, steps=50)
    axes, bar = plot_escape(found).axes
    image = axes.images[0].get_array()
    assert image.shape == (20, 20)
    assert (np.ma.getmaskarray(np.ma.masked_invalid(image)) == (found.times < 0)).all()
    assert bar.get_ylabel() == "steps until |x| > 1000"
    figure = plot_escape(found, show="basin")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == "\N{MINUS SIGN}$x$"
    assert len(labels) == len(set(found.directions.ravel().tolist()) - {STAYS})
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$x$", "$y$")
    refuses("expected two axes and 2 coordinates", survey_escape, load("harmonic").map, "1/2", WINDOW, (0, 0))
