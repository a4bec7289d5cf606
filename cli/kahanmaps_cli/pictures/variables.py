"""Two variables on the command line, X,Y: the axes of a picture."""

from __future__ import annotations

import click


def two_variables(option: str, text: str | None, variables: tuple[str, ...]) -> tuple[int, int] | None:
    """The numbers of two variables that the text names; None for none."""
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or any(name not in variables for name in names):
        raise click.UsageError(
            f"found {option} {text[:60]}, expected two of the variables {', '.join(variables)}, as X,Y"
        )
    if names[0] == names[1] and len(variables) > 1:
        raise click.UsageError(f"found {option} {text[:60]}, expected two different variables")
    return variables.index(names[0]), variables.index(names[1])
