"""kahanmaps plot rotation."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import PointText, Whole
from kahanmaps_cli.pictures.output import Drawing, picture
from kahanmaps_cli.screen.progress import SearchProgress


@picture(
    "rotation",
    opt.system_options,
    click.option("--from", "first", type=PointText(), metavar="X", required=True, help="First initial point."),
    click.option("--to", "last", type=PointText(), metavar="X", required=True, help="Last initial point."),
    click.option("--points", type=Whole(2), default=200, show_default=True, metavar="N", help="Number of points."),
    click.option(
        "--against", metavar="NAME", help="Horizontal axis: a declared integral (default: position on the segment)."
    ),
    opt.eps_options,
)
def command(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot rotation numbers along a segment of initial points.

    \b
      kahanmaps plot rotation nahm_tetrahedral --eps 1/10 --from 1/10,1/5 \\
          --to 2,3 -o rotation.pdf
      kahanmaps plot rotation mcmillan --from 1/10,1/10 --to 2/5,1/2 \\
          --against I -o mcmillan.pdf

    SYSTEM is a member of the commuting family, which has a rotation number for each
    real root of chi, or any map whose orbits lie on curves of genus 1 or 0. Solid
    lines belong to the map; dashed lines to an iterate of it, such as the second
    one where the map exchanges two real components; dotted lines to the flow of a
    member. Horizontal lines mark resonances p/q. Initial points without a rotation
    number are left out. See kahanmaps geometry --help.

    Exit status: 0 done, 2 usage error.
    """
    file = opt.load_system(options["system"], options)
    eps = opt.eps_of(file, options)
    progress("rotation numbers")
    settings = {name: options[name] for name in ("points", "against")}
    return Drawing(lib.plot_rotation(file, eps, options["first"], options["last"], options["style"], **settings), file)
