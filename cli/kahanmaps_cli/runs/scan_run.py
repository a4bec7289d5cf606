"""Options and execution of a scan of degree growth over parameters, shared by `scan` and `plot scan`."""

from __future__ import annotations

import os
from collections.abc import Callable
from threading import Event
from typing import Any, TypeVar

import click

from kahanmaps import internals as lib
from kahanmaps.errors import quoted
from kahanmaps_cli import options as opt
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.signals import INTERRUPTED, interruptible

F = TypeVar("F", bound=Callable[..., Any])

scan_options: Callable[[F], F] = opt.stack(
    opt.system_options,
    click.option(
        "--over",
        required=True,
        metavar="A,B,...",
        help="Names of the parameters to vary, at most 8; eps may be one of them.",
    ),
    opt.eps_options,
    click.option("--terms", type=int, metavar="N", help="Compute d_1, ..., d_N (default: at most 7)."),
    click.option(
        "--primes",
        metavar="P,Q,...",
        help="Compute modulo these primes, at least three (default: depends on the number of parameters).",
    ),
    opt.effort_options,
    click.option(
        "-j", "--jobs", type=int, metavar="N", help="Number of threads, used with numba (default: all processors)."
    ),
    opt.seed_option,
)


def names_of(options: dict[str, Any]) -> list[str]:
    """Return the names of the parameters given by --over."""
    names = [name.strip() for name in options["over"].split(",") if name.strip()]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise click.UsageError(f"found {quoted(repeated)} twice in --over, expected different parameters")
    return names


def run_scan(system: str | None, quiet: bool, options: dict[str, Any]) -> tuple[lib.Scan, SearchProgress]:
    """Run the scan that a command line requests; return its result and its progress, which counts the units of work."""
    names = names_of(options)
    if opt.is_inline(options, system):
        assigned_names = {"eps", *(name for name, _ in options["parameters"])}
        options["parameters"] = (*options["parameters"], *((name, "1") for name in names if name not in assigned_names))
    if "eps" in names and (options.get("as_toml") or options.get("folder") is not None):
        raise click.UsageError(
            "system files contain no eps: leave eps out of --over, or leave out --toml and --write-to"
        )
    file = opt.load_system(system, {**options, "quiet": quiet})
    has_begun, stop_requested = Event(), Event()

    def on_progress(sentence: str) -> None:
        has_begun.set()
        if stop_requested.is_set():
            raise lib.TimeOver
        search(sentence)

    def interrupt() -> None:
        if not has_begun.is_set():
            # Code may still be compiled, for up to ten seconds: there is no partial result yet, and an exception in a
            # callback of the compiler would be lost.
            os.write(2, b"interrupted\n")
            os._exit(INTERRUPTED)
        stop_requested.set()

    with SearchProgress({**options, "quiet": quiet}) as search, interruptible(interrupt):
        result = lib.scan(
            file,
            names,
            eps=opt.requested_eps(options["eps"], options["time_step"], required=False),
            **opt.pick(options, "terms", "effort", "seed", "jobs"),
            primes=primes_of(options["primes"]),
            analysis=options.get("analysis"),
            progress=on_progress,
        )
    return result, search


def ending(result: lib.Scan, search: SearchProgress) -> int:
    """Print why the scan stopped early, if it did; return the exit status."""
    if search.is_over:
        return 3
    if result.ended == "complete":
        return 0
    is_interrupted = result.ended == "interrupted"
    if not search.quiet:
        reason = "interrupted" if is_interrupted else "work limit reached; raise --effort"
        print_stderr(f"stopped early: {reason}; not done: {', '.join(result.omitted)}")
    return INTERRUPTED if is_interrupted else 3


def primes_of(text: str | None) -> list[int] | None:
    """Return the primes given by --primes."""
    if text is None:
        return None
    pieces = [piece.strip() for piece in text.split(",")]
    if not all(piece.isascii() and piece.isdigit() and len(piece) < 10 for piece in pieces):
        raise click.UsageError(f"found --primes {text[:60]!r}, expected primes separated by commas")
    return [int(piece) for piece in pieces]
