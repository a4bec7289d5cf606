"""Maps that are given by rational functions: x~_i = P_i(x, eps)/Q_i(x, eps).

As an equation M is the diagonal of the denominators Q_i and r the column of the numerators P_i.
"""

from __future__ import annotations

from collections.abc import Sequence

from flint import fmpq_mpoly

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.errors import InputError, counted
from kahanmaps.maps.implicit import ImplicitMap

TITLE = "explicit map"


def explicit_map(
    variables: Sequence[str],
    image: Sequence[RationalFunction | str],
    inverse: Sequence[RationalFunction | str] | None = None,
) -> ImplicitMap:
    """The map x -> (P_1/Q_1, ..., P_n/Q_n).

    Args:
        variables: the names of the n coordinates.
        image: n rational functions of the variables, then symbols, if there are any, and eps; or texts.
        inverse: the same for the inverse map, where it is known. That it is the inverse is not tested here.

    Returns:
        The map, exact. Without `inverse` the inverse is computed by elimination on demand, if the map is birational.

    Raises:
        InputError: for another number of functions than of variables, or other names in them.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> lyness = [parse_rational_function(text, ["x", "y", "eps"]) for text in ("y", "(y + 2)/x")]
    >>> explicit_map(["x", "y"], lyness).at(1).step([1, 3])
    (3, 5)
    """
    names = tuple(variables)
    for functions in (image, inverse or image):
        if len(functions) != len(names):
            raise InputError(
                f"found {counted(len(functions), 'function')} for {counted(len(names), 'variable')}, expected as many"
            )
    return ImplicitMap(names, _rows(names, image), TITLE, backward=None if inverse is None else _rows(names, inverse))


def _rows(names: tuple[str, ...], given: Sequence[RationalFunction | str]) -> tuple[tuple[fmpq_mpoly, ...], ...]:
    n = len(given)
    functions = [parse_rational_function(f, (*names, "eps")) if isinstance(f, str) else f for f in given]
    return tuple(
        (*(f.denominator if i == j else f.denominator * 0 for j in range(n)), -f.numerator)
        for i, f in enumerate(functions)
    )
