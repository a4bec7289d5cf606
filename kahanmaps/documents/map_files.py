"""System files for maps that are constructed in Python, so that functions for system files accept maps too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import names_of, ring
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.reader import KINDS
from kahanmaps.documents.toml_text import to_toml
from kahanmaps.errors import InputError
from kahanmaps.maps.algebraic import AlgebraicMap
from kahanmaps.maps.composed import ComposedMap, MapFactor, composed_map
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import ImplicitMap, Map, MapFamily
from kahanmaps.maps.inverse import Rows
from kahanmaps.maps.kahan import KahanFamily


def map_file(map_: Map | MapFamily, name: str = "map") -> SystemFile:
    """Return a system file for a map; a map at one eps becomes a map that does not depend on eps.

    Raises InputError for a map over a field other than Q, and for a map with symbols that are not an algebraic number.

    >>> from kahanmaps.maps.explicit import explicit_map
    >>> print(map_file(explicit_map(["x", "y"], ["y", "(y + 2)/x"])))
    map:
    x~ = y
    y~ = (y + 2)/x
    """
    map_ = without_eps(map_) if isinstance(map_, Map) else map_
    if isinstance(map_, AlgebraicMap):
        numbers = {map_.family.symbols[0]: str(map_.root)}
        document = {"name": name, **_document(map_.family), "parameters": numbers}
    elif map_.symbols:
        raise InputError(f"found a map with the symbols {', '.join(map_.symbols)}, expected numbers in their place")
    else:
        document = {"name": name, **_document(map_)}
    file = parse_system(to_toml(document, ("name", "variables"), ("parameters", *KINDS)), name)
    return replace(file, map=map_) if map_.time_steps else file  # formulas do not contain the flow of the map


def without_eps(map_: Map) -> MapFamily:
    """Convert a map over Q to a map that does not depend on eps; the map has one eps, or one for each factor."""
    if map_.field is not QQ:
        raise InputError(f"found {map_!r}, expected a map over the rational numbers")
    variables = tuple(map_.variables or (f"x{k + 1}" for k in range(map_.dim)))
    factors = []
    for factor in map_.factors:
        is_linear = factor.equation.degree == 1
        backward = None if is_linear else _equation_rows(factor.inverse.equation, variables)
        rows = _equation_rows(factor.equation, variables)
        factors.append(ImplicitMap(variables, rows, "map at one eps", backward=backward))
    return factors[0] if len(factors) == 1 else ComposedMap(variables, [MapFactor(f, False) for f in factors], ())


def _equation_rows(equation: Equation, variables: Sequence[str]) -> Rows:
    context = ring((*variables, "eps"))
    monomials = [(*map(int, exponent[:-1]), 0) for exponent in equation.exponents]
    return tuple(tuple(context.from_dict({monomials[k]: c for k, c in form}) for form in row) for row in equation.terms)


def _document(map_: MapFamily) -> dict[str, Any]:
    """Return the document of a map, with its variables and one section."""
    variables, n = list(map_.variables), map_.dim
    if isinstance(map_, KahanFamily):
        return {"variables": variables, "system": {"rhs": [format_polynomial(f) for f in map_.system.rhs]}}
    if isinstance(map_, ComposedMap):
        factors = [{"map": _document(factor.map), "inverse": factor.is_inverse} for factor in map_.parts]
        return {"variables": variables, "composition": {"of": factors}}
    if map_.image is None and all(sum(m[:n]) <= 1 for row in map_.rows for entry in row for m in entry.monoms()):
        equations: Sequence[fmpq_mpoly] = map_.equations  # type: ignore[attr-defined]  # an ImplicitMap
        section = {
            "new": names_of(equations[0])[n : 2 * n],
            "equations": [f"{format_polynomial(f)} = 0" for f in equations],
        }
        return {"variables": variables, "bilinear": section}
    section = {"image": [format_rational_function(f) for f in map_.image or composed_map(map_).image or ()]}
    backward = getattr(map_, "backward", None)
    if backward is not None and (inverse := ImplicitMap(map_.variables, backward, "inverse").image) is not None:
        section["inverse"] = [format_rational_function(f) for f in inverse]
    return {"variables": variables, "map": section}
