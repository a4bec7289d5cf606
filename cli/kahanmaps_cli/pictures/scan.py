"""kahanmaps plot scan."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.pictures.output import Drawing, picture, window_from, window_option
from kahanmaps_cli.runs.scan_run import ending, names_of, primes_of, run_scan, scan_options
from kahanmaps_cli.screen.progress import Progress


@picture(
    "scan",
    scan_options,
    window_option("A0,A1,B0,B1"),
    click.option("--modulo", type=int, metavar="P", help="Show the plane over GF(P), P a prime, instead."),
)
def command(options: dict[str, Any], progress: Progress) -> Drawing:
    """Draw the plane of two parameters with the points and curves where degrees grow more slowly.

    \b
      kahanmaps plot scan zhukovski_volterra_2 --over b1,b2 -o plane.svg
      kahanmaps plot scan --rhs "x' = x*(a*x+y); y' = y*(x+b*y)" --over a,b \\
        --window=-2,2,-2,2 -o plane.pdf
      kahanmaps plot scan zhukovski_volterra_2 --over b1,b2 --modulo 53 \\
          -o modulo.svg

    Each kind of growth has a color. The equations of components without
    exponential growth are written beside them, as far as space permits. With
    --modulo P the plane over GF(P) with all special parameters is shown.

    Exit status: 0 done, 2 usage error, 3 the work limit was reached, 130 interrupted
    (the picture is written if it is not empty).
    """
    window = window_from(options, 2)
    if window is not None and options["modulo"] is not None:
        raise click.UsageError("give --window or --modulo, not both: --modulo shows the whole plane")
    modulo, primes = options["modulo"], primes_of(options["primes"])
    from flint import fmpz

    if modulo is not None and not (modulo in primes if primes else fmpz(modulo).is_prime()):
        expected = f"one of --primes {','.join(map(str, primes))}" if primes else "a prime number"
        raise click.UsageError(f"found --modulo {modulo}, expected {expected}")
    names = names_of(options)
    if len(names) != 2:
        raise click.UsageError(f"found --over {','.join(names)}, expected two parameters")
    result, search = run_scan(options["system"], options["quiet"], options)
    status = ending(result, search)
    if result.ended != "complete" and not (result.components or any(sweep.prime == modulo for sweep in result.sweeps)):
        return Drawing(None, messages=["no picture is written: the scan ended before it found anything"], status=status)
    return Drawing(lib.plot_scan(result, options["style"], window=window, modulo=modulo), result.file, status=status)
