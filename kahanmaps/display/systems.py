"""How systems look in a notebook: their equations, bounded in size whatever the system is."""

from __future__ import annotations

from kahanmaps.algebra.text import format_number
from kahanmaps.display import markup
from kahanmaps.display.latex import latex_aligned, latex_cut, latex_name, latex_number
from kahanmaps.display.mathml import equations, formula, matrix
from kahanmaps.displayed import html_form, latex_form
from kahanmaps.systems.files import SystemFile
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

CHARACTERS = 300  # of one formula, about
_EQUATIONS = 12
_LARGEST_J = 8


@latex_form.register
def system_latex(system: QuadraticSystem) -> str:
    """The equations x' = f(x), for a notebook."""
    names = [rf"\dot{{{latex_name(name)}}}" for name in system.variables]
    rows = [(x, latex_cut(f, CHARACTERS)) for x, f in zip(names, system.rhs[: _EQUATIONS + 1], strict=False)]
    rows += [(x, "") for x in names[len(rows) :]]  # only counted
    return latex_aligned(rows, _EQUATIONS)


@latex_form.register
def hamiltonian_latex(hamiltonian: CubicHamiltonian) -> str:
    """H, and the equations x' = J grad H, for a notebook."""
    return latex_aligned(
        [("H", latex_cut(hamiltonian.H, CHARACTERS)), (r"\dot{x}", rf"J \nabla H, \quad J = {_J(hamiltonian)}")]
    )


def _J(hamiltonian: CubicHamiltonian) -> str:
    if hamiltonian.is_standard:
        return r"\begin{pmatrix} 0 & I \\ -I & 0 \end{pmatrix}"
    n = hamiltonian.dim
    if n > _LARGEST_J or any(len(format_number(entry)) > 12 for entry in hamiltonian.J.entries()):
        return rf"\text{{a constant skew matrix, {n} by {n}}}"
    rows = r" \\ ".join(" & ".join(latex_number(entry) for entry in row) for row in hamiltonian.J.tolist())
    return rf"\begin{{pmatrix}} {rows} \end{{pmatrix}}"


def equations_html(system: QuadraticSystem, characters: int | None = CHARACTERS, most: int = _EQUATIONS) -> str:
    """The equations as HTML, at most `most` of them, each cut after about so many characters."""
    shown = equations(system.variables[:most], system.rhs[:most], characters)
    return shown if system.dim <= most else f"{shown}<br/>\n… ({system.dim} equations)"


@html_form.register
def file_html(file: SystemFile) -> str:
    """A system file: its equations, parameters and claims."""
    rows = [("equations", equations_html(file.system))]
    if file.parameters:
        values = (f"{name} = {markup.shortened(format_number(v))}" for name, v in list(file.parameters.items())[:20])
        rows.append(("parameters", markup.escape(", ".join(values))))
    if file.member is not None:
        rows.append(("member of the commuting family", matrix(file.member.A, "A")))
    if file.hamiltonian is not None:
        rows.append(("Hamiltonian", formula(file.hamiltonian.H, "H", CHARACTERS)))
    rows += [
        (f"integral {markup.shortened(name)}".strip(), formula(function, characters=CHARACTERS))
        for name, function in list(file.integrals.items())[:10]
    ]
    if file.density is not None:
        rows.append(("density (claimed)", formula(file.density, "phi", CHARACTERS)))
    title = file.catalog.get("title", "")
    return markup.titled(markup.shortened(file.name), markup.definitions(rows), markup.shortened(str(title), 200))
