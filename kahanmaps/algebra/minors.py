"""The kernel of an n x (n + 1) matrix by its maximal minors, over any commutative ring, without division."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

Product = Callable[[Any, Any], Any]
PairsCheck = Callable[[list[tuple[Any, Any]]], None]


def kernel_minors(
    rows: Sequence[Sequence[Any]], times: Product = operator.mul, check_pairs: PairsCheck | None = None
) -> list[Any]:
    """Return the vector of signed maximal minors of an n x (n + 1) matrix: it lies in the kernel of the matrix.

    `rows` are n >= 1 rows of n + 1 elements of any commutative ring (numbers, polynomials, arrays); the result is exact
    if the operations of the ring are. `times` multiplies two elements. The minors of the first k rows are computed for
    k = 1, 2, ..., with 2^(n+1) n/2 products in all. An entry None stands for 0; products with it are skipped.
    `check_pairs` is called with all pairs to be multiplied for the next row, and may raise an exception. The k-th minor
    omits column k and has the sign (-1)^k; it is None if all its products contain a None.

    >>> kernel_minors([[1, 2, 3], [4, 5, 6]])
    [-3, 6, -3]
    >>> kernel_minors([[1, 2, None], [4, 5, None]])
    [None, None, -3]
    """
    # Expansion along rows, not elimination: it needs no division and no decision whether an entry is zero.
    width = len(rows) + 1
    minors: dict[int, Any] = {1 << j: entry for j, entry in enumerate(rows[0])}
    for row, layer in zip(rows[1:], _layers(width), strict=True):
        if check_pairs is not None:
            pairs = ((row[j], minors[smaller_mask]) for _, products in layer for j, smaller_mask, _ in products)
            check_pairs([(entry, minor) for entry, minor in pairs if entry is not None and minor is not None])
        larger_minors: dict[int, Any] = {}
        for mask, products in layer:
            total: Any = None
            for j, smaller_mask, is_negative in products:
                entry, minor = row[j], minors[smaller_mask]
                if entry is None or minor is None:
                    continue
                term = times(entry, minor)
                if is_negative:
                    total = -term if total is None else total - term
                else:
                    total = term if total is None else total + term
            larger_minors[mask] = total
        minors = larger_minors
    all_columns = (1 << width) - 1
    maximal_minors = (minors[all_columns ^ 1 << j] for j in range(width))
    return [-minor if j % 2 and minor is not None else minor for j, minor in enumerate(maximal_minors)]


@cache
def _layers(width: int) -> list[list[tuple[int, list[tuple[int, int, bool]]]]]:
    """Return, for k = 2, 3, ..., all sets of k columns as bit masks, each with the expansion of its minor.

    The expansion is along the last row. Each of its products is (column, mask without column, whether the sign is -1).
    """
    layers = []
    for k in range(2, width):
        layer = []
        for mask in range(1 << width):
            if mask.bit_count() == k:
                columns = [j for j in range(width) if mask >> j & 1]
                layer.append(
                    (mask, [(j, mask ^ 1 << j, bool((k - 1 + position) % 2)) for position, j in enumerate(columns)])
                )
        layers.append(layer)
    return layers
