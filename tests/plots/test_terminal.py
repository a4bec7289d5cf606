"""A figure as characters: dots where the picture has ink, texts in between, nothing outside the frame asked for."""

import pytest

from kahanmaps.errors import InputError
from kahanmaps.plots.figures import drawing, label_of, new_figure
from kahanmaps.plots.style import COLOURS, Style
from kahanmaps.plots.terminal import draw_in_characters

STYLE = Style()


def a_figure(x=(0, 1), y=(0, 1), **how):
    with drawing(STYLE):
        figure = new_figure(STYLE)
        axes = figure.subplots()
        axes.plot(x, y, **how)
        axes.set_xlabel(label_of("x1"))
        axes.set_ylabel(label_of("omega"))
    return figure


def lines(figure, columns=60, rows=20):
    return ["".join(cell.character for cell in row) for row in draw_in_characters(figure, columns, rows, STYLE)]


def dots(cells):
    return sum(
        bin(ord(cell.character) - 0x2800).count("1") for row in cells for cell in row if cell.character > "\u2800"
    )


@pytest.mark.parametrize(("columns", "rows"), [(20, 8), (60, 20), (119, 40)])
def test_the_picture_has_the_size_asked_for(columns, rows):
    drawn = lines(a_figure(), columns, rows)
    assert (len(drawn), {len(line) for line in drawn}) == (rows, {columns})


def test_labels_can_be_read():
    text = "\n".join(lines(a_figure()))
    assert " x1 " in text
    assert "omega" in text
    assert "0.5" in text


def test_a_curve_leaves_dots_in_its_colour():
    with_curve = draw_in_characters(a_figure(color=COLOURS[1]), 60, 20, STYLE)
    without = draw_in_characters(a_figure(x=(), y=()), 60, 20, STYLE)
    coloured = [cell for row in with_curve for cell in row if cell.colour and cell.colour[2] > 150 > cell.colour[0]]
    assert dots(with_curve) > dots(without) + 20
    assert len(coloured) > 15


def test_a_rising_line_rises():
    colours = [
        (i, j)
        for i, row in enumerate(draw_in_characters(a_figure(color="#ff0000"), 60, 20, STYLE))
        for j, cell in enumerate(row)
        if cell.colour
    ]
    low, high = min(colours, key=lambda at: at[1]), max(colours, key=lambda at: at[1])
    assert low[0] > high[0]


def test_too_small_a_terminal_is_refused():
    with pytest.raises(InputError, match="at least 20 and 8"):
        draw_in_characters(a_figure(), 10, 5, STYLE)


def test_the_label_of_a_vertical_axis_stands_above_it_and_covers_no_number():
    with drawing(STYLE):
        figure = new_figure(STYLE)
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1])
        axes.set_yticks([0.5], ["1/2"])
        axes.set_ylabel("relative error of I")
    rows = lines(figure)
    [above] = [k for k, row in enumerate(rows) if "relative error of I" in row]
    [beside] = [k for k, row in enumerate(rows) if "1/2" in row]
    assert above < beside


def test_entries_of_a_legend_stand_in_rows_of_their_own():
    with drawing(STYLE):
        figure = new_figure(STYLE)
        axes = figure.subplots()
        for name in ("first", "second", "third"):
            axes.plot([0, 1], [0, 1], label=name)
        figure.legend(loc="outside upper left")
    rows = lines(figure, 60, 24)
    found = [next(k for k, row in enumerate(rows) if name in row) for name in ("first", "second", "third")]
    assert len(set(found)) == 3
    assert found[2] - found[0] <= 3


def test_a_picture_that_does_not_fit_is_refused_and_may_be_tried_with_more_rows():
    with drawing(STYLE):
        figure = new_figure(STYLE)
        for axes in figure.subplots(5, 1):
            axes.set_ylabel("y")
            axes.set_xlabel("x")
    with pytest.raises(InputError, match="expected more for this picture"):
        draw_in_characters(figure, 60, 10, STYLE)
    assert len(draw_in_characters(figure, 60, 60, STYLE)) == 60


def test_powers_of_ten_below_a_logarithmic_axis_are_not_written():
    with drawing(STYLE):
        figure = new_figure(STYLE)
        axes = figure.subplots()
        axes.semilogy([0, 1], [1e-16, 1e-7])
        axes.set_ylim(1e-16, 1e-7)
        axes.set_yticks([1e-25, 1e-16, 1e-7], ["below", "least", "most"])
        axes.set_ylim(1e-16, 1e-7)
    text = "\n".join(lines(figure))
    assert ("least" in text, "most" in text, "below" in text) == (True, True, False)
