"""kahanmaps systems."""

from __future__ import annotations

from typing import Any

import click

from kahanmaps import internals as lib
from kahanmaps_cli.complete import complete_system
from kahanmaps_cli.options import json_option, load_reference, parameter_option
from kahanmaps_cli.screen.render import envelope, print_json
from kahanmaps_cli.screen.terminal import abbreviated, print_entry, print_stdout


@click.command("systems")
@click.argument("name", required=False, shell_complete=complete_system)
@parameter_option
@click.option("--toml", "as_toml", is_flag=True, help="Print the system file, to copy and edit.")
@click.option("--latex", "as_latex", is_flag=True, help="Print equations, integrals and density in LaTeX.")
@json_option
def command(
    name: str | None, parameters: tuple[tuple[str, str], ...], as_toml: bool, as_latex: bool, as_json: bool
) -> None:
    """List the systems of the catalogue, or show one: its equations, what is known about it, and references.

    \b
      kahanmaps systems
      kahanmaps systems euler_top
      kahanmaps systems 'lv(7,3)'
      kahanmaps systems euler_top -p a1=2 --toml > my-top.toml
      kahanmaps systems lagrange_top --latex
    """
    if as_toml + as_latex + as_json > 1:
        raise click.UsageError("give only one of --toml, --latex and --json")
    if name is None:
        if as_toml or as_latex or parameters:
            raise click.UsageError("--toml, --latex and -p need the NAME of a system")
        if as_json:
            systems = [_summary(lib.load(key)) for key in lib.titles()]
            print_json({**envelope("systems"), "systems": systems})
            return
        titles = lib.titles()
        width = max(map(len, titles))
        for key, (dim, title) in titles.items():
            print_entry(f"{key:<{width}}  {dim:>2}  ", title, "bold")
        for family in lib.FAMILIES.values():
            print_entry(f"{family.form:<{width}}   n  ", f"{family.title}, e.g. {family.example}", "bold")
        return
    file = load_reference(name, dict(parameters))
    if as_toml:
        click.echo(file.to_toml(), nl=False)
    elif as_latex:
        click.echo(_latex(file))
    elif as_json:
        print_json(
            {
                **envelope("systems"),
                **_summary(file),
                "variables": list(file.variables),
                **file.map.to_record(),
                "integrals": {name: lib.format_rational_function(f) for name, f in file.integrals.items()},
                "density": lib.format_rational_function(file.density) if file.density is not None else None,
                "facts": list(file.catalog.get("facts", [])),
                "convention": file.catalog.get("convention", ""),
                "sources": [lib.source(key) for key in file.catalog.get("sources", [])],
                "known": _structured_facts(file),
                "document": file.document,
            }
        )
    else:
        _print_system(file)


def _summary(file: Any) -> dict[str, Any]:
    return {
        "name": file.name,
        "dim": file.dim,
        "kind": file.kind,
        "title": file.catalog.get("title", ""),
        "parameters": {name: str(value) for name, value in file.parameters.items()},
    }


def _structured_facts(file: Any) -> dict[str, Any]:
    """Return a dict from the names of structured facts to their values; a fact that the file does not state is None."""
    return {key: file.document.get("catalog", {}).get(key) for key in lib.FACT_KEYS}


def _latex(file: Any) -> str:
    names = [lib.latex_name(name) for name in file.variables]
    if isinstance(file.map, lib.KahanFamily):  # `file.system` would refuse eps in coefficients
        rows = [rf"\dot{{{x}}} &= {lib.latex_polynomial(f)}" for x, f in zip(names, file.map.system.rhs, strict=True)]
    elif file.map.image is not None:
        rows = [
            rf"\tilde{{{x}}} &= {lib.latex_rational_function(f)}" for x, f in zip(names, file.map.image, strict=True)
        ]
    else:
        rows = [f"{lib.latex_polynomial(equation)} &= 0" for equation in file.map.equations]
    lines = [r"\[", r"\left\{", r"\begin{aligned}", " \\\\\n".join(rows), r"\end{aligned}", r"\right.", r"\]"]
    formulas = [("H", lib.latex_polynomial(file.hamiltonian.H))] if file.hamiltonian is not None else []
    for name, integral in file.integrals.items():
        formulas.append((lib.latex_name(name) if name else "I", lib.latex_rational_function(integral)))
    if file.density is not None:
        formulas.append((lib.latex_name("phi"), lib.latex_rational_function(file.density)))
    for name, text in formulas:
        lines += [r"\[", f"{name} = {text}", r"\]"]
    return "\n".join(lines)


def _print_system(file: Any) -> None:
    print_stdout(f"{file.name}: {file.catalog.get('title', '')}" if file.catalog.get("title") else file.name)
    for name, value in file.parameters.items():
        print_stdout(f"  {name} = {value}")
    for line in str(file.map).split("\n"):
        print_stdout(abbreviated(line))
    if file.hamiltonian is not None:
        print_stdout(f"H = {abbreviated(lib.format_polynomial(file.hamiltonian.H))}")
    claim_word = "" if file.catalog else "claimed "  # tests verify the integrals that a catalogue file states
    for name, integral in file.integrals.items():
        print_stdout(f"{claim_word}integral {name} = {abbreviated(lib.format_factored(integral))}")
    if file.density is not None:
        print_stdout(
            f"{claim_word}density phi = {abbreviated(lib.format_factored(file.density))}  (dx/phi is invariant)"
        )
    facts, lines = _structured_facts(file), []
    if facts["verdict"]:
        lines.append(f"verdict: {facts['verdict']}")
    growth = f"{facts['growth']} growth" if facts["growth"] else ""
    if facts["dynamical_degree"]:
        growth += f"{', ' * bool(growth)}by the largest root of {facts['dynamical_degree']}"
    if facts["degrees"]:
        degrees = ", ".join(str(degree) for degree in facts["degrees"])
        lines.append(f"degrees of the iterates: {degrees}, ...{f' ({growth})' * bool(growth)}")
    elif growth:
        lines.append(f"degrees of the iterates: {growth}")
    if facts["codimension"] is not None:
        lines.append(f"a generic orbit lies in a variety of codimension {facts['codimension']}")
    for relation in lib.relations(file.catalog, file.variables):
        count = (
            "no relation"
            if not relation.dimension
            else f"{relation.dimension} relation{'s' * (relation.dimension > 1)}"
        )
        functions = f"polynomials of {relation.text}" if relation.text.startswith("degree") else relation.text
        lines.append(f"{count} along an orbit among: {functions}")
    if lines:
        print_stdout("for generic parameters and eps:" if file.parameters else "for generic eps:")
    for line in lines:
        print_stdout(f"  {line}")
    for fact in file.catalog.get("facts", []):
        print_stdout(f"* {fact}")
    if file.catalog.get("convention"):
        print_stdout(f"step: {file.catalog['convention']}")
    for key in file.catalog.get("sources", []):
        print_stdout(f"source: {lib.source(key)}")
