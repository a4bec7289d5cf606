"""What a misspelt name may have meant: groups that suggest commands, and errors of click in the words of the others."""

from __future__ import annotations

import re

import click


class SuggestingGroup(click.Group):
    """A group that suggests commands where a name is none."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        known = self.list_commands(ctx)
        if args and args[0] not in known and not args[0].startswith("-") and not ctx.resilient_parsing:
            raise click.UsageError(f"There is no command {args[0]!r}.{self.hint(args[0], known)}", ctx)
        return super().resolve_command(ctx, args)

    def hint(self, written: str, known: list[str]) -> str:
        """A sentence about what may have been meant, after a blank; empty where nothing is like it."""
        close = close_to(written, known, 0.5)
        return f" Did you mean {' or '.join(close)}?" if close else ""


def close_to(written: str, known: list[str], cutoff: float = 0.6) -> list[str]:
    """Up to three of the known words that are like the one that was written."""
    from difflib import get_close_matches

    return get_close_matches(written, known, n=3, cutoff=cutoff)


def in_our_words(error: click.ClickException) -> click.ClickException:
    """The error with what was found and what was expected, and where a choice is misspelt with one that is like it."""
    if not isinstance(error, click.BadParameter) or error.param is None:
        return error
    message = error.message
    if found := re.fullmatch(r"'(.*)' is not a valid (integer|float)\.", message, re.DOTALL):
        message = f"found {found[1]!r}, expected {'an integer' if found[2] == 'integer' else 'a number'}"
    elif found := re.fullmatch(r"(\S+) is not in the range (.*)\.", message):
        message = f"found {found[1]}, expected {found[2].replace('<=x<=', ' to ').replace('x>=', 'at least ')}"
    elif isinstance(error.param.type, click.Choice) and (found := re.match(r"'([^']*)' is not one of ", message)):
        close = close_to(found[1].lower(), [str(choice) for choice in error.param.type.choices])
        message += f" Did you mean {' or '.join(close)}?" if close else ""
    if message == error.message:
        return error
    return click.BadParameter(message, error.ctx, error.param, error.param_hint)
