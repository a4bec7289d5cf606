"""Figures: the requested size, the same bytes every time, complete files or none, matplotlib's settings left alone."""

import re
import xml.etree.ElementTree as ElementTree
from functools import cache

import matplotlib as mpl
import numpy as np
import pytest
from helpers import refuses, together

from kahanmaps.plots.figures import (
    FORMATS,
    draw_points,
    drawing,
    format_of,
    label_of,
    new_figure,
    picture_bytes,
    svg_text,
)
from kahanmaps.plots.style import Style

STYLE = Style(width=4)


def a_figure(count=10, style=STYLE):
    with drawing(style):
        figure = new_figure(style)
        axes = figure.subplots()
        draw_points(axes, np.linspace(0, 1, count), np.linspace(0, 1, count))
        axes.set(xlabel=label_of("x1"), ylabel=label_of(r"a$\frac$_b"))  # a name of a user is no formula
    return figure


@cache
def the_bytes(kind):
    return picture_bytes(a_figure(), kind, STYLE)


@pytest.mark.parametrize("kind", FORMATS)
def test_the_same_picture_is_the_same_bytes_and_another_is_not(kind):
    assert picture_bytes(a_figure(), kind, STYLE) == the_bytes(kind)
    assert kind != "svg" or picture_bytes(a_figure(11), kind, STYLE) != the_bytes(kind)


def test_many_points_are_an_image_inside_the_picture(monkeypatch):
    monkeypatch.setattr("kahanmaps.plots.figures.MAX_VECTOR_POINTS", 5000)
    few, many = (picture_bytes(a_figure(count), "svg", STYLE) for count in (5000, 5001))
    assert b"<image" not in few
    assert b"<image" in many
    assert len(many) < len(few) / 10


def test_settings_of_a_user_do_not_get_into_a_picture_and_are_left_as_they_were():
    expected = the_bytes("png")
    mpl.rcParams["font.size"] = 30
    try:
        assert picture_bytes(a_figure(), "png", STYLE) == expected
        assert mpl.rcParams["font.size"] == 30
    finally:
        mpl.rcdefaults()


@together(
    "path, requested, expected",
    [
        *(("a.pdf", None, "pdf"), ("a.PNG", None, "png"), ("a.b.svg", None, "svg")),
        *(("a.pdf", "png", "png"), ("a", "svg", "svg")),
        *((path, None, None) for path in ("a", "a.jpg", "a.pdf.gz", ".svg")),
    ],
)
def test_the_format_is_that_of_the_ending_or_the_one_requested(path, requested, expected):
    if expected is None:
        refuses(r"expected \.pdf, \.svg or \.png", format_of, path, requested)
    else:
        assert format_of(path, requested) == expected


def test_pictures_on_one_page_have_different_ids_and_every_reference_is_met():
    first, second = (svg_text(a_figure(), name, STYLE, "a < b") for name in ("one", "two"))
    ids = [set(re.findall(r'\bid="([^"]+)"', text)) for text in (first, second)]
    assert ids[0] & ids[1] == set()
    for text, own in zip((first, second), ids, strict=True):
        assert set(re.findall(r"(?:url\(|href=\")#([^)\"]+)", text)) <= own
        assert next(ElementTree.fromstring(text).iter("{http://www.w3.org/2000/svg}title")).text == "a < b"


def test_pictures_of_more_dots_than_fit_into_memory_are_refused():
    refuses("use fewer dots per inch than 2400", Style, width=200, dpi=2400)
    tall = Style(width=20, dpi=2000)  # 12 000 x 16 000 dots are few enough, as high as three times that are not
    refuses("2000", picture_bytes, new_figure(tall, aspect=3), "png", tall)
