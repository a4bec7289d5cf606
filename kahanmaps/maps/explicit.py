"""Maps given by rational functions: x~_i = P_i(x, eps)/Q_i(x, eps).

In the equation M x~ = r, M is the diagonal matrix of the denominators Q_i, and r the column of the numerators P_i.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.values import as_point

TITLE = "explicit map"


def explicit_map(
    variables: Sequence[str] | Mapping[Any, Any],
    image: Sequence[Any] | None = None,
    inverse: Sequence[Any] | Mapping[Any, Any] | None = None,
) -> ImplicitMap:
    """Return the map x -> (P_1/Q_1, ..., P_n/Q_n) for n rational functions P_i/Q_i.

    Args:
        variables: the names of the n coordinates; or a dict {variable: function}, which replaces `image`.
        image: n rational functions of the variables, then symbols (if any), then eps; or texts, or SymPy expressions.
        inverse: the functions of the inverse map, if known; they are not verified here.

    Returns:
        The map, exact. Without `inverse`, the inverse is computed by elimination when it is first needed.

    Raises:
        InputError: if the number of functions is not n, or if a function contains other names.

    >>> explicit_map(["x", "y"], ["y", "(y + 2)/x"])([1, 3]), explicit_map({"x": "y", "y": "(y + 2)/x"})([1, 3])
    ((3, 5), (3, 5))
    """
    if isinstance(variables, Mapping):
        if image is not None:
            raise InputError("found {variable: function} and image=, expected one of them")
        image, variables = list(variables.values()), list(variables)
    names = tuple(map(str, variables))
    inverse = as_point(inverse, names) if isinstance(inverse, Mapping) else inverse
    if image is None:
        raise InputError('found no functions, expected image=: explicit_map(["x", "y"], ["y", "(y + 1)/x"])')
    if not names:
        raise InputError("found no variables, expected at least one")
    for functions in (image, inverse or image):
        if len(functions) != len(names):
            raise InputError(
                f"found {counted(len(functions), 'function')} for {counted(len(names), 'variable')}, expected as many"
            )
    return ImplicitMap(names, _rows(names, image), TITLE, backward=None if inverse is None else _rows(names, inverse))


def _rows(names: tuple[str, ...], formulas: Sequence[Any]) -> tuple[tuple[fmpq_mpoly, ...], ...]:
    n, text_of = len(formulas), import_module("kahanmaps.documents.expressions").formula_text  # from a higher layer
    functions = [
        f if isinstance(f, RationalFunction) else parse_rational_function(text_of(f), (*names, "eps")) for f in formulas
    ]
    return tuple(
        (*(f.denominator if i == j else f.denominator * 0 for j in range(n)), -f.numerator)
        for i, f in enumerate(functions)
    )
