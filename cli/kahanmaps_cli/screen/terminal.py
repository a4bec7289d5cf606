"""Output on a terminal: colors, and lines broken at words with a hanging indent.

In a pipe, lines are unbroken and contain tabs. Colors appear on a terminal, or as --color requests; they carry no
information of their own. Yellow, blue and gray are illegible on some backgrounds, so they are not used.
"""

from __future__ import annotations

import os
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

VERDICT_COLORS = {"proved": "green", "supported": "cyan", "refuted": "red", "undecided": "magenta"}
# Maximal number of characters of a number on a terminal.
NUMBER_WIDTH = 40
_LABEL_WIDTH = 12  # width of the first cell of a line, its label
_COLOR_CHOICES = {"auto": None, "always": True, "never": False}


def on_terminal() -> bool:
    """Whether standard output is a terminal."""
    return sys.stdout.isatty()


def columns() -> int:
    """The width of the terminal in characters, at least 20."""
    from shutil import get_terminal_size  # imported here: shutil loads four modules for compression

    return max(20, get_terminal_size().columns)


def is_colored() -> bool:
    """Whether output is colored: --color decides, then NO_COLOR, FORCE_COLOR, CLICOLOR_FORCE, then the terminal."""
    context = click.get_current_context(silent=True)
    if context is not None and context.color is not None:
        return context.color
    if os.environ.get("NO_COLOR"):
        return False
    if any(os.environ.get(name, "0") not in ("", "0") for name in ("FORCE_COLOR", "CLICOLOR_FORCE")):
        return True
    return on_terminal() and os.environ.get("TERM") != "dumb"


def paint(text: str, style: str) -> str:
    """Return the text in a style such as "bold green" if the output is colored."""
    words = style.split()
    if not words or not is_colored():
        return text
    color = next((word for word in words if word != "bold"), None)
    return click.style(text, fg=color, bold="bold" in words or None)


def console() -> Console:
    """Return a rich console that prints markup as it is, and writes no escape sequences unless output is colored."""
    from rich.console import Console

    colored = is_colored()
    return Console(
        markup=False,
        emoji=False,
        highlight=False,
        force_terminal=colored,
        color_system="standard" if colored else None,
        width=columns(),
    )


def abbreviated(text: str, width: int = 400) -> str:
    """Return a formula, shortened to `width` if standard output is a terminal; a pipe gets the complete formula."""
    return shorten(text, width) if on_terminal() else text


def print_stdout(text: str, hang: int = _LABEL_WIDTH, style: str = "") -> None:
    """Print lines of tab-separated cells; on a terminal the first cell of a line is a label, and long lines are broken.

    Verdicts are colored, and lines that start with # are bold headings. `hang` is the width of the label.
    """
    for line in printable(text).split("\n"):
        cells = line.split("\t")
        output = line
        if on_terminal() and len(cells) > 1:
            label = cells[0].ljust(hang) if len(cells[0]) < hang else f"{cells[0]}  "
            output = _wrap("  ".join(cells[1:]), label, hang)
        elif on_terminal():
            margin = len(line) - len(line.lstrip())
            output = _wrap(line.lstrip(), line[:margin], margin + 4)
        if style or line.startswith("# "):
            output = "\n".join(paint(piece, style or "bold") if piece else "" for piece in output.split("\n"))
        for cell in cells[:2]:
            if cell in VERDICT_COLORS and not style:
                output = output.replace(cell, paint(cell, VERDICT_COLORS[cell]), 1)
        click.echo(output, color=is_colored())


def print_raw(text: str, end: str = "\n") -> None:
    """Print text on standard output without breaking lines; control characters, e.g. from a file, are escaped."""
    click.echo(printable(text) + end, nl=False)


def styled(text: str, style: str = "") -> Text:
    """Return a text as a cell of a rich table, with control characters escaped."""
    from rich.text import Text

    return Text(printable(text), style=style)


def print_entry(head: str, text: str, style: str = "") -> None:
    """Print an entry of a list whose heads have equal length; on a terminal its continuation lines are indented."""
    head, text = printable(head), printable(text)
    lines = _wrap(text, head, len(head)) if on_terminal() else head + text
    click.echo(paint(lines[: len(head)], style) + lines[len(head) :], color=is_colored())


def print_table(rows: Sequence[Sequence[str]], text_count: int = 1) -> None:
    """Print a table, tab-separated unless on a terminal; the first `text_count` columns are text, the others numbers.

    It is also tab-separated on a terminal too narrow for the numbers: a broken number would look like two numbers.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    min_width = sum(min(width, 10) for width in widths[:text_count]) + sum(widths[text_count:]) + 3 * len(widths) + 1
    if not on_terminal() or min_width > columns():
        for row in rows:
            print_raw("\t".join(row))
        return
    from rich.table import Table

    table = Table(header_style="bold")
    for k, heading in enumerate(rows[0]):
        header, justify = styled(heading, VERDICT_COLORS.get(heading, "")), "left" if k < text_count else "right"
        table.add_column(header, justify=justify, overflow="fold", no_wrap=k >= text_count)  # type: ignore[arg-type]
    for row in rows[1:]:
        table.add_row(*map(styled, row))
    console().print(table)


def _wrap(text: str, first_label: str, hang: int) -> str:
    """Break `first_label` and `text` into lines of the terminal's width; all but the first are indented by `hang`."""
    margins = {"initial_indent": first_label, "subsequent_indent": " " * hang}
    return fill(text, columns(), **margins, replace_whitespace=False, break_on_hyphens=False) or first_label  # type: ignore[arg-type]


def color_option() -> click.Option:
    """Return the option --color auto|always|never."""

    def choose(context: click.Context, parameter: click.Parameter, value: Any) -> None:
        if value is not None:
            context.color = _COLOR_CHOICES[value]

    return click.Option(
        ["--color"],
        type=click.Choice(list(_COLOR_CHOICES)),
        metavar="WHEN",
        callback=choose,
        expose_value=False,
        is_eager=True,
        help="Color the output: auto (default; on a terminal), always or never.",
    )
