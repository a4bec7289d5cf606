"""Command groups that suggest commands for misspelt names; errors of click reworded like all other messages."""

from __future__ import annotations

import re
from typing import ClassVar

import click

from kahanmaps.errors import quoted


class SuggestingGroup(click.Group):
    """A command group that suggests similar commands for an unknown name, and replacements for a removed command."""

    removed: ClassVar[dict[str, str]] = {}  # name of a removed command -> what to use instead

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        names = self.list_commands(ctx)
        if args and args[0] not in names and not args[0].startswith("-") and not ctx.resilient_parsing:
            if args[0] in self.removed:
                raise click.UsageError(f"{args[0]} was removed in 0.3.0: {self.removed[args[0]]}.", ctx)
            raise click.UsageError(f"There is no command {quoted(args[0])}.{self.hint(args[0], names)}", ctx)
        return super().resolve_command(ctx, args)

    def hint(self, written: str, names: list[str]) -> str:
        """Return ' Did you mean ...?' with commands similar to `written`, or an empty text if there are none."""
        extensions = [name for name in names if len(written) > 2 and name.startswith(f"{written}-")]
        similar_names = extensions or similar_words_of(written, names, 0.5)
        return f" Did you mean {' or '.join(similar_names)}?" if similar_names else ""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands, each with its complete one-line help, which click would shorten."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [
            (name, command.get_short_help_str(limit=1000))
            for name, command in commands
            if command and not command.hidden
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def similar_words_of(written: str, words: list[str], cutoff: float = 0.6) -> list[str]:
    """Return up to three of `words`: the word most similar to `written`, and others that are nearly as similar."""
    from difflib import SequenceMatcher, get_close_matches

    similar_words = get_close_matches(written, words, n=3, cutoff=cutoff)
    ratios = [SequenceMatcher(None, candidate, written).ratio() for candidate in similar_words]
    return [candidate for candidate, ratio in zip(similar_words, ratios, strict=True) if ratio > ratios[0] - 0.15]


# (command, removed option) -> what to use instead
REMOVED_OPTIONS = {
    **{
        ("report", name): "'kahanmaps batch show' shows the results of a batch, 'batch export' writes them for pandas"
        for name in ("--db", "--by", "--value")
    },
    ("cycles", "--reversor"): "cycles are counted by length and compared with no law",
    ("ensemble", "--arithmetic"): "ensembles are in floating point; kahanmaps orbit has exact, mod:P and ball:BITS",
    ("plot portrait", "--density"): "kahanmaps ensemble -o FILE.npy and numpy.histogram2d count points in cells",
    ("plot portrait", "--from"): "a portrait is computed from a SYSTEM; matplotlib draws the points of a file",
    ("scan", "--by"): "scans compare degrees; kahanmaps batch has find-integrals and find-density over ranges",
    ("plot scan", "--by"): "scans compare degrees; kahanmaps batch has find-integrals and find-density over ranges",
    ("scan", "--keep"): "kahanmaps batch run with the task scan keeps each result, and goes on where it was",
    ("scan", "--shard"): "kahanmaps batch run has --shard I/N",
}


def rephrase(error: click.ClickException) -> click.ClickException:
    """Reword an error of click, usually to "found X, expected Y", with a suggestion for a misspelt choice."""
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        command = error.ctx.command_path.removeprefix("kahanmaps ")
        replacement = REMOVED_OPTIONS.get((command, error.option_name))
        if replacement is not None:
            return click.UsageError(f"{error.option_name} was removed in 0.3.0: {replacement}.", error.ctx)
        return error
    if not isinstance(error, click.BadParameter) or error.param is None:
        return error
    if isinstance(error, click.MissingParameter):
        is_described = isinstance(error.param.type, click.Choice) or not isinstance(error.param, click.Option)
        text = f"{error.format_message().removesuffix('.')}: {getattr(error.param, 'help', '')}"
        return error if is_described else click.UsageError(text, error.ctx)
    message = error.message
    if match := re.fullmatch(r"'(.*)' is not a valid (integer|float)(?: range)?\.", message, re.DOTALL):
        message = f"found {quoted(match[1])}, expected {'an integer' if match[2] == 'integer' else 'a number'}"
    elif match := re.fullmatch(r"(\S+) is not in the range (.*)\.", message):
        message = f"found {match[1][:40]}, expected {match[2].replace('<=x<=', ' to ').replace('x>=', 'at least ')}"
    elif isinstance(error.param.type, click.Choice) and (match := re.match(r"'([^']*)' is not one of ", message)):
        similar_choices = similar_words_of(match[1].lower(), [str(choice) for choice in error.param.type.choices])
        message += f" Did you mean {' or '.join(similar_choices)}?" if similar_choices else ""
    if message == error.message:
        return error
    return click.BadParameter(message, error.ctx, error.param, error.param_hint)
