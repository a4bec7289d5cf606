"""kahanmaps completion."""

from __future__ import annotations

import os
from pathlib import Path

import click

_SHELLS = ("bash", "zsh", "fish")


@click.command("completion")
@click.argument("shell", required=False, type=click.Choice(_SHELLS))
def command(shell: str | None) -> None:
    """Print the completion script for SHELL: bash, zsh or fish (default: from $SHELL).

    \b
      kahanmaps completion bash
      eval "$(kahanmaps completion bash)"     # for this session

    \b
    For every session, add a line to your configuration file:
      ~/.bashrc                    eval "$(kahanmaps completion bash)"
      ~/.zshrc                     eval "$(kahanmaps completion zsh)"
      ~/.config/fish/config.fish   kahanmaps completion fish | source

    In zsh the line must come after compinit. The script completes commands, options and their values, and systems
    (names of the catalogue, .toml files, folders).
    """
    from click.shell_completion import get_completion_class

    from kahanmaps_cli.main import COMPLETION, cli

    name = shell or Path(os.environ.get("SHELL", "")).name
    completion = get_completion_class(name) if name in _SHELLS else None
    if completion is None:
        raise click.UsageError(f"found the shell {name[:40]!r}, expected one of {', '.join(_SHELLS)}: give it as SHELL")
    script = completion(cli, {}, "kahanmaps", COMPLETION).source()
    if name == "bash":  # type no blank after a folder or after NAME=, since the user continues this word
        offer = "COMPREPLY+=($value)"
        script = script.replace(offer, f"{offer}\n            [[ $value == *[/=] ]] && compopt -o nospace 2>/dev/null")
    click.echo(script)
