"""The level curves of a planar Kahan map as real plane cubics, drawn whole: every branch, and through infinity.

The Kahan map of u' = h_v, v' = -h_u, h = a u^3 + b u^2 v + c u v^2 + d v^3, conserves h/(1 + eps^2 D) with the Hessian
determinant D = h_uu h_vv - h_uv^2, so an orbit stays on a cubic below * h = above * (1 + eps^2 D). On the line through
the origin in the direction t write (u, v) = (cos t, sin t)/s. Then

    s^3 + eps^2 D(t) s = below h(t)/above,

which has one or three real roots s, 0 at infinity. Their number changes only in the directions in which the form
4 eps^6 D^3 above^2 + 27 below^2 h^2, of degree 6, is 0; in between the roots are smooth functions of t.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_FIRST = 65  # directions between two changes, before refinement
_ROUNDS = 40  # of refinement, which halves angles
_ANGLE = 0.02  # between neighbours of a curve, as lines through the origin of space
_MOST = 20_000  # directions between two changes


@dataclass(frozen=True)
class PlaneCubic:
    """The curve below * h = above * (1 + eps^2 D) in the plane, for the coefficients of h and eps (half the time step).

    `above` = 0 is h = 0, lines through the origin; `below` = 0 is the conic 1 + eps^2 D = 0 of the points that the map
    sends to infinity; both zero: no level, as for a point where all the curves meet.

    >>> circle = PlaneCubic((1.0, 0.0, -3.0, 0.0), 0.5, 1.0, 0.0)
    >>> round(circle.length, 12), round(circle.defect(0, circle.length), 12)
    (0.333333333333, 0.0)
    """

    h: tuple[float, float, float, float]
    eps: float
    above: float
    below: float

    @property
    def D(self) -> tuple[float, float, float]:
        """The coefficients of D = h_uu h_vv - h_uv^2, of u^2, uv and v^2."""
        a, b, c, d = self.h
        return 12 * a * c - 4 * b * b, 36 * a * d - 4 * b * c, 12 * b * d - 4 * c * c

    @property
    def length(self) -> float:
        """The distance from the origin at which the map changes its ways: that of 1 + eps^2 D = 0, where it is real."""
        largest = self.eps * self.eps * float(np.abs(_form(self.D, np.linspace(0, np.pi, 721))).max())
        return float(1 / np.sqrt(largest)) if largest > 0 else 1.0

    def defect(self, u: Any, v: Any) -> float:
        """How far points are from the curve: the largest |below h - above (1 + eps^2 D)| over the sum of its terms."""
        u, v = np.atleast_1d(np.asarray(u, dtype=float)), np.atleast_1d(np.asarray(v, dtype=float))
        a, b, c, d = self.h
        p, q, r = (self.eps * self.eps * entry for entry in self.D)
        terms = [self.below * term for term in (a * u**3, b * u * u * v, c * u * v * v, d * v**3)]
        terms += [-self.above * term for term in (1 + 0 * u, p * u * u, q * u * v, r * v * v)]
        size = sum(np.abs(term) for term in terms)
        return float(np.max(np.abs(sum(terms)) / np.where(size > 0, size, 1.0), initial=0.0))

    def gradient(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """The derivatives of below h - above (1 + eps^2 D) along u and v."""
        a, b, c, d = self.h
        p, q, r = (self.above * self.eps * self.eps * entry for entry in self.D)
        along_u = self.below * (3 * a * u * u + 2 * b * u * v + c * v * v) - 2 * p * u - q * v
        along_v = self.below * (b * u * u + 2 * c * u * v + 3 * d * v * v) - q * u - 2 * r * v
        return along_u, along_v

    def arcs(self) -> list[Floats]:
        """The whole real curve: arrays of rows (x, y, w) of length 1 that stand for (u, v) = length * (x, y)/w.

        An arc is cut where it goes through infinity; it starts and ends there with w = 0 otherwise w > 0.
        """
        if self.above == 0 and self.below == 0:
            return []
        if self.above == 0:
            return [np.array([(-x, -y, 0.0), (0.0, 0.0, 1.0), (x, y, 0.0)]) for x, y in self._lines()]
        found: list[Floats] = []
        for first, last in pairwise(self._changes()):
            # Roots meet like square roots at the ends, so that equal steps are taken of an angle whose cosine is t.
            angles = np.linspace(np.pi, 0, _FIRST)
            middle, half = (first + last) / 2, (last - first) / 2
            for _ in range(_ROUNDS):
                directions = middle + half * np.cos(angles)
                branches = [_unit(directions, s) for s in self._roots(directions)]
                wide = np.zeros(len(angles) - 1, dtype=bool)
                for branch in branches:
                    wide |= np.abs((branch[1:] * branch[:-1]).sum(axis=1)) < np.cos(_ANGLE)
                if not wide.any() or len(angles) > _MOST:
                    break
                angles = np.sort(np.concatenate([angles, ((angles[1:] + angles[:-1]) / 2)[wide]]))[::-1]
            for branch in branches:
                found += _cut(branch)
        return found

    def flow_arcs(self, u: float, v: float) -> list[Floats]:
        """The level curve of h itself through a point, on which the differential equation moves; rows as in `arcs`."""
        a, b, c, d = self.h
        level = a * u**3 + b * u * u * v + c * u * v * v + d * v**3
        # With eps = 0 the unit of length is 1, so it is the level that is scaled.
        return PlaneCubic(self.h, 0.0, level / self.length**3, 1.0).arcs()

    def _lines(self) -> list[tuple[float, float]]:
        """The directions of h = 0."""
        return [(float(np.cos(t)), float(np.sin(t))) for t in _zeros(np.array(self.h))]

    def _changes(self) -> list[float]:
        """The directions, from one to itself after half a turn, between which the number of roots is constant.

        With T = h_u D_v - h_v D_u there is the identity T^2 + 432 disc(h) h^2 = -D^3, so that the form of degree 6 is a
        difference of squares, and its two factors have better roots than it has.
        """
        a, b, c, d = self.h
        p, q, r = self.D
        disc = b * b * c * c - 4 * (a * c**3 + b**3 * d) + 18 * a * b * c * d - 27 * a * a * d * d
        # h_u D_v - h_v D_u, each a list of coefficients
        T = np.convolve([3 * a, 2 * b, c], [q, 2 * r]) - np.convolve([b, 2 * c, 3 * d], [2 * p, q])
        cube = 8 * self.eps**3
        rest = 27 * (self.below * self.below - cube * cube * disc * self.above * self.above)
        changes: list[float] = []
        if rest >= 0 and cube:
            for sign in (-1, 1):
                changes += _zeros(cube / 4 * self.above * T + sign * np.sqrt(rest) * np.array(self.h))
        changes = sorted(changes) or [0.0]
        return [*changes, changes[0] + np.pi]

    def _roots(self, directions: Floats) -> list[Floats]:
        """The roots s * length, in increasing order: one array of them, or three."""
        length = self.length
        p = (self.eps * length) ** 2 * _form(self.D, directions)
        q = self.below / self.above * length**3 * _form(self.h, directions)
        inside = len(directions) // 2  # the ends may be double roots, where rounding decides
        if 4 * p[inside] ** 3 + 27 * q[inside] ** 2 > 0:
            return [_only_root(p, q)]
        radius = 2 * np.sqrt(np.maximum(-p, 0) / 3)
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.where(radius > 0, 4 * q / radius**3, 0.0)
        angle = np.arccos(np.clip(cosine, -1, 1)) / 3
        return [radius * np.cos(angle + turn) for turn in (2 * np.pi / 3, -2 * np.pi / 3, 0.0)]


def _only_root(p: Floats, q: Floats) -> Floats:
    """The real root of s^3 + p s = q where there is one."""
    root = np.sqrt(np.maximum(q * q / 4 + p**3 / 27, 0))
    first = np.cbrt(np.where(q >= 0, q / 2 + root, q / 2 - root))  # the larger of the two cube roots: no cancellation
    with np.errstate(divide="ignore", invalid="ignore"):
        second = np.where(first != 0, -p / (3 * first), 0.0)
    s = first + second
    with np.errstate(divide="ignore", invalid="ignore"):
        better = s - (s**3 + p * s - q) / (3 * s * s + p)  # for p > 0 the sum cancels near 0
    return np.where(np.isfinite(better) & (p > 0), better, s)


def _unit(directions: Floats, s: Floats) -> Floats:
    rows = np.stack([np.cos(directions), np.sin(directions), s], axis=1)
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def _cut(branch: Floats) -> list[Floats]:
    """A branch in pieces with w >= 0, which end with w = 0 where it goes through infinity."""
    pieces, held = [], [branch[0]]
    for before, after in pairwise(branch):
        if before[2] * after[2] < 0:
            middle = before * abs(after[2]) + after * abs(before[2])
            middle = np.array([middle[0], middle[1], 0.0]) / np.hypot(middle[0], middle[1])
            pieces.append(np.array([*held, middle]))
            held = [middle]
        held.append(after)
    pieces.append(np.array(held))
    return [piece if piece[:, 2].sum() >= 0 else -piece for piece in pieces]


def _form(coefficients: Any, directions: Floats) -> Floats:
    """The binary form at (cos t, sin t), first coefficient that of the highest power of the cosine."""
    x, y = np.cos(directions), np.sin(directions)
    degree = len(coefficients) - 1
    return np.asarray(sum(entry * x ** (degree - k) * y**k for k, entry in enumerate(coefficients)))


def _zeros(form: Floats) -> list[float]:
    """The directions t, 0 <= t < pi, in which a binary form is zero; double ones may be missed or come as two."""
    largest = float(np.abs(form).max(initial=0.0))
    if largest == 0 or not np.isfinite(largest):
        return []
    # Turned by an angle that no nice form is zero at, so that no root is at infinity.
    turn = 0.7390851
    u, v = np.poly1d([np.cos(turn), -np.sin(turn)]), np.poly1d([np.sin(turn), np.cos(turn)])
    degree = len(form) - 1
    turned = sum((u ** (degree - k) * v**k * entry for k, entry in enumerate(form / largest)), np.poly1d([0.0]))
    roots = turned.roots
    real = roots[np.abs(roots.imag) < 1e-7 * (1 + np.abs(roots))].real
    # u = cos(turn) u' - sin(turn) v', v = sin(turn) u' + cos(turn) v': a root u'/v' has the direction atan2(1, root).
    return [float((np.arctan2(1.0, root) + turn) % np.pi) for root in real]
