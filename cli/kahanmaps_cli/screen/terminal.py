"""What a terminal gets and a pipe does not: colours, and lines broken at words with what follows indented.

A pipe gets every line as it is, with tabs. Colours go to a terminal, or wherever --color says, and say nothing that
words do not say as well. They are the named ones of the terminal that can be read on light and on dark ground: no
yellow, no blue, no grey, no dim.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import click

from kahanmaps.display_protocols import shorten as shorten
from kahanmaps.errors import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

COLOURS = {"proved": "green", "supported": "cyan", "refuted": "red", "undecided": "magenta"}
# On a terminal long numbers are shortened to this many characters.
NUMBER_WIDTH = 40
_LABEL = 12
_WHEN = {"auto": None, "always": True, "never": False}


def on_terminal() -> bool:
    """Whether standard output is a terminal."""
    return sys.stdout.isatty()


def columns() -> int:
    """The width of the terminal."""
    return max(20, shutil.get_terminal_size().columns)


def is_coloured() -> bool:
    """Whether standard output gets colours: --color decides, NO_COLOR, FORCE_COLOR, CLICOLOR_FORCE, a terminal."""
    context = click.get_current_context(silent=True)
    if context is not None and context.color is not None:
        return context.color
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        return True
    return on_terminal() and os.environ.get("TERM") != "dumb"


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
        shown = line
        if on_terminal() and len(cells) > 1:
            label = cells[0].ljust(hang) if len(cells[0]) < hang else f"{cells[0]}  "
            shown = _filled("  ".join(cells[1:]), label, hang)
        elif on_terminal():
            margin = len(line) - len(line.lstrip())
            shown = _filled(line.lstrip(), line[:margin], margin + 4)
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
    lines = _filled(text, head, len(head)) if on_terminal() else head + text
    click.echo(paint(lines[: len(head)], style) + lines[len(head) :], color=is_coloured())


def print_table(rows: Sequence[Sequence[str]], words: int = 1) -> None:
    """Columns on a terminal, tabs elsewhere; the first `words` columns are texts, the others numbers.

    A broken number looks like two: a terminal that is too narrow for the numbers gets tabs as well.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    least = sum(min(width, 10) for width in widths[:words]) + sum(widths[words:]) + 3 * len(widths) + 1
    if not on_terminal() or least > columns():
        for row in rows:
            echo("\t".join(row))
        return
    from rich.table import Table

    table = Table(header_style="bold")
    for k, heading in enumerate(rows[0]):
        header, side = styled(heading, COLOURS.get(heading, "")), "left" if k < words else "right"
        table.add_column(header, justify=side, overflow="fold", no_wrap=k >= words)  # type: ignore[arg-type]
    for row in rows[1:]:
        table.add_row(*map(styled, row))
    console().print(table)


def _filled(text: str, first: str, hang: int) -> str:
    """The text behind `first`, in lines of the terminal's width that are broken at blanks and hang below the text."""
    margins = {"initial_indent": first, "subsequent_indent": " " * hang}
    return fill(text, columns(), **margins, replace_whitespace=False, break_on_hyphens=False) or first  # type: ignore[arg-type]


def colour_option() -> click.Option:
    """The option --color auto|always|never."""

    def choose(context: click.Context, parameter: click.Parameter, value: Any) -> None:
        if value is not None:
            context.color = _WHEN[value]

    return click.Option(
        ["--color"],
        type=click.Choice(list(_WHEN)),
        metavar="WHEN",
        callback=choose,
        expose_value=False,
        is_eager=True,
        help="Colours: auto (the default), always or never.",
    )
