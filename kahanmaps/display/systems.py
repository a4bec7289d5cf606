"""How systems look in a notebook: their equations, bounded in size whatever the system is."""

from __future__ import annotations

from kahanmaps.algebra.written.text import format_number
from kahanmaps.display import markup
from kahanmaps.display.formulas import equations
from kahanmaps.display.latex import latex_aligned, latex_cut, latex_name, latex_number
from kahanmaps.displayed import latex_form
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import Kahan
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


def map_html(map_: BirationalMap) -> str:
    """The equations of a vector field, or those of another map."""
    if isinstance(map_, Kahan):
        return equations_html(map_.system)
    return "<br/>\n".join(markup.escape(markup.shortened(line, CHARACTERS)) for line in str(map_).split("\n"))


def equations_html(system: QuadraticSystem, characters: int | None = CHARACTERS, most: int = _EQUATIONS) -> str:
    """The equations as HTML, at most `most` of them, each cut after about so many characters."""
    shown = equations(system.variables[:most], system.rhs[:most], characters)
    return shown if system.dim <= most else f"{shown}<br/>\n… ({system.dim} equations)"
