"""Initial points of many orbits: on a grid, on a line, or random."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import numpy as np
from flint import fmpq

from kahanmaps.algebra.parsing import parse_number, parse_point
from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.floats.float_conversion import FloatArray, to_float

MAX_NUMBERS = 50_000_000  # maximal number of coordinates of all initial points together
_MAX_DIGITS = 9  # maximal number of digits of the number of points


def starts_in_box(count: int, dim: int, size: float, seed: int) -> FloatArray:
    """Return random initial points (count, dim), with coordinates uniform in [-size, size), determined by the seed.

    >>> starts_in_box(2, 1, 1.0, seed=0).tolist()
    [[0.2739233746429086], [-0.4604265724722594]]
    """
    starts: FloatArray = (2 * np.random.default_rng(seed).random((count, dim)) - 1) * size
    return starts


def starts_on(text: str, variables: Sequence[str]) -> FloatArray:
    """Return the initial points (n, dim) of a grid or of a line.

    A grid is a list of NAME=LOW:HIGH:N (N equidistant values, including both ends) and NAME=VALUE; all other variables
    are 0. The last variable with several values changes fastest. A line is A:B:N, for N points from A to B, both
    included. Coordinates are rounded from exact numbers. Raises InputError for any other text and for too many points.

    >>> starts_on("x=-1:1:3, z=1/2", ["x", "y", "z"]).tolist()
    [[-1.0, 0.0, 0.5], [0.0, 0.0, 0.5], [1.0, 0.0, 0.5]]
    >>> starts_on("0,0 : 1,1/2 : 3", ["x", "y"]).tolist()
    [[0.0, 0.0], [0.5, 0.25], [1.0, 0.5]]
    """
    dim = len(variables)
    if "=" not in text:
        pieces = text.split(":")
        if len(pieces) != 3:
            raise InputError(f"found {quoted(text)}, expected A:B:N, two points and a number of points: 0,0:1,1/2:50")
        ends = [parse_point(piece) for piece in pieces[:2]]
        if any(len(end) != dim for end in ends):
            raise InputError(
                f"found points with {len(ends[0])} and {len(ends[1])} coordinates, expected {dim}: "
                f"{', '.join(variables)}"
            )
        axes = [_equidistant_values(low, high, pieces[2], dim) for low, high in zip(*ends, strict=True)]
        return np.stack(axes, axis=1)
    values = {name: np.zeros(1) for name in variables}
    assigned_names = set[str]()
    for assignment in text.split(","):
        name, _, value = (piece.strip() for piece in assignment.partition("="))
        if name not in values or name in assigned_names:
            found_text = f"{name} twice" if name in assigned_names else quoted(assignment.strip())
            raise InputError(f"found {found_text}, expected NAME=LOW:HIGH:N or NAME=VALUE, with {', '.join(variables)}")
        assigned_names.add(name)
        pieces = value.split(":")
        if len(pieces) not in (1, 3):
            raise InputError(f"found {quoted(value)} for {name}, expected LOW:HIGH:N or a number: -1:1:20")
        if pieces[2:] and pieces[2].strip() == "1":
            raise InputError(f"found 1 point from LOW to HIGH for {name}, expected at least 2: type {name}={pieces[0]}")
        low, high = parse_number(pieces[0]), parse_number(pieces[-2] if len(pieces) == 3 else pieces[0])
        values[name] = np.array([to_float(low)]) if len(pieces) == 1 else _equidistant_values(low, high, pieces[2], dim)
        if (size := prod(map(len, values.values()))) * dim > MAX_NUMBERS:
            raise InputError(f"found a grid of {size} points, expected at most {MAX_NUMBERS // dim} in dimension {dim}")
    return np.stack(np.meshgrid(*values.values(), indexing="ij"), axis=-1).reshape(-1, dim)


def _equidistant_values(low: fmpq, high: fmpq, count: str, dim: int) -> FloatArray:
    """Return `count` equidistant numbers from low to high, including both, each rounded to the nearest double."""
    digits = count.strip()
    point_count = int(digits) if digits.isascii() and digits.isdigit() and len(digits) <= _MAX_DIGITS else 0
    if not 2 <= point_count <= MAX_NUMBERS // dim:
        raise InputError(f"found {quoted(digits)} points, expected 2 to {MAX_NUMBERS // dim} in dimension {dim}")
    to_float(low), to_float(high)  # raise the error for numbers that are too large for doubles
    denominator = int(low.q) * int(high.q)
    low_numerator, high_numerator = int(low.p) * int(high.q), int(high.p) * int(low.q)
    interval_count = point_count - 1  # a quotient of Python integers is rounded correctly
    return np.array(
        [
            (low_numerator * (interval_count - k) + high_numerator * k) / (denominator * interval_count)
            for k in range(point_count)
        ]
    )
