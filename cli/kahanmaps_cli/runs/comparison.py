"""The options that `compare` and `plot compare` share, and the comparison that they request."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.params import ParameterKind
from kahanmaps_cli.runs.ensemble_starts import requested_starts, require_one_kind_of_starts

comparison_options: Callable[[opt.F], opt.F] = opt.stack(
    opt.system_options,
    opt.given_starts_options,
    opt.eps_options,
    click.option(
        "--steps", type=int, metavar="N", default=10_000, show_default=True, help="Number of steps of each orbit."
    ),
    click.option(
        "--methods",
        type=ParameterKind("methods", lambda text: [name.strip() for name in text.split(",")]),
        metavar="M1,M2,...",
        help="Methods, all with the time step 2 eps: kahan, normal-form, euler, symplectic-euler, stormer-verlet, "
        "midpoint, rk4, gauss4, yoshida4, suzuki4, yoshida6 (default: kahan,midpoint,rk4,gauss4,suzuki4,yoshida6).",
    ),
    opt.integral_option(
        "Function whose drift is measured: an expression in the variables and eps, the name of a known integral, or "
        "'known' for all (default: the known integrals, or those that a quick search finds). Repeatable."
    ),
    opt.seed_option,
)


def requested_comparison(options: dict[str, Any], progress: Callable[[str], None], **extra: Any) -> lib.Comparison:
    """Run the comparison that the options of `comparison_options` request; `extra` is passed on to `compare`."""
    starts_option = require_one_kind_of_starts(options)
    file = opt.load_system(options["system"], options)
    _ = file.real_approximation.system  # first refuse a map without a quadratic system
    starts = None if starts_option is None else options["start"] or requested_starts(file, options)
    return lib.compare(
        file,
        starts,
        opt.requested_eps(options["eps"], options["time_step"]),
        options["steps"],
        progress=progress,
        **{"methods": options["methods"], "integrals": options["integrals"] or None, "seed": options["seed"], **extra},
    )


def early_messages(result: lib.Comparison) -> list[str]:
    """Return a sentence for each method some of whose orbits ended early."""
    early_runs = [(lib.METHODS[run.method].title, run.early, len(run.ends)) for run in result.runs if run.early]
    return [f"{title} ended early in {len(ends)} of {n} orbits: {ends[0].message}" for title, ends, n in early_runs]
