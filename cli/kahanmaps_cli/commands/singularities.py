"""kahanmaps singularities."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.screen.progress import SearchProgress, print_stderr
from kahanmaps_cli.screen.render import print_json, record_of
from kahanmaps_cli.screen.terminal import abbreviated, print_stdout


@click.command("singularities")
@opt.system_options
@opt.eps_options
@click.option(
    "--steps",
    type=int,
    metavar="N",
    help="Follow each hypersurface for N steps (default: 1000 in dimension 2, 500 in 3, 250 in 4, 100 in 5 and more).",
)
@opt.effort_options
@opt.seed_option
@opt.output_options
def command(system: str | None, as_json: bool, quiet: bool, **options: Any) -> int:
    """Test the singularities of the map of SYSTEM for confinement.

    \b
      kahanmaps singularities euler_top
      kahanmaps singularities lotka_volterra --eps 1/10 --steps 20
      kahanmaps singularities --vars x,y --rhs y --rhs '6*x^2 - 2' --json

    The exceptional hypersurfaces, those that the map contracts, are computed over Q, together with the zeros of the
    denominator det(I - eps f'(x)). Their images are followed along power series modulo large primes. A singularity is
    confined if after some steps the image is a hypersurface again. Without --eps two values of eps are tried and
    compared.

    "ranks" are the dimensions of the images after 1, 2, ... steps, and "pole orders" the multiplicities with which
    they lie in the hyperplane at infinity, called Z, for the first steps. Confined singularities are evidence for
    integrability, and no proof: those of henon_heiles are confined, and its degrees grow exponentially. "not confined"
    is given with the number of steps that were tried. Where the map is not dominant, so that its image lies in a
    hypersurface, nothing is followed.

    A composition too long to be multiplied out is followed map by map: steps are then single maps, and each
    hypersurface is listed with the map that contracts it.

    If the polynomials are too long, random points of the hypersurfaces are followed instead. All hypersurfaces with
    the same multiplicity and the same outcome then share a line, with ? in place of a polynomial.

    Exit status: 0 done, 2 usage error, 3 undecided (work limit reached, or two random points or eps disagree).
    """
    from kahanmaps.laboratory.singular.singularities import default_eps

    eps = opt.requested_eps(options["eps"], options["time_step"], required=False)
    file = opt.load_system(system, {**options, "quiet": quiet})
    with SearchProgress({**options, "quiet": quiet}) as search:
        runs = [
            lib.singularities(file.map, value, **opt.pick(options, "steps", "seed", "effort"), progress=search)
            for value in ((eps,) if eps is not None else default_eps(file.map, options["seed"]))
            if not search.is_over
        ]
    is_consistent = len({run.shape for run in runs}) == 1
    verdict = runs[0].verdict if is_consistent else lib.UNDECIDED
    symbolic = lib.symbolic_denominator(file.map) if eps is None else None
    if as_json:
        hypersurface_keys = (
            "polynomial",
            "degree",
            "divides_denominator",
            "multiplicity",
            "status",
            "contracted_at",
            "confined_at",
        )
        step_keys = {"ranks": "rank", "poles": "pole", "denominators": "denominator", "common": "common"}
        records = [
            {
                **lib.attributes(run, "verdict", "denominator", "map_degree", "critical_degree"),
                **lib.attributes(run, stopped="is_stopped", followed="followed", text="text"),
                **lib.attributes(run, singular_everywhere="is_undefined", dominant="is_dominant"),
                "eps": str(run.eps),
                "time_step": lib.eps_record(run.eps, file.map)["time_step"],
                "maps_a_step": None if run.word is None else run.word.length,
                "hypersurfaces": [
                    {
                        **lib.attributes(surface, *hypersurface_keys, "followed", "settled_at", "note", "stage"),
                        **{name: [getattr(step, key) for step in surface.steps] for name, key in step_keys.items()},
                        "primes": [str(prime) for prime in surface.primes],
                    }
                    for surface in run.hypersurfaces
                ],
            }
            for run in runs
        ]
        print_json(
            record_of(
                "singularities",
                file,
                "exact; series modulo primes",
                seed=options["seed"],
                steps=options["steps"] or lib.steps_by_default(file.map.dim),
                **search.work,
                verdict=verdict,
                symbolic_denominator=symbolic,
                runs=records,
            )
        )
    else:
        name = file.map.denominator_name
        about_eps = lib.describe_eps(file.map)
        print_stdout(f"# {file.name}, dimension {file.map.dim}{about_eps and ', '}{about_eps}")
        if symbolic is not None:
            factors = " * ".join(f"({text})" + (f"^{power}" if power > 1 else "") for text, power in symbolic)
            print_stdout(f"factors of {name}\t{abbreviated(factors, 200) or 'none'}")
        for run in runs:
            at_eps = f"eps = {run.eps}: " if file.map.has_eps else ""
            text = str(run).replace("# ", f"\n# {at_eps}", 1).replace("\ndenominator\t", f"\n{name}\t", 1)
            print_stdout(
                "\n".join("\t".join(abbreviated(cell, 200) for cell in line.split("\t")) for line in text.split("\n"))
            )
        print_stdout(f"\n# {runs[0].text if is_consistent else verdict}")
    if verdict == lib.UNDECIDED and not quiet and not search.is_over:
        if any(run.is_stopped for run in runs):
            reason = "work limit reached; raise --effort"
        elif not is_consistent:
            reason = "the two values of eps give different results; choose one with --eps"
        else:
            reason = next(h.note for run in runs for h in run.hypersurfaces if h.note)
        print_stderr(f"undecided: {reason}")
    return 3 if verdict == lib.UNDECIDED or search.is_over else 0
