"""What a terminal gets and a pipe does not: colours, and lines broken at words with what follows indented.

A pipe gets every line as it is, with tabs. Colours go to a terminal, or wherever --color says, and say nothing that
words do not say as well. They are the named ones of the terminal that can be read on light and on dark ground: no
yellow, no blue, no grey, no dim.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Sequence
from textwrap import TextWrapper
from typing import TYPE_CHECKING, TextIO

import click

from kahanmaps.displayed import shorten as shorten
from kahanmaps.errors import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

COLOURS = {"proved": "green", "supported": "cyan", "refuted": "red", "undecided": "magenta"}
# On a terminal long numbers are shortened to this many characters.
NUMBER_WIDTH = 40
NARROW = 60  # columns, below which there is no room for a table of texts
_LABEL = 12
_WORD_WIDTH = 10  # what words keep in a table that is too wide
_BREAKABLE = re.compile(r"(?<=[*/,;])")
_JOINED = "\0"  # a blank at which no line ends


def on_terminal() -> bool:
    """Whether standard output is a terminal."""
    return sys.stdout.isatty()


def columns() -> int:
    """The width of the terminal."""
    return max(20, shutil.get_terminal_size().columns)


def is_coloured(stream: TextIO | None = None) -> bool:
    """Whether a stream gets colours: --color decides, then NO_COLOR, FORCE_COLOR, CLICOLOR_FORCE, a terminal.

    The stream is standard output unless given.
    """
    context = click.get_current_context(silent=True)
    if context is not None and context.color is not None:
        return context.color
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        return True
    return (on_terminal() if stream is None else stream.isatty()) and os.environ.get("TERM") != "dumb"


def paint(text: str, style: str) -> str:
    """The text in a style such as "bold green", where colours are wanted."""
    words = style.split()
    if not words or not is_coloured():
        return text
    colour = next((word for word in words if word != "bold"), None)
    return click.style(text, fg=colour, bold="bold" in words or None)


def console() -> Console:
    """Where rich prints tables: no markup in texts, and no escape sequence at all where colours are not wanted."""
    from rich.console import Console

    coloured = is_coloured()
    return Console(
        markup=False,
        emoji=False,
        highlight=False,
        force_terminal=coloured,
        color_system="standard" if coloured else None,
        width=columns(),
    )


def formula(text: str, width: int = 400) -> str:
    """A long formula is shortened on a terminal only."""
    return shorten(text, width) if on_terminal() else text


def tell(text: str, hang: int = _LABEL, style: str = "") -> None:
    """Print lines of cells separated by tabs; on a terminal the first cell is a label, and the others stand beside it.

    Verdicts are coloured, lines that start with # are headings. `hang` is the column of what stands beside a label.
    """
    for line in printable(text).split("\n"):
        cells = line.split("\t")
        shown = _laid_out(cells, hang) if on_terminal() else line
        if style or line.startswith("# "):
            shown = "\n".join(paint(piece, style or "bold") if piece else "" for piece in shown.split("\n"))
        for cell in cells[:2]:
            if cell in COLOURS and not style:
                shown = shown.replace(cell, paint(cell, COLOURS[cell]), 1)
        click.echo(shown, color=is_coloured())


def echo(text: str, end: str = "\n") -> None:
    """Print text on standard output as it is, but for what a terminal would obey; others may have written it."""
    click.echo(printable(text) + end, nl=False)


def styled(text: str, style: str = "") -> Text:
    """Text for a table of rich, with nothing in it that a terminal would obey."""
    from rich.text import Text

    return Text(printable(text), style=style)


def tell_entry(head: str, text: str, style: str = "") -> None:
    """Print an entry of a list whose heads have the same length; on a terminal its text goes on below itself."""
    head, text = printable(head), printable(text)
    lines = [head + text]
    if on_terminal():
        lines = wrapped(text, columns(), head, " " * (len(head) if columns() >= NARROW else 4))
    lines[0] = paint(lines[0][: len(head)], style) + lines[0][len(head) :]
    click.echo("\n".join(lines), color=is_coloured())


def print_table(rows: Sequence[Sequence[str]], words: int = 1) -> None:
    """Columns on a terminal, tabs elsewhere; the first `words` columns are texts, the others numbers.

    A broken number looks like two: where a terminal is too narrow for the numbers, cells stand below each other.
    """
    if not on_terminal():
        for row in rows:
            echo("\t".join(row))
        return
    from rich.table import Table

    screen = console()
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padding = 1 if sum(widths) + 3 * len(widths) < screen.width else 0
    # Where a table is too wide words are broken.
    least = sum(min(width, _WORD_WIDTH) for width in widths[:words])
    least += sum(widths[words:]) + (1 + 2 * padding) * len(widths) + 1
    if least > screen.width:
        _print_cells(rows)
        return
    table = Table(header_style="bold", padding=(0, padding))
    for k, heading in enumerate(rows[0]):
        table.add_column(
            styled(heading, COLOURS.get(heading, "")),
            justify="left" if k < words else "right",
            overflow="fold",
            no_wrap=k >= words,
        )
    for row in rows[1:]:
        table.add_row(*map(styled, row))
    screen.print(table)


def _print_cells(rows: Sequence[Sequence[str]]) -> None:
    """One cell a line behind its heading, and an empty line after each row."""
    headings, *others = rows
    width = max(map(len, headings))
    for row in others:
        for heading, cell in zip(headings, row, strict=True):
            echo("\n".join(wrapped(cell, columns(), heading.ljust(width) + "  ", " " * 4)))
        click.echo()


def _laid_out(cells: list[str], hang: int) -> str:
    width = columns()
    label, *others = cells
    if not others:
        margin = " " * (len(label) - len(label.lstrip()))
        return "\n".join(wrapped(label.lstrip(), width, margin, margin + "    "))
    if width < NARROW:
        hang = min(hang, 4)
    first = label.ljust(hang) if len(label) < hang else f"{label}  "
    # What a long label would push to the right margin stands below it.
    if len(first) > max(hang, width // 2):
        return "\n".join([*wrapped(label, width), *wrapped("  ".join(others), width, " " * hang, " " * hang)])
    return "\n".join(wrapped("  ".join(others), width, first, " " * hang))


def wrapped(text: str, width: int, first: str = "", rest: str = "") -> list[str]:
    """The text in lines of at most `width`, broken at blanks, before + and - and not after them, each with its margin.

    A number that is longer than a line is shortened, another word folded, after * / , ; if that is possible.
    """
    room = max(8, width - len(rest))
    text = re.sub(rf"\d{{{room + 1},}}", lambda number: shorten(number[0], NUMBER_WIDTH), text)
    text = re.sub(r" ([-+]) (?=\S)", r" \1" + _JOINED, text)
    wrapper = _Wrapper(width, initial_indent=first, subsequent_indent=rest, replace_whitespace=False)
    return [line.replace(_JOINED, " ").rstrip() for line in wrapper.wrap(text) or [first]]


class _Wrapper(TextWrapper):
    def _split(self, text: str) -> list[str]:
        room = self.width - len(self.subsequent_indent)
        words = (word for word in re.split("( +)", text) if word)
        return [piece for word in words for piece in (_BREAKABLE.split(word) if len(word) > room else [word]) if piece]
