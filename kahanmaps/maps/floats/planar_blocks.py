"""The normal form in floating point: one planar map for each root of chi, in a canonical form.

At a root r of chi the Kahan map of a member is a map of the plane (u, v), given by a binary cubic h_r (see
kahanmaps/family/planar.py). Let (U, V) = 2 eps (u, v) and h = a U^3/3 + b U^2 V + c U V^2 + d V^3/3. Half the second
derivatives of h are A = a U + b V, B = b U + c V and C = c U + d V. Cramer's rule for two equations gives the map:

    U~ = ((1 + B) U + C V)/w,     V~ = ((1 - B) V - A U)/w,     w = (1 + B)(1 - B) + A C = 1 + eps^2 D.

A linear change of coordinates (U, V) -> F (U, V), which multiplies h by det F, makes h one of

    lines    U V (U + V)         (a, b, c, d) = (0, 1, 1, 0)    three linear factors over R, or over C at a complex r
    cubes    (U^3 + V^3)/3                      (1, 0, 0, 1)    one real linear factor
    general                      arbitrary                      a repeated factor, h = 0, or U and V nearly dependent

so that most maps have no coefficients except 0 and 1, and take five or six multiplications and a division. If several
pairs (U, V) are possible, U and V as forms in x are as close to orthogonal as possible. The integral of the block,
h_r/(1 + eps^2 D), is kappa (A U^2 + 2 B U V + C V^2)/w, with a constant kappa for each block.

A real root gives a real block (two rows: U, V), a pair of complex roots a complex block (four rows: Re U, Im U, Re V,
Im V). Roots, coefficients and the linear maps between x and the rows are computed in balls and rounded once, so each of
these numbers is the double nearest to the exact number, or a neighbor of this double.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import acb, acb_poly, arb, ctx, fmpq, fmpq_poly
from numpy.typing import NDArray

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.float_conversion import FloatArray
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure

LINES, CUBES, GENERAL = "lines", "cubes", "general"
_CANONICAL = {LINES: (0, 1, 1, 0), CUBES: (1, 0, 0, 1)}
_ROTATIONS = ((1, 0), (0, 1), (1, 1), (1, -1))  # at least one gives a nonzero form a nonzero leading coefficient
_MIN_SINE = 0.02  # sine of the angle between the forms U and V; smaller angles would lose too many digits
_BITS = (192, 384, 768, 1536, 3072)  # working precisions, tried in this order
_MIN_ACCURACY = 60  # accurate bits that an entry needs before it is rounded
_NEGLIGIBLE = 120  # an entry smaller than 2^-120 times the largest entry of its row is rounded to 0

Frame = tuple[list[acb], list[acb]]


@dataclass(frozen=True, eq=False)
class PlanarBlocks:
    """The planar maps of a normal form at one eps, in doubles.

    The `real_count` real blocks come first, sorted by root; then one block for each root with positive imaginary part.
    `coefficients` has a row (a, b, c, d) of complex numbers for each block. `x_to_state` is the 2m x 2m matrix that
    maps x to the rows of the blocks, and `state_to_x` is its inverse.

    >>> from flint import fmpq_poly
    >>> from kahanmaps.family.random_members import random_member_with_chi
    >>> from kahanmaps.family.planar import normal_form
    >>> blocks = planar_blocks(normal_form(random_member_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=7)), "1/10")
    >>> blocks.real_count, blocks.coefficients.real.tolist(), blocks.labels
    (1, [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]], ('1.25992', '-0.629961+-1.09112i'))
    """

    real_count: int
    coefficients: NDArray[np.complex128]
    kappa: NDArray[np.complex128]
    x_to_state: FloatArray
    state_to_x: FloatArray
    roots: tuple[complex, ...]

    @property
    def rows(self) -> int:
        """The number of rows of a state, 2m."""
        return len(self.x_to_state)

    @property
    def labels(self) -> tuple[str, ...]:
        """The roots as short text; a complex root stands for itself and its conjugate."""
        labels = []
        for root in self.roots:
            real_part = 0.0 if abs(root.real) < 1e-30 * abs(root.imag) else root.real  # the midpoint of a ball around 0
            labels.append(f"{root.real:.6g}" if root.imag == 0 else f"{real_part:.6g}+-{root.imag:.6g}i")
        return tuple(labels)

    def integrals(self, z: FloatArray) -> NDArray[np.complex128]:
        """Return the integrals h/(1 + eps^2 D) at the states z (rows, ...) as an array (blocks, ...)."""
        integrals = np.empty((len(self.kappa), *z.shape[1:]), dtype=np.complex128)
        with np.errstate(all="ignore"):
            for r, (coefficients, kappa) in enumerate(zip(self.coefficients, self.kappa, strict=True)):
                if r < self.real_count:
                    U, V = z[2 * r : 2 * r + 2]
                    (a, b, c, d), kappa = coefficients.real, kappa.real
                else:
                    row = 4 * r - 2 * self.real_count
                    U, V = z[row] + 1j * z[row + 1], z[row + 2] + 1j * z[row + 3]
                    a, b, c, d = coefficients
                A, B, C = a * U + b * V, b * U + c * V, c * U + d * V
                integrals[r] = kappa * (((A * U + 2.0 * B * V) * U + C * V * V) / ((1.0 + B) * (1.0 - B) + A * C))
        return integrals

    def distances(self, z: FloatArray, base: NDArray[np.complex128]) -> FloatArray:
        """Return the distances (blocks, ...) of h/(1 + eps^2 D) at the states z (rows, ...) from `base`."""
        with np.errstate(all="ignore"):
            distance: FloatArray = np.abs(self.integrals(z) - base)
        distance[np.isnan(distance)] = np.inf
        return distance


def planar_blocks(form: NormalForm, eps: Any) -> PlanarBlocks:
    """Return the blocks of a normal form at an exact eps (half the time step; negative for the inverse map).

    Raises InputError if eps is 0 or a number is out of the range of doubles.
    """
    epsilon = rational(eps)
    if epsilon == 0:
        raise InputError("found eps = 0, expected another number: the Kahan map is the identity at eps = 0")
    for bits in _BITS:
        with ctx.workprec(bits), suppress(_InsufficientPrecision):
            return _BallBlocks(form, epsilon).to_floats()
    raise InputError(f"the normal form needs more than {_BITS[-1]} bits: its coefficients are too long for doubles")


def require_same_system(form: NormalForm, map_: MapFamily) -> None:
    """Raise InputError if the normal form belongs to another map."""
    system = CubicHamiltonian(form.H, standard_structure(form.dim)).system
    if not isinstance(map_, KahanFamily) or system.dim != map_.dim or system.renamed(map_.variables) != map_.system:
        raise InputError(
            "the normal form belongs to another system: pass normal_form(member) of the member with this system"
        )


class _InsufficientPrecision(Exception):
    """The working precision does not determine a sign or a rounded value."""


class _BallBlocks:
    """The computation of the blocks in balls of the working precision."""

    def __init__(self, form: NormalForm, eps: fmpq) -> None:
        self.form = form
        self.eps = arb(eps)
        m = form.m
        self.S_inverse_columns = [
            (fmpq_poly(column[:m]), fmpq_poly(column[m:])) for column in form.S_inverse.transpose().tolist()
        ]
        a, b, c, d = form.coefficients
        self.discriminant = (
            b * b * c * c - 4 * a * c**3 - 4 * b**3 * d - 27 * a * a * d * d + 18 * a * b * c * d
        ) % form.chi
        pairs: Any = form.chi.complex_roots()  # the type stub omits the multiplicities
        roots = [root for root, _ in pairs]
        real_roots = sorted((r for r in roots if r.imag.is_zero()), key=lambda r: float(r.real.mid()))
        upper_roots = [r for r in roots if not r.imag.is_zero() and r.imag > 0]
        self.roots = real_roots + sorted(upper_roots, key=lambda r: (float(r.real.mid()), float(r.imag.mid())))

    def to_floats(self) -> PlanarBlocks:
        """Round all numbers to doubles. Raises _InsufficientPrecision if the precision is too low."""
        coefficients, kappas = [], []
        to_state: list[list[float]] = []
        to_x: list[list[float]] = []
        for root in self.roots:
            canonical_cubic, kappa, forms, columns = self._block(root)
            is_real = root.imag.is_zero()
            doubles = _round_to_doubles([part for entry in canonical_cubic for part in (entry.real, entry.imag)])
            coefficients.append([complex(x, y) for x, y in zip(doubles[::2], doubles[1::2], strict=True)])
            kappas.append(complex(*_round_to_doubles([kappa.real, kappa.imag])))
            for row, column in zip(forms, columns, strict=True):
                to_state.append(_round_to_doubles([entry.real for entry in row]))
                # A complex block represents two conjugate blocks, whose sum is twice the real part.
                to_x.append(_round_to_doubles([entry.real if is_real else 2 * entry.real for entry in column]))
                if not is_real:
                    to_state.append(_round_to_doubles([entry.imag for entry in row]))
                    to_x.append(_round_to_doubles([-2 * entry.imag for entry in column]))
        arrays = [np.array(coefficients), np.array(kappas), np.array(to_state), np.ascontiguousarray(np.array(to_x).T)]
        if not all(np.isfinite(array).all() for array in arrays):
            raise InputError("the normal form exceeds the range of floating-point numbers: use exact arithmetic")
        real_count = sum(1 for root in self.roots if root.imag.is_zero())
        roots = tuple(complex(float(root.real.mid()), float(root.imag.mid())) for root in self.roots)
        return PlanarBlocks(real_count, arrays[0], arrays[1], arrays[2], arrays[3], roots)

    def _block(self, root: acb) -> tuple[list[acb], acb, list[list[acb]], list[list[acb]]]:
        """Return for a root: (a, b, c, d); kappa; U and V as forms in x; the columns that express x in U and V."""
        cubic = [_evaluate(coefficient, root) for coefficient in self.form.coefficients]
        rows = [[_evaluate(element[k], root) for element in self.S_inverse_columns] for k in (0, 1)]
        kind, frame = self._frame(root, cubic, rows)
        det = frame[0][0] * frame[1][1] - frame[0][1] * frame[1][0]
        a, b, c, d = (entry * det for entry in _substitute(cubic, _invert(frame)))
        if kind == LINES:
            scale_U, scale_V = b, c
        elif kind == CUBES:
            # U = s L1, V = t L2 for `frame` = (L1, L2); 3 a t = s^2 and 3 d s = t^2: s^3 = 27 a^2 d, t^3 = 27 a d^2
            scale_U, scale_V = acb(_cube_root((27 * a * a * d).real)), acb(_cube_root((27 * a * d * d).real))
        else:
            scale_U, scale_V = acb(1), acb(1)
        canonical_cubic = [acb(entry) for entry in _CANONICAL.get(kind, ())] or [3 * a, b, c, 3 * d]
        if kind == GENERAL and all(self._vanishes(coefficient, root) for coefficient in self.form.coefficients):
            canonical_cubic = [acb(0)] * 4
        frame = ([entry * scale_U for entry in frame[0]], [entry * scale_V for entry in frame[1]])
        kappa = 1 / (24 * self.eps**3 * det * scale_U * scale_V)
        step = 2 * self.eps
        forms = [[step * (f * x + g * y) for x, y in zip(*rows, strict=True)] for f, g in frame]
        # The Lagrange polynomial chi(t)/((t - root) chi'(root)) is 1 at this root and 0 at all other roots.
        chi_derivative, quotient = _evaluate(self.form.chi.derivative(), root), acb(0)
        lagrange: list[acb] = []
        for coefficient in reversed(self.form.chi.coeffs()[1:]):
            quotient = quotient * root + arb(coefficient)
            lagrange.insert(0, quotient / chi_derivative)
        m, S = self.form.m, self.form.S.tolist()
        x_u, x_v = (
            [sum((arb(s) * l for s, l in zip(row[columns], lagrange, strict=True)), acb(0)) for row in S]
            for columns in (slice(0, m), slice(m, None))
        )
        inverse_frame = _invert(frame)
        point_columns = [
            [(x * inverse_frame[0][k] + y * inverse_frame[1][k]) / step for x, y in zip(x_u, x_v, strict=True)]
            for k in (0, 1)
        ]
        return canonical_cubic, kappa, forms, point_columns

    def _frame(self, root: acb, cubic: list[acb], rows: list[list[acb]]) -> tuple[str, Frame]:
        """Return the kind of h, and two linear forms in u and v, up to scale, that bring h to its canonical form."""
        if self._vanishes(self.discriminant, root):
            return GENERAL, self._orthonormal_frame(rows)
        if root.imag.is_zero() and _evaluate(self.discriminant, root).real < 0:
            a, b, c, d = cubic
            kind, linear_forms = CUBES, _linear_factors([3 * a * c - b * b, 9 * a * d - b * c, 3 * b * d - c * c])
        else:
            kind, linear_forms = LINES, _linear_factors(cubic)
        if root.imag.is_zero():  # at a real root the factors are real
            linear_forms = [[acb(entry.real) for entry in form] for form in linear_forms]
        pairs = [(linear_forms[i], linear_forms[j]) for i in range(len(linear_forms)) for j in range(i)]
        sine, frame = max(((_sine_of_angle(pair, rows), pair) for pair in pairs), key=lambda candidate: candidate[0])
        return (kind, frame) if sine > _MIN_SINE else (GENERAL, self._orthonormal_frame(rows))

    def _orthonormal_frame(self, rows: list[list[acb]]) -> Frame:
        """Return two linear forms in u and v that are orthonormal as forms in x."""
        one, zero = acb(1), acb(0)
        length = acb(_inner_product(rows[0], rows[0]).real.sqrt())
        projection = _inner_product(rows[1], rows[0]) / _inner_product(rows[0], rows[0]).real
        remainder = [y - projection * x for x, y in zip(*rows, strict=True)]
        height = acb(_inner_product(remainder, remainder).real.sqrt())
        return [one / length, zero], [-projection / height, one / height]

    def _vanishes(self, element: fmpq_poly, root: acb) -> bool:
        """Return whether an element of K = Q[t]/chi is exactly 0 at the root."""
        value = _evaluate(element, root)
        if not value.contains(acb(0)):
            return False
        gcd = element.gcd(self.form.chi)  # chi has simple roots, so the gcd is 0 at the root iff the element is
        if gcd.degree() < 1 or not _evaluate(gcd, root).contains(acb(0)):
            raise _InsufficientPrecision
        if gcd.degree() < self.form.chi.degree() and _evaluate(self.form.chi / gcd, root).contains(acb(0)):
            raise _InsufficientPrecision
        return True


def _linear_factors(form: list[acb]) -> list[list[acb]]:
    """Return the linear factors f u + g v, as [f, g] up to scale, of a squarefree form (coefficient of u^k first)."""
    for p, q in _ROTATIONS:
        # u = p u' - q v', v = q u' + p v'
        rotated_form = _substitute(form, ([acb(p), acb(-q)], [acb(q), acb(p)]))
        if not rotated_form[0].contains(acb(0)):
            try:
                roots = acb_poly(rotated_form[::-1]).roots(tol=arb(2) ** (ctx.prec // -2), maxprec=2 * ctx.prec)
            except ValueError as error:
                raise _InsufficientPrecision from error
            # u' - root v', with u' = (p u + q v)/N, v' = (p v - q u)/N and N = p^2 + q^2
            return [[p + root * q, q - root * p] for root in roots]
    raise _InsufficientPrecision


def _substitute(form: list[acb], matrix: Frame) -> list[acb]:
    """Return the binary form after the substitution (u, v) = matrix (u', v')."""
    degree, (u, v) = len(form) - 1, (acb_poly(row) for row in matrix)  # u and v as polynomials in v', for u' = 1
    polynomial = sum((u ** (degree - k) * v**k * coefficient for k, coefficient in enumerate(form)), acb_poly([]))
    return [polynomial[k] for k in range(degree + 1)]


def _invert(frame: Frame) -> Frame:
    (f, g), (k, l) = frame
    det = f * l - g * k
    return [l / det, -g / det], [-k / det, f / det]


def _sine_of_angle(frame: Frame, rows: list[list[acb]]) -> float:
    """Return the sine of the angle between two forms in u and v, both expressed as forms in x."""
    U, V = ([f * x + g * y for x, y in zip(*rows, strict=True)] for f, g in frame)
    size = abs(_inner_product(U, V))
    # Not size**2: in python-flint 0.9.0 all powers except the 0th of an arb with midpoint 0 and nonzero radius are nan.
    squared_cosine = size * size / (_inner_product(U, U).real * _inner_product(V, V).real)
    if not squared_cosine.is_finite():
        raise _InsufficientPrecision
    return float((1 - squared_cosine).mid()) ** 0.5 if squared_cosine < 1 else 0.0


def _inner_product(left: list[acb], right: list[acb]) -> acb:
    return sum((x * acb(y.real, -y.imag) for x, y in zip(left, right, strict=True)), acb(0))


def _cube_root(number: arb) -> arb:
    root = abs(number).root(3)
    return root if number > 0 else -root


def _evaluate(polynomial: fmpq_poly, point: acb) -> acb:
    return acb_poly(polynomial)(point)


def _round_to_doubles(row: Sequence[arb]) -> list[float]:
    """Round the entries to doubles; entries certainly negligible compared with the largest entry become 0."""
    largest = max((abs(entry) for entry in row), key=lambda entry: entry.mid())
    doubles = []
    for entry in row:
        if entry.is_zero() or abs(entry) * arb(2) ** _NEGLIGIBLE < largest:
            doubles.append(0.0)
        elif entry.rel_accuracy_bits() >= _MIN_ACCURACY:
            doubles.append(float(entry.mid()))
        else:
            raise _InsufficientPrecision
    return doubles
