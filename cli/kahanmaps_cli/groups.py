"""Groups of commands that know what a misspelt name may have meant."""

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


def with_hint(error: click.ClickException) -> click.ClickException:
    """The error; where a value is none of the choices its message says which one is like it."""
    if isinstance(error, click.BadParameter) and error.param is not None and isinstance(error.param.type, click.Choice):
        found = re.match(r"'([^']*)' is not one of ", error.message)
        close = close_to(found[1].lower(), [str(choice) for choice in error.param.type.choices]) if found else []
        if close:
            message = f"{error.message} Did you mean {' or '.join(close)}?"
            return click.BadParameter(message, error.ctx, error.param, error.param_hint)
    return error
