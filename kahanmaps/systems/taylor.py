"""Solutions of quadratic systems in balls, from Taylor polynomials with a bound of the remainder.

Let q = max_i (sum |Q_jk| s + sum |B_j| + |c|/s) over the equations i, and v_0 = max |x_i|/s + 1 at a point, for a
number s > 0. Then x/s is majorized by v - 1, where v' = q v^2, so the k-th Taylor coefficient of x_i is at most
s v_0 (q v_0)^k, and beyond degree p the terms at time t add up to at most s v_0 r^(p + 1)/(1 - r), r = q v_0 t < 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import arb, fmpq

from kahanmaps.algebra.fields import QQ, RR, rational
from kahanmaps.errors import InputError
from kahanmaps.systems.quadratic import QuadraticSystem

_MAX_STEPS = 200  # if more steps are needed, the solution is close to a pole
_MAX_BITS = 2048  # largest working precision


def solution(system: QuadraticSystem, start: Sequence[Any], time: Any, bits: int = 64) -> list[arb] | None:
    """Return balls that contain the solution x(time) with x(0) = start, of radius at most 2^-bits max |x_i(time)|.

    `start` and `time` are exact numbers; the time may be negative. Returns None if there is no such solution, or if it
    comes too close to a pole. Raises InputError if `start` has a wrong length.

    >>> [ball] = solution(QuadraticSystem.from_text(["x"], ["x^2"]), [1], "1/2")  # x = 1/(1 - t)
    >>> ball.contains(2), bool(ball.rad() < 1e-18)
    (True, True)
    >>> solution(QuadraticSystem.from_text(["x"], ["x^2"]), [1], 2) is None
    True
    """
    if len(start) != system.dim:
        raise InputError(f"found a point with {len(start)} coordinates, expected {system.dim}")
    exact_start, end_time = [rational(entry) for entry in start], rational(time)
    if all(value == 0 for value in system.over(QQ).value(exact_start)):
        return [arb(entry) for entry in exact_start]
    precision = bits + 32
    while precision <= _MAX_BITS:
        with RR(precision).working():
            x = _integrate(system, [arb(entry) for entry in exact_start], end_time, precision)
            if x is None:
                return None
            if max(ball.rad() for ball in x) <= max(abs(ball.mid()) for ball in x) * arb(2) ** -bits:
                return x
        precision *= 2
    return None


def _integrate(system: QuadraticSystem, x: list[arb], time: fmpq, bits: int) -> list[arb] | None:
    equations = []
    for polynomial in system.rhs:
        terms = []
        for monomial, coefficient in polynomial.terms():
            terms.append((arb(coefficient), [k for k, power in enumerate(monomial) for _ in range(int(power))]))
        equations.append(terms)
    index_pairs = sorted({tuple(indices) for terms in equations for _, indices in terms if len(indices) == 2})
    degree = bits // 2 + 1  # sufficient since r (module docstring) is at most 1/4
    for step_count in range(_MAX_STEPS):
        size = max(abs(entry).upper() for entry in x)
        scales = [size, 4 * size, arb(1)] if size > 0 else [arb(1)]
        rates = [
            max(sum(abs(c) * s ** (len(indices) - 1) for c, indices in terms) for terms in equations if terms)
            for s in scales
        ]
        rate, scale = min(((rate * (size / s + 1)).upper(), s) for rate, s in zip(rates, scales, strict=True))
        required_steps = (4 * rate * abs(arb(time))).upper()
        if not required_steps < _MAX_STEPS - step_count:
            return None
        step = time / (1 + int(float(required_steps)))
        coefficients = [[entry] for entry in x]
        for k in range(degree):
            products = {}
            for i, j in index_pairs:
                a, b = coefficients[i], coefficients[j]
                partial_sum = sum((a[m] * b[k - m] for m in range(k + 1 if i != j else (k + 1) // 2)), arb(0))
                products[i, j] = partial_sum if i != j else 2 * partial_sum + (a[k // 2] ** 2 if k % 2 == 0 else 0)
            for terms, series in zip(equations, list(coefficients), strict=True):
                total = arb(0)
                for c, indices in terms:
                    if len(indices) == 2:
                        total += c * products[indices[0], indices[1]]
                    elif indices or not k:
                        total += c * coefficients[indices[0]][k] if indices else c
                series.append(total / (k + 1))
        r = (rate * abs(arb(step))).upper()
        remainder = arb(0, (scale * (size / scale + 1) * r ** (degree + 1) / (1 - r)).upper())
        x = []
        for series in coefficients:
            total = arb(0)
            for entry in reversed(series):
                total = total * arb(step) + entry
            x.append(total + remainder)
        time -= step
        if time == 0:
            return x
    return None
