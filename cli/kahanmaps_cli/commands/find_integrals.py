"""kahanmaps find-integrals."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps_cli.options import eps_options, load_system, output_options, system_options, the_eps
from kahanmaps_cli.progress import Progress
from kahanmaps_cli.render import on_terminal, print_json, shorten


@click.command("find-integrals")
@system_options
@eps_options
@click.option("--symbolic", metavar="NAMES", help="Parameters that formulas are to contain, e.g. a1,a2 (eps is one).")
@click.option(
    "--monomials",
    "sets",
    metavar="LIST",
    multiple=True,
    help="A Hirota-Kimura basis of these polynomials instead, e.g. 'x^2,y^2,1'.",
)
@click.option(
    "--darboux",
    type=click.IntRange(1, 12),
    metavar="DEGREE",
    help="Instead: all discrete Darboux polynomials up to it.",
)
@click.option("--max-degree", type=click.IntRange(1, 20), help="Largest degree of relations along orbits.")
@click.option("--seconds", type=click.FloatRange(min=1), default=60, show_default=True, help="Time for the search.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of everything drawn at random.")
@click.option("--toml", "as_toml", is_flag=True, help="The section [integrals] of a system file.")
@click.option("--latex", "as_latex", is_flag=True, help="The formulas in LaTeX.")
@output_options
def command(system: str | None, **options: Any) -> int:
    """Integrals of the Kahan map of SYSTEM, in closed form: how many there are, formulas P/Q, and their proofs.

    Without --eps the formulas contain eps (the time step is 2 eps). How many independent integrals orbits show is
    measured modulo primes; every formula is verified as an identity.

    \b
      kahanmaps find-integrals euler_top --symbolic a1,a2,a3
      kahanmaps find-integrals volterra_periodic_4 --toml
      kahanmaps find-integrals lagrange_top --monomials 'm1^2+m2^2,p3^2,p3,1'
      kahanmaps find-integrals volterra_periodic_4 --darboux 2
      kahanmaps find-integrals --vars x,y --rhs 'x^2-y^2' --rhs='-2*x*y'

    Exit status: 0 every integral that orbits show has a formula, 2 wrong use,
    3 some have none, orbits were not measured, or the time was too short.
    """
    from kahanmaps.laboratory.integrals import find_integrals

    if sum((options["as_toml"], options["as_latex"], options["as_json"])) > 1:
        raise click.UsageError("give one of --toml, --latex and --json")
    with Progress(options["quiet"]) as progress:
        file = load_system(system, options["variables"], options["rhs"], options["parameters"])
        symbols, eps = symbols_and_eps(options)
        if options["sets"]:
            if options["darboux"] is not None:
                raise click.UsageError("give --monomials or --darboux, not both")
            if options["as_toml"] or options["as_latex"]:
                raise click.UsageError("--monomials goes with --json, not with --toml and --latex")
            return _bases(file, eps, options)
        if options["darboux"] is not None:
            if options["as_toml"] or options["as_latex"]:
                raise click.UsageError("--darboux goes with --json, not with --toml and --latex")
            return _darboux(file, symbols, eps, options, progress)
        found = find_integrals(
            file,
            symbols=symbols,
            eps=eps,
            max_degree=options["max_degree"],
            seconds=options["seconds"],
            seed=options["seed"],
            progress=progress,
        )
    if options["as_json"]:
        print_json({**heading("find-integrals", found), **found.to_json(), "document": dict(file.document)})
    elif options["as_toml"]:
        click.echo(found.toml_section(), nl=False)
    elif options["as_latex"]:
        for one in found.integrals:
            click.echo(f"{one.name} = {one.to_json()['latex']}")
    else:
        click.echo(f"find-integrals: {file.name}, {scope(found)}")
        for one in found.integrals:
            formula = shorten(one.text, 400) if on_terminal() else one.text
            click.echo(f"{one.name}\t{one.verdict}\t{formula}\n\t{one.origin}: {one.evidence.summary}")
        click.echo(_count(found))
        for text in filter(None, (found.note, found.reason)):
            click.echo(f"note\t{text}")
    return 3 if found.reason else 0


def symbols_and_eps(options: dict[str, Any]) -> tuple[tuple[str, ...], Any]:
    """The names of --symbolic without eps, and the number eps or None."""
    named = [name.strip() for name in (options["symbolic"] or "").split(",") if name.strip()]
    eps = the_eps(options["eps"], options["time_step"], required=False)
    if eps is not None and "eps" in named:
        raise click.UsageError("give --eps as a number, or eps among --symbolic, not both")
    return tuple(name for name in named if name != "eps"), eps


def scope(found: Any) -> str:
    """For which eps and which symbols the formulas hold."""
    if found.eps is None:
        step = "every eps (the time step is 2 eps)"
    else:
        step = f"eps = {found.eps} (time step 2 eps = {2 * found.eps})"
    return f"{step}, every {', '.join(found.symbols)}" if found.symbols else step


def heading(name: str, found: Any) -> dict[str, Any]:
    """What is needed to redo a search, as plain data."""
    from kahanmaps.checks.settings import CONVENTION
    from kahanmaps.version import __version__

    return {
        "command": name,
        "version": __version__,
        "system": found.file.name,
        "parameters": {key: str(value) for key, value in found.file.parameters.items()},
        "symbols": list(found.symbols),
        "eps": "every" if found.eps is None else str(found.eps),
        "time_step": "every" if found.eps is None else str(2 * found.eps),
        "convention": CONVENTION,
        "arithmetic": "exact formulas, from residues modulo primes",
        "seed": found.seed,
    }


def _was_not_measured(found: Any) -> bool:
    return not found.profile.nullities


def _count(found: Any) -> str:
    if _was_not_measured(found):
        return "orbits\tnot measured"
    measured = f"measured, relations of degree up to {found.profile.degree}"
    return (
        f"found\t{len(found.integrals)} functionally independent; orbits show {found.codimension} independent "
        f"({measured})"
    )


def _darboux(file: Any, symbols: tuple[str, ...], eps: Any, options: dict[str, Any], progress: Progress) -> int:
    from kahanmaps.algebra.text import format_polynomial
    from kahanmaps.laboratory.darboux import darboux_polynomials

    found = darboux_polynomials(
        file,
        options["darboux"],
        symbols=symbols,
        eps=eps,
        seconds=options["seconds"],
        seed=options["seed"],
        progress=progress,
    )
    if options["as_json"]:
        print_json({**heading("darboux-polynomials", found), **found.to_json(), "document": dict(file.document)})
    else:
        click.echo(f"Darboux polynomials: {file.name}, {scope(found)}")
        click.echo("P(x~) = C P(x), C a product of C[g] = g(x~, -eps)/g(x, eps); spaces spanned by products left out")
        for space in found.spaces:
            click.echo(f"C = {space.cofactor}")
            for P in space.polynomials:
                text = format_polynomial(P)
                click.echo(f"\t{space.verdict}\t{shorten(text, 400) if on_terminal() else text}")
        if found.reason:
            click.echo(f"note\t{found.reason}")
    return 3 if found.reason else 0


def _bases(file: Any, eps: Any, options: dict[str, Any]) -> int:
    from kahanmaps.algebra.text import parse_polynomial
    from kahanmaps.errors import InputError
    from kahanmaps.laboratory.hirota_kimura import Basis, hirota_kimura_basis
    from kahanmaps.laboratory.integrals import closing_note
    from kahanmaps.laboratory.laboratory import Laboratory
    from kahanmaps.laboratory.modular_points import NoPoint

    if options["symbolic"]:
        raise click.UsageError("--monomials goes without --symbolic: the null space is measured at random eps")
    laboratory = Laboratory(file, (), eps, options["seed"])
    rows: list[Basis] = []
    reason = laboratory.defect
    for text in options["sets"]:
        parts = [part.strip() for part in text.split(",")]
        if not all(parts):
            raise InputError(f"found the set {text!r}, expected polynomials with commas between them: 'x^2,y^2,1'")
        functions = [parse_polynomial(part, file.variables, file.parameters) for part in parts]
        for k, function in enumerate(functions):
            if function.is_zero():
                raise InputError(
                    f"found 0 as function {k + 1} of the set {text!r}, expected polynomials that are not 0"
                )
            if function in functions[:k]:
                raise InputError(f"found function {k + 1} twice in the set {text!r}, expected different ones")
        try:
            if not reason:
                rows.append(hirota_kimura_basis(laboratory.maps, functions, parts))
        except NoPoint as error:
            reason = str(error)
    note = closing_note(next((row.period for row in rows if row.period), None), laboratory.eps)
    if options["as_json"]:
        print_json(
            {
                **heading("hirota-kimura", laboratory),
                "arithmetic": "residues modulo primes, eps random where none is given",
                "primes": [str(prime) for prime in laboratory.primes],
                "bases": [row.to_json() for row in rows],
                "note": note,
                "reason": reason,
                "document": dict(file.document),
            }
        )
        return 3 if reason else 0
    step = "generic eps" if laboratory.eps is None else scope(laboratory)
    click.echo(f"Hirota-Kimura bases: {file.name}, {step}, measured on two orbits modulo each of two primes")
    for row in rows:
        click.echo(f"dimension {row.dimension}\t{', '.join(row.functions)}")
        for vector in row.constant:
            names = [name for name, same in zip(row.functions, vector, strict=True) if not same]
            click.echo(f"\tcoefficients that are integrals: {', '.join(names) or 'none'}")
        if not row.agree:
            click.echo("\tthe orbits that were compared do not agree: try another --seed")
    for text in filter(None, (note, reason)):
        click.echo(f"note\t{text}")
    return 3 if reason else 0
