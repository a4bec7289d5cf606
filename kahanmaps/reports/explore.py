"""Pages with sliders for eps and the initial point of an orbit, which the browser draws beside the exact verdict.

The browser computes in floating point: explore.js solves the linear system M x~ = r for each step, where the entries of
M and r are polynomials in x and eps. The proofs are computed before, and the page contains them as text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, names_of
from kahanmaps.algebra.printing import format_number, format_rational_function
from kahanmaps.display import markup
from kahanmaps.display.latex import formula
from kahanmaps.errors import InputError
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.maps.floats.float_conversion import to_float, to_floats
from kahanmaps.plots.portraits.flow import automatic_starts
from kahanmaps.reports.page import CHARACTERS, Html, PageSection, system_section
from kahanmaps.reports.pictures import DEFAULT_EPS

_MIN_SLIDER_END = 0.5  # the slider of eps ends here, or at twice the given eps if this is larger
_DEFAULT_STEPS, _MAX_STEPS = 800, 5000
_MAX_TERMS = 2000  # maximal number of terms of the polynomials that the browser evaluates at each step
_MAX_VARIABLES = 12  # maximal number of variables, each of which has a slider


def explore_sections(analysis: Analysis) -> list[PageSection]:
    """Return the sections of a page: an orbit with sliders, the verdict and the integrals of an analysis; the system.

    Raises InputError if the map has too many variables or terms for a browser.
    """
    data, conclusion = explore_data(analysis), analysis.conclusion
    names, bound, eps = data["variables"], data["reach"], data["eps"]
    sliders = [(f"x{k}", name, -bound, bound, data["start"][k], "any") for k, name in enumerate(names)]
    if data["has_eps"]:
        max_eps = max(_MIN_SLIDER_END, 2 * abs(eps))
        sliders.insert(0, ("eps", "eps", -max_eps if eps < 0 else 0, max_eps, eps, "any"))
    sliders.append(("steps", "steps", 10, _MAX_STEPS, _DEFAULT_STEPS, "10"))
    scope = "for every eps" if analysis.eps is None else f"at eps = {format_number(analysis.eps)} only"
    integrals = analysis.integrals.integrals if analysis.integrals is not None else ()
    explore = {
        "axes": [*names, "step"],
        "chosen": (1, 0) if len(names) == 1 else (0, 1),
        "sliders": sliders,
        "eps_moves": data["eps_moves"],
        "verdict": f"The verdict{f', {scope}' if analysis.file.map.has_eps else ''}",
        "conclusion": (conclusion.kind, conclusion.sentence),
        "integrals": [
            (
                Html(markup.verdict(str(integral.verdict.value))),
                Html(formula(integral.function, integral.name or "I", CHARACTERS)),
            )
            for integral in integrals
        ],
        "functions": data["functions"],
        # In a script, < could begin a tag. In JSON it can be escaped.
        "data": Html(json.dumps(data, sort_keys=True).replace("<", "\\u003c")),
    }
    return [PageSection("explore", "An orbit", explore=explore), system_section(analysis.file)]


def explore_data(analysis: Analysis) -> dict[str, Any]:
    """Return the data for explore.js: the rows of (M | -r), where M x~ = r; functions to plot; an initial point."""
    file = analysis.file
    map_, n = file.map, file.dim
    if n > _MAX_VARIABLES:
        raise InputError(f"found {n} variables, expected at most {_MAX_VARIABLES} to have a slider each")
    names = (*file.variables, "eps")
    rows = [[_terms(entry, names, {}) for entry in row] for row in map_.rows]
    size = sum(len(terms) for row in rows for terms in row)
    if size > _MAX_TERMS:
        raise InputError(f"found a map of {size} terms, expected at most {_MAX_TERMS} for a browser to step")
    integrals = analysis.integrals.integrals if analysis.integrals is not None else ()
    functions = [(integral.name, integral.function, str(integral.verdict.value)) for integral in integrals]
    if file.hamiltonian is not None and "H" not in {name for name, *_ in functions}:
        H = file.hamiltonian.H
        functions.append(("H", RationalFunction(H, H.context().constant(1)), "of the flow"))
    plotted_functions = []
    for name, function, certainty in functions:
        sides = [_terms(part, names, file.parameters) for part in (function.numerator, function.denominator)]
        if sum(map(len, sides)) <= _MAX_TERMS:
            text = format_rational_function(function)
            plotted_functions.append(
                {"name": name, "text": text, "word": certainty, "numerator": sides[0], "denominator": sides[1]}
            )
    if file.is_quadratic:  # the middle one of sixteen initial points with bounded orbits
        starts = automatic_starts(file.system, DEFAULT_EPS if analysis.eps is None else analysis.eps)
        start, bound = starts[len(starts) // 2], float(f"{2 * max(1.0, float(abs(starts).max())):.1g}")
    else:
        start, bound = to_floats([fmpq(k + 1, 2 * (k + 2)) for k in range(n)]), 3.0
    return {
        "variables": list(file.variables),
        "rows": rows,
        "has_eps": map_.has_eps,
        "eps": to_float(DEFAULT_EPS if analysis.eps is None else analysis.eps),
        "eps_moves": analysis.eps is None,
        "start": [float(f"{value:.4g}") for value in start],
        "reach": bound,
        "functions": plotted_functions,
    }


def _terms(polynomial: fmpq_mpoly, names: tuple[str, ...], values: Mapping[str, fmpq]) -> list[list[Any]]:
    """Return the terms of a polynomial as lists [coefficient, *exponents of `names`]; other names have `values`."""
    own_names = names_of(polynomial)
    terms = []
    for powers, coefficient in polynomial.terms():
        exponents = dict(zip(own_names, powers, strict=True))
        for name in set(own_names) - set(names):
            coefficient *= values[name] ** int(exponents[name])
        terms.append([to_float(coefficient), *(int(exponents.get(name, 0)) for name in names)])
    return terms
