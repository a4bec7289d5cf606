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
    opt.eps_options,
)
def command(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot rotation numbers along a segment of initial points, for a member of the commuting family.

    \b
      kahanmaps plot rotation nahm_tetrahedral --eps 1/10 --from 1/10,1/5 \\
          --to 2,3 -o rotation.pdf

    Solid lines are the rotation numbers of the map, one for each real root of chi;
    dashed lines are those of its second iterate, where the map exchanges two real
    components; dotted lines are those of the flow. Horizontal lines mark some of
    the resonances 1/n. See kahanmaps geometry --help.

    Exit status: 0 done, 2 usage error.
    """
    file = opt.load_system(options["system"], options)
    normal_form = file.normal_form
    if isinstance(normal_form, lib.NoNormalForm):
        raise lib.InputError(f"{file.name} has no rotation numbers here: {normal_form.reason}")
    eps = opt.requested_eps(options["eps"], options["time_step"])
    for end in (options["first"], options["last"]):
        file.map.at(eps, lib.QQ).point(end)
    progress("rotation numbers")
    ends = options["first"], options["last"]
    return Drawing(lib.plot_rotation(normal_form, eps, *ends, options["style"], points=options["points"]), file)
