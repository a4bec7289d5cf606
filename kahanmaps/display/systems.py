"""How systems, their files and members of the family look in a notebook, bounded in size whatever they are."""

from __future__ import annotations

from kahanmaps.algebra.printing import format_number
from kahanmaps.display import markup
from kahanmaps.display.formulas import equations, formula, matrix
from kahanmaps.display.latex import latex_aligned, latex_cut, latex_matrix, latex_name
from kahanmaps.displayed import html_form, latex_form
from kahanmaps.documents.files import SystemFile
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.implicit import BirationalMap
from kahanmaps.maps.kahan import Kahan
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

CHARACTERS = 300  # of one formula, about
_TEXT = 200
_EQUATIONS = 12


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
    J = r"\begin{pmatrix} 0 & I \\ -I & 0 \end{pmatrix}" if hamiltonian.is_standard else latex_matrix(hamiltonian.J)
    return latex_aligned([("H", latex_cut(hamiltonian.H, CHARACTERS)), (r"\dot{x}", rf"J \nabla H, \quad J = {J}")])


def map_html(map_: BirationalMap) -> str:
    """The equations of a vector field, or those of another map."""
    if isinstance(map_, Kahan):
        return equations_html(map_.system)
    return "<br/>\n".join(markup.escape(markup.shortened(line, CHARACTERS)) for line in str(map_).split("\n"))


def equations_html(system: QuadraticSystem, characters: int | None = CHARACTERS, most: int = _EQUATIONS) -> str:
    """The equations as HTML, at most `most` of them, each cut after about so many characters."""
    shown = equations(system.variables[:most], system.rhs[:most], characters)
    return shown if system.dim <= most else f"{shown}<br/>\n… ({system.dim} equations)"


@html_form.register
def file_html(file: SystemFile) -> str:
    """A system file: its equations, parameters and claims."""
    rows = [("equations", map_html(file.map))]
    if file.parameters:
        values = (f"{name} = {markup.shortened(format_number(v))}" for name, v in list(file.parameters.items())[:20])
        rows.append(("parameters", markup.escape(", ".join(values))))
    if file.member is not None:
        rows.append(("member of the commuting family", matrix(file.member.A, "A")))
    if file.hamiltonian is not None:
        rows.append(("Hamiltonian", formula(file.hamiltonian.H, "H", CHARACTERS)))
    rows += [
        (f"integral {markup.shortened(name)}".strip(), formula(function, characters=CHARACTERS))
        for name, function in [*file.integrals.items(), *file.integrals_in_iterates.items()][:10]
    ]
    if file.density is not None:
        rows.append(("density (claimed)", formula(file.density, "phi", CHARACTERS)))
    title = file.catalog.get("title", "")
    return markup.titled(markup.shortened(file.name), markup.definitions(rows), markup.shortened(str(title), 200))


@html_form.register
def member_html(member: FamilyMember) -> str:
    """A member: A, H, chi, the associated system that its signs pick."""
    factors = " ".join(
        f"({factor})" + f"^{factor.multiplicity}" * (factor.multiplicity > 1) for factor in member.factors
    )
    rows = [
        ("A", matrix(member.A)),
        ("H", formula(member.H, characters=CHARACTERS)),
        ("chi", markup.escape(markup.shortened(factors, _TEXT))),
        ("signs", markup.escape(member.chosen.label)),
        ("associated systems over Q", str(2 ** (len(member.factors) - 1))),
    ]
    return markup.titled(f"member of the commuting family, m = {member.m}", markup.definitions(rows))


@html_form.register
def associated_html(system: AssociatedSystem) -> str:
    """An associated system: its signs, K, B and the equations."""
    powers = [
        f"{markup.shortened(format_number(c), 20)} {('I', 'A')[k] if k < 2 else f'A^{k}'}"
        for k, c in enumerate(system.coefficients[:12])
        if c != 0
    ]
    rows = [
        ("B", markup.escape(" + ".join(powers) or "0")),
        ("K", formula(system.K, characters=CHARACTERS)),
        ("equations", equations_html(system.system)),
    ]
    return markup.titled(f"associated system {system.label}", markup.definitions(rows))


@html_form.register
def normal_form_html(form: NormalForm) -> str:
    """A normal form: chi, h, D and the planes over Q."""
    texts = {"chi(t)": form.chi_text, "h(X, Y)": form.h_text, "D(X, Y)": form.D_text}
    rows = [(name, markup.escape(markup.shortened(text, _TEXT))) for name, text in texts.items()]
    rows.append(("S", matrix(form.S)))
    rows += [
        (f"plane at t = {markup.shortened(format_number(part.root), 20)}", formula(part.h, "h", CHARACTERS))
        for part in form.parts[:8]
    ]
    more = "x = S z, a planar system over K = Q[t]/chi"
    return markup.titled(f"normal form, m = {form.m}", markup.definitions(rows), more)
