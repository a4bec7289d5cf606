"""The normal form in floating point: one planar map for each root of chi, in a canonical form.

At a root r of chi the Kahan map of a member is planar, with a binary cubic h_r (see kahanmaps/family/planar.py). Let
(U, V) = 2 eps (u, v), and A = a U + b V, B = b U + c V, C = c U + d V half the second derivatives of
h = a U^3/3 + b U^2 V + c U V^2 + d V^3/3. Then the map is Cramer's rule for two equations:

    U~ = ((1 + B) U + C V)/w,     V~ = ((1 - B) V - A U)/w,     w = (1 + B)(1 - B) + A C = 1 + eps^2 D.

A linear change of U and V (h is divided by its determinant) makes h one of

    lines    U V (U + V)         (a, b, c, d) = (0, 1, 1, 0)    three linear factors over R, or over C at a complex r
    cubes    (U^3 + V^3)/3                      (1, 0, 0, 1)    one real linear factor
    general                      arbitrary                      a repeated factor, h = 0, or U and V nearly dependent

so that most maps have no coefficients except 0 and 1, and take five or six multiplications and a division. The linear
factors U and V are those two whose forms in x are closest to orthogonal. The integral h_r/(1 + eps^2 D) of the block is
kappa (A U^2 + 2 B U V + C V^2)/w.

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
_BITS = (192, 384, 768, 1536, 3072)
_MIN_ACCURACY = 60  # accurate bits that an entry needs before it is rounded
_NEGLIGIBLE = 120  # an entry smaller than 2^-120 times the largest entry of its row is rounded to 0

Frame = tuple[list[acb], list[acb]]


@dataclass(frozen=True, eq=False)
class PlanarBlocks:
    """The planar maps of a normal form at one eps, in doubles.

    The `reals` real blocks come first, by increasing root; then one block for each root with positive imaginary part.
    `coefficients` has a row (a, b, c, d) of complex numbers for each block. `x_to_state` is the 2m x 2m matrix that
    maps x to the rows of the blocks, and `state_to_x` is its inverse.

    >>> from flint import fmpq_poly
    >>> from kahanmaps.family.random_members import random_member_with_chi
    >>> from kahanmaps.family.planar import normal_form
    >>> blocks = planar_blocks(normal_form(random_member_with_chi(fmpq_poly([-2, 0, 0, 1]), seed=7)), "1/10")
    >>> blocks.reals, blocks.coefficients.real.tolist(), blocks.labels
    (1, [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0]], ('1.25992', '-0.629961+-1.09112i'))
    """

    reals: int
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
            real = 0.0 if abs(root.real) < 1e-30 * abs(root.imag) else root.real  # the midpoint of a ball around 0
            labels.append(f"{root.real:.6g}" if root.imag == 0 else f"{real:.6g}+-{root.imag:.6g}i")
        return tuple(labels)

    def integrals(self, z: FloatArray) -> NDArray[np.complex128]:
        """Return the integrals h/(1 + eps^2 D) at the states z (rows, ...) as an array (blocks, ...)."""
        integrals = np.empty((len(self.kappa), *z.shape[1:]), dtype=np.complex128)
        with np.errstate(all="ignore"):
            for r, (coefficients, kappa) in enumerate(zip(self.coefficients, self.kappa, strict=True)):
                if r < self.reals:
                    U, V = z[2 * r : 2 * r + 2]
                    (a, b, c, d), kappa = coefficients.real, kappa.real
                else:
                    at = 4 * r - 2 * self.reals
                    U, V = z[at] + 1j * z[at + 1], z[at + 2] + 1j * z[at + 3]
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
        with ctx.workprec(bits), suppress(_Unclear):
            return _Blocks(form, epsilon).to_floats()
    raise InputError(f"the normal form needs more than {_BITS[-1]} bits: its coefficients are too long for doubles")


def require_same_system(form: NormalForm, map_: MapFamily) -> None:
    """Raise InputError if the normal form belongs to another map."""
    theirs = CubicHamiltonian(form.H, standard_structure(form.dim)).system
    if not isinstance(map_, KahanFamily) or theirs.dim != map_.dim or theirs.renamed(map_.variables) != map_.system:
        raise InputError(
            "the normal form belongs to another system: pass normal_form(member) of the member with this system"
        )


class _Unclear(Exception):
    """The working precision does not determine a sign or a rounded value."""


class _Blocks:
    """The computation of the blocks in balls of the working precision."""

    def __init__(self, form: NormalForm, eps: fmpq) -> None:
        self.form = form
        self.eps = arb(eps)
        m = form.m
        self.inverse = [
            (fmpq_poly(column[:m]), fmpq_poly(column[m:])) for column in form.S_inverse.transpose().tolist()
        ]
        a, b, c, d = form.coefficients
        self.discriminant = (
            b * b * c * c - 4 * a * c**3 - 4 * b**3 * d - 27 * a * a * d * d + 18 * a * b * c * d
        ) % form.chi
        pairs: Any = form.chi.complex_roots()  # the type stub omits the multiplicities
        roots = [root for root, _ in pairs]
        real = sorted((r for r in roots if r.imag.is_zero()), key=lambda r: float(r.real.mid()))
        upper = [r for r in roots if not r.imag.is_zero() and r.imag > 0]
        self.roots = real + sorted(upper, key=lambda r: (float(r.real.mid()), float(r.imag.mid())))

    def to_floats(self) -> PlanarBlocks:
        """Round all numbers to doubles. Raises _Unclear if the precision is too low."""
        coefficients, kappas = [], []
        into: list[list[float]] = []
        out: list[list[float]] = []
        for root in self.roots:
            numbers, kappa, into_uv, out_uv = self._block(root)
            real = root.imag.is_zero()
            parts = _round_to_doubles([part for entry in numbers for part in (entry.real, entry.imag)])
            coefficients.append([complex(x, y) for x, y in zip(parts[::2], parts[1::2], strict=True)])
            kappas.append(complex(*_round_to_doubles([kappa.real, kappa.imag])))
            for row, column in zip(into_uv, out_uv, strict=True):
                into.append(_round_to_doubles([entry.real for entry in row]))
                # A complex block represents two conjugate blocks, whose sum is twice the real part.
                out.append(_round_to_doubles([entry.real if real else 2 * entry.real for entry in column]))
                if not real:
                    into.append(_round_to_doubles([entry.imag for entry in row]))
                    out.append(_round_to_doubles([-2 * entry.imag for entry in column]))
        tables = [np.array(coefficients), np.array(kappas), np.array(into), np.ascontiguousarray(np.array(out).T)]
        if not all(np.isfinite(table).all() for table in tables):
            raise InputError("the normal form exceeds the range of floating-point numbers: use exact arithmetic")
        reals = sum(1 for root in self.roots if root.imag.is_zero())
        roots = tuple(complex(float(root.real.mid()), float(root.imag.mid())) for root in self.roots)
        return PlanarBlocks(reals, tables[0], tables[1], tables[2], tables[3], roots)

    def _block(self, root: acb) -> tuple[list[acb], acb, list[list[acb]], list[list[acb]]]:
        """Return (a, b, c, d); kappa; U and V as forms in x; and the columns that express x in U and V."""
        cubic = [_value(coefficient, root) for coefficient in self.form.coefficients]
        rows = [[_value(element[k], root) for element in self.inverse] for k in (0, 1)]
        kind, frame = self._frame(root, cubic, rows)
        det = frame[0][0] * frame[1][1] - frame[0][1] * frame[1][0]
        a, b, c, d = (entry * det for entry in _transformed(cubic, _inverse(frame)))
        if kind == LINES:
            scale_U, scale_V = b, c
        elif kind == CUBES:
            # U = s L1, V = t L2 with 3 a t = s^2 and 3 d s = t^2: s^3 = 27 a^2 d, t^3 = 27 a d^2
            scale_U, scale_V = acb(_cube_root((27 * a * a * d).real)), acb(_cube_root((27 * a * d * d).real))
        else:
            scale_U, scale_V = acb(1), acb(1)
        numbers = [acb(entry) for entry in _CANONICAL.get(kind, ())] or [3 * a, b, c, 3 * d]
        if kind == GENERAL and all(self._vanishes(coefficient, root) for coefficient in self.form.coefficients):
            numbers = [acb(0)] * 4
        frame = ([entry * scale_U for entry in frame[0]], [entry * scale_V for entry in frame[1]])
        kappa = 1 / (24 * self.eps**3 * det * scale_U * scale_V)
        step = 2 * self.eps
        into = [[step * (f * x + g * y) for x, y in zip(*rows, strict=True)] for f, g in frame]
        # The Lagrange polynomial chi(t)/((t - root) chi'(root)) is 1 at this root and 0 at all other roots.
        slope, carry = _value(self.form.chi.derivative(), root), acb(0)
        lagrange: list[acb] = []
        for coefficient in reversed(self.form.chi.coeffs()[1:]):
            carry = carry * root + arb(coefficient)
            lagrange.insert(0, carry / slope)
        m, S = self.form.m, self.form.S.tolist()
        x_u, x_v = (
            [sum((arb(s) * l for s, l in zip(row[half], lagrange, strict=True)), acb(0)) for row in S]
            for half in (slice(0, m), slice(m, None))
        )
        inverse_frame = _inverse(frame)
        out = [
            [(x * inverse_frame[0][k] + y * inverse_frame[1][k]) / step for x, y in zip(x_u, x_v, strict=True)]
            for k in (0, 1)
        ]
        return numbers, kappa, into, out

    def _frame(self, root: acb, cubic: list[acb], rows: list[list[acb]]) -> tuple[str, Frame]:
        """Return the kind of h, and two linear forms in u and v, up to scale, that bring h to its canonical form."""
        if self._vanishes(self.discriminant, root):
            return GENERAL, self._orthonormal_frame(rows)
        if root.imag.is_zero() and _value(self.discriminant, root).real < 0:
            a, b, c, d = cubic
            kind, lines = CUBES, _factors([3 * a * c - b * b, 9 * a * d - b * c, 3 * b * d - c * c])
        else:
            kind, lines = LINES, _factors(cubic)
        if root.imag.is_zero():  # at a real root the factors are real
            lines = [[acb(entry.real) for entry in line] for line in lines]
        pairs = [(lines[i], lines[j]) for i in range(len(lines)) for j in range(i)]
        sine, frame = max(((_sine(pair, rows), pair) for pair in pairs), key=lambda candidate: candidate[0])
        return (kind, frame) if sine > _MIN_SINE else (GENERAL, self._orthonormal_frame(rows))

    def _orthonormal_frame(self, rows: list[list[acb]]) -> Frame:
        """Return two linear forms in u and v that are orthonormal as forms in x."""
        one, zero = acb(1), acb(0)
        length = acb(_inner(rows[0], rows[0]).real.sqrt())
        slant = _inner(rows[1], rows[0]) / _inner(rows[0], rows[0]).real
        remainder = [y - slant * x for x, y in zip(*rows, strict=True)]
        height = acb(_inner(remainder, remainder).real.sqrt())
        return [one / length, zero], [-slant / height, one / height]

    def _vanishes(self, element: fmpq_poly, root: acb) -> bool:
        """Return whether an element of K is exactly 0 at the root."""
        value = _value(element, root)
        if not value.contains(acb(0)):
            return False
        common = element.gcd(self.form.chi)  # since chi has simple roots, it is 0 at the root iff the element is
        if common.degree() < 1 or not _value(common, root).contains(acb(0)):
            raise _Unclear
        if common.degree() < self.form.chi.degree() and _value(self.form.chi / common, root).contains(acb(0)):
            raise _Unclear
        return True


def _factors(form: list[acb]) -> list[list[acb]]:
    """Return the linear factors f u + g v, up to scale, of a binary form (u^k first) without repeated factors."""
    for p, q in _ROTATIONS:
        # u = p u' - q v', v = q u' + p v'
        turned = _transformed(form, ([acb(p), acb(-q)], [acb(q), acb(p)]))
        if not turned[0].contains(acb(0)):
            try:
                roots = acb_poly(turned[::-1]).roots(tol=arb(2) ** (ctx.prec // -2), maxprec=2 * ctx.prec)
            except ValueError as error:
                raise _Unclear from error
            # u' - root v', with u' = (p u + q v)/N, v' = (p v - q u)/N
            return [[p + root * q, q - root * p] for root in roots]
    raise _Unclear


def _transformed(form: list[acb], matrix: Frame) -> list[acb]:
    """Return the binary form after the substitution (u, v) = matrix (u', v')."""
    degree, (u, v) = len(form) - 1, (acb_poly(row) for row in matrix)  # u and v as polynomials in v', for u' = 1
    total = sum((u ** (degree - k) * v**k * coefficient for k, coefficient in enumerate(form)), acb_poly([]))
    return [total[k] for k in range(degree + 1)]


def _inverse(frame: Frame) -> Frame:
    (f, g), (k, l) = frame
    det = f * l - g * k
    return [l / det, -g / det], [-k / det, f / det]


def _sine(frame: Frame, rows: list[list[acb]]) -> float:
    """Return the sine of the angle between two forms in u and v, both expressed as forms in x."""
    first, second = ([f * x + g * y for x, y in zip(*rows, strict=True)] for f, g in frame)
    size = abs(_inner(first, second))
    # Not size**2: in python-flint 0.9.0 all powers except the 0th of an arb with midpoint 0 and nonzero radius are nan.
    cosine = size * size / (_inner(first, first).real * _inner(second, second).real)
    if not cosine.is_finite():
        raise _Unclear
    return float((1 - cosine).mid()) ** 0.5 if cosine < 1 else 0.0


def _inner(left: list[acb], right: list[acb]) -> acb:
    return sum((x * acb(y.real, -y.imag) for x, y in zip(left, right, strict=True)), acb(0))


def _cube_root(number: arb) -> arb:
    root = abs(number).root(3)
    return root if number > 0 else -root


def _value(polynomial: fmpq_poly, at: acb) -> acb:
    return acb_poly(polynomial)(at)


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
            raise _Unclear
    return doubles
