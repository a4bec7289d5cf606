"""kahanmaps plot drift."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_options, integral_option, load_system, requested_eps, seed_option, system_options
from kahanmaps_cli.params import PointText
from kahanmaps_cli.pictures.output import Drawing, picture
from kahanmaps_cli.screen.progress import Progress

_MAX_START = 160  # characters
_MAX_INTEGRALS = 3  # shown by default


@picture(
    "drift",
    system_options,
    click.option(
        "--start", type=PointText(), metavar="X", help="Initial point (default: a random point near the origin)."
    ),
    eps_options,
    click.option(
        "--steps", type=int, metavar="N", default=10_000, show_default=True, help="Number of steps of each orbit."
    ),
    integral_option(
        "Function to plot: an expression in the variables and eps, the name of a known integral, or 'known' for all. "
        "Repeatable."
    ),
    click.option(
        "--method",
        "methods",
        type=click.Choice(["generic", "normal-form", "rk4", "midpoint"]),
        multiple=True,
        help="Integration method (default: all available). Repeatable.",
    ),
    click.option(
        "--scale",
        type=click.Choice(["loglog", "semilog"]),
        default="loglog",
        show_default=True,
        help="Scale of the axes.",
    ),
    seed_option,
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Plot the drift of integrals along floating-point orbits: Kahan, RK4, implicit midpoint.

    \b
      kahanmaps plot drift henon_heiles --eps 1/20 -o drift.svg
      kahanmaps plot drift weierstrass --eps 1/50 --steps 100000 -o drift.pdf
      kahanmaps plot drift euler_top --start 1,1/2,1/3 --eps 1/10 --integral F1 \\
          -o top.svg
      kahanmaps plot drift harmonic --eps 1/10 --integral E=x^2+y^2 -o e.png

    Each panel shows the relative error |I(x_n) - I(x_0)|/|I(x_0)| of one function I
    (the absolute error where I(x_0) = 0). All methods use the time step 2 eps. The
    Kahan map conserves the integrals that depend on eps; H is the Hamiltonian of
    the differential equation. The maximum over each of 200 bins of steps is
    plotted; errors of exactly 0 lie in the gray band.

    Exit status: 0 done, 2 usage error, 3 some orbit ended early (the picture is
    written).
    """
    file = load_system(options["system"], options)
    real_approximation = file.real_approximation
    system = real_approximation.system  # a vector field, since the other methods need one
    eps = requested_eps(options["eps"], options["time_step"])
    if eps == 0:
        raise lib.InputError("found eps = 0, expected another number: at eps = 0 every map is the identity")
    messages: list[str] = []
    if options["integrals"]:
        functions = lib.requested_functions(real_approximation, eps, options["integrals"])
    else:
        known_integrals = lib.known_functions(real_approximation, eps)
        map_integrals = [function for function in known_integrals if function.name != "H"]
        if len(map_integrals) > _MAX_INTEGRALS:
            messages.append(
                f"shown: {_MAX_INTEGRALS} of {len(map_integrals)} known integrals; --integral NAME shows others"
            )
        functions = map_integrals[:_MAX_INTEGRALS] + [function for function in known_integrals if function.name == "H"]
    form, reason = lib.float_normal_form(real_approximation)
    methods = options["methods"] or [name for name in lib.METHODS if name != "normal-form" or form is not None]
    if "normal-form" in methods and form is None:
        raise lib.InputError(f"the method normal-form needs a normal form, and there is none: {reason}")
    start = options["start"] or lib.small_start(system, eps, options["seed"])
    survey = lib.survey_drift(
        system,
        eps,
        start,
        options["steps"],
        functions,
        list(dict.fromkeys(methods)),
        form=form,
        linear_bins=options["scale"] == "semilog",
        progress=progress,
    )
    point = ",".join(lib.format_number(entry) for entry in survey.start)
    point = point if len(point) <= _MAX_START else point[:_MAX_START] + "..."
    messages.append(f"start {point}{lib.eps_suffix(survey.eps)}")
    for name, is_relative in survey.relative.items():
        if not is_relative:
            messages.append(f"{name}: absolute errors, for it is 0 at the start")
    for curve in survey.curves:
        if curve.undefined:
            missing = lib.counted(curve.undefined, "step")
            messages.append(f"{curve.function} along {lib.METHODS[curve.method]}: no value at {missing}, left out")
        if (curve.errors > (limit := lib.clipped_from(survey, curve.function))).any():
            curve_name = f"{curve.function} along {lib.METHODS[curve.method]}"
            messages.append(f"{curve_name}: errors above {limit:.0e} are an arrow at the top")
    for method, end in survey.ends.items():
        if not end.is_complete:
            messages.append(f"{lib.METHODS[method]} ended early: {end.message}")
    early = not all(end.is_complete for end in survey.ends.values())
    figure = lib.plot_drift(survey, options["style"], scale=options["scale"])
    return Drawing(figure, file, messages, 3 if early else 0)
