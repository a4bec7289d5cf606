"""kahanmaps find-commuting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from kahanmaps_cli.options import (
    error_bits_option,
    load_system,
    output_options,
    seconds_option,
    seed_option,
    system_options,
)
from kahanmaps_cli.progress import Progress, say
from kahanmaps_cli.render import print_json
from kahanmaps_cli.terminal import tell

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.laboratory.symmetry.commuting import CommutingField, CommutingSystems

_SHAPES = {"linear": "g = B f with a constant matrix B", "quadratic": "any quadratic g"}


@click.command("find-commuting")
@system_options
@click.option(
    "--shape",
    type=click.Choice(list(_SHAPES)),
    default="linear",
    show_default=True,
    help="linear: g = B f with a constant B; quadratic: any g of degree at most 2.",
)
@seed_option
@error_bits_option("What is supported is false with probability below 2^-BITS.")
@seconds_option(60, "Stop about then, and say what is open.")
@output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """All rational g whose Kahan map commutes with that of SYSTEM, x' = f(x), at the same eps, for every eps.

    \b
      kahanmaps find-commuting paper_m3
      kahanmaps find-commuting three_wave --shape quadratic
      kahanmaps find-commuting --vars x,y --rhs 'x^2' --rhs 'y^2 + x*y'
      kahanmaps find-commuting pair.toml --json | jq '.solutions[].B'

    First the g with [f, g] = 0 by linear algebra; then equations from the next powers of eps, solved over Q; then every
    solution is proved, or supported at random points. Nothing is lost on the way, so the list is complete unless it
    says otherwise. The solutions 0, f and -f are always there and told apart.

    Exit status: 0 the list is complete, 2 wrong use, 3 something remained open.
    """
    from kahanmaps.checks.settings import Settings
    from kahanmaps.laboratory.symmetry.commuting import commuting_systems

    file = load_system(system, options)
    seed, error_bits = options["seed"], options["error_bits"]
    settings = Settings(seed=seed, error_bits=error_bits)
    with Progress(quiet) as progress:
        found = commuting_systems(
            file.system,
            options["shape"],
            seed=seed,
            error_bits=error_bits,
            seconds=options["seconds"],
            progress=progress,
        )
    if as_json:
        context = settings.context([file], seconds=options["seconds"])
        print_json({"command": "find-commuting", **context, **found.to_json()})
    else:
        _print(file, found)
    if not quiet:
        for sentence in found.undecided:
            say(f"undecided: {sentence}")
    return 0 if found.complete else 3


def _print(file: SystemFile, found: CommutingSystems) -> None:
    tell(f"# find-commuting: {file.name}, {_SHAPES[found.shape]}, every eps (the time step is 2 eps)")
    if found.dimension is not None:
        tell(f"bracket\tthe g with [f, g] = 0 have dimension {found.dimension}")
    if found.every_g_commutes:
        tell("proved\tf = 0 and its map is x -> x: every g commutes")
    for g in found.solutions:
        if g.trivial:
            tell(f"{g.finding.verdict}\ttrivial\tg = {g.trivial}")
    told: list[Any] = []
    for g in found.nontrivial:
        if g.system.scaled(-1) in told:
            continue
        told.append(g.system)
        tell(f"{g.finding.verdict}\tg and -g\t{_pasted(g)}")
        _print_matrix(g)
        tell(f"\t{g.finding.evidence.summary}")
    for family in found.families:
        letters = [f"t{k + 1}" for k in range(len(family.directions))]
        base = "" if family.base.trivial == "0" else "base + "
        total = " + ".join(f"{t}*g{k + 1}" for k, t in enumerate(letters))
        tell(f"{family.finding.verdict}\tfamily\tg = {base}{total} for all {', '.join(letters)}")
        named = [("base", family.base)] * bool(base) + [(f"g{k + 1}", g) for k, g in enumerate(family.directions)]
        for name, g in named:
            tell(f"\t{name}\t{_pasted(g)}")
            _print_matrix(g)
        tell(f"\t{family.finding.evidence.summary}")
    if found.irrational:
        tell(f"note\tmore solutions, not rational: {'; '.join(found.irrational)}")
    if found.discarded:
        tell(f"note\t{found.discarded} solutions of the equations up to eps^{found.order} do not commute")
    shape = _SHAPES["linear"] if found.shape == "linear" else "quadratic g"
    message = f"complete: no other rational {shape} commutes"
    if found.every_g_commutes:
        message = "complete: every g commutes"
    elif not found.complete:
        message = "undecided: there may be more, see standard error"
    tell(f"# {message}")


def _pasted(g: CommutingField) -> str:
    """The system as options of any other command."""
    texts = [f"--rhs='{text}'" for text in g.rhs]
    return f"--vars {','.join(g.system.variables)} {' '.join(texts)}"


def _print_matrix(g: CommutingField) -> None:
    rows = g.to_json()["B"]
    if rows is not None:
        tell(f"\tB = [{', '.join('[' + ', '.join(row) + ']' for row in rows)}]")
