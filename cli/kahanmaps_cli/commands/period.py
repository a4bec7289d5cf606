"""kahanmaps period."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_options, load_system, output_options, requested_eps, system_options
from kahanmaps_cli.params import Arithmetic, PointText
from kahanmaps_cli.screen.progress import print_stderr
from kahanmaps_cli.screen.render import envelope, print_json, record_of
from kahanmaps_cli.screen.terminal import print_stdout

_EXIT_STATUS = {"periodic": 0, "aperiodic": 0}
_ORBIT_HINT = "Try instead: kahanmaps orbit ... --steps N reports when the orbit returns to its initial point"
_LONG_PRIME_BITS, _MAX_PRIME_BITS = 90, 192  # for primes between these sizes the computation takes seconds to minutes


@click.command("period")
@system_options
@click.option("--start", type=PointText(), metavar="X", help="Initial point, e.g. 1/2,-1/3,0.25.")
@click.option(
    "--levels", type=int, metavar="N", help="Instead of --start: find the levels on which all orbits have period N."
)
@eps_options
@click.option(
    "--arithmetic",
    type=Arithmetic(),
    metavar="KIND",
    default="exact",
    show_default=True,
    help="Arithmetic: exact or mod:P.",
)
@click.option("-v", "--verbose", is_flag=True, help="Describe the normal form of the system on standard error.")
@output_options
def command(system: str | None, as_json: bool, quiet: bool, verbose: bool, **options: Any) -> int:
    """Compute the exact period of an orbit of a member of the commuting family, without iterating the map.

    \b
      kahanmaps period paper_m3 --start 1,2,3,4,5,6 --eps 1/10
      kahanmaps period paper_m3 --start 1,2,3,4,5,6 --eps 1/10 \\
          --arithmetic mod:2305843009213693951
      kahanmaps period paper_m2 --start 1,2,3,4 --eps 1/10 \\
          --arithmetic mod:10007 --json
      kahanmaps period --levels 5
      kahanmaps period nahm_tetrahedral --eps 1/10 --levels 5

    In every plane of its normal form the map is a translation on a cubic curve, and the period is the order of a point.
    Modulo P this order is computed; over Q the orbit is proved periodic or aperiodic.

    The command also recognizes systems of the family that are not declared as such. The translation is defined at
    indeterminacy points of the map too: if the orbit meets one, the output says so, and gives the period under the
    translation.

    --levels N is about all orbits on a level. In a plane with the cubic Hamiltonian h(u, v) and D = h_uu h_vv - h_uv^2
    the map conserves c = h/(1 + eps^2 D), and the period depends on gamma = 1 - 64 eps^6 disc(h) c^2 only. The command
    prints the polynomial psi_N, at whose roots gamma the period is N or a divisor of N, and the rational gamma with
    period N; with SYSTEM and eps also c^2 for these gamma, in each plane of a rational root of chi ("family show").

    Exit status: 0 if the period was found, or proved not to exist, 2 for a usage error or a system without a normal
    form, 3 if undecided, or if the orbit cannot be continued at some point.
    """
    if (options["levels"] is None) == (options["start"] is None):
        raise click.UsageError("give either --start X or --levels N")
    if options["levels"] is not None:
        return _print_levels(system, as_json, options)
    kind, prime = options["arithmetic"]
    if kind not in ("exact", "mod"):
        raise click.UsageError(f"found --arithmetic {kind}, expected exact or mod:P: a period is exact")
    file = load_system(system, {**options, "quiet": quiet})
    no_period, normal_form = f"no period of {file.name} can be computed", file.normal_form
    if not file.is_quadratic and isinstance(normal_form, lib.NoNormalForm):
        raise lib.InputError(f"{no_period}: {normal_form.reason}. {_ORBIT_HINT}")
    eps = requested_eps(options["eps"], options["time_step"])
    # Raise the errors that `orbit` raises for an invalid eps, prime or initial point.
    file.map.at(eps, lib.GF(prime) if kind == "mod" else lib.QQ).point(options["start"])
    if isinstance(normal_form, lib.NoNormalForm):
        raise lib.InputError(
            f"{no_period}: {normal_form.reason}. The map is a translation only if a matrix A makes the system a member "
            f"of the commuting family with distinct roots of chi. {_ORBIT_HINT}"
        )
    if not quiet:
        if verbose:
            print_stderr(normal_form.text)
        if kind == "mod" and _LONG_PRIME_BITS < prime.bit_length() <= _MAX_PRIME_BITS:
            print_stderr(f"a prime of {prime.bit_length()} bits: this may take a while (Ctrl-C gives up)")
    result = lib.period_of(normal_form, eps, options["start"], prime if kind == "mod" else None)
    message, status = result.text.splitlines()[0], _EXIT_STATUS.get(result.status, 3)
    if as_json:
        # Integers are written as strings: many JSON readers cannot represent long periods exactly.
        planes = [
            {
                **lib.attributes(plane, "name", "status", "meets_pole", "reason"),
                "period": None if plane.period is None else str(plane.period),
                "kind": plane.kind.name.lower(),
                "kind_text": str(plane.kind),
                "field_size": str(plane.q) if plane.q else None,
            }
            for plane in result.planes
        ]
        record = record_of(
            "period",
            file,
            str(options["arithmetic"]),
            seed=None,
            structure=normal_form.text,
            **lib.eps_record(eps, file.map),
            start=lib.plain(options["start"]),
            **lib.attributes(result, "status", "meets_pole"),
            period=None if result.period is None else str(result.period),
            planes=planes,
            message=message,
        )
        print_json(record)
        if status and not quiet:
            print_stderr(f"{result.status}: {message}")
    else:
        print_stdout(f"# {file.name}{lib.eps_suffix(eps, file.map)}, {options['arithmetic']} arithmetic")
        print_stdout(str(result))
    return status


def _print_levels(system: str | None, as_json: bool, options: dict[str, Any]) -> int:
    """Print the levels on which all orbits have the period --levels; for a given system, also those in each plane."""
    levels = lib.PeriodicLevels(options["levels"])
    data: dict[str, Any] = {
        **envelope("period levels"),
        "period": levels.period,
        "psi": lib.text_in_gamma(levels.psi),
        "primitive": lib.text_in_gamma(levels.primitive),
        "gamma": [lib.format_number(gamma) for gamma in levels.gammas],
    }
    if system is not None or options["rhs"]:
        file = load_system(system, options)
        normal_form = file.normal_form
        if isinstance(normal_form, lib.NoNormalForm):
            reason = normal_form.reason if file.is_quadratic else "it is no Kahan map"
            raise lib.InputError(f"no levels of {file.name} can be computed: {reason}")
        eps = requested_eps(options["eps"], options["time_step"])
        data |= {
            "system": file.name,
            "eps": lib.format_number(eps),
            "time_step": lib.format_number(lib.time_step(eps, file.map)),
            "planes": [],
        }
        for part in normal_form.form.parts:
            disc = lib.PlanarBlock(*(part.h[3 - k, k] for k in range(4))).discriminant
            squares = levels.squares(disc, eps) if disc != 0 else ()
            plane = {
                "root": lib.format_number(part.root),
                "h": part.text,
                "D": part.D_text,
                "disc": lib.format_number(disc),
            }
            data["planes"].append({**plane, "squares": [lib.format_number(square) for square in squares]})
    if as_json:
        print_json(data)
        return 0
    print_stdout(f"psi_{levels.period}\t{data['psi']}" + " times gamma^(1/3)" * (levels.period % 3 == 0))
    print_stdout(f"period {levels.period} only\t{data['primitive']}")
    print_stdout(f"rational gamma\t{', '.join(data['gamma']) or 'none'}")
    for plane in data.get("planes", ()):
        print_stdout(f"plane t = {plane['root']}\th = {plane['h']}, D = {plane['D']}")
        for square in plane["squares"]:
            remark = ", no real level" if square[0] == "-" else ""
            print_stdout(f"level\t(h/(1 + eps^2*D))^2 = {square}{remark}")
        if plane["disc"] == "0":  # then gamma = 1 on every level, and no psi_N has the root 1
            print_stdout("level\tnone, except perhaps 0: disc(h) = 0, so that gamma = 1 on every level")
    return 0
