"""The manual page: what --help says of every command, as it stands, and what holds for all of them."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap

import click

_SYSTEM = (
    "SYSTEM is a file (docs/system-files.md describes the format), a name of the catalogue, - for standard input, or "
    "left out for a system that stands on the line: --rhs \"x' = x*y; y' = -x^2\". Data goes to standard output, "
    "progress and talk to standard error."
)
_ENVIRONMENT = {
    "KAHANMAPS_DB": "The database of a batch, where --db is not given.",
    "KAHANMAPS_DEBUG": "Show where an internal error happened.",
    "NO_COLOR": "No colours, unless --color always asks for them.",
    "FORCE_COLOR, CLICOLOR_FORCE": "Colours also where standard output is no terminal.",
    "COLUMNS": "The width that lines are broken for, on a terminal.",
    "SHELL": "The shell that completion is for.",
}
_STATUS = {
    "0": "The work is done, or the claim holds (proved or supported).",
    "1": "Refuted, and nothing else.",
    "2": "Usage error or bad input: the message says what was found, what was expected, and what to do.",
    "3": "Undecided, or stopped early: a singular point, a digit budget, the clock; or standard output is closed.",
    "70": "An internal error.",
    "130": "Interrupted by Ctrl-C or SIGTERM.",
}
_FILES = {
    "*.toml": "A system: its variables, right-hand sides or Hamiltonian, parameters, and what is claimed of it; "
    "or the spec of a batch.",
    "*.db": "The results of a batch.",
    "*.jsonl, *.csv, *.npz, *.npy": "Orbits.",
    "*.csv.meta.json": "What the orbit in the .csv file beside it is of, and how it ended.",
}
_WIDTH = 72


def manual_page(group: click.Group, sections: dict[str, list[str]], version: str) -> str:
    """The page in the man macros of roff, whatever the terminal; `sections` are the headings and their commands."""
    settings = {**group.context_settings, "terminal_width": _WIDTH, "max_content_width": _WIDTH}
    context = click.Context(group, info_name="kahanmaps", **settings)
    lines = [
        '.\\" Made by: kahanmaps manual',
        f'.TH KAHANMAPS 1 "" "kahanmaps {version}" "User Commands"',
        ".SH NAME",
        "kahanmaps \\- Kahan (Hirota\\-Kimura) maps of quadratic systems, exactly",
        ".SH SYNOPSIS",
        ".B kahanmaps",
        ".RI [ options ]",
        ".I command",
        ".RI [ arguments ]",
        ".SH DESCRIPTION",
        *_as_it_stands(group.get_help(context)),
        ".PP",
        *_filled(_SYSTEM),
    ]
    for heading, names in sections.items():
        lines.append(f".SH {_escaped(heading.upper())}")
        for name in names:
            lines += _command(group, name, context)
    lines += [".SH EXIT STATUS", *_list(_STATUS), ".SH ENVIRONMENT", *_list(_ENVIRONMENT), ".SH FILES", *_list(_FILES)]
    return "\n".join(lines) + "\n"


def _command(group: click.Group, name: str, context: click.Context) -> Iterator[str]:
    command = group.get_command(context, name)
    if command is None:
        return
    own = click.Context(command, info_name=name, parent=context)
    yield f".SS {_escaped(own.command_path)}"
    yield from _as_it_stands(command.get_help(own))
    if isinstance(command, click.Group):
        for other in command.list_commands(own):
            yield from _command(command, other, own)


def _as_it_stands(text: str) -> list[str]:
    return [".EX", *(_escaped(line.rstrip()) for line in text.splitlines()), ".EE"]


def _list(entries: dict[str, str]) -> Iterator[str]:
    for term, text in entries.items():
        yield from (".TP", f".B {_escaped(term)}", *_filled(text))


def _filled(text: str) -> list[str]:
    """Lines of roff for a text that is filled anyway."""
    return [_escaped(line) for line in wrap(text, 72, break_long_words=False, break_on_hyphens=False)]


def _escaped(text: str) -> str:
    """Text in which nothing is a request, and what is to be typed can be copied from the page."""
    for character, escape in (
        ("\\", "\\e"),
        ("-", "\\-"),
        ("'", "\\(aq"),
        ("`", "\\(ga"),
        ("^", "\\(ha"),
        ("~", "\\(ti"),
    ):
        text = text.replace(character, escape)
    return f"\\&{text}" if text.startswith(".") else text
