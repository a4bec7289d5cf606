"""Values at points as users write them: exact numbers in a sequence, by variable or as text, or arrays of floats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq_mat, fmpq_mpoly, fmpz_mat

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.parsing import parse_point
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.errors import InexactNumber, InputError, counted

_MATRIX_TYPES = (fmpq_mat, fmpz_mat)  # a matrix with one column or one row is read as a point


def is_float_value(value: Any) -> bool:
    """Whether the value is a float of Python or numpy, or an array of floats."""
    return isinstance(value, float) or getattr(getattr(value, "dtype", None), "kind", "") == "f"


def is_float_array(value: Any) -> bool:
    """Whether the value is a numpy array of floats."""
    return is_float_value(value) and getattr(value, "ndim", 0) > 0


def as_point(value: Any, variables: Sequence[str]) -> Any:
    """Return the coordinates of a point in order: from a sequence, an array, {variable: value}, or text such as "1,2".

    The caller converts the coordinates. Raises InputError for unknown names, several points, and values of other kinds.

    >>> as_point("1/2, 3", ["x", "y"]), as_point({"y": 3, "x": "1/2"}, ["x", "y"])
    ((1/2, 3), ['1/2', 3])
    """
    if isinstance(value, str):
        return parse_point(value)
    if isinstance(value, Mapping):
        coordinates_by_name = {str(name): coordinate for name, coordinate in value.items()}
        if set(coordinates_by_name) != set(variables):
            raise InputError(f"found the coordinates {', '.join(coordinates_by_name)}, expected {', '.join(variables)}")
        return [coordinates_by_name[name] for name in variables]
    if isinstance(value, _MATRIX_TYPES):
        return value.entries()
    if not hasattr(value, "__len__") or isinstance(value, set | frozenset):  # the order of a set is arbitrary
        raise InputError(f"found the point {value!r}, expected a sequence of {len(variables) or 'its'} coordinates")
    if is_several(value):
        raise InputError(
            f"found {counted(len(value), 'point')}, expected one: type [f(x) for x in points]; "
            "km.ensemble(system, x0, eps, steps) computes many orbits"
        )
    return value


def is_several(value: Any) -> bool:
    """Whether the value is a sequence of points: an array with two axes, or a sequence of sequences."""
    if isinstance(value, str | Mapping | fmpq_mat | fmpz_mat) or not hasattr(value, "__len__"):
        return False
    return len(value) > 0 and all(
        "," in entry if isinstance(entry, str) else hasattr(entry, "__len__") and getattr(entry, "ndim", 1) > 0
        for entry in value
    )


def as_points(value: Any, variables: Sequence[str]) -> list[Any]:
    """Return one point or several points as a list; each is converted by `as_point`."""
    return [as_point(point, variables) for point in (value if is_several(value) else [value])]


def start_rows(starts: Any, variables: Sequence[str]) -> Any:
    """Return one initial point or several, in any form that `as_point` accepts, as the rows of an array of doubles.

    Text with a colon is a grid or a line, as in `starts_on`.

    >>> start_rows(["1/2", 0], ["x", "y"]), start_rows([{"y": 2.5, "x": 1}], ["x", "y"])
    (array([[0.5, 0. ]]), array([[1. , 2.5]]))
    >>> start_rows("x=0:1:2, y=3", ["x", "y"])
    array([[0., 3.],
           [1., 3.]])
    """
    import numpy as np

    from kahanmaps.maps.floats.float_conversion import to_floats

    if isinstance(starts, str) and ":" in starts:
        from kahanmaps.maps.floats.starts import starts_on

        return starts_on(starts, variables)

    if is_float_array(starts):
        return np.array(np.atleast_2d(starts), dtype=np.float64)
    points = as_points(starts, variables)
    if len({len(point) for point in points}) != 1:
        raise InputError("found initial points of different lengths, expected the same number of coordinates in each")
    return np.array([to_floats(point) for point in points])


def point_of(arguments: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """Return the point in the arguments of a call: f(x), f({"x": 1, "y": 2}), f("1,2"), f(1, 2) or f(x=1, y=2)."""
    if len(arguments) == 2 and hasattr(arguments[1], "__len__") and not isinstance(arguments[1], str):
        raise InputError("found two arguments, expected the point alone: nothing here depends on the time t")
    if named:
        if arguments:
            raise InputError(f"found a point and {', '.join(named)}=, expected f(x) or f({', '.join(named)}=...)")
        return named
    is_point = len(arguments) == 1 and (hasattr(arguments[0], "__len__") or isinstance(arguments[0], _MATRIX_TYPES))
    return arguments[0] if is_point else arguments


def coordinates(values: Any, field: Field, variables: Sequence[str], dim: int) -> tuple[Any, ...]:
    """Convert a value for `as_point` to a point over `field`. Raises InputError for a wrong length and for floats."""
    if not isinstance(values, tuple):
        values = as_point(values, variables)
    if len(values) != dim:
        variables_text = f": {', '.join(variables)}" if variables else ""
        raise InputError(f"found a point with {counted(len(values), 'coordinate')}, expected {dim}{variables_text}")
    try:
        return tuple(field.convert(value) for value in values)
    except InexactNumber as error:
        hint = "[Fraction(x) for x in point] is exact" if is_float_array(values) else "numpy.array([...]) gives floats"
        raise InexactNumber(f"{error}; {hint}") from None


def function_value(function: RationalFunction, arguments: Sequence[Any], named: Mapping[str, Any]) -> Any:
    """Return the value of a rational function at a point, as described in `RationalFunction.__call__`."""
    if arguments and is_several(arguments[0]):
        import numpy as np

        values = [function_value(function, (row, *arguments[1:]), named) for row in arguments[0]]
        return np.array(values, dtype=np.float64 if any(map(is_float_value, values)) else object)
    names, values_by_name, values = function.names, dict(named), list[Any]()
    for name in {"h", "time_step"} & {*named} - {*names}:  # both names mean 2 eps
        h = values_by_name.pop(name)
        values_by_name["eps"] = h / 2 if is_float_value(h) else QQ.convert(h) / 2
    for entry in arguments:
        if isinstance(entry, Mapping):
            values_by_name.update({str(name): value for name, value in entry.items()})
        else:
            values.extend(as_point(entry, ()) if hasattr(entry, "__len__") else [entry])
    free_names = [name for name in names if name not in values_by_name]
    unused_names = {*function.numerator.unused_gens()}.intersection(function.denominator.unused_gens())
    if len(values) == len(free_names) - 1 and free_names[-1] == "eps" and "eps" in unused_names:
        values.append(0)  # a value for eps, which does not occur in the function
    if len(values) != len(free_names) or not {*values_by_name} <= {*names}:
        hint = (
            ', for example I(x, eps="1/10")' if len(values) == len(free_names) - 1 and free_names[-1] == "eps" else ""
        )
        given_text = ", ".join([f"{len(values)} values", *(f"{name}=" for name in values_by_name)])
        raise InputError(f"found {given_text}, expected {len(names)}: {', '.join(names)}{hint}")
    values_by_name.update(zip(free_names, values, strict=True))
    values = [values_by_name[name] for name in names]
    if any(map(is_float_value, values)):
        from kahanmaps.maps.floats.float_conversion import FLOATS, double

        return function.value(FLOATS, [double(x) for x in values])
    return function.value(QQ, [QQ.convert(x) for x in values])


def values_at(polynomials: Sequence[fmpq_mpoly], variables: Sequence[str], point: Any) -> Any:
    """Return the values of polynomials at a point: a tuple of exact numbers, or an array for an array of floats."""
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
