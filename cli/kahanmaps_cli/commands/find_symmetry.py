"""kahanmaps find-symmetry."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import effort_options, load_system, output_options, system_options
from kahanmaps_cli.runs.certificates import certificate_option, write_certificate
from kahanmaps_cli.runs.search import print_list
from kahanmaps_cli.screen.progress import SearchProgress


@click.command("find-symmetry")
@system_options
@effort_options
@certificate_option
@output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Find affine symmetries T Phi T^-1 = Phi and reversing symmetries T Phi T^-1 = Phi^-1 of the map of SYSTEM.

    \b
      kahanmaps find-symmetry euler_top
      kahanmaps find-symmetry three_wave
      kahanmaps find-symmetry --vars x,y --rhs 'x*(1 - y)' --rhs 'y*(x - 1)'
      kahanmaps find-symmetry lorenz --json | jq .group

    Kahan's method is equivariant under affine changes of variables: for every eps, T(x) = S x + r is a symmetry if and
    only if f(T(x)) = S f(x), and a reversing symmetry if and only if f(T(x)) = -S f(x). Hence every symmetry reported
    is proved.

    Three searches are made: for one-parameter groups of symmetries, and of scalings that also change eps; in dimension
    at most 12 for signed permutations of the variables, or of scaled variables, with a translation; in dimension at
    most 3 for all rational matrices S, unless there are one-parameter groups of linear maps. x -> -x reverses every
    homogeneous quadratic system; it is reported as trivial. A finite group is given by generators; --json lists its
    elements.

    Exit status: 0 all searches completed, 2 usage error, 3 a search was too large or the work limit was reached.
    """
    file = load_system(system, {**options, "quiet": quiet})
    with SearchProgress({**options, "quiet": quiet}) as search:
        symmetries = lib.linear_symmetries(file.system, effort=options["effort"], progress=search)
    heading = f"# find-symmetry: {file.name}, every eps (the time step is 2 eps); every symmetry is proved"
    status = print_list(
        "find-symmetry", heading, symmetries, search, lib.Settings().context([file], **search.work), as_json
    )
    return write_certificate({**options, "quiet": quiet}, file.name, symmetries.certificate, status)
