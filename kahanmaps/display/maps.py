"""How maps and orbits look in a notebook: nothing is computed that was not computed before, and the size is bounded."""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.printing import first_terms
from kahanmaps.display import markup
from kahanmaps.display.latex import latex_aligned, latex_cut, latex_name, latex_polynomial
from kahanmaps.display.systems import CHARACTERS, system_latex
from kahanmaps.displayed import html_form, latex_form, text_form
from kahanmaps.errors import counted
from kahanmaps.maps.composed import ComposedMap
from kahanmaps.maps.implicit import BirationalMap, ImplicitMap
from kahanmaps.maps.kahan import Kahan, KahanMap
from kahanmaps.maps.normal_form.periods import OrbitPeriod, PlanePeriod
from kahanmaps.maps.orbits.iteration import Orbit, OrbitPoint

_EQUATIONS = 8
_COORDINATES = 8
_LARGEST_SHOWN = 2_000  # digits: the text of a longer number is not even made


@latex_form.register
def map_latex(kahan: KahanMap) -> str:
    """The equation that defines the map, for its system and its eps."""
    system, field = kahan.system, kahan.field
    rows = []
    for name, f in zip(system.variables[:_EQUATIONS], system.rhs, strict=False):
        change = rf"{latex_name(name + '~')} - {latex_name(name)}"
        rows.append((rf"\frac{{{change}}}{{2 \varepsilon}}", _polarised(f, system.variables)))
    if system.dim > _EQUATIONS:
        rows.append((r"\vdots", rf"\text{{({system.dim} equations)}}"))
    with field.working():
        eps, step = (markup.shortened(field.format(value)) for value in (kahan.eps, kahan.eps + kahan.eps))
    where = "" if str(field) == "QQ" else rf"\text{{ over {_plain(field)}}}"
    rows.append(
        (
            r"\varepsilon",
            rf"\text{{{_plain(eps)}}},\quad \text{{time step }} 2 \varepsilon = \text{{{_plain(step)}}}{where}",
        )
    )
    return latex_aligned(rows, _EQUATIONS + 2)


@latex_form.register
def birational_latex(map_: BirationalMap) -> str:
    """The equations between a point and its image; of a Kahan map the differential equation that it belongs to."""
    if isinstance(map_, Kahan):
        return system_latex(map_.system)
    if isinstance(map_, ComposedMap) and not map_.is_small:
        return latex_aligned([(r"\widetilde{x}", rf"\text{{{len(map_.parts)} maps one after the other}}")])
    assert isinstance(map_, ImplicitMap | ComposedMap)
    shown = map_.equations[: _EQUATIONS + 1]
    return latex_aligned([(latex_cut(equation, CHARACTERS), "0") for equation in shown], _EQUATIONS)


def _polarised(polynomial: fmpq_mpoly, variables: Sequence[str]) -> str:
    """The right-hand side Q(x, x~) + B (x + x~)/2 + c of one component, which is 2 f((x + x~)/2) - f(x)/2 - f(x~)/2."""
    shown = first_terms(polynomial, CHARACTERS // 2)
    context = ring((*variables, *(f"{name}~" for name in variables)))
    x, y = context.gens()[: len(variables)], context.gens()[len(variables) :]
    middle = [(a + b) / 2 for a, b in zip(x, y, strict=True)]
    at_middle, at_x, at_y = (shown.compose(*point, ctx=context) for point in (middle, x, y))
    terms = counted(len(polynomial), "term")
    if not len(shown) and len(polynomial):
        return rf"\text{{({terms}, not shown)}}"
    more = rf" + \cdots\ \text{{({terms})}}" if len(shown) < len(polynomial) else ""
    return latex_polynomial(2 * at_middle - (at_x + at_y) / 2) + more


def _plain(text: object) -> str:
    """Text of a number or a field for \\text{...}."""
    return str(text).replace("_", r"\_")


@html_form.register
def orbit_html(orbit: Orbit) -> str:
    """The first points and the last one that were computed, and how the orbit ended."""
    variables = orbit.map.variables
    shown, last = list(orbit.first), orbit.last
    head = ["step", *variables[:_COORDINATES], *(["…"] if len(variables) > _COORDINATES else []), "digits"]
    rows = [_cells(point, len(variables)) for point in shown]
    if last is not None and last.step > shown[-1].step:
        if last.step > shown[-1].step + 1:
            rows.append(["…"] * len(head))
        rows.append(_cells(last, len(variables)))
    if orbit.end is not None:
        word = orbit.end.status
        status = f"{markup.verdict(word)}: {markup.escape(orbit.end.message)}"
    elif last is not None:
        status = f"computed to step {last.step}, not to its end"
    else:
        status = "no point computed yet: iterate over it"
    field = orbit.map.field
    direction = " backward" if orbit.backward else ""
    eps, flow = orbit.map.eps, orbit.map.flow  # None where maps at several eps, of several fields were composed
    at = "" if eps is None else f" eps = {markup.shortened(field.format(eps))},"
    at += "" if flow is None else f" time step {markup.shortened(field.format(flow[1]))},"
    title = f"orbit{direction},{at} over {field}"
    return markup.titled(title, f"{markup.table(head, rows)}\n<p>{status}</p>" if rows else f"<p>{status}</p>")


def _cells(point: OrbitPoint, count: int) -> list[str]:
    """One row: the step, the first coordinates of `count`, and the number of digits."""
    is_long = point.digits > _LARGEST_SHOWN
    texts = [t if len(t) <= 24 else f"{t[:10]}…{t[-10:]}" for t in (["(long)"] * count if is_long else point.text)]
    cells = texts[:_COORDINATES] + ["…"] * (count > _COORDINATES)
    return [str(point.step), *(markup.escape(text) for text in cells), str(point.digits or "")]


@html_form.register
def period_html(found: OrbitPeriod) -> str:
    """The period, and that of every plane."""
    sentence, *planes = found.text.split("\n")
    inside = markup.listed(markup.escape(markup.shortened(line, 200)) for line in planes[:20])
    return markup.titled(markup.shortened(sentence, 200), inside)


@text_form.register
def period_text(found: OrbitPeriod) -> str:
    """The period, that in each plane, and whether the orbit meets a pole."""
    lines = [f"period\t{_period_word(found)}"]
    for plane in found.planes:
        cells = ["plane", plane.name, f"period {_period_word(plane)}", str(plane.kind), plane.reason]
        lines.append("\t".join(cells).rstrip())
    poles = {True: "the orbit meets one", False: "the orbit meets none", None: "not known whether the orbit meets one"}
    return "\n".join([*lines, f"poles\t{poles[found.meets_pole]}", f"# {found.status}: {found.text.splitlines()[0]}"])


def _period_word(found: OrbitPeriod | PlanePeriod) -> str:
    return "none" if found.status == "aperiodic" else found.status if found.period is None else str(found.period)
