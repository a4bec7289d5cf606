"""Matrices S with one entry in each row and column that a translation may complete to a symmetry.

With (S x)_{p(i)} = s_i x_i the condition f(S x) = sign S f(x) on coefficients is a table of equations between single
numbers. In scaled variables y_i = e_i x_i, e_i > 0, for which the logarithms of the coefficients have the least sum of
squares, the numbers s_i are 1 or -1: S takes this scale to another such one, and there is but one up to scales that
do not change f. So signed permutations are sought with the coefficients of that scale, whose logarithms are rational
combinations of those of coprime integers. Where S is not rational in x it is dropped.

Variables are placed one after the other, and a choice is dropped at the first equation that fails.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product

from flint import fmpq, fmpq_mat, fmpz

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.work import Budget, count
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_DIMENSION = 12
MAX_FOUND = 1_000  # all permutations in dimension 6 are 720


Table = dict[tuple[int, ...], fmpq]  # coefficients by the component and the variables


def signed_permutations(f: QuadraticSystem, sign: int, budget: Budget) -> tuple[list[fmpq_mat], bool]:
    """The S with f_2(S x) = sign S f_2(x), f_2 the quadratic terms (the linear ones if none).

    Where infinitely many are alike up to scales that do not change f_2, finitely many of them: the signed permutations
    for one scale of the variables, for the given one if it has any. Exact. Returns them, and whether these are all:
    there may be too many, or the `budget` is spent.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "4*y^2 + 1"])
    >>> [S.tolist() for S in signed_permutations(f, 1, Budget())[0]]
    [[[1, 0], [0, 1]], [[0, 4], [1/4, 0]]]
    """
    found: list[fmpq_mat] = []
    # A translation changes the linear terms where there are quadratic ones, and never those of highest degree.
    n, size = f.dim, 2 if f.degree <= 1 else 3
    forms = [f.B] if size == 2 else f.Q
    everywhere = (((i, j, k)[-size:], form[j, k]) for i, form in enumerate(forms) for j in range(n) for k in range(n))
    table: Table = {at: value for at, value in everywhere if value != 0}
    base, scales, numbers = _balanced(table, n)
    for permutation in _walk(numbers, n, sign, budget):
        if permutation is None or len(found) >= MAX_FOUND:
            return found, False
        S = fmpq_mat(n, n)
        for i, (place, s) in enumerate(permutation):
            powers = [a - b for a, b in zip(scales[i], scales[place], strict=True)]
            if all(e.q == 1 for e in powers):
                S[place, i] = math.prod((fmpq(b) ** int(e.p) for b, e in zip(base, powers, strict=True)), start=fmpq(s))
        if S.det() != 0:
            found.append(S)
    return found, True


def _balanced(table: Table, n: int) -> tuple[list[fmpz], list[list[fmpq]], dict[tuple[int, ...], int]]:
    """Coprime integers b, the exponents of the e_i in them, and the coefficients in y_i = e_i x_i.

    Of the coefficients the signs and numbers for the different absolute values are given, those being no rational
    numbers in general.
    """
    base = _coprime_base(part for c in table.values() for part in (abs(c.p), c.q))
    # log |c| + (row . log e) is that of the coefficient in y; e is the shortest solution of the normal equations.
    logarithms = [[fmpq(_exponent(c.p, b) - _exponent(c.q, b)) for b in base] for c in table.values()]
    rows = [[fmpq((at[0] == k) - at[1:].count(k)) for k in range(n)] for at in table]
    scales = [[fmpq(0)] * len(base) for _ in range(n)]
    if base:
        M, L = fmpq_mat(rows), fmpq_mat(logarithms)
        G = M.transpose() * M
        right = M.transpose() * L
        for j in range(len(base)):
            system = fmpq_mat([[*(G * G).tolist()[i], right[i, j]] for i in range(n)])
            special = next(v for v in reversed(nullspace(QQ, system)) if v[-1] != 0)
            shortest = G * fmpq_mat(n, 1, [w / special[-1] for w in special[:-1]])
            for i in range(n):
                scales[i][j] = shortest[i, 0]
        logarithms = (L + M * fmpq_mat(scales)).tolist()
    sizes: dict[tuple[fmpq, ...], int] = {}
    numbers = {}
    for (at, c), row in zip(table.items(), logarithms, strict=True):
        numbers[at] = sizes.setdefault(tuple(row), len(sizes) + 1) * (1 if c > 0 else -1)
    return base, scales, numbers


def _coprime_base(integers: Iterable[fmpz]) -> list[fmpz]:
    """Integers above 1, coprime in pairs and no perfect powers, of whose powers all the given ones are products."""
    waiting, base = list(integers), list[fmpz]()
    while waiting:
        one = waiting.pop()
        if one == 1:
            continue
        other = next((b for b in base if b.gcd(one) > 1), None)
        if other is not None:
            common = other.gcd(one)
            base.remove(other)
            waiting += [one // common, common, other // common]
        elif one.is_perfect_power():
            k = next(k for k in range(2, one.bit_length() + 1) if one.root(k) ** k == one)
            waiting.append(one.root(k))
        else:
            base.append(one)
    return sorted(base)


def _exponent(number: fmpz, b: fmpz) -> int:
    """How often b divides a number."""
    count = 0
    while number % b == 0:
        number, count = number // b, count + 1
    return count


def _walk(
    numbers: dict[tuple[int, ...], int], n: int, sign: int, budget: Budget
) -> Iterator[list[tuple[int, int]] | None]:
    """The signed permutations for a table of numbers, place and sign of each; None at the end of the budget."""
    size = len(next(iter(numbers), (0, 0)))
    # The equations that contain a variable and no later one, each of them once; first those that fail most.
    equations = [
        sorted(
            (at for at in product(range(last + 1), repeat=size) if max(at) == last and at[1] <= at[-1]),
            key=lambda at: at not in numbers,
        )
        for last in range(n)
    ]

    def fits(p: list[int], s: list[int]) -> bool:
        for checked, at in enumerate(equations[len(p) - 1], 1):
            if numbers.get(tuple(p[k] for k in at), 0) * math.prod(s[k] for k in at) != numbers.get(at, 0) * sign:
                count(2 + 1.5 * checked)
                return False
        count(2 + 1.5 * len(equations[len(p) - 1]))
        return True

    def further(p: list[int], s: list[int]) -> Iterator[list[tuple[int, int]] | None]:
        if budget.is_spent:
            yield None
        elif len(p) == n:
            yield list(zip(p, s, strict=True))
        else:
            choices = (([*p, place], [*s, t]) for place in range(n) if place not in p for t in (1, -1))
            for places, signs in choices:
                if fits(places, signs):
                    yield from further(places, signs)

    return further([], [])
