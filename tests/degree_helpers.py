"""Degrees of iterates computed slowly, by other means than the library: polynomials on a line, and their gcd."""

import random
from typing import Any

from flint import fmpq, nmod_poly

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.systems.quadratic import QuadraticSystem


def polynomial_degrees(system: QuadraticSystem, count: int, seed: int, eps: Any = None) -> list[int]:
    """The degrees by Cramer's rule on homogeneous coordinates, common factors divided out: no power series."""
    rng = random.Random(seed)
    field = GF(2**61 - 1)
    p, n = field.prime, system.dim
    eps = field.random(rng) if eps is None else field.convert(fmpq(*map(int, eps.split("/"))))
    local = system.over(field)
    zero, item = nmod_poly([0], p), field.one
    X = [nmod_poly([1], p), *(nmod_poly([rng.randrange(p), rng.randrange(p)], p) for _ in range(n))]
    results = []
    for _ in range(count):
        matrix = [
            [
                X[0] * ((i == j) * item - eps * local.B[i, j])
                - sum((X[k + 1] * (eps * local.tensor[i * n + j, k]) for k in range(n)), zero)
                for j in range(n)
            ]
            for i in range(n)
        ]
        right = [
            sum(
                (X[j + 1] * ((i == j) * item + eps * local.B[i, j]) for j in range(n)), X[0] * (2 * eps * local.c[i, 0])
            )
            for i in range(n)
        ]
        image = [determinant(matrix)]
        for j in range(n):
            image.append(determinant([[*row[:j], b, *row[j + 1 :]] for row, b in zip(matrix, right, strict=True)]))
        common = image[0]
        for entry in image[1:]:
            common = common.gcd(entry)
        X = [entry // common for entry in image]
        results.append(max(entry.degree() for entry in X))
    return results


def by_formulas(variables: str, image: str) -> ImplicitMap:
    """The map that formulas in some variables and eps give, "x,y" and "y; (1 + y)/x"."""
    names = variables.split(",")
    return explicit_map(names, [parse_rational_function(text, [*names, "eps"]) for text in image.split(";")])


def determinant(rows: list[list[nmod_poly]]) -> nmod_poly:
    """By expansion along the first row."""
    if len(rows) == 1:
        return rows[0][0]
    minors = (determinant([[*row[:j], *row[j + 1 :]] for row in rows[1:]]) for j in range(len(rows)))
    signed = (entry * minor * (-1) ** j for j, (entry, minor) in enumerate(zip(rows[0], minors, strict=True)))
    return sum(signed, nmod_poly([0], rows[0][0].modulus()))
