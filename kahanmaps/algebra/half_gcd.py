"""Half of the Euclidean algorithm: the simple fraction near a number, in nearly linear time.

GMP has half gcds, but python-flint does not offer them. Most of the quotients depend on leading digits alone, so a
recursion finds them from short integers: first those that halve the work, then the others.
"""

from __future__ import annotations

from flint import fmpz

# (u, v, w, z) maps integers (a, b) to the later remainders (u a + v b, w a + z b); u z - v w is 1 or -1.
Matrix = tuple[fmpz, fmpz, fmpz, fmpz]

_SHORT_BITS = 800  # integers that are to become shorter by at most this number of bits are divided one by one
_GUARD_BITS = 8  # the last quotients from leading digits may be wrong, which costs time only
_SPARE_BITS = 16


def simple_denominator(number: fmpz, power: int) -> fmpz | None:
    """Return the denominator d < 2^(power/2 - 16) of the fraction near number/2^power; None if there is none.

    The distance is at most 2^(-power/2)/d; there is at most one such fraction in lowest terms. Near a random number
    there is one with probability about 2^-16.

    >>> simple_denominator((fmpz(22) << 100) // 7, 100), simple_denominator(fmpz(3) ** 63, 100)
    (7, None)
    """
    modulus, bound = fmpz(1) << power, fmpz(1) << (power // 2)
    number = number % modulus
    larger, smaller, (_, v, _, z) = _applied(_quotients(modulus, number, power // 2), modulus, number)
    while smaller >= bound:
        quotient = larger // smaller
        larger, smaller, v, z = smaller, larger - quotient * smaller, z, v - quotient * z
    return abs(z) if abs(z).bit_length() <= power // 2 - _SPARE_BITS else None


def _quotients(a: fmpz, b: fmpz, bits: int) -> Matrix:
    """Return the matrix of the divisions that make a > b >= 0 shorter by about `bits` bits (not by more)."""
    excess = max(a.bit_length() - 2 * bits - _GUARD_BITS, 0)
    a, b = a >> excess, b >> excess
    if bits <= _SHORT_BITS:
        return _divisions(a, b, bits)
    larger, smaller, first = _applied(_quotients(a, b, bits // 2), a, b)
    missing_bits = bits - (a.bit_length() - larger.bit_length())
    if smaller == 0 or not _GUARD_BITS < missing_bits < 3 * bits // 4:  # a long quotient stops the recursion
        return first
    u, v, w, z = first
    p, q, r, s = _quotients(larger, smaller, missing_bits)
    return p * u + q * w, p * v + q * z, r * u + s * w, r * v + s * z


def _divisions(a: fmpz, b: fmpz, bits: int) -> Matrix:
    """Return the matrix of single divisions. The lower digits of x and y hold the multiples of b that were added."""
    field = fmpz(1) << (bits + 2 * _GUARD_BITS)
    x, y, limit = a * field, b * field + 1, field << (a.bit_length() - bits)
    while y > limit:
        x, y = y, x % y
    v, z = ((number + field // 2) % field - field // 2 for number in (x, y))
    return ((x - v) // field - v * b) // a, v, ((y - z) // field - z * b) // a, z


def _applied(matrix: Matrix, a: fmpz, b: fmpz) -> tuple[fmpz, fmpz, Matrix]:
    """Return the image (c, d) of (a, b), and the matrix. If the last quotient was wrong, d < 0, and d changes sign."""
    u, v, w, z = matrix
    c, d = u * a + v * b, w * a + z * b
    return (c, d, matrix) if d >= 0 else (c, -d, (u, v, -w, -z))
