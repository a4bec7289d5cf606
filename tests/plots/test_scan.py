"""The plane of two parameters: curves and points of a scan, a color for each block."""

import numpy as np
import pytest
from helpers import refuses

from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.scan.scan import scan
from kahanmaps.plots.figures import label_of
from kahanmaps.plots.scan import plot_scan

PLANE = """variables = ["x", "y"]
parameters = { a = 1, b = 1 }
[system]
rhs = ["x*(a*x + y)", "y*(x + b*y)"]"""


@pytest.fixture(scope="module")
def scanned():
    return scan(parse_system(PLANE), ["a", "b"], terms=3, primes=[11, 13, 17])


def of_growth(scanned, kind):
    """The components of the blocks with this growth."""
    return [
        entry
        for _, some in scanned.classes
        for entry in some
        if any(o.growth is not None and o.growth.growth == kind for o in some)
    ]


def test_marks_are_the_points_of_each_kind_of_growth(scanned):
    figure = plot_scan(scanned)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    kinds = [kind for kind in ("bounded", "linear", "quadratic", "exponential") if of_growth(scanned, kind)]
    assert len(kinds) > 2
    assert texts[: len(kinds)] == [f"{kind} growth" for kind in kinds]
    for text, line in zip(texts, figure.axes[0].lines, strict=True):
        points = [entry for entry in of_growth(scanned, text.split()[0]) if entry.dimension == 0]
        assert sorted(line.get_xdata()) == sorted(
            int(point.values["a"].p) / int(point.values["a"].q) for point in points
        )


def test_curves_are_the_zeros_of_the_conditions_and_these_are_written_beside_them(scanned):
    figure = plot_scan(scanned, window=((-2.0, 2.0), (-2.0, 2.0)))
    [axes] = figure.axes
    a, b = np.concatenate(axes.collections[1].get_segments()).T  # those of linear growth
    assert len(a) > 50
    assert np.abs(2 * a * b - a - b).max() < 1e-9
    assert (axes.get_xlim(), axes.get_xlabel()) == ((-2.0, 2.0), "$a$")
    at = {text.get_text(): text.xy for text in axes.texts}
    a, b = at["$2 a b - a - b = 0$"]
    assert abs(2 * a * b - a - b) < 1e-9
    assert at["(1, 1)"] == (1, 1)
    # Conditions do not overlap, and none is of exponential growth.
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) > 3
    assert not any(box.overlaps(other) for k, box in enumerate(boxes) for other in boxes[:k])
    assert not set(at) & {label_of(entry.text) for entry in of_growth(scanned, "exponential")}


def test_a_scan_without_conditions_is_an_empty_plane_and_one_of_another_dimension_refused():
    none, line = (
        scan(parse_system(PLANE), over, terms=1, primes=[5, 7, 11], effort=-20) for over in (["a", "b"], ["a"])
    )
    assert plot_scan(none).legends == []
    refuses("expected two parameters", plot_scan, line)


def test_the_plane_modulo_a_prime_has_every_slow_member(scanned):
    [axes] = plot_scan(scanned, modulo=13).axes
    sweep = next(sweep for sweep in scanned.sweeps if sweep.prime == 13)
    drawn = [tuple(point) for line in axes.lines for point in line.get_xydata().tolist()]
    assert sorted(drawn) == sorted(sweep.special)
    a, b = {text.get_text(): text.xy for text in axes.texts}[label_of("2*a*b - a - b = 0")]
    assert (2 * a * b - a - b) % 13 == 0
    refuses("expected one modulo which all members were tried: 11, 13, 17", plot_scan, scanned, modulo=19)
