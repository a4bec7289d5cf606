"""The reference of the command line, from the commands themselves."""

from __future__ import annotations

import re

import click

from kahanmaps_cli.main import SECTIONS, cli
from kahanmaps_docs.markdown import block, code, plain, table


def commands() -> str:
    """A section for every command, under the headings and in the order of `kahanmaps --help`."""
    main = click.Context(cli, info_name="kahanmaps", **cli.context_settings)  # click keeps the help option it makes
    pieces = []
    for heading, names in SECTIONS.items():
        pieces.append(f"## {plain(heading)}\n")
        for name in names:
            command = cli.get_command(main, name)
            assert command is not None
            pieces.append(section(command, name, main, 3))
    return "\n".join(pieces)


def section(command: click.Command, name: str, parent: click.Context, depth: int) -> str:
    """A command and, below it, its own commands."""
    context = click.Context(command, info_name=name, parent=parent)
    path = context.command_path.removeprefix("kahanmaps ")
    usage = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
    pieces = [
        f"(command-{path.replace(' ', '-')})=\n{'#' * depth} {path}\n",
        block(usage),
        *help_text(command.help or ""),
    ]
    rows = []
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None and record[1] and "--help" not in record[0]:
            rows.append((code(record[0]), prose(record[1])))
    if rows:
        pieces.append(table(("option", ""), rows))
    if isinstance(command, click.Group):
        for below in command.list_commands(context):
            result = command.get_command(context, below)
            assert result is not None
            pieces.append(section(result, below, context, depth + 1))
    return "\n".join(pieces)


def help_text(text: str) -> list[str]:
    """Paragraphs, and as code what the help keeps in lines (after a line with the character \\b): examples, lists."""
    results = []
    for paragraph in re.split(r"\n\s*\n", text.strip()):
        lines = paragraph.split("\n")
        if lines[0].strip() != "\b":
            results.append(prose(" ".join(paragraph.split())) + "\n")
            continue
        kept = lines[1:]
        # A line at the margin says what the indented ones below it are.
        if len(kept) > 1 and kept[0].endswith(":") and not kept[0].startswith(" "):
            results.append(prose(kept.pop(0)) + "\n")
        indent = min((len(line) - len(line.lstrip()) for line in kept if line.strip()), default=0)
        results.append(block("\n".join(line[indent:] for line in kept)))
    return results


def prose(text: str) -> str:
    """Text of a help, the options in it as code."""
    return re.sub(r"(?<![\w-])--[a-z][a-z-]*", lambda option: code(option[0]), plain(text))
