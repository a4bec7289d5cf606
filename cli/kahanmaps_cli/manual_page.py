"""The manual page, made of the commands themselves: the same text for the same commands, whatever the terminal."""

from __future__ import annotations

import re
from collections.abc import Iterator
from inspect import cleandoc
from textwrap import wrap

import click

from kahanmaps_cli.colour_option import is_colour_option

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
    "2": "Wrong use or bad input: the message says what was found, what was expected, and what to do.",
    "3": "Undecided, or stopped early: a singular point, a digit budget, the clock.",
    "70": "An internal error.",
    "130": "Interrupted by Ctrl-C or SIGTERM.",
}
_FILES = {
    "*.toml": "A system: its variables, right-hand sides or Hamiltonian, parameters, and what is claimed of it; "
    "or the spec of a batch.",
    "*.db": "The results of a batch.",
    "*.jsonl, *.csv, *.npz, *.npy": "Orbits.",
}


def manual_page(group: click.Group, sections: dict[str, list[str]], version: str) -> str:
    """The page in the man macros of roff; `sections` are the headings and the commands below them."""
    context = click.Context(group, info_name="kahanmaps")
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
        *_text(group.help or ""),
        ".PP",
        *_filled(_SYSTEM),
        ".SS Options",
        *_options(group, context),
    ]
    for heading, names in sections.items():
        lines.append(f".SH {_escaped(heading.upper())}")
        for name in names:
            command = group.get_command(context, name)
            if command is not None:
                lines += _command(command, f"kahanmaps {name}", context)
    lines += [".SH EXIT STATUS", *_list(_STATUS), ".SH ENVIRONMENT", *_list(_ENVIRONMENT), ".SH FILES", *_list(_FILES)]
    return "\n".join(lines) + "\n"


def _command(command: click.Command, words: str, context: click.Context) -> Iterator[str]:
    yield f".SS {_escaped(words)}"
    own = click.Context(command, info_name=words, parent=context)
    arguments = [parameter for parameter in command.params if isinstance(parameter, click.Argument)]
    usage = [words, "[options]", *(_argument(argument) for argument in arguments)]
    below = []
    if isinstance(command, click.Group):
        below = [command.get_command(own, name) for name in command.list_commands(own)]
    yield _escaped(" ".join([*usage, "command ..."] if below else usage))
    yield ".PP"
    yield from _text(command.help or "")
    yield from _options(command, own)
    for other in below:
        if other is not None:
            yield from _command(other, f"{words} {other.name}", own)


def _argument(argument: click.Argument) -> str:
    name = (argument.metavar or str(argument.name)).upper() + ("..." if argument.nargs == -1 else "")
    return name if argument.required else f"[{name}]"


def _options(command: click.Command, context: click.Context) -> Iterator[str]:
    for option in command.params:
        if not isinstance(option, click.Option) or option.hidden:
            continue
        if context.parent is not None and is_colour_option(option):  # told once, at the top
            continue
        names = option.opts[:1] if getattr(option, "old_names", False) else sorted(option.opts, key=len)
        metavar = "" if option.is_flag or option.count else _metavar(option)
        yield ".TP"
        yield f"\\fB{_escaped(', '.join(names))}\\fR" + (f" \\fI{_escaped(metavar)}\\fR" if metavar else "")
        default = ""
        if option.show_default and option.default is not None:
            default = f" [default: {option.default}]"
        elif option.required:
            default = " [required]"
        yield from _filled(f"{option.help or ''}{default}")


def _metavar(option: click.Option) -> str:
    if option.metavar:
        return option.metavar
    if isinstance(option.type, click.Choice):
        return "|".join(map(str, option.type.choices))
    return option.type.name.upper()


def _list(entries: dict[str, str]) -> Iterator[str]:
    for term, text in entries.items():
        yield from (".TP", f".B {_escaped(term)}", *_filled(text))


def _text(text: str) -> Iterator[str]:
    """Paragraphs, and as they stand those that follow the mark for click.

    Python 3.13 takes the common indentation from docstrings, the versions before do not: `cleandoc` makes them equal.
    """
    for k, paragraph in enumerate(re.split(r"\n\s*\n", cleandoc(text))):
        if k:
            yield ".PP"
        lines = paragraph.split("\n")
        if lines[0].strip() == "\b":
            yield from (".EX", *(_escaped(line) for line in lines[1:]), ".EE")
        else:
            yield from _filled(" ".join(line.strip() for line in lines))


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
