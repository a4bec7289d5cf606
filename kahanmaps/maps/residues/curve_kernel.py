"""Images of lines under many maps, over GF(p^2): polynomials, their products and gcds in doubles that are integers.

An element a + b w of GF(p^2), with w^2 = nu not a square modulo p, is a pair of doubles that are integers in [0, p); a
polynomial is an array (2, length). By the choice of p and of the largest length, sums of products stay below 2^53, so
that they are exact. Sums are reduced modulo p by a product with 1/p: floor((x + 1/2)/p) is right if x/p < 2^36, since
(x + 1/2)/p differs from every integer by at least 1/(2 p).

The functions are ordinary Python until `kernel` replaces them by functions compiled by numba.
"""

from __future__ import annotations

from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np

_LOCK = Lock()


@lru_cache(maxsize=1)
def _compiled() -> Any:
    import numba

    from kahanmaps.maps.numba_cache import compiled

    module, jit = globals(), numba.njit(nogil=True)
    names = "reduce add_product clear copy trimmed_length subtract inverse_of_last gcd divide entries minors "
    for name in f"{names} divide_by_common_factor".split():
        module[f"_{name}"] = jit(module[f"_{name}"])
    return compiled(walk, nogil=True)


def kernel() -> Any:
    """Return the compiled `walk`. Raises ImportError without numba."""
    with _LOCK:
        return _compiled()


def _reduce(x: Any, length: int, p: float) -> None:
    """Reduce the entries modulo p, in place."""
    r = 1.0 / p
    for part in range(2):
        row = x[part]
        for i in range(length):
            row[i] -= p * np.floor((row[i] + 0.5) * r)


def _add_product(result: Any, a: Any, length_a: int, b: Any, length_b: int, sign: float, nu: float) -> None:
    """Add `sign` * a * b to `result`, without reduction modulo p; a and b are polynomials of the given lengths."""
    x, y, b0, b1 = result[0], result[1], b[0], b[1]
    for i in range(length_a):
        c0, c1 = sign * a[0, i], sign * a[1, i]
        if c0 != 0 or c1 != 0:
            d = nu * c1
            for j in range(length_b):
                x[i + j] += c0 * b0[j] + d * b1[j]
                y[i + j] += c0 * b1[j] + c1 * b0[j]


def _clear(a: Any, length: int) -> None:
    """Set the first `length` coefficients to zero."""
    for i in range(length):
        a[0, i] = a[1, i] = 0.0


def _copy(a: Any, b: Any, length: int) -> None:
    """Copy the first `length` coefficients of a to b."""
    for i in range(length):
        b[0, i], b[1, i] = a[0, i], a[1, i]


def _trimmed_length(a: Any, length: int) -> int:
    """Return the length of a polynomial without the zeros at its end."""
    while length > 0 and a[0, length - 1] == 0 and a[1, length - 1] == 0:
        length -= 1
    return length


def _subtract(a: Any, length_a: int, b: Any, length_b: int, inverse: Any, p: float, nu: float) -> Any:
    """Subtract c x^k b from a to remove the leading term of a; return c. `inverse` is 1/b[-1]."""
    u, v = a[0, length_a - 1], a[1, length_a - 1]
    c0 = (u * inverse[0] + nu * v * inverse[1]) % p
    c1 = (u * inverse[1] + v * inverse[0]) % p
    shift, d, r = length_a - length_b, nu * c1, 1.0 / p
    b0, b1, x, y = b[0], b[1], a[0], a[1]
    # s mod p without a division: s is an integer, so (s + 1/2)/p differs from every integer by at least 1/(2p), more
    # than the rounding error. Without the 1/2, the quotient of a multiple of p could be rounded to a smaller integer.
    for j in range(length_b - 1):
        s = x[shift + j] - c0 * b0[j] - d * b1[j]
        t = y[shift + j] - c0 * b1[j] - c1 * b0[j]
        x[shift + j] = s - p * np.floor((s + 0.5) * r)
        y[shift + j] = t - p * np.floor((t + 0.5) * r)
    a[0, length_a - 1] = a[1, length_a - 1] = 0.0
    return c0, c1


def _inverse_of_last(b: Any, length: int, p: float, nu: float, inverses: Any) -> Any:
    """Return 1/c for the last coefficient c of b; inverses[k] is 1/k modulo p."""
    u, v = b[0, length - 1], b[1, length - 1]
    norm = inverses[int((u * u - nu * v * v) % p)]
    return (u * norm) % p, ((p - v) * norm) % p


def _gcd(a: Any, length_a: int, b: Any, length_b: int, p: float, nu: float, inverses: Any) -> Any:
    """Return a gcd of a and b, and its length; both arrays are overwritten."""
    while length_b > 1:
        inverse = _inverse_of_last(b, length_b, p, nu, inverses)
        while length_a >= length_b:
            _subtract(a, length_a, b, length_b, inverse, p, nu)
            length_a = _trimmed_length(a, length_a - 1)
        a, b = b, a
        length_a, length_b = length_b, length_a
    return (a, length_a) if length_b == 0 else (b, length_b)


def _divide(a: Any, length_a: int, b: Any, length_b: int, p: float, nu: float, inverses: Any, quotient: Any) -> int:
    """Divide a by b: write the quotient to `quotient`, leave the remainder in a; return the remainder's length."""
    inverse = _inverse_of_last(b, length_b, p, nu, inverses)
    _clear(quotient, max(length_a, 1))
    while length_a >= length_b:
        shift = length_a - length_b
        quotient[0, shift], quotient[1, shift] = _subtract(a, length_a, b, length_b, inverse, p, nu)
        length_a = _trimmed_length(a, length_a - 1)
    return length_a


def _entries(X: Any, length: int, exponents: Any, terms: Any, values: Any, p: float, nu: float, M: Any) -> int:
    """Write (M | -r) at the curve X, a vector of polynomials of this length, to M; return the length of the entries.

    Each row of `terms` is (i, j, k, l): entry (i, j) has monomial k with the coefficient values[l].
    """
    power = exponents[0].sum()
    entry_length = power * (length - 1) + 1
    for i in range(M.shape[0]):
        for j in range(M.shape[1]):
            _clear(M[i, j], entry_length)
    product, next_product = np.empty((2, entry_length)), np.empty((2, entry_length))
    for k in range(len(exponents)):
        product[0, 0], product[1, 0], size = 1.0, 0.0, 1
        for variable in range(exponents.shape[1]):
            for _ in range(exponents[k, variable]):
                _clear(next_product, size + length - 1)
                _add_product(next_product, X[variable], length, product, size, 1.0, nu)
                size += length - 1
                _reduce(next_product, size, p)
                product, next_product = next_product, product
        for t in range(len(terms)):
            if terms[t, 2] == k:
                _add_product(M[terms[t, 0], terms[t, 1]], values[:, terms[t, 3] : terms[t, 3] + 1], 1, product, size,
                             1.0, nu)  # fmt: skip
    for i in range(M.shape[0]):
        for j in range(M.shape[1]):
            _reduce(M[i, j], entry_length, p)
    return int(entry_length)


def _minors(M: Any, length: int, minors: Any, p: float, nu: float) -> int:
    """Compute the minors of the first k rows and any k columns for all k <= n; return the length of those for k = n."""
    n = M.shape[0]
    for j in range(n + 1):
        _copy(M[0, j], minors[1 << j], length)
    minor_length = length
    for k in range(1, n):
        for mask in range(1 << (n + 1)):
            column_count = 0
            for j in range(n + 1):
                column_count += mask >> j & 1
            if column_count != k + 1:
                continue
            _clear(minors[mask], minor_length + length - 1)
            column = 0
            for j in range(n + 1):
                if mask >> j & 1:
                    sign = 1.0 if (k + column) % 2 == 0 else -1.0
                    entry_length = _trimmed_length(M[k, j], length)
                    _add_product(minors[mask], M[k, j], entry_length, minors[mask ^ 1 << j], minor_length, sign, nu)
                    column += 1
            _reduce(minors[mask], minor_length + length - 1, p)
        minor_length += length - 1
    return minor_length


def _divide_by_common_factor(
    X: Any, length: int, weights: Any, p: float, nu: float, inverses: Any, buffers: Any
) -> int:
    """Divide the polynomials of the curve by their gcd, in place; return their length, 0 if all are zero."""
    a, b, c, common_factor = buffers[0], buffers[1], buffers[2], buffers[3]
    count = X.shape[0]
    _clear(a, length)
    _clear(b, length)
    for j in range(count):
        _add_product(a, weights[0, :, j : j + 1], 1, X[j], length, 1.0, nu)
        _add_product(b, weights[1, :, j : j + 1], 1, X[j], length, 1.0, nu)
    _reduce(a, length, p)
    _reduce(b, length, p)
    divisor, size = _gcd(a, _trimmed_length(a, length), b, _trimmed_length(b, length), p, nu, inverses)
    _copy(divisor, common_factor, size)
    if size != 1:  # two linear combinations may have a common factor that not all polynomials have
        for j in range(count):
            _copy(X[j], c, length)
            c_length = _trimmed_length(c, length)
            if size:
                c_length = _divide(c, c_length, common_factor, size, p, nu, inverses, a)
            if c_length:
                divisor, size = _gcd(common_factor, size, c, c_length, p, nu, inverses)
                _copy(divisor, common_factor, size)
    max_length = 0
    for j in range(count):
        if size > 1:
            _copy(X[j], c, length)
            _divide(c, _trimmed_length(c, length), common_factor, size, p, nu, inverses, X[j])
        max_length = max(max_length, _trimmed_length(X[j], length))
    return max_length


def walk(
    start: Any, exponents: Any, terms: Any, values: Any, weights: Any, inverses: Any, p: float, nu: float,
    max_length: int, degrees: Any,
) -> None:  # fmt: skip
    """Write to degrees[m, s] the degree of the image of the line start[m] under s + 1 steps of map m.

    start[m, j] contains the two coefficients of coordinate j, values[m] the coefficients of the equation, in GF(p^2);
    `weights` (steps, 2, 2, n + 1) are the coefficients of two linear combinations of the coordinates for each step. The
    iteration ends before polynomials exceed `max_length`. A degree is -1 if the iterate is defined nowhere.
    """
    n = start.shape[1] - 1
    power = exponents[0].sum()
    X = np.zeros((n + 1, 2, max_length))
    M = np.zeros((n, n + 1, 2, max_length))
    minors = np.zeros((1 << (n + 1), 2, max_length))
    buffers = np.zeros((4, 2, max_length))
    all_columns = (1 << (n + 1)) - 1
    one = np.zeros((2, 1))
    one[0, 0] = 1.0
    for m in range(start.shape[0]):
        for j in range(n + 1):
            _copy(start[m, j], X[j], 2)
        length = 2
        for step in range(degrees.shape[1]):
            if n * power * (length - 1) + 1 > max_length:
                break
            size = _entries(X, length, exponents, terms, values[m], p, nu, M)
            minor_length = _minors(M, size, minors, p, nu)
            for j in range(n + 1):  # with the sign (-1)^j
                _clear(X[j], minor_length)
                _add_product(X[j], one, 1, minors[all_columns ^ 1 << j], minor_length, 1.0 - 2.0 * (j % 2), nu)
                _reduce(X[j], minor_length, p)
            length = _divide_by_common_factor(X, minor_length, weights[step], p, nu, inverses, buffers)
            degrees[m, step] = length - 1
            if length == 0:
                degrees[m, step:] = -1
                break
