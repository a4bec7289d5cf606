"""kahanmaps find-integrals."""

from __future__ import annotations

from functools import partial
from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli import options as opt
from kahanmaps_cli.runs.certificates import write_certificate
from kahanmaps_cli.runs.search import (
    heading,
    print_search,
    record,
    require_one_form,
    scope,
    search_arguments,
    search_options,
    symbols_and_eps,
)
from kahanmaps_cli.screen.progress import SearchProgress
from kahanmaps_cli.screen.render import print_json
from kahanmaps_cli.screen.terminal import abbreviated, print_stdout
from kahanmaps_cli.screen.value_rows import Cell, rows_of, table


@click.command("find-integrals")
@opt.system_options
@click.option(
    "--monomials",
    "sets",
    metavar="LIST",
    multiple=True,
    help="Search for a Hirota-Kimura basis of these polynomials instead, e.g. 'x^2,y^2,1'; x~ is the image of x.",
)
@click.option(
    "--darboux",
    type=click.IntRange(1, 12),
    metavar="DEGREE",
    help="Search for discrete Darboux polynomials up to this degree instead; with --flow for those of the differential "
    "equation.",
)
@click.option("--flow", is_flag=True, help="Compare integrals of the differential equation with those of the map.")
@click.option(
    "--max-degree",
    type=click.IntRange(1, 20),
    metavar="D",
    help="Largest degree of polynomials that vanish along an orbit (default: by dimension and --effort).",
)
@search_options("integrals")
def command(system: str | None, **options: Any) -> int:
    """Search for integrals of the map of SYSTEM: their number, formulas P/Q, and proofs.

    \b
      kahanmaps find-integrals euler_top --symbolic a1,a2,a3
      kahanmaps find-integrals volterra_periodic_4 --toml
      kahanmaps find-integrals kirchhoff_case
      kahanmaps find-integrals lagrange_top --monomials 'm1^2+m2^2,p3^2,p3,1'
      kahanmaps find-integrals volterra_periodic_4 --darboux 2
      kahanmaps find-integrals henon_heiles --flow
      kahanmaps find-integrals henon_heiles -p c=-2..0
      kahanmaps find-integrals euler_top -p 'a1 = root of t^2 - 2'
      kahanmaps find-integrals lorenz --parameter b=20 --flow --darboux 3
      kahanmaps find-integrals --vars x,y --rhs 'x^2-y^2' --rhs='-2*x*y'

    Without --eps the formulas contain eps (the time step is 2 eps). The number of independent integrals follows from
    theorems and from orbits, measured modulo primes; every formula is verified as an identity. If there is no formula
    in x alone, a formula may contain x~, the image of x, x~~, the image of x~, and so on. --flow reports which
    integrals of the differential equation are limits of integrals of the map as eps -> 0, and which are lost.

    A parameter with a range of values, FIRST..LAST or FIRST..LAST:STEP, gives a table with a line for each value or
    combination of values; with --json one record per line. Values at which the map does not exist are listed at the
    end.

    Exit status: 0 if every integral that theorems give or orbits show has a formula, 2 for a usage error, 3 if some
    have no formula, orbits were not measured, or the work or time limit was too small.
    """
    require_one_form(options)

    def cell(file: lib.SystemFile, search: SearchProgress) -> Cell:
        if any(options[name] for name in ("sets", "darboux", "flow", "as_toml", "as_latex")):
            raise click.UsageError(
                "a range of values cannot be combined with --monomials, --darboux, --flow, --toml and --latex"
            )
        if options["certificate"] is not None:
            raise click.UsageError(
                "a range of values cannot be combined with --certificate: certify one value of each parameter"
            )
        result = lib.find_integrals(file, **search_arguments(options, "max_degree"), progress=search)
        formulas = "; ".join(f"{integral.text} ({integral.verdict})" for integral in result.integrals)
        _, _, count_text = _count_line(result).partition("\t")
        line = f"{count_text}\t{abbreviated(formulas)}".rstrip()
        return Cell(line, lambda: record("find-integrals", result, search), lambda: None, result.reason)

    if rows_of(options["parameters"], system) is not None:
        return table(system, options, cell)
    if options["certificate"] is not None and (options["flow"] or options["sets"]):
        raise click.UsageError(
            "--certificate cannot be combined with --flow and --monomials: it is for integrals of the map"
        )
    if options["flow"] and (options["sets"] or options["as_toml"]):
        raise click.UsageError("--flow cannot be combined with --monomials and --toml, which are for the map")
    if options["sets"] and options["darboux"] is not None:
        raise click.UsageError("give --monomials or --darboux, not both")
    search_flag = "--monomials" if options["sets"] else "--darboux" if options["darboux"] is not None else ""
    if search_flag and (options["as_toml"] or options["as_latex"]):
        raise click.UsageError(f"{search_flag} can be combined with --json, not with --toml and --latex")
    if search_flag:
        return (_search_bases if options["sets"] else _search_darboux)(system, options)
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        find = partial(lib.find_integrals, file, **search_arguments(options, "max_degree"), progress=search)
        if options["flow"]:
            stages = lib.budget_for("integrals", options["effort"]).share([1, 1])
            result = find(flow=True, effort=next(stages))
            comparison = lib.flow_and_map(find(effort=next(stages)), None, result)
        else:
            result, comparison = find(), None
    if comparison is not None and options["as_json"]:
        print_json(record("find-integrals", result, search, beside_map=comparison.to_json()))
        return 3 if result.reason else 0
    integrals: list[Any] = [*result.integrals, *result.in_iterates]
    rows = [(integral.name, integral, f"{integral.origin}: ") for integral in integrals]
    print_search("find-integrals", result, search, options, rows, _count_line(result))
    if not any((options["as_json"], options["as_toml"], options["as_latex"])):
        for integral in result.time_dependent:
            prefix = "" if result.flow else "of the n-th point: "
            print_stdout(
                f"{integral.name}\t{integral.integral.verdict}\t{abbreviated(integral.text)}\n\t{prefix}depends on time"
            )
        for status, text in () if comparison is None else comparison.lines(others=False):
            print_stdout(f"{status}\t{abbreviated(text)}")
    return write_certificate(options, file.name, result.certificate, 3 if result.reason else 0)


def _count_line(result: Any) -> str:
    if not result.profile.nullities and not result.codimension:
        return "orbits\tnot measured"
    return f"found\t{lib.counted(result.formula_count, 'functionally independent integral')}; {result.count_text}"


def _search_darboux(system: str | None, options: dict[str, Any]) -> int:
    with SearchProgress(options) as search:
        file, degree = opt.load_system(system, options), options["darboux"]
        result = lib.darboux_polynomials(file, degree, **search_arguments(options, "flow"), progress=search)
    if options["as_json"]:
        print_json(record("darboux-polynomials", result, search))
    else:
        print_stdout(f"Darboux polynomials: {result.file.name}{scope(result)}")
        print_stdout("\n".join("\t".join(map(abbreviated, line.split("\t"))) for line in str(result).split("\n")))
    status = 3 if result.reason else 0
    return write_certificate(options, file.name, result.certificate, status)


def _search_bases(system: str | None, options: dict[str, Any]) -> int:
    if options["symbolic"]:
        raise click.UsageError(
            "--monomials cannot be combined with --symbolic: the null space is measured at random eps"
        )
    eps = symbols_and_eps(options)[1]
    with SearchProgress(options) as search:
        file = opt.load_system(system, options)
        laboratory = lib.Laboratory(file, (), eps, options["seed"])
        bases: list[lib.Basis] = []
        reason = laboratory.defect
        for text in options["sets"]:
            formulas = [f.strip() for f in text.split(",")]
            if not all(formulas):
                expected = "polynomials with commas between them: 'x^2,y^2,1'"
                raise lib.InputError(f"found the set {lib.quoted(text)}, expected {expected}")
            letters = lib.with_iterates(file.variables, lib.iterates_in(text))
            functions = [lib.parse_polynomial(f, letters, file.parameters) for f in formulas]
            for k, function in enumerate(functions):
                position = f"function {k + 1}"
                if function.is_zero():
                    expected = "polynomials that are not 0"
                    raise lib.InputError(f"found 0 as {position} of the set {lib.quoted(text)}, expected {expected}")
                if function in functions[:k]:
                    raise lib.InputError(
                        f"found {position} twice in the set {lib.quoted(text)}, expected different ones"
                    )
            try:
                if not reason:
                    bases.append(lib.hirota_kimura_basis(laboratory.maps, functions, formulas))
            except lib.NoPoint as error:
                reason = str(error)
    note = lib.closing_note(next((basis.period for basis in bases if basis.period), None), laboratory.eps, file.map)
    if options["as_json"]:
        print_json(
            {
                **heading("hirota-kimura", laboratory, search),
                "arithmetic": "residues modulo primes, eps random where none is given",
                "primes": [str(prime) for prime in laboratory.primes],
                "bases": [basis.to_json() for basis in bases],
                "note": note,
                "reason": reason,
                "document": dict(file.document),
            }
        )
        return 3 if reason else 0
    eps_text = ", generic eps" if laboratory.eps is None and file.map.has_eps else scope(laboratory)
    print_stdout(f"Hirota-Kimura bases: {file.name}{eps_text}, measured on two orbits modulo each of two primes")
    for basis in bases:
        print_stdout(f"dimension {basis.dimension}\t{', '.join(basis.functions)}")
        for vector in basis.constant:
            names = [name for name, is_constant in zip(basis.functions, vector, strict=True) if not is_constant]
            print_stdout(f"\tcoefficients that are integrals: {', '.join(names) or 'none'}")
        if not basis.orbits_agree:
            print_stdout("\tthe orbits that were compared do not agree: try another --seed")
    for text in filter(None, (note, reason)):
        print_stdout(f"note\t{text}")
    return 3 if reason else 0
