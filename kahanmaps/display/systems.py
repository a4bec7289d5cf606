"""Systems, members, maps and orbits as HTML and LaTeX for notebooks; the size of the display is bounded.

Nothing is computed for the display of a value.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.printing import first_terms, format_number
from kahanmaps.display import markup
from kahanmaps.display.latex import (
    equations,
    formula,
    latex_aligned,
    latex_cut,
    latex_matrix,
    latex_name,
    latex_polynomial,
    matrix,
)
from kahanmaps.display_protocols import html_form, latex_form, text_form
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import counted
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.composed import ComposedMap
from kahanmaps.maps.implicit import ImplicitMap, Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily, KahanMap
from kahanmaps.maps.normal_form.geometry import LevelGeometry
from kahanmaps.maps.normal_form.periods import OrbitPeriod, PlanePeriod
from kahanmaps.maps.orbits.iteration import Orbit, OrbitPoint
from kahanmaps.maps.orbits.orbit import Trajectory
from kahanmaps.maps.orbits.relations.orbit_curve import OrbitCurve
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

CHARACTERS = 300  # approximate maximal number of characters of one formula
_MAX_TEXT = 200  # maximal number of characters of the text of one value
_MAX_EQUATIONS, _MAX_LATEX_EQUATIONS = 12, 8


@latex_form.register
def system_latex(system: QuadraticSystem) -> str:
    """Return the equations x' = f(x) of a system as LaTeX."""
    names = [rf"\dot{{{latex_name(name)}}}" for name in system.variables]
    rows = [(x, latex_cut(f, CHARACTERS)) for x, f in zip(names, system.rhs[: _MAX_LATEX_EQUATIONS + 1], strict=False)]
    rows += [(x, "") for x in names[len(rows) :]]  # only counted by `latex_aligned`, not shown
    return latex_aligned(rows, _MAX_LATEX_EQUATIONS)


@latex_form.register
def hamiltonian_latex(hamiltonian: CubicHamiltonian) -> str:
    """Return H and the equations x' = J grad H as LaTeX."""
    J = r"\begin{pmatrix} 0 & I \\ -I & 0 \end{pmatrix}" if hamiltonian.is_standard else latex_matrix(hamiltonian.J)
    return latex_aligned([("H", latex_cut(hamiltonian.H, CHARACTERS)), (r"\dot{x}", rf"J \nabla H, \quad J = {J}")])


@latex_form.register
def file_latex(file: SystemFile) -> str:
    """Return the equations of the system or map in a system file as LaTeX."""
    return birational_latex(file.map)


def map_html(map_: MapFamily) -> str:
    """Return as HTML the vector field of a Kahan map, or the equations of any other map."""
    if isinstance(map_, KahanFamily):
        return equations_html(map_.system)
    return "<br/>\n".join(markup.escape(markup.abbreviate(line, CHARACTERS)) for line in str(map_).split("\n"))


def equations_html(
    system: QuadraticSystem, characters: int | None = CHARACTERS, max_count: int = _MAX_EQUATIONS
) -> str:
    """Return at most `max_count` equations of a system as HTML; each is cut after about `characters` characters."""
    text = equations(system.variables[:max_count], system.rhs[:max_count], characters)
    return text if system.dim <= max_count else f"{text}<br/>\n… ({system.dim} equations)"


@html_form.register
def file_html(file: SystemFile) -> str:
    """Return the equations, the parameters and the claims of a system file as HTML."""
    rows = [("equations", map_html(file.map))]
    if file.parameters:
        values = (f"{name} = {markup.abbreviate(format_number(v))}" for name, v in list(file.parameters.items())[:20])
        rows.append(("parameters", markup.escape(", ".join(values))))
    if file.member is not None:
        rows.append(("member of the commuting family", matrix(file.member.A, "A")))
    if file.hamiltonian is not None:
        rows.append(("Hamiltonian", formula(file.hamiltonian.H, "H", CHARACTERS)))
    rows += [
        (f"integral {markup.abbreviate(name)}".strip(), formula(function, characters=CHARACTERS))
        for name, function in [*file.integrals.items(), *file.integrals_in_iterates.items()][:10]
    ]
    if file.density is not None:
        rows.append(("density (claimed)", formula(file.density, "phi", CHARACTERS)))
    title = file.catalog.get("title", "")
    return markup.block(markup.abbreviate(file.name), markup.definitions(rows), markup.abbreviate(str(title), 200))


@html_form.register
def member_html(member: FamilyMember) -> str:
    """Return A, H, chi and the signs of a member of the family as HTML."""
    factors = " ".join(
        f"({factor})" + f"^{factor.multiplicity}" * (factor.multiplicity > 1) for factor in member.factors
    )
    rows = [
        ("A", matrix(member.A)),
        ("H", formula(member.H, characters=CHARACTERS)),
        ("chi", markup.escape(markup.abbreviate(factors, _MAX_TEXT))),
        ("signs", markup.escape(member.chosen.label)),
        ("associated systems over Q", str(2 ** (len(member.factors) - 1))),
    ]
    return markup.block(f"member of the commuting family, m = {member.m}", markup.definitions(rows))


@html_form.register
def associated_html(system: AssociatedSystem) -> str:
    """Return B, K and the equations of an associated system as HTML."""
    powers = [
        f"{markup.abbreviate(format_number(c), 20)} {('I', 'A')[k] if k < 2 else f'A^{k}'}"
        for k, c in enumerate(system.coefficients[:12])
        if c != 0
    ]
    rows = [
        ("B", markup.escape(" + ".join(powers) or "0")),
        ("K", formula(system.K, characters=CHARACTERS)),
        ("equations", equations_html(system.system)),
    ]
    return markup.block(f"associated system {system.label}", markup.definitions(rows))


@html_form.register
def normal_form_html(form: NormalForm) -> str:
    """Return chi, h, D and the planes over Q of a normal form as HTML."""
    texts = {"chi(t)": form.chi_text, "h(X, Y)": form.h_text, "D(X, Y)": form.D_text}
    rows = [(name, markup.escape(markup.abbreviate(text, _MAX_TEXT))) for name, text in texts.items()]
    rows.append(("S", matrix(form.S)))
    rows += [
        (f"plane at t = {markup.abbreviate(format_number(part.root), 20)}", formula(part.h, "h", CHARACTERS))
        for part in form.parts[:8]
    ]
    remark = "x = S z, a planar system over K = Q[t]/chi"
    return markup.block(f"normal form, m = {form.m}", markup.definitions(rows), remark)


_COORDINATES = 8  # maximal number of coordinates in a row of a table
_POINTS = 6  # number of points at the beginning of an orbit that are displayed
_MAX_DIGITS = 2_000  # maximal number of digits of a number that is converted to text


@latex_form.register
def map_latex(kahan: KahanMap) -> str:
    """Return as LaTeX the equation that defines a Kahan map."""
    system, field = kahan.system, kahan.field
    rows = []
    for name, f in zip(system.variables[:_MAX_LATEX_EQUATIONS], system.rhs, strict=False):
        change = rf"{latex_name(name + '~')} - {latex_name(name)}"
        rows.append((rf"\frac{{{change}}}{{2 \varepsilon}}", _polarized_component(f, system.variables)))
    if system.dim > _MAX_LATEX_EQUATIONS:
        rows.append((r"\vdots", rf"\text{{({system.dim} equations)}}"))
    with field.working():
        eps, step = (markup.abbreviate(field.format(value)) for value in (kahan.eps, kahan.eps + kahan.eps))
    over_field = "" if str(field) == "QQ" else rf"\text{{ over {_tex(field)}}}"
    rows.append(
        (
            r"\varepsilon",
            rf"\text{{{_tex(eps)}}},\quad \text{{time step }} 2 \varepsilon = \text{{{_tex(step)}}}{over_field}",
        )
    )
    return latex_aligned(rows, _MAX_LATEX_EQUATIONS + 2)


@latex_form.register
def composition_latex(map_: Map) -> str:
    """Return as LaTeX the text of a map that is not a Kahan map."""
    return rf"$\text{{{_tex(map_)}}}$"


@latex_form.register
def birational_latex(map_: MapFamily) -> str:
    """Return as LaTeX the equations between a point and its image, or the vector field of a Kahan map."""
    if isinstance(map_, KahanFamily):
        return system_latex(map_.system)
    if isinstance(map_, ComposedMap) and not map_.is_small:
        return latex_aligned([(r"\widetilde{x}", rf"\text{{{len(map_.parts)} maps one after the other}}")])
    assert isinstance(map_, ImplicitMap | ComposedMap)
    equations_shown = map_.equations[: _MAX_LATEX_EQUATIONS + 1]
    return latex_aligned([(latex_cut(equation, CHARACTERS), "0") for equation in equations_shown], _MAX_LATEX_EQUATIONS)


def _polarized_component(polynomial: fmpq_mpoly, variables: Sequence[str]) -> str:
    """Return as LaTeX the polarization 2 f((x + x~)/2) - f(x)/2 - f(x~)/2 of a component f of a quadratic field."""
    terms_shown = first_terms(polynomial, CHARACTERS // 2)
    context = ring((*variables, *(f"{name}~" for name in variables)))
    x, y = context.gens()[: len(variables)], context.gens()[len(variables) :]
    midpoint = [(a + b) / 2 for a, b in zip(x, y, strict=True)]
    at_midpoint, at_x, at_y = (terms_shown.compose(*point, ctx=context) for point in (midpoint, x, y))
    terms = counted(len(polynomial), "term")
    if not len(terms_shown) and len(polynomial):
        return rf"\text{{({terms}, not shown)}}"
    ellipsis = rf" + \cdots\ \text{{({terms})}}" if len(terms_shown) < len(polynomial) else ""
    return latex_polynomial(2 * at_midpoint - (at_x + at_y) / 2) + ellipsis


def _tex(text: object) -> str:
    return str(text).replace("_", r"\_")


@html_form.register
def orbit_html(orbit: Orbit) -> str:
    """Return as HTML the first points of an orbit, the last point that is computed, and how the orbit ended."""
    variables = orbit.map.variables
    first_points, last = list(orbit.first), orbit.last
    head = ["step", *variables[:_COORDINATES], *(["…"] if len(variables) > _COORDINATES else []), "digits"]
    rows = [_point_cells(point, len(variables)) for point in first_points]
    if last is not None and last.step > first_points[-1].step:
        if last.step > first_points[-1].step + 1:
            rows.append(["…"] * len(head))
        rows.append(_point_cells(last, len(variables)))
    if orbit.end is not None:
        word = orbit.end.status
        status = f"{markup.verdict(word)}: {markup.escape(orbit.end.message)}"
    elif last is not None:
        status = f"computed to step {last.step}, not to its end"
    else:
        status = "no point computed yet: iterate over it"
    field = orbit.map.field
    direction = " backward" if orbit.backward else ""
    eps, flow = orbit.map.eps, orbit.map.flow  # None for a composition of maps with different eps or fields
    at_eps = "" if eps is None else f" eps = {markup.abbreviate(field.format(eps))},"
    at_eps += "" if flow is None else f" time step {markup.abbreviate(field.format(flow[1]))},"
    title = f"orbit{direction},{at_eps} over {field}"
    return markup.block(title, f"{markup.table(head, rows)}\n<p>{status}</p>" if rows else f"<p>{status}</p>")


@html_form.register
def trajectory_html(orbit: Trajectory) -> str:
    """Return as HTML the first points of an orbit and, if all points are computed, the last one."""
    computed = vars(orbit).get("points")
    points_shown = orbit.preview(_POINTS) if computed is None else [*computed[:_POINTS], *computed[_POINTS:][-1:]]
    variables = orbit.variables
    head = ["step", *variables[:_COORDINATES], *(["…"] if len(variables) > _COORDINATES else []), "digits"]
    rows = [_point_cells(point, len(variables)) for point in points_shown]
    if computed is not None and len(computed) > _POINTS + 1:
        rows.insert(_POINTS, ["…"] * len(head))
    if computed is None:
        status = "the first points; len(orbit), orbit.x and orbit[-1] compute all"
    else:
        status = f"{markup.verdict(orbit.end.status)}: {markup.escape(orbit.end.message)}"
    title = f"orbit, {orbit.arithmetic} arithmetic, {orbit.method} method"
    return markup.block(title, f"{markup.table(head, rows)}\n<p>{status}</p>")


def _point_cells(point: OrbitPoint, count: int) -> list[str]:
    """Return the cells of a point: its step, the first of its `count` coordinates, its number of digits."""
    is_long = point.digits > _MAX_DIGITS
    texts = [t if len(t) <= 24 else f"{t[:10]}…{t[-10:]}" for t in (["(long)"] * count if is_long else point.text)]
    cells = texts[:_COORDINATES] + ["…"] * (count > _COORDINATES)
    return [str(point.step), *(markup.escape(text) for text in cells), str(point.digits or "")]


@html_form.register
def period_html(period: OrbitPeriod) -> str:
    """Return as HTML the period of an orbit, and the periods of its projections to the planes."""
    sentence, *planes = period.text.split("\n")
    planes_html = markup.bullet_list(markup.escape(markup.abbreviate(line, 200)) for line in planes[:20])
    return markup.block(markup.abbreviate(sentence, 200), planes_html)


@text_form.register
def period_text(period: OrbitPeriod) -> str:
    """Return as text the period of an orbit, the periods in its planes, and whether the orbit meets a pole."""
    lines = [f"period\t{_period_word(period)}"]
    for plane in period.planes:
        cells = ["plane", plane.name, f"period {_period_word(plane)}", str(plane.kind), plane.reason]
        lines.append("\t".join(cells).rstrip())
    poles = {True: "the orbit meets one", False: "the orbit meets none", None: "not known whether the orbit meets one"}
    return "\n".join(
        [*lines, f"poles\t{poles[period.meets_pole]}", f"# {period.status}: {period.text.splitlines()[0]}"]
    )


def _period_word(period: OrbitPeriod | PlanePeriod) -> str:
    return "none" if period.status == "aperiodic" else period.status if period.period is None else str(period.period)


@text_form.register
def geometry_text(geometry: LevelGeometry | OrbitCurve) -> str:
    """Return as text the curves, translations and rotation numbers in the planes of an orbit."""
    return geometry.text


@html_form.register
def geometry_html(geometry: LevelGeometry | OrbitCurve) -> str:
    """Return as an HTML list the curves, translations and rotation numbers in the planes of an orbit."""
    lines = (
        markup.escape(markup.abbreviate(line.strip(), 200)) for line in geometry.text.replace("\t", ": ").split("\n")
    )
    return markup.block("geometry of the level set", markup.bullet_list(lines))
