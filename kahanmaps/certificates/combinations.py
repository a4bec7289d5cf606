"""Claims that follow from the equation of a map by linear combinations, without solving for x~.

Let e(x, y) = M(x) y - r(x), which is 0 if y is the image of x. A claim G = 0 is proved by polynomials c with G = c . e,
an identity for arbitrary points. Let x, y, z be three consecutive points of an orbit, with 1 as an additional
coordinate, T the symmetric trilinear form with H(x) = T(x, x, x), and g(a, b) = T(a, b, .). For f = J grad H with J
constant and skew,

    T(y, y, z) - T(x, x, y) = g(x, y) . (e(x, y) + e(y, z)) + g(y, z) . e(x, y),

so that T(x, x, x~) = H + grad H . (x~ - x)/3 is an integral. For a skew matrix B with B f' symmetric,

    y^T B z - x^T B y = x^T B e(y, z) - z^T B e(x, y),

so that x^T B x~ is an integral, as for members of the commuting family. An affine T(x) = S x + b with f(T x) = S f(x)
is a symmetry, since e(T x, T y) = S e(x, y). If f(T x) = -S f(x), it is a reversing symmetry: e(T y, T x) = -S e(x, y).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import lcm

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, ring
from kahanmaps.certificates.identities import EquationClaim, FalseClaim, MapData, coprime

Row = tuple[fmpq_mpoly, ...]


@dataclass(frozen=True)
class OrbitIntegral(EquationClaim):
    """I(x, x~) = P/Q with P(y, z) - P(x, y) = `first` . e(x, y) + `second` . e(y, z), where e(x, y) = M(x) y - r(x).

    P, Q, `first` and `second` are polynomials over Z in the names `three_points`; Q does not contain the variables.
    """

    numerator: fmpq_mpoly
    denominator: fmpq_mpoly
    first: Row
    second: Row


@dataclass(frozen=True)
class AffineSymmetry(EquationClaim):
    """The affine map T(x) = `image`/`divisor` takes the map `data` to the map `target`; they are equal for a symmetry.

    For e(x, y) = M(x) y - r(x) of `data` and e' of `target`, k e'(T x, T y) = R e(x, y), or k e'(T y, T x) = R e(x, y)
    if `reversing`: then T takes `data` to the inverse of `target`. k is `multiple`, R is `matrix`.
    """

    target: MapData
    image: Row
    divisor: int
    matrix: tuple[tuple[int, ...], ...]
    multiple: int
    reversing: bool
    about: str = ""  # what the target is, for the comment at the beginning

    @property
    def inverse(self) -> list[tuple[fmpq_mpoly, int]]:
        """The inverse of T: for each coordinate a polynomial over Z and its divisor."""
        n, zero, letters = self.data.dim, (0,) * len(self.data.names), ring(self.data.names).gens()
        S = fmpq_mat([[P.derivative(j)[zero] for j in range(n)] for P in self.image]).inv()
        translated_point = [self.divisor * x - P[zero] for x, P in zip(letters, self.image, strict=False)]
        images = [sum((S[i, j] * translated_point[j] for j in range(n)), letters[0] * 0) for i in range(n)]
        return [(P * common_denominator(P), int(common_denominator(P))) for P in images]


@dataclass(frozen=True)
class ChangedFunction(EquationClaim):
    """P(T z)/Q(T z) = p(z)/q(z), T z = `image`/`divisor`: `old_function` is (P, Q) over Z, `new_function` (p, q)."""

    image: Row
    divisor: int
    old_function: tuple[fmpq_mpoly, fmpq_mpoly]
    new_function: tuple[fmpq_mpoly, fmpq_mpoly]


def three_points(data: MapData) -> tuple[str, ...]:
    """Return the names for x, its image y, the image z of y, and the constants."""
    return (*data.variables, *data.new, *(f"{name}2" for name in data.new), *data.names[data.dim :])


def row_multiples(data: MapData) -> list[fmpq]:
    """Return the factors by which the rows of I - eps f' of a Kahan map were multiplied, read from M at x = eps = 0."""
    return [row[i][(0,) * len(data.names)] for i, row in enumerate(data.rows)]


def modified_hamiltonian(data: MapData, name: str, H: fmpq_mpoly) -> OrbitIntegral:
    """Return the identity for H(x) + grad H(x) . (x~ - x)/3, where H has degree at most 3 in the variables.

    Raises:
        FalseClaim: if the map is not the Kahan map of J grad H with a constant skew J.
    """
    n, names = data.dim, three_points(data)
    context = ring(names)
    gens = context.gens()
    constants = gens[3 * n : -1]

    def gradient(a: int, b: int) -> list[fmpq_mpoly]:
        """Return the vector g(a, b) by polarizing grad H/3; a and b are indices of the first names of two points."""
        points = (
            [(gens[a + i] + gens[b + i]) / 2 for i in range(n)],
            gens[a : a + n],
            gens[b : b + n],
        )
        result = []
        for k in range(n):
            derivative = H.derivative(k)
            at_midpoint, *at_ends = (derivative.compose(*point, *constants, ctx=context) for point in points)
            result.append((2 * at_midpoint - (at_ends[0] + at_ends[1]) / 2) / 3)
        return result

    def value(a: int, b: int) -> fmpq_mpoly:
        x = gens[a : a + n]
        total = H.compose(*x, *constants, ctx=context)
        for k in range(n):
            total += H.derivative(k).compose(*x, *constants, ctx=context) * (gens[b + k] - gens[a + k]) / 3
        return total

    g, h = gradient(0, n), gradient(n, 2 * n)
    multipliers = [a + b for a, b in zip(g, h, strict=True)]
    return _orbit_integral(data, name, value(0, n), value(n, 2 * n), context.constant(1), multipliers, g)


def bilinear_integral(data: MapData, name: str, B: fmpq_mat) -> OrbitIntegral:
    """Return the identity for x^T B x~/eps. Raises FalseClaim if it does not hold."""
    n, context = data.dim, ring(three_points(data))
    gens = context.gens()

    def BT_times(a: int) -> list[fmpq_mpoly]:
        """Return B^T x for the point x whose first name has the index a."""
        return [sum((gens[a + i] * B[i, j] for i in range(n)), gens[0] * 0) for j in range(n)]

    def value(a: int, b: int) -> fmpq_mpoly:
        return sum((entry * gens[b + j] for j, entry in enumerate(BT_times(a))), gens[0] * 0)

    return _orbit_integral(
        data, name, value(0, n), value(n, 2 * n), gens[-1], [-c for c in BT_times(2 * n)], BT_times(0)
    )


def affine_symmetry(
    data: MapData,
    name: str,
    S: fmpq_mat,
    shift: Sequence[fmpq],
    reversing: bool = False,
    target: MapData | None = None,
    about: str = "",
) -> AffineSymmetry:
    """Return the identity: T(x) = S x + shift takes the map to `target` (None: itself), or its inverse if `reversing`.

    Raises:
        FalseClaim: if the identity does not hold, or T is not invertible.
    """
    target = target or data
    if S.det() == 0:
        raise FalseClaim(f"{name} is not invertible: no certificate can be written")
    n, names = data.dim, data.two_points
    context = ring(names)
    gens = context.gens()
    divisor = lcm(*(int(entry.q) for entry in (*S.entries(), *shift)))
    images = [[_affine(S, shift, gens[k : k + n], i) for i in range(n)] for k in (0, n)]
    left, right = reversed(images) if reversing else images
    target_residual = [P.compose(*left, *right, *gens[2 * n :], ctx=context) for P in target.residual(names, 0, n)]
    target_scales, own_scales = row_multiples(target), row_multiples(data)
    K = [[(-1 if reversing else 1) * S[i, j] * target_scales[i] / own_scales[j] for j in range(n)] for i in range(n)]
    multiple = lcm(*(int(entry.q) for row in K for entry in row))
    matrix = tuple(tuple(int(entry * multiple) for entry in row) for row in K)
    own_residual = data.residual(names, 0, n)
    for row, value in zip(matrix, target_residual, strict=True):
        if value * multiple != sum((c * P for c, P in zip(row, own_residual, strict=True)), context.constant(0)):
            reason = f"is no {'reversing ' * reversing}symmetry" if target is data else "takes the map to another one"
            raise FalseClaim(f"{name} {reason}: no certificate can be written")
    image = tuple(
        ring(data.names).constant(0) + divisor * _affine(S, shift, ring(data.names).gens(), i) for i in range(n)
    )
    return AffineSymmetry(name, data, target, image, divisor, matrix, multiple, reversing, about)


def changed_function(
    claim: AffineSymmetry,
    name: str,
    function: RationalFunction,
    new_function: RationalFunction,
    letters: tuple[str, ...],
) -> ChangedFunction:
    """Return the identity that a function of x = T z is `new_function`, a function of z that contains only `letters`.

    Raises:
        FalseClaim: if the two functions are not equal.
    """
    data, context = claim.data, ring(claim.data.names)
    gens = dict(zip(data.names, context.gens(), strict=True))
    p, q = (P.compose(*(gens[letter] for letter in letters), ctx=context) for P in coprime(new_function, letters))
    P, Q = coprime(function, data.names)
    images = [entry / claim.divisor for entry in claim.image] + [*context.gens()[data.dim :]]
    if P.compose(*images, ctx=context) * q != p * Q.compose(*images, ctx=context):
        raise FalseClaim(f"{name} is another function in these coordinates: no certificate can be written")
    return ChangedFunction(name, data, claim.image, claim.divisor, (P, Q), (p, q))


def _affine(S: fmpq_mat, shift: Sequence[fmpq], letters: Sequence[fmpq_mpoly], i: int) -> fmpq_mpoly:
    """Return component i of S x + shift."""
    return sum((S[i, j] * letters[j] for j in range(len(shift))), letters[0] * 0 + shift[i])


def _orbit_integral(
    data: MapData,
    name: str,
    value: fmpq_mpoly,
    next_value: fmpq_mpoly,
    denominator: fmpq_mpoly,
    first: Sequence[fmpq_mpoly],
    second: Sequence[fmpq_mpoly],
) -> OrbitIntegral:
    """Return the claim with integer coefficients, after verifying its identity by expansion."""
    n, names = data.dim, three_points(data)
    row_factors = [fmpq(1) / c for c in row_multiples(data)]
    multipliers = [[c * s for c, s in zip(factors, row_factors, strict=True)] for factors in (first, second)]
    total = ring(names).constant(0)
    for factors, k in zip(multipliers, (0, n), strict=True):
        for c, e in zip(factors, data.residual(names, k, k + n), strict=True):
            total += c * e
    if total != next_value - value:
        raise FalseClaim(f"{name} is not conserved: no certificate can be written")
    multiple = lcm(*(int(common_denominator(c)) for c in (value, *multipliers[0], *multipliers[1])))
    a, b = (tuple(c * multiple for c in factors) for factors in multipliers)
    return OrbitIntegral(name, data, value * multiple, denominator * multiple, a, b)
