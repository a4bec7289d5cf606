"""Conditions over Q on parameters: what the pieces of the slow members modulo primes are lifted to."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence

from kahanmaps.algebra.modular_matrices import pivots
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.work import count as count_work
from kahanmaps.laboratory.scan.lift import flat_equations, lifted_conjugates, lifted_flats, lifted_forms, residues
from kahanmaps.laboratory.scan.pieces import Pieces, pieces
from kahanmaps.laboratory.scan.result import Component
from kahanmaps.laboratory.scan.sweep import Degrees, Point, Sweep

_SHARE = 0.5  # of the prime, points of a curve at least


def conditions(
    degrees: Degrees, sweeps: Sequence[Sweep], names: tuple[str, ...], rng: random.Random, check: Callable[[], None]
) -> list[Component]:
    """The components of the slow members with these degrees. Raises what `check` raises, which is called now and then.

    Hypersurfaces first, from random lines, which hardly meet anything smaller; then what is smaller, beside them.
    """
    found: list[Component] = []
    count = len(names)

    def parts_of(on_lines: bool) -> list[Pieces]:
        parts = []
        for one in sweeps:
            if one.on_lines is on_lines and degrees in one.classes:
                rest = beside(one.classes[degrees], found, one.prime)
                smallest = 0 if one.complete else count - one.width
                parts += [pieces(rest, one.prime, one.seen, smallest, rng, check)] if rest else []
        if count > 1:  # a hyperplane by its coefficients in the order of those of other hypersurfaces
            forms = {
                part.prime: [
                    *((row[-1], *row[:-1]) for (row,) in part.flats.get(count - 1, [])),
                    *part.forms.get((), []),
                ]
                for part in parts
            }
            found.extend(Component((form,), count - 1, degrees, at) for form, at in lifted_forms(forms, names))
        return parts

    parts_of(on_lines=True)
    parts = parts_of(on_lines=False)
    for dimension in range(max(1, count - 1)):
        flats = {part.prime: part.flats[dimension] for part in parts if part.flats.get(dimension)}
        if dimension == 0 and len(flats) > 1:
            low, high = min(flats), max(flats)
            few, many = len(flats[low]), len(flats[high])
            if few >= _SHARE * low and many - few >= _SHARE * (high - low):  # as many as a curve has
                continue
        lifted = lifted_flats(flats)
        found += [Component(flat_equations(rows, names), dimension, degrees, at) for rows, at in lifted.items()]
        if dimension == 0:
            points = {p: [tuple(-row[-1] % p for row in rows) for rows in some] for p, some in flats.items()}
            rest = {p: beside(some, found, p) for p, some in points.items()}
            rest.update((one.prime, []) for one in sweeps if one.complete and one.prime not in rest)
            conjugate = lifted_conjugates(rest, names, rng, check)
            found += [Component(equations, 0, degrees, at) for equations, at in conjugate]
    for size in {len(rows) for part in parts for rows in part.forms if rows}:
        inside = {part.prime: [rows for rows in part.forms if len(rows) == size] for part in parts}
        for rows in lifted_flats(inside):
            forms = {part.prime: part.forms.get(residues(rows, part.prime) or (), []) for part in parts}
            equations = flat_equations(rows, names)
            free = [name for k, name in enumerate(names) if k not in pivots(rows)]
            for form, at in lifted_forms(forms, free):
                whole = form.project_to_context(ring(names))
                found.append(Component((whole, *equations), len(free) - 1, degrees, at))
    return found


def beside(points: Sequence[Point], components: Iterable[Component], prime: int) -> list[Point]:
    """The points modulo a prime that are on none of the components."""
    import numpy as np

    rest = np.array(points, dtype=np.int64)
    for one in components:
        terms = sum(map(len, one.equations))
        count_work(10 * terms * (1 + len(rest) / 200))
        on = np.ones(len(rest), dtype=bool)
        for equation in one.equations:
            total = np.zeros(len(rest), dtype=np.int64)
            for exponents, coefficient in equation.terms():
                term = np.full(len(rest), int(coefficient.p) % prime)
                for k, exponent in enumerate(exponents):
                    for _ in range(int(exponent)):
                        term = term * rest[:, k] % prime
                total += term
            on &= total % prime == 0
        rest = rest[~on]
    return [tuple(x) for x in rest.tolist()]
