"""kahanmaps geometry."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.options import eps_of, eps_options, load_system, output_options, system_options
from kahanmaps_cli.params import PointText
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import print_stdout


@click.command("geometry")
@system_options
@click.option("--start", type=PointText(), metavar="X", required=True, help="Initial point, e.g. 1/2,-1/3,0.25.")
@eps_options
@output_options
def command(system: str | None, as_json: bool, quiet: bool, start: Any, **options: Any) -> int:
    """Describe the level set or curve of an orbit: j-invariants, translations, heights, rotation numbers.

    \b
      kahanmaps geometry paper_m3 --start 1,2,3,4,5,6 --eps 1/10
      kahanmaps geometry euler_top --start 1,2,3 --eps 1/10
      kahanmaps geometry mcmillan --start 1/3,2/5
      kahanmaps geometry paper_m2 --start 1,2,3,4 --eps 1/7 --json | jq '.planes[0].j'

    For a member of the commuting family, and for systems that are recognized as such, the level set of the integrals is
    a product of elliptic curves, one in each plane of the normal form, and the map is a translation of it. The planes
    belong to the roots of chi, where chi(t)^2 = det(t I - A) with the matrix A of the member. For each irreducible
    factor of chi the command prints k^3 of the Hesse cubic X^3 + Y^3 + Z^3 = 3 k X Y Z, a Weierstrass model with its
    j-invariant, discriminant and bad primes, the translation point, its order (finite or infinite, proved) and its
    canonical height. For each real root it prints the rotation numbers of the map (in (0, 1/2], up to sign, with an
    error bound) and of the flow at the time step 2 eps, and their difference, the phase error, unless the level of the
    initial point is singular for a smaller eps. For a pair of complex roots it prints two numbers instead: the
    coordinates of the translation in a reduced basis of the lattice of periods. The last lines say how many real
    components the level set has (closed at infinity), and whether the orbit is dense in those that it visits: proved
    for one circle, otherwise supported by the absence of integer relations of the rotation numbers up to the given
    size.

    For any other map, in any dimension, the command searches for a curve of genus 1 or 0 that contains the orbit, and
    proves what it finds. For genus 1 it prints a Weierstrass model, the j-invariant, the bad primes, the translation,
    its canonical height and its rotation number, for genus 0 the multiplier kappa. If only an iterate maps the curve to
    itself, the numbers refer to this iterate.

    Exit status: 0 done, 2 usage error, 3 if no curve was found.
    """
    file = load_system(system, {**options, "quiet": quiet})
    normal_form = file.normal_form
    eps = eps_of(file, options)
    map_over = file.at(eps)
    map_over.point(start)
    result: Any
    if isinstance(normal_form, lib.NoNormalForm):
        result = lib.orbit_curve(map_over, start, file.map, list(file.integrals.values()))
    else:
        result = lib.geometry_of(normal_form, eps, start)
    if as_json:
        record = record_of(
            "geometry", file, "exact", seed=None, **lib.eps_record(eps, file.map), start=lib.plain(start)
        )
        print_json({**record, **result.to_json()})
    else:
        print_stdout(f"# {file.name}{lib.eps_suffix(eps, file.map)}")
        print_stdout(str(result))
    return 0
