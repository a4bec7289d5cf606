"""Conditions over Q on the parameters of a family, lifted from components of its special members modulo primes."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence

from kahanmaps.algebra.modular_matrices import pivots
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.work import count_work
from kahanmaps.laboratory.scan.lift import (
    lift_conjugate_points,
    lift_hypersurfaces,
    lift_linear,
    linear_equations,
    residues,
)
from kahanmaps.laboratory.scan.modular_components import ModularComponents, find_components
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.sweep import Degrees, Point, Sweep

_SHARE = 0.5  # a curve over GF(p) is assumed to have at least _SHARE * p points


def conditions(
    degrees: Degrees, sweeps: Sequence[Sweep], names: tuple[str, ...], rng: random.Random, check: Callable[[], None]
) -> list[Component]:
    """Return the components over Q of the special members whose iterates have these degrees.

    Hypersurfaces are lifted first, from members on random lines, which rarely meet components of lower dimension. The
    latter are lifted from points outside these hypersurfaces. `check` is called repeatedly, and may raise.
    """
    components: list[Component] = []
    parameter_count = len(names)

    def find_reductions(on_lines: bool) -> list[ModularComponents]:
        reductions = []
        for sweep in sweeps:
            if sweep.on_lines is on_lines and degrees in sweep.classes:
                unassigned = points_outside(sweep.classes[degrees], components, sweep.prime)
                min_dimension = 0 if sweep.complete else parameter_count - sweep.subspace_dimension
                if unassigned:
                    reductions.append(
                        find_components(unassigned, sweep.prime, sweep.member_count, min_dimension, rng, check)
                    )
        if parameter_count > 1:  # the constant is the last entry of a hyperplane, but the first of other forms
            hypersurfaces = {
                reduction.prime: [
                    *((row[-1], *row[:-1]) for (row,) in reduction.linear.get(parameter_count - 1, [])),
                    *reduction.hypersurfaces.get((), []),
                ]
                for reduction in reductions
            }
            components.extend(
                Component((form,), parameter_count - 1, degrees, primes)
                for form, primes in lift_hypersurfaces(hypersurfaces, names)
            )
        return reductions

    find_reductions(on_lines=True)
    reductions = find_reductions(on_lines=False)
    for dimension in range(max(1, parameter_count - 1)):
        subspaces = {
            reduction.prime: reduction.linear[dimension] for reduction in reductions if reduction.linear.get(dimension)
        }
        if dimension == 0 and len(subspaces) > 1:
            low_prime, high_prime = min(subspaces), max(subspaces)
            low_count, high_count = len(subspaces[low_prime]), len(subspaces[high_prime])
            # The number of points grows like the prime: so they lie on an undetected curve, and are not isolated.
            if low_count >= _SHARE * low_prime and high_count - low_count >= _SHARE * (high_prime - low_prime):
                continue
        lifts = lift_linear(subspaces)
        components += [
            Component(linear_equations(rows, names), dimension, degrees, primes) for rows, primes in lifts.items()
        ]
        if dimension == 0:
            points = {p: [tuple(-row[-1] % p for row in rows) for rows in items] for p, items in subspaces.items()}
            unassigned = {p: points_outside(items, components, p) for p, items in points.items()}
            unassigned.update((sweep.prime, []) for sweep in sweeps if sweep.complete and sweep.prime not in unassigned)
            conjugate_points = lift_conjugate_points(unassigned, names, rng, check)
            components += [Component(equations, 0, degrees, primes) for equations, primes in conjugate_points]
    for size in {len(rows) for reduction in reductions for rows in reduction.hypersurfaces if rows}:
        carriers = {
            reduction.prime: [rows for rows in reduction.hypersurfaces if len(rows) == size] for reduction in reductions
        }
        for rows in lift_linear(carriers):
            hypersurfaces = {
                reduction.prime: reduction.hypersurfaces.get(residues(rows, reduction.prime) or (), [])
                for reduction in reductions
            }
            equations = linear_equations(rows, names)
            free_names = [name for k, name in enumerate(names) if k not in pivots(rows)]
            for form, primes in lift_hypersurfaces(hypersurfaces, free_names):
                polynomial = form.project_to_context(ring(names))
                components.append(Component((polynomial, *equations), len(free_names) - 1, degrees, primes))
    return components


def points_outside(points: Sequence[Point], components: Iterable[Component], prime: int) -> list[Point]:
    """Return those of the points modulo a prime that lie on none of the components."""
    import numpy as np

    outside_points = np.array(points, dtype=np.int64)
    for component in components:
        terms = sum(map(len, component.equations))
        count_work(10 * terms * (1 + len(outside_points) / 200))
        is_on = np.ones(len(outside_points), dtype=bool)
        for equation in component.equations:
            total = np.zeros(len(outside_points), dtype=np.int64)
            for exponents, coefficient in equation.terms():
                term = np.full(len(outside_points), int(coefficient.p) % prime)
                for k, exponent in enumerate(exponents):
                    for _ in range(int(exponent)):
                        term = term * outside_points[:, k] % prime
                total += term
            is_on &= total % prime == 0
        outside_points = outside_points[~is_on]
    return [tuple(x) for x in outside_points.tolist()]
