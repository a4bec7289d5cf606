"""kahanmaps plot commute."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_of, eps_options, in_order, inline_options, load_pair
from kahanmaps_cli.params import ExactNumber, PointText
from kahanmaps_cli.pictures.output import Drawing, picture, two_variables
from kahanmaps_cli.screen.progress import Progress


@picture(
    "commute",
    click.argument("system", required=False),
    click.argument("other", required=False),
    inline_options,
    click.option("--start", type=PointText(), metavar="X", required=True, help="The point x, e.g. 1/2,-1/3,0,1."),
    eps_options,
    click.option(
        "--eps2", type=ExactNumber(), metavar="E", help="Half the time step of the map of OTHER (default: as --eps)."
    ),
    click.option(
        "--steps",
        type=int,
        metavar="N",
        default=1,
        show_default=True,
        help="Steps of each map, at most 12: more than one give a lattice.",
    ),
    click.option(
        "--axes",
        "axes",
        metavar="X,Y",
        help="Two variables to project to (default: those in which the squares are widest).",
    ),
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Draw x, Phi_f x and Phi_g x, and both candidates for the fourth corner of the square.

    \b
      kahanmaps plot commute paper_m2 --start 1/2,-1/3,0,1 --eps 1/50 \\
          -o square.pdf
      kahanmaps plot commute paper_m2 --start 1/2,-1/3,0,1 --eps 1/100 \\
          --steps 5 -o lattice.pdf
      kahanmaps plot commute euler_top zhukovski_volterra_1 \\
          --start 1,1/2,-1 --eps 1/10 -o open.svg

    The maps commute at x if the two candidates coincide. For one SYSTEM, a member of the commuting family, the left
    panel shows two associated maps, which commute, and the right one the maps of H_0 and H_1, where
    grad H_1 = A grad H_0, which in general do not. Two systems have one panel.

    Blue arrows are steps of f, red ones steps of g. All points are exact: "closes exactly" means equality; the gap is
    the largest Euclidean distance of corresponding points.

    Exit status: 0 done, 2 usage error, 3 some points are missing (indeterminacy points, or numbers too long).
    """
    system, other = in_order(options["system"], options["other"], options)
    if options["eps2"] is not None and other is None:
        raise click.UsageError("--eps2 needs a second system: kahanmaps plot commute SYSTEM OTHER --eps E --eps2 E2")
    file, second_file = load_pair(system, other, options)
    eps = eps_of(file if second_file is None or file.map.has_eps else second_file, options)
    eps = lib.rational(1) if eps is None else eps
    axes = two_variables("--axes", options["axes"], file.variables)
    if second_file is None:
        captions, pairs = list[str](), list(lib.pairs_of_member(file))
    else:
        captions = [f"{file.labelled('f')}, {second_file.labelled('g')}"]
        pairs = [lib.pair_of_systems(file, second_file, eps, options["eps2"])]
    squares_of_pairs = [lib.squares(pair, options["start"], eps, options["steps"], progress) for pair in pairs]
    figure = lib.plot_squares(squares_of_pairs, options["style"], axes, captions)
    messages = []
    for square in squares_of_pairs:
        names = captions[0] if captions else " and ".join(square.pair.names)
        messages.append(f"{names}: {square.verdict}")
        messages += [f"  {square.pair.note}"] * bool(square.pair.note)
        messages += [f"  points are missing: {square.stop_reason}"] * bool(square.stop_reason)
    is_partial = any(square.stop_reason for square in squares_of_pairs)
    return Drawing(figure, file if second_file is None else None, messages, 3 if is_partial else 0)
