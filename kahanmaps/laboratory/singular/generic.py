"""Contracted hypersurfaces for every eps: polynomials over Q[eps] whose values at one eps are those that were followed.

The Jacobian determinant of the homogeneous map is factored over Q in the point and eps together. By Hilbert's
irreducibility theorem its factors stay irreducible at all but few eps, so that those at one eps are their values there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from math import comb
from typing import Any

from flint import fmpq

from kahanmaps.algebra.minors import kernel_minors
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.written.text import format_polynomial
from kahanmaps.errors import InputError
from kahanmaps.laboratory.singular.outcomes import Hypersurface
from kahanmaps.laboratory.singular.written import factors_at_finite_points, name_of
from kahanmaps.maps.composed import ComposedMap
from kahanmaps.maps.implicit import BirationalMap

_MOST_TERMS = 6_000  # of the determinant at one eps


def with_eps(map_: BirationalMap, eps: fmpq, hypersurfaces: Sequence[Hypersurface]) -> tuple[Hypersurface, ...]:
    """The hypersurfaces that a map contracts at one eps, each with its polynomial over Q[eps] where that is found.

    Exact: at this eps the polynomial is that of the hypersurface, up to a factor. None is found for compositions that
    are multiplied out, where forms are large, and at an eps where a polynomial is reducible.
    """
    names: dict[int | None, dict[str, str]] = {}
    found = []
    for one in hypersurfaces:
        if one.stage not in names:
            names[one.stage] = _named(map_, eps, one.stage)
        found.append(replace(one, generic=names[one.stage].get(one.polynomial, "")))
    return tuple(found)


def _named(map_: BirationalMap, eps: fmpq, stage: int | None) -> dict[str, str]:
    """The polynomials over Q[eps] of what a map, or that of this number in a word, contracts, by those at one eps."""
    variables = map_.variables
    rows = _rows(map_, stage)
    if rows is None or "eps" in variables or "Z" in variables:
        return {}
    n, context, at_eps = len(variables), ring((*variables, "Z", "eps")), ring((*variables, "Z"))
    degree = max(sum(m[:n]) for row in rows for entry in row for m in entry.monoms())

    def homogeneous(entry: Any) -> Any:
        return context.from_dict({(*m[:n], degree - sum(m[:n]), m[-1]): c for m, c in entry.terms()})

    forms = kernel_minors([[homogeneous(entry) for entry in row] for row in rows])
    common = reduce(lambda P, Q: P.gcd(Q), forms)
    forms = [form / common for form in forms]
    size = max(sum(m[:-1]) for form in forms for m in form.monoms()) - 1
    if size < 1:
        return {}
    if comb((n + 1) * size + n, n) <= _MOST_TERMS:
        zero = context.constant(0)
        critical = kernel_minors([[*(form.derivative(j) for j in range(n + 1)), zero] for form in forms])[-1]
        factors = critical.factor()[1]
    else:
        factors = factors_at_finite_points(forms) or []
    affine, found = ring((*variables, "eps")), {}
    for factor, _ in factors:
        if all(sum(m[:n]) == 0 for m in factor.monoms()):  # infinity, and powers of eps
            continue
        value = factor.compose(*at_eps.gens(), at_eps.constant(eps), ctx=at_eps)
        parts = value.factor()[1]
        if len(parts) == 1 and parts[0][1] == 1:
            text = format_polynomial(affine.from_dict({(*m[:n], m[-1]): c for m, c in factor.terms()}))
            found[name_of(parts[0][0], map_)] = text
    return found


def _rows(map_: BirationalMap, stage: int | None) -> Sequence[Sequence[Any]] | None:
    """The rows of the equation of a map, or of that of this number in a word; None where they are not at hand."""
    if isinstance(map_, ComposedMap):
        if stage is None or any(isinstance(part.map, ComposedMap) or part.values for part in map_.parts):
            return None
        part = map_.parts[stage]
        try:
            rows = part.map.inverse_rows if part.is_inverse else part.map.rows
        except InputError:
            return None
    else:
        rows = map_.rows
    return None if map_.symbols else rows
