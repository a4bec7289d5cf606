"""kahanmaps plot scan."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.pictures.output import Drawn, picture, window_from, window_option
from kahanmaps_cli.runs.scan_run import ending, names_of, primes_of, scan_options, scanned
from kahanmaps_cli.screen.progress import Progress


@picture(
    "scan",
    scan_options,
    window_option("A0,A1,B0,B1"),
    click.option("--modulo", type=int, metavar="P", help="The special members modulo P, one of the primes, instead."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawn:
    """The plane of two parameters: where degrees grow more slowly.

    \b
      kahanmaps plot scan zhukovski_volterra_2 --over b1,b2 -o plane.svg
      kahanmaps plot scan --rhs "x' = x*(a*x+y); y' = y*(x+b*y)" --over a,b \\
        --window=-2,2,-2,2 -o plane.pdf
      kahanmaps plot scan zhukovski_volterra_2 --over b1,b2 --modulo 53 \\
          -o modulo.svg

    A colour for each kind of growth; marks are points, lines are curves. The
    conditions of those that do not grow exponentially are written beside them,
    as far as there is room. With --modulo P
    the plane over GF(P): all special members that were seen.

    Exit status: 0 done, 2 usage error, 3 the budget was spent, 130 interrupted
    (the picture is written if something was found).
    """
    window = window_from(options, 2)
    if window is not None and options["modulo"] is not None:
        raise click.UsageError("give --window or --modulo, not both: modulo a prime the whole plane is shown")
    modulo, primes = options["modulo"], primes_of(options["primes"])
    from flint import fmpz

    if modulo is not None and not (modulo in primes if primes else fmpz(modulo).is_prime()):
        raise click.UsageError(f"found --modulo {modulo}, expected one of the primes (--primes)")
    names = names_of(options)
    if len(names) != 2:
        raise click.UsageError(f"found --over {','.join(names)}, expected two parameters: a plane is drawn")
    found, search = scanned(options["system"], options["quiet"], options)
    status = ending(found, search)
    if found.ended != "complete" and not (found.components or any(one.prime == modulo for one in found.sweeps)):
        return Drawn(
            None, talk=["there is no picture: nothing to be drawn was found before the scan ended"], status=status
        )
    return Drawn(lib.plot_scan(found, options["style"], window=window, modulo=modulo), found.file, status=status)
