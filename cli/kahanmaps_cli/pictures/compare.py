"""kahanmaps plot compare."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.pictures.output import Drawing, picture
from kahanmaps_cli.runs.comparison import comparison_options, early_messages, requested_comparison
from kahanmaps_cli.screen.progress import SearchProgress

_MAX_START_CHARACTERS = 160  # maximal number of characters of an initial point in a message


@picture(
    "compare",
    comparison_options,
    click.option(
        "--show",
        type=click.Choice(["drift", "error", "work"]),
        default="drift",
        show_default=True,
        help="What to plot: drift over the steps, error against the time step, error against evaluations of f.",
    ),
    click.option(
        "--scale",
        type=click.Choice(["loglog", "semilog"]),
        default="loglog",
        show_default=True,
        help="Scale of the axes of the drift.",
    ),
)
def command(options: dict[str, Any], progress: SearchProgress) -> Drawing:
    """Plot a comparison of methods: drift of integrals, error against step size, work against precision.

    \b
      kahanmaps plot compare henon_heiles --eps 1/20 -o drift.svg
      kahanmaps plot compare euler_top --start 1,1/2,1/3 --eps 1/10 --integral F1 \\
          --methods kahan,midpoint,rk4 --steps 100000 -o top.pdf
      kahanmaps plot compare henon_heiles --eps 1/20 --show error -o order.svg
      kahanmaps plot compare lotka_volterra --eps 1/20 --show work -o work.svg

    drift: each panel shows the relative error |I(x_n) - I(x_0)|/|I(x_0)| of one function I (the absolute error where
    I(x_0) = 0), as the maximum over each of 200 bins of steps; errors of exactly 0 lie in the gray band. error: the
    error at a fixed time, with dotted lines of the orders; a gray line marks the time step 2 eps. work: the same errors
    against the number of evaluations of f. See kahanmaps compare --help for methods and numbers.

    Exit status: 0 done, 2 usage error, 3 some orbit ended early (the picture is written).
    """
    is_drift = options["show"] == "drift"
    settings = {"orders": not is_drift, "linear_bins": options["scale"] == "semilog"}
    if not is_drift and not options["integrals"]:
        settings["integrals"] = ()  # no integrals, so that no search for integrals is started
    result = requested_comparison(options, progress, **settings)
    figure = lib.plot_comparison(result, options["style"], show=options["show"], scale=options["scale"])
    start = ",".join(map(lib.format_number, result.starts[0]))[:_MAX_START_CHARACTERS]
    more_starts = f" and {len(result.starts) - 1} more" if len(result.starts) > 1 else ""
    messages = [f"start {start}{more_starts}{lib.eps_suffix(result.eps)}", *result.remarks(), *early_messages(result)]
    for curve in result.curves:
        curve_text = f"{curve.function} along {lib.METHODS[curve.method].title}"
        if curve.undefined:
            messages.append(f"{curve_text}: no value at {lib.counted(curve.undefined, 'step')}, left out")
        if is_drift and (curve.errors > (limit := lib.clipped_from(result, curve.function))).any():
            messages.append(f"{curve_text}: errors above {limit:.0e} are an arrow at the top")
    return Drawing(figure, result.file, messages, 3 if any(run.early for run in result.runs) else 0)
