"""kahanmaps find-commuting."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import certificate_option, write_certificate
from kahanmaps_cli.runs.search import print_list
from kahanmaps_cli.screen.progress import SearchProgress


@click.command("find-commuting")
@opt.system_options
@click.option(
    "--shape",
    type=click.Choice(["linear", "quadratic"]),
    help="linear: g = B f with a constant matrix B; quadratic: any g of degree at most 2 (the default in dimension 1 "
    "to 3, else linear).",
)
@opt.seed_option
@opt.error_bits_option("A statement reported as supported is false with probability below 2^-BITS.")
@opt.effort_options
@certificate_option
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Find g over Q, of degree at most 2, whose Kahan map commutes with that of SYSTEM, x' = f(x), for every eps.

    \b
      kahanmaps find-commuting paper_m3
      kahanmaps find-commuting three_wave --shape quadratic
      kahanmaps find-commuting --vars x,y --rhs 'x^2' --rhs 'y^2 + x*y'
      kahanmaps find-commuting pair.toml --json | jq '.solutions[].B'
      kahanmaps find-commuting "x' = a*x^2; y' = y^2" -p 'a=root of t^2 - 2'

    --shape quadratic, the default in dimension 1 to 3, finds all g of degree at most 2; --shape linear finds all
    g = B f with a constant matrix B.

    Linear algebra gives all g with [f, g] = 0; higher powers of eps in Phi_f Phi_g = Phi_g Phi_f give polynomial
    equations, which are solved over Q; then it is proved for each solution that the maps commute, or tested at random
    points. No solution is discarded at any stage, so the list is complete unless the output says otherwise. If a
    parameter is an algebraic number t of degree r, the search is made for the system over Q of the coefficients x_i in
    x = x_0 + x_1 t + ... + x_(r-1) t^(r-1); the default is then --shape linear in every dimension. 0, f and -f always
    commute and are left out; --json has them, marked in "trivial".

    Exit status: 0 the list is complete, 2 usage error, 3 undecided: there may be more such g.
    """
    file = opt.load_system(system, {**options, "quiet": quiet})
    seed, error_bits = options["seed"], options["error_bits"]
    settings = lib.Settings(seed=seed, error_bits=error_bits)
    with SearchProgress({**options, "quiet": quiet}) as search:
        commuting = lib.find_commuting(
            file.system if file.map.root is None else file.map,
            options["shape"],
            seed=seed,
            error_bits=error_bits,
            effort=options["effort"],
            progress=search,
        )
    heading = f"# find-commuting: {file.name}, {commuting.kind_text}, every eps (the time step is 2 eps)"
    context = settings.context([file], **search.work)
    status = print_list("find-commuting", heading, commuting, search, context, as_json)
    return write_certificate({**options, "quiet": quiet}, file.name, commuting.certificate, status)
