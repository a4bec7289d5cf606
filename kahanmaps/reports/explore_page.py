"""A page with sliders: eps and the start move, the orbit is drawn by the reader's browser, the exact verdict beside it.

What the browser computes are machine numbers, from the same polynomials M and r (M x~ = r) as all orbits of the
library; explore.js solves the linear system of each step. What is proved was proved before, and is text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import resources
from typing import TYPE_CHECKING, Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.written.text import format_number, format_rational_function
from kahanmaps.display import markup
from kahanmaps.display.laboratory import eps_sentence
from kahanmaps.display.mathml import formula
from kahanmaps.errors import InputError
from kahanmaps.maps.floats.doubles import to_float, to_floats
from kahanmaps.plots.curves.plane_cubics import Floats
from kahanmaps.plots.portraits.automatic_starts import automatic_starts
from kahanmaps.reports.analysis_page import system_html
from kahanmaps.reports.page import CHARACTERS, Section, page, text, wide
from kahanmaps.reports.pictures import Pictures

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.laboratory.analysis import Analysis
    from kahanmaps.plots.recipe import Recipe

_EPS = fmpq(1, 20)
_LARGEST_EPS = 0.5
_STEPS, _MOST_STEPS = 800, 5000
_MOST_TERMS = 2000  # of all polynomials: the browser evaluates them at every step
_MOST_VARIABLES = 12
_LAYOUT = """
.explore { display: grid; grid-template-columns: minmax(0, 3fr) minmax(14rem, 2fr); gap: 1.2rem; }
@media (max-width: 50rem) { .explore { grid-template-columns: minmax(0, 1fr); } }
.explore canvas { width: 100%; background: #ffffff; border-radius: .4rem; touch-action: none; cursor: crosshair; }
.explore label { display: grid; grid-template-columns: 3.5rem minmax(0, 1fr) 5.5rem; gap: .6rem; align-items: center; }
"""


def explore_page(found: Analysis, title: str, recipe: Recipe) -> str:
    """The page about what `analyze` found, with an orbit that its reader moves.

    Raises InputError where a map has too many variables or terms for a browser to follow the slider.
    """
    file = found.file
    data = explore_data(found)
    words = (file.name, f"dimension {found.dim}", eps_sentence(found.eps, file.map))
    inside = f'<div class="explore">\n<div>{_picture(data)}</div>\n<div>{_verdict(found)}</div>\n</div>'
    # in a script element < could begin a tag, in text of JSON it can be written otherwise
    held = json.dumps(data, sort_keys=True).replace("<", "\\u003c")
    script = (resources.files("kahanmaps.reports") / "explore.js").read_text(encoding="utf-8")
    inside += f"\n<style>{_LAYOUT}</style>\n"
    inside += f'<script type="application/json" id="explore-data">{held}</script>'
    sections = [
        Section("explore", "An orbit", inside),
        Section("values", "Along the orbit", _functions(data)),
        Section("system", "The system", system_html(file)),
    ]
    lead = text(", ".join(filter(None, words)))
    return page(title, lead, sections, Pictures(False), recipe, found.seed, script=script)


def explore_data(found: Analysis) -> dict[str, Any]:
    """What explore.js works with: the rows of (M | -r), the functions to be watched, where to begin."""
    file = found.file
    map_, n = file.map, file.dim
    if n > _MOST_VARIABLES:
        raise InputError(f"found {n} variables, expected at most {_MOST_VARIABLES} to have a slider each")
    names = (*file.variables, "eps")
    rows = [[_terms(entry, names, {}) for entry in row] for row in map_.rows]
    functions = [(one.name, one.function, str(one.verdict.value)) for one in _integrals(found)]
    if file.hamiltonian is not None and "H" not in {name for name, *_ in functions}:
        H = file.hamiltonian.H
        functions.append(("H", RationalFunction(H, H.context().constant(1)), "of the flow"))
    watched = []
    for name, function, word in functions:
        above, below = (_terms(part, names, file.parameters) for part in (function.numerator, function.denominator))
        shown = format_rational_function(function)
        watched.append({"name": name, "text": shown, "word": word, "above": above, "below": below})
    size = sum(len(terms) for row in rows for terms in row)
    if size > _MOST_TERMS:
        raise InputError(f"found a map of {size} terms, expected at most {_MOST_TERMS} for a browser to step")
    start, reach = _start(file, found.eps)
    return {
        "variables": list(file.variables),
        "rows": rows,
        "has_eps": map_.has_eps,
        "eps": to_float(_EPS if found.eps is None else found.eps),
        "eps_moves": found.eps is None,
        "start": [float(f"{value:.4g}") for value in start],
        "reach": reach,
        "functions": [one for one in watched if len(one["above"]) + len(one["below"]) <= _MOST_TERMS],
    }


def _integrals(found: Analysis) -> Any:
    return () if found.integrals is None else found.integrals.integrals


def _terms(polynomial: fmpq_mpoly, names: tuple[str, ...], values: Mapping[str, fmpq]) -> list[list[Any]]:
    """The terms, each its coefficient and the powers of the names; symbols have their values."""
    places = names_of(polynomial)
    made = []
    for powers, coefficient in polynomial.terms():
        power = dict(zip(places, powers, strict=True))
        for name in set(places) - set(names):
            coefficient *= values[name] ** int(power[name])
        made.append([to_float(coefficient), *(int(power.get(name, 0)) for name in names)])
    return made


def _start(file: SystemFile, eps: fmpq | None) -> tuple[Floats, float]:
    """A start whose orbit stays, in the middle of those that a portrait takes, and how far the sliders go."""
    if file.is_quadratic:
        starts = automatic_starts(file.system, _EPS if eps is None else eps)
        return starts[len(starts) // 2], float(f"{2 * max(1.0, float(abs(starts).max())):.1g}")
    return to_floats([fmpq(k + 1, 2 * (k + 2)) for k in range(file.dim)]), 3.0


def _picture(data: Mapping[str, Any]) -> str:
    """The canvas with a slider for eps, the steps and every coordinate of the start."""
    reach, n = data["reach"], len(data["variables"])
    lines = [_slider(f"x{k}", name, -reach, reach, data["start"][k]) for k, name in enumerate(data["variables"])]
    if data["has_eps"]:
        most = max(_LARGEST_EPS, 2 * abs(data["eps"]))
        slider = _slider("eps", "eps", -most if data["eps"] < 0 else 0, most, data["eps"])
        lines.insert(0, slider if data["eps_moves"] else slider.replace("<input", "<input disabled"))
    lines.append(_slider("steps", "steps", 10, _MOST_STEPS, _STEPS, "10"))
    first, second = (n, 0) if n == 1 else (0, 1)
    return f"""<canvas id="explore-canvas" width="720" height="540" role="img" aria-label="the orbit"></canvas>
<p class="soft" id="explore-status" aria-live="polite"></p>
<p>across {_axis("horizontal", "across", data, first)} up {_axis("vertical", "up", data, second)}
<button type="button" id="explore-fit">Fit the window</button></p>
<p class="soft">The start is the ring: drag it in the picture, or move a slider.</p>
{"".join(lines)}
<noscript><p>The orbit is drawn by JavaScript, which is off here.</p></noscript>"""


def _slider(name: str, label: str, low: float, high: float, value: float, step: str = "any") -> str:
    limits = f'min="{low:g}" max="{high:g}" step="{step}" value="{value!r}"'
    return (
        f'<label><span>{markup.escape(label)}</span><input type="range" id="explore-{name}" {limits}/>'
        f'<output id="explore-{name}-value"></output></label>\n'
    )


def _axis(name: str, label: str, data: Mapping[str, Any], chosen: int) -> str:
    options = "".join(
        f'<option value="{k}"{" selected" if k == chosen else ""}>{markup.escape(word)}</option>'
        for k, word in enumerate((*data["variables"], "step"))
    )
    return f'<select id="explore-{name}" aria-label="{label}">{options}</select>'


def _functions(data: Mapping[str, Any]) -> str:
    """A row for each function: its formula, what is known of it, and cells that explore.js fills in."""
    if not data["functions"]:
        return "<p>No integral has been found in closed form.</p>"
    rows = [
        (
            markup.escape(one["name"]),
            text(one["word"]),
            *(f'<span id="explore-{cell}{k}"></span>' for cell in ("first", "last", "change")),
            f"<code>{text(one['text'])}</code>",
        )
        for k, one in enumerate(data["functions"])
    ]
    heads = ["", "conserved", "at the start", "at the end", "largest change", "formula"]
    note = (
        '<p class="soft">Changes are those in machine numbers: of an integral they are round-off, which grows near '
        "poles.</p>"
    )
    return wide(markup.table(heads, rows)) + note


def _verdict(found: Analysis) -> str:
    final = found.conclusion
    where = "for every eps" if found.eps is None else f"at eps = {format_number(found.eps)} only"
    of = f", {where}" if found.file.map.has_eps else ""
    lines = [
        (markup.verdict(str(one.verdict.value)), formula(one.function, one.name or "I", CHARACTERS))
        for one in _integrals(found)
    ]
    listed = "".join(f'<p class="formula">{word} {what}</p>' for word, what in lines)
    return (
        f'<h3>The verdict{text(of)}</h3>\n<p class="conclusion"><strong>{text(final.kind)}</strong><br/>'
        f"{text(final.sentence)}</p>\n{listed}\n"
        '<p class="soft">Found by exact computation before this page was written; the picture only shows it.</p>'
    )
