"""kahanmaps modified."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import load_system, output_options, seconds_option, system_options
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("modified")
@system_options
@click.option("--order", type=int, metavar="K", default=4, show_default=True, help="Order in eps, an even number.")
@seconds_option
@output_options
def command(system: str | None, as_json: bool, quiet: bool, order: int, **options: Any) -> int:
    """Compute the modified vector field of the Kahan map of SYSTEM, exactly, as a series in eps.

    \b
      kahanmaps modified henon_heiles
      kahanmaps modified weierstrass --order 6
      kahanmaps modified "x' = x*(1-y); y' = y*(x-1)" --order 4 --json

    The Kahan map is the flow at time 2 eps of f + eps^2 f_2 + eps^4 f_4 + ..., a formal series whose terms are
    polynomials. For Hamiltonian f (constant J) the map conserves the modified Hamiltonian, which is printed as a series
    as well.

    A polynomial integral I of the flow of f survives to eps^k if there are polynomials I_2, ..., I_k for which
    I + eps^2 I_2 + ... is an integral of the modified field up to eps^k. This is decided by linear algebra over Q: both
    answers are proved. The integrals are H, the limits of declared integrals, and those that a quick search finds.

    Exit status: 0 done, 2 usage error, 3 --seconds stopped the run.
    """
    file = load_system(system, {**options, "quiet": quiet})
    with SearchProgress({**options, "quiet": quiet}) as search:
        result = lib.modified(file, order, progress=search)
    if as_json:
        print_json(record_of("modified", file, "exact", **lib.eps_record(None, file.map), **result.to_json()))
        return 0
    print_stdout(str(result).partition("\n")[0])
    for line in result.lines():
        print_stdout(line, 15)
    return 0
