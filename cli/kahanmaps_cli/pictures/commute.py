"""kahanmaps plot commute."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_of, eps_options, in_order, inline_options, load_pair
from kahanmaps_cli.params import ExactNumber, PointText
from kahanmaps_cli.pictures.output import Drawn, picture, two_variables
from kahanmaps_cli.screen.progress import Progress


@picture(
    "commute",
    click.argument("system", required=False),
    click.argument("other", required=False),
    inline_options,
    click.option("--start", type=PointText(), metavar="X", required=True, help="The point x."),
    eps_options,
    click.option("--eps2", type=ExactNumber(), metavar="E", help="Another eps for the map of OTHER."),
    click.option(
        "--steps", type=int, metavar="N", default=1, show_default=True, help="Steps of each map: a lattice, up to 12."
    ),
    click.option("--axes", "axes", metavar="X,Y", help="The two variables shown (default: where squares are widest)."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawn:
    """The square x, Phi_f x, Phi_g x: do its two fourth corners coincide?

    \b
      kahanmaps plot commute paper_m2 --start 1/2,-1/3,0,1 --eps 1/50 \\
          -o square.pdf
      kahanmaps plot commute paper_m2 --start 1/2,-1/3,0,1 --eps 1/100 \\
          --steps 5 -o lattice.pdf
      kahanmaps plot commute euler_top zhukovski_volterra_1 \\
          --start 1,1/2,-1 --eps 1/10 -o open.svg

    For one SYSTEM, a member of the commuting family: on the left two associated maps, which commute; on the right the
    maps of H_0 and H_1, grad H_1 = A grad H_0, which do not in general. For two systems one panel.

    Blue arrows are steps of f from points that g has reached, red ones steps of g from points that f has reached. All
    points are exact: "closes exactly" means that they are equal; a gap is the largest distance in all coordinates.

    Exit status: 0 done, 2 usage error, 3 some points are missing (a map has no value there, or numbers are too long).
    """
    system, other = in_order(options["system"], options["other"], options)
    if options["eps2"] is not None and other is None:
        raise click.UsageError("--eps2 needs a second system: kahanmaps plot commute SYSTEM OTHER --eps E --eps2 E2")
    file, second = load_pair(system, other, options)
    eps = eps_of(file if second is None or file.map.has_eps else second, options)
    eps = lib.rational(1) if eps is None else eps
    chosen = two_variables("--axes", options["axes"], file.variables)
    if second is None:
        captions, pairs = list[str](), list(lib.pairs_of_member(file))
    else:
        captions = [f"{file.labelled('f')}, {second.labelled('g')}"]
        pairs = [lib.pair_of_systems(file, second, eps, options["eps2"])]
    found = [lib.squares(pair, options["start"], eps, options["steps"], progress) for pair in pairs]
    figure = lib.plot_squares(found, options["style"], chosen, captions)
    talk = []
    for square in found:
        names = captions[0] if captions else " and ".join(square.pair.names)
        talk.append(f"{names}: {square.verdict}")
        talk += [f"  {square.pair.note}"] * bool(square.pair.note)
        talk += [f"  points are missing: {square.stopped}"] * bool(square.stopped)
    is_partial = any(square.stopped for square in found)
    return Drawn(figure, file if second is None else None, talk, 3 if is_partial else 0)
