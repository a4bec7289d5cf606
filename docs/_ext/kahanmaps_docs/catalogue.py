"""The page of the catalogue: every system and map with its equations, what is known about it, with references."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kahanmaps.display.latex import latex_name, latex_number, latex_polynomial, latex_rational_function
from kahanmaps.documents.catalog import load, map_names, names
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.structured_facts import relations
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps_docs.literature import KEY, link
from kahanmaps_docs.markdown import code, plain, table

LONGEST_FORMULA = 900  # characters of LaTeX; longer ones are said to be long, and where to see them


def catalogue() -> str:
    """A table of all systems and then of all maps, and a section for each."""
    systems, maps = ([load(name) for name in entry] for entry in (names(), map_names()))
    tables = [_table("system", systems), "Maps that are not Kahan's:\n", _table("map", maps)]
    return "\n".join([*tables, *(section(file) for file in (*systems, *maps))])


def _table(head: str, files: list[SystemFile]) -> str:
    rows = [
        [
            f"[{plain(f.name)}](#system-{f.name})",
            str(f.dim),
            plain(f.catalog["title"]),
            f.catalog.get("verdict", ""),
        ]
        for f in files
    ]
    return table([head, "dim", "", "verdict"], rows)


def section(file: SystemFile) -> str:
    """All about one system."""
    known = file.catalog
    pieces = [
        f"(system-{file.name})=\n## {plain(file.name)}\n",
        f"{plain(known['title'])}, dimension {file.dim}.",
    ]
    if file.parameters:
        values = ", ".join(f"${latex_name(name)} = {latex_number(value)}$" for name, value in file.parameters.items())
        pieces.append(f"The formulas are for these values of the parameters: {values}.")
    pieces += [displayed(formula) for formula in formulas(file)]
    if "family" in file.document:
        pieces.append("A member of the commuting family.")
    pieces += ["\n".join(f"* {line}" for line in facts(file)), where_from(file, known)]
    pieces.append(f"To copy and change: `kahanmaps systems {file.name} --toml`.\n")
    return "\n\n".join(filter(None, pieces)) + "\n"


def formulas(file: SystemFile) -> list[str]:
    """The equations, H, integrals and density in LaTeX."""
    if isinstance(file.map, KahanFamily):  # with eps in its coefficients, if it was repaired
        sides = zip(file.variables, file.map.system.rhs, strict=True)
        rows = [rf"{latex_name(x)}^\prime &= {latex_polynomial(f)}" for x, f in sides]
    elif file.map.image is not None:
        images = zip(file.variables, file.map.image, strict=True)
        rows = [rf"\tilde {latex_name(x)} &= {latex_rational_function(f)}" for x, f in images]
    else:
        rows = [rf"{latex_polynomial(equation)} &= 0" for equation in file.map.equations]
    results = [r"\begin{aligned}" + r" \\ ".join(rows) + r"\end{aligned}"]
    if file.hamiltonian is not None:
        results.append(f"H = {latex_polynomial(file.hamiltonian.H)}")
    for name, integral in file.integrals.items():
        results.append(f"{latex_name(name) if name else 'I'} = {latex_rational_function(integral)}")
    if file.density is not None:
        results.append(rf"\phi = {latex_rational_function(file.density)}")
    return results


def displayed(formula: str) -> str:
    """A displayed formula; of one that is too long to be read only the beginning, its left side."""
    if len(formula) <= LONGEST_FORMULA or formula.startswith(r"\begin"):
        return f"$$\n{formula}\n$$"
    left = formula.partition(" = ")[0]
    return f"${left}$ is too long to be shown: {len(formula)} characters of LaTeX."


def facts(file: SystemFile) -> list[str]:
    """What is known, first what programs can read as well."""
    known = file.catalog
    results = []
    if "degrees" in known or "growth" in known:
        degrees = ", ".join(map(str, known.get("degrees", [])))
        growth = f"{known['growth']} growth" if "growth" in known else ""
        dynamical = known.get("dynamical_degree")
        root = f", dynamical degree: the largest root of {code(dynamical)}" if dynamical else ""
        results.append(f"degrees of the iterates: {degrees + ', ...: ' if degrees else ''}{growth}{root}")
    if "codimension" in known:
        results.append(f"a generic orbit lies in a variety of codimension {known['codimension']}")
    for relation in relations(known, file.variables):
        results.append(f"relations along an orbit: {relation.dimension} among {code(relation.text)}")
    return results + [_linked(fact) for fact in known.get("facts", [])]


def where_from(file: SystemFile, known: Mapping[str, Any]) -> str:
    """The sources, and what eps is in them."""
    sources = ", ".join(link(key) for key in known.get("sources", []))
    lines = [f"Sources: {sources}."] if sources else []
    if "convention" in known:
        lines.append(f"The step: {_linked(known['convention'])}.")
    return " ".join(lines)


def _linked(text: str) -> str:
    """Text in which the keys of sources lead to the bibliography."""
    return KEY.sub(lambda key: link(key[1]), plain(text))
