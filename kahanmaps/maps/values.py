"""Values at points as users write them: exact numbers in a sequence or by variable, or arrays of floats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq_mpoly

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.errors import InexactNumber, InputError, counted


def is_float_value(value: Any) -> bool:
    """Whether the value is a float, or a number or an array of floats of numpy."""
    return isinstance(value, float) or getattr(getattr(value, "dtype", None), "kind", "") == "f"


def is_float_array(value: Any) -> bool:
    """Whether the value is an array of numpy with floats."""
    return is_float_value(value) and getattr(value, "ndim", 0) > 0


def point_of(arguments: Sequence[Any], variables: Sequence[str]) -> Any:
    """Return the point in the arguments of a call, f(x), f({"x": 1}) or f(1, 2), as a sequence in this order."""
    if len(arguments) == 2 and hasattr(arguments[1], "__len__") and not isinstance(arguments[1], str):
        raise InputError("found two arguments, expected the point alone: nothing here depends on the time t")
    point = arguments[0] if len(arguments) == 1 and hasattr(arguments[0], "__len__") else arguments
    return point_by_names(point, variables) if isinstance(point, Mapping) else point


def point_by_names(values: Mapping[Any, Any], variables: Sequence[str]) -> list[Any]:
    """Return the coordinates of a point that is given by variable. Raises InputError for other names."""
    named = {str(name): value for name, value in values.items()}
    if set(named) != set(variables):
        raise InputError(f"found the coordinates {', '.join(named)}, expected {', '.join(variables)}")
    return [named[name] for name in variables]


def coordinates(values: Any, field: Field, variables: Sequence[str], dim: int) -> tuple[Any, ...]:
    """Convert a sequence to a point over the field. Raises InputError for a wrong length or inexact numbers."""
    if isinstance(values, str):
        raise InputError(f"found the text {values[:60]!r}, expected a sequence: parse_point reads points from text")
    if not hasattr(values, "__len__"):
        raise InputError(f"found {values!r}, expected a sequence of {dim} exact numbers")
    if len(values) != dim:
        variables_text = f": {', '.join(variables)}" if variables else ""
        raise InputError(f"found a point with {counted(len(values), 'coordinate')}, expected {dim}{variables_text}")
    try:
        return tuple(field.convert(value) for value in values)
    except InexactNumber as error:
        hint = "[Fraction(x) for x in point] is exact" if is_float_array(values) else "numpy.array([...]) gives floats"
        raise InexactNumber(f"{error}; {hint}") from None


def function_value(function: RationalFunction, arguments: Sequence[Any]) -> Any:
    """Return the value of a rational function at a point, as `RationalFunction.__call__` does."""
    if arguments and getattr(arguments[0], "ndim", 1) == 2:
        import numpy as np

        return np.array([function_value(function, (row, *arguments[1:])) for row in arguments[0]], dtype=np.float64)
    names, values = function.names, list[Any]()
    for entry in arguments:
        values.extend(entry if hasattr(entry, "__len__") and not isinstance(entry, str) else [entry])
    unused = {*function.numerator.unused_gens()}.intersection(function.denominator.unused_gens())
    if len(values) == len(names) - 1 and names[-1] == "eps" and "eps" in unused:
        values.append(0)  # it does not matter
    if len(values) != len(names):
        raise InputError(f"found {len(values)} values, expected {len(names)}: {', '.join(names)}")
    if any(map(is_float_value, values)):
        from kahanmaps.maps.floats.float_conversion import FLOATS, double

        return function.value(FLOATS, [double(x) for x in values])
    return function.value(QQ, [QQ.convert(x) for x in values])


def values_at(polynomials: Sequence[fmpq_mpoly], variables: Sequence[str], arguments: Sequence[Any]) -> Any:
    """Return the values of polynomials at a point: a tuple of exact numbers, or an array for an array of floats."""
    point = point_of(arguments, variables)
    if not is_float_array(point):
        x = coordinates(point, QQ, variables, len(variables))
        return tuple(evaluate(polynomial, QQ, x) for polynomial in polynomials)
    import numpy as np

    from kahanmaps.maps.floats.float_conversion import FLOATS

    if point.shape[-1] != len(variables):
        raise InputError(f"found an array of shape {point.shape}, expected {len(variables)} as its last entry")
    columns = np.moveaxis(np.asarray(point, dtype=np.float64), -1, 0)
    values = [evaluate(polynomial, FLOATS, list(columns)) for polynomial in polynomials]
    return np.stack([np.broadcast_to(value, columns.shape[1:]) for value in values], axis=-1)
