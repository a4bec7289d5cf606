"""Degrees over finite fields: exponential growth over Q may be quadratic or bounded modulo a prime.

The planar system with three invariant lines of exponents (6, 3, 2) has the degrees 2^n over Q. Modulo p every fraction
is congruent to an integer, so that singularities may be confined that are not confined over Q. Over GF(5) and GF(11)
the degrees are periodic, over GF(7) they grow quadratically, like those of an integrable map, and over GF(17) no degree
drops.

A line over GF(p^k), with p^k about 2^60, is mapped as polynomials, and common factors are divided out. This follows the
definition of the degrees, and shares no code with `kahanmaps degrees`. Other systems (files, names of the catalogue,
equations) and primes are arguments; `--terms` is the number of degrees:

    python 12_degrees_mod_p.py euler_top "x' = x^2; y' = 41/2*x*y" --primes 3,5,2305843009213693951
"""

import argparse
import random
from math import ceil, log2

from flint import fq_default_ctx, fq_default_poly_ctx

import kahanmaps as km

SIX_THREE_TWO = "x' = 3*x^2 + 10*x*y; y' = -8*x*y - 12*y^2"
MERSENNE = 2**61 - 1  # in place of Q: no fraction that occurs is an integer of moderate size modulo this prime


def solve(matrix, right):
    """det(matrix) and det(matrix) times the solution, by the method of Bareiss: every division is exact."""
    rows = [[*row, entry] for row, entry in zip(matrix, right, strict=True)]
    pivot = None
    for k in range(len(rows)):
        at = next(i for i in range(k, len(rows)) if rows[i][k] != 0)
        rows[k], rows[at] = rows[at], [-entry for entry in rows[k]] if at != k else rows[at]
        for i in range(len(rows)):
            if i != k:
                new = [rows[k][k] * a - rows[i][k] * b for a, b in zip(rows[i], rows[k], strict=True)]
                rows[i] = new if pivot is None else [entry // pivot for entry in new]
        pivot = rows[k][k]
    return pivot, [row[-1] for row in rows]


def degrees(system, p, terms, seed=0):
    """The degrees of the first iterates over GF(p), for a random eps and on a random line over GF(p^k)."""
    draw, k = random.Random(seed), ceil(60 / log2(p))
    field = fq_default_ctx(p, k)
    ring = fq_default_poly_ctx(field)
    zero, dim = ring([]), range(system.dim)

    def element():
        return field([draw.randrange(p) for _ in range(k)])

    def constant(number):
        return ring([field(int(number.p)) / field(int(number.q))])

    Q = [[[constant(part[i, j]) for j in dim] for i in dim] for part in system.Q]  # f = x^T Q x + B x + c
    B = [[constant(system.B[i, j]) for j in dim] for i in dim]
    c = [constant(number) for number in system.c]
    eps, z = ring([element()]), ring([field(1)])
    x = [ring([element(), element()]) for _ in dim]
    result = []
    for _ in range(terms):
        # (z - eps f'(x, z)) (z x~ - x) = 2 eps f(x, z): a step in homogeneous coordinates (x : z).
        slope = [[sum(((Q[a][i][j] + Q[a][j][i]) * x[i] for i in dim), B[a][j] * z) for j in dim] for a in dim]
        value = [
            sum((Q[a][i][j] * x[i] * x[j] for i in dim for j in dim), zero)
            + sum((B[a][j] * x[j] for j in dim), c[a] * z) * z
            for a in dim
        ]
        matrix = [[(z if a == j else zero) - eps * slope[a][j] for j in dim] for a in dim]
        det, move = solve(matrix, [2 * eps * entry for entry in value])
        x, z = [entry * det + step for entry, step in zip(x, move, strict=True)], z * det
        common = z
        for entry in x:
            common = common.gcd(entry)
        x, z = [entry // common for entry in x], z // common
        result.append(max(entry.degree() for entry in [*x, z]))
    return result


parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
parser.add_argument("systems", nargs="*", default=[SIX_THREE_TWO])
parser.add_argument("--primes", default=f"{MERSENNE},5,7,11,13,17")
parser.add_argument("--terms", type=int, default=9)
arguments = parser.parse_args()
for text in arguments.systems:
    system = (km.parse_system(text) if "'" in text else km.load(text)).system
    if len(arguments.systems) > 1:
        print(text)
    for p in map(int, arguments.primes.split(",")):
        print(f"GF({p})", ", ".join(map(str, degrees(system, p, arguments.terms))))
