"""The option --certificate of checks and searches: it writes a script in which another program verifies the proofs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.commands.convert import write_text
from kahanmaps_cli.screen.outputs import OutputFile
from kahanmaps_cli.screen.progress import print_stderr

CHECKERS = {".v": "rocq", ".gp": "gp", ".py": "sympy"}


def _with_known_ending(ctx: click.Context, param: click.Parameter, path: str | None) -> str | None:
    if path is not None and Path(path).suffix not in CHECKERS:
        raise click.UsageError(f"found --certificate {path}, expected a file that ends with .v, .gp or .py")
    return path


certificate_option = click.option(
    "--certificate",
    type=OutputFile(),
    metavar="FILE",
    callback=_with_known_ending,
    help="Also write a proof that Coq (FILE.v), PARI/GP (FILE.gp) or SymPy (FILE.py) checks.",
)


def refuse_certificate_with_eps(options: dict[str, Any]) -> None:
    """Refuse --certificate with --eps before the computation."""
    if options["certificate"] is not None and any(options.get(name) is not None for name in ("eps", "time_step")):
        raise click.UsageError("a certificate is about every eps: give --certificate or --eps, not both")


def write_certificate(options: dict[str, Any], name: str, write: Callable[[str], Any], status: int = 0) -> int:
    """Write the certificate if requested; return `status`, or 3 instead of 0 if no certificate could be written."""
    path = options["certificate"]
    if path is None:
        return status
    checker = CHECKERS[Path(path).suffix]
    try:
        text = write(checker)
    except lib.InputError as error:
        print_stderr(f"{path} is not written: {error}")
        return status or 3
    if not options["quiet"]:
        print_stderr(f"{name}: {text.summary}")
    write_text(text, f"{name}: a certificate for {checker}", path, options["quiet"])
    return status
