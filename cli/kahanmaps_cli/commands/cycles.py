"""kahanmaps cycles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from kahanmaps_cli import library as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.screen.numbers import read_matrix
from kahanmaps_cli.screen.progress import Progress
from kahanmaps_cli.screen.render import record_of
from kahanmaps_cli.screen.terminal import tell
from kahanmaps_cli.screen.value_rows import Cell, table

_STOPPED = "stopped by the clock: give more --seconds, fewer --samples or a smaller prime"


@click.command("cycles")
@opt.system_or_prime_options
@click.option("--prime", "primes", type=int, multiple=True, metavar="P", help="The prime; repeatable.")
@opt.several_eps_options
@click.option("--samples", type=int, metavar="N", help="Follow N random points instead of making the whole graph.")
@click.option("--steps", type=int, metavar="N", help="... for at most N steps (default 8 (p + 1 + 2 sqrt p)).")
@click.option("--reversor", metavar="ROWS", help="A matrix R with f(R x) = -R f(x): '1,0;0,-1'.")
@opt.seconds_option(60.0, "Time for the samples of one run.")
@opt.seed_option
@opt.output_options
def command(system: str | None, **options: Any) -> int:
    """The orbits of the map of SYSTEM on projective space over a finite field, and how long its cycles are.

    \b
      kahanmaps cycles weierstrass -p 101
      kahanmaps cycles euler_top -p a1=2 --prime 31 --prime 47
      kahanmaps cycles lotka_volterra --prime 997 --eps 1/10 --eps 1/7
      kahanmaps cycles weierstrass --prime 10007 --samples 200 --json
      kahanmaps cycles henon_heiles -p c=-2..0 --prime 11
      kahanmaps cycles --vars x,y --rhs 'x*y' --rhs '-x^2' --prime 31

    All points of P^n over GF(P), or random ones where they are more than two million (from dimension 7 on, half as many
    with each dimension). Without --eps two values are tried for each prime: one alone may be special.

    A point is lost where the map has no value; where forms have a common factor it is divided out first (up to
    dimension 6). It falls if its orbit gets to a lost point, and is transient if its orbit gets to a cycle. The lengths
    are held against the largest number of points of a curve of genus 1 (the fibres of integrable maps of the plane;
    a longer cycle must have a length that reducible fibres allow), against the law of random reversible maps and
    against random permutations; "compatible" is no proof of anything.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table, a line for each value or
    combination of values; with --json a record a line. Values without a map are named at the end.

    Exit status: 0 done, 2 usage error, 3 samples stopped by the clock.
    """
    if options["steps"] is not None and options["samples"] is None:
        raise click.UsageError("--steps N is for --samples N")
    options["primes"] = (*options["primes"], *map(_prime, (text for name, text in options["parameters"] if not name)))
    if not options["primes"]:
        raise click.UsageError("missing --prime P, or -p P")
    options["parameters"] = [pair for pair in options["parameters"] if pair[0]]

    def censuses(
        file: lib.SystemFile, progress: Progress
    ) -> tuple[lib.fmpq_mat | None, list[tuple[lib.Census, lib.Comparison]]]:
        reversor = None
        if options["reversor"] is not None:
            reversor = read_matrix(options["reversor"])
        elif file.is_quadratic:
            reversor = lib.find_reversor(file.system)
        runs = []
        for prime in dict.fromkeys(options["primes"]):
            values = [*options["eps"], *(step / 2 for step in options["time_step"])] or lib.default_eps(prime)
            for eps in values if file.map.has_eps else [1]:
                census = lib.cycle_census(
                    file.map,
                    eps,
                    prime,
                    reversor=reversor,
                    **opt.given(options, "samples", "steps", "seed", "seconds"),
                    progress=progress,
                )
                runs.append((census, lib.compare(census, options["seed"])))
        return reversor, runs

    def cell(file: lib.SystemFile, progress: Progress) -> Cell:
        reversor, runs = censuses(file, progress)
        common = [law for law in runs[0][1].compatible if all(law in found.compatible for _, found in runs)]
        longest = ", ".join(f"{census.longest} modulo {census.prime}" for census, _ in runs)
        line = f"longest cycle {longest}\tcompatible with {', '.join(common) or 'none of the laws'}"
        return Cell(
            line,
            lambda: _record(file, options, reversor, runs, common),
            lambda: _print(file, reversor, runs, common),
            _STOPPED if any(census.stopped for census, _ in runs) else "",
        )

    return table(system, options, cell)


def _prime(text: str) -> int:
    if not text.isdecimal() or len(text) > 20:
        raise click.UsageError(f"found -p {text[:40]!r}, expected NAME=VALUE for a parameter, or a prime")
    return int(text)


def _print(
    file: lib.SystemFile,
    reversor: lib.fmpq_mat | None,
    runs: list[tuple[lib.Census, lib.Comparison]],
    common: list[str],
) -> None:
    what = "the Kahan map" if file.is_quadratic else file.map.kind
    share = lib.eps_share(file.map)
    tell(f"# {file.name}, {what} on P^{file.dim} over GF(p){share and ', '}{share}")
    rows = lib.plain(reversor)
    shown = "none known" if rows is None else ";".join(",".join(row) for row in rows)
    tell(f"reversing symmetry\t{shown}")
    for census, found in runs:
        at = f", eps = {census.eps}" if file.map.has_eps else ""
        tell(f"\n# p = {census.prime}{at}")
        tell(str(census))
        for law, reason in found.reasons.items():
            tell(f"{law}\t{found.verdict(law)}: {reason}")
    tell(f"\n# compatible in all {len(runs)} runs with: {', '.join(common) or 'none of the laws'}")


def _record(
    file: lib.SystemFile,
    options: dict[str, Any],
    reversor: lib.fmpq_mat | None,
    runs: list[tuple[lib.Census, lib.Comparison]],
    common: list[str],
) -> dict[str, Any]:
    def pairs(lengths: Mapping[int, int] | None) -> list[list[int]] | None:
        return None if lengths is None else [[length, n] for length, n in lengths.items()]

    return record_of(
        "cycles",
        file,
        "exact modulo primes",
        **opt.given(options, "seed", "samples", steps_asked="steps"),
        seconds=options["seconds"],
        reversor=lib.plain(reversor),
        primes=list(dict.fromkeys(options["primes"])),
        runs=[
            {
                **lib.attributes(
                    census, "prime", "complete", "looked_at", "steps", "stopped", "degree", "lost", "falling"
                ),
                **lib.attributes(census, "transient", "open", "periodic", "cycles", "longest", "mean"),
                **lib.attributes(
                    census, common_factor="factor", singular_everywhere="is_undefined", fixed_points="fixed"
                ),
                "eps": str(census.eps),
                "time_step": lib.eps_record(census.eps, file.map)["time_step"],
                "points": str(census.points),
                "lengths": pairs(census.lengths),
                "at_infinity": pairs(census.at_infinity),
                "symmetric": pairs(census.symmetric),
                "longer_than_bound": pairs(found.longer),
                **lib.attributes(
                    found, "bound", "unexplained", "scale", "model_scale", "distance", "compatible", "reasons"
                ),
                **lib.attributes(
                    found, share_within_bound="share_within", critical_distance="critical", not_compatible="refused"
                ),
            }
            for census, found in runs
        ],
        compatible_in_all_runs=common,
    )
