"""Search for linear parts S of symmetries that have exactly one nonzero entry in each row and each column.

Let (S x)_{p(i)} = s_i x_i with a permutation p. Each equation from f(S x) = sign S f(x), sign = 1 or -1, relates only
two coefficients of f. Take variables y_i = e_i x_i, e_i > 0, for which the logarithms of the absolute values of the
coefficients have the least sum of squares. S maps such scales e to scales with the same property, and these are unique
up to scalings that do not change f. So in the variables y each s_i is 1 or -1: S is a signed permutation. Logarithms of
coefficients in y are rational combinations of logarithms of coprime integers. An S that is not rational is dropped.

The search is a backtracking over images of the variables; it drops a partial permutation if one equation fails.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product
from operator import itemgetter

from flint import fmpq, fmpq_mat, fmpz

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.matrices import nullspace
from kahanmaps.algebra.work import Budget, count_work
from kahanmaps.systems.quadratic import QuadraticSystem

MAX_DIMENSION = 12
MAX_FOUND = 1_000  # in dimension 6 there are 720 permutations


def signed_permutations(f: QuadraticSystem, sign: int, budget: Budget) -> tuple[list[fmpq_mat], bool]:
    """Search for S with f_2(S x) = sign S f_2(x), where f_2 are the quadratic terms, or for affine f the linear terms.

    Exact. If scalings of the variables do not change f_2, there are infinitely many S. Then only the signed
    permutations of one choice of scaled variables are returned; those of the given variables are among them. Returns
    the matrices and whether the list is complete: the search stops after 1000 matrices or when the `budget` is spent.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "4*y^2 + 1"])
    >>> [S.tolist() for S in signed_permutations(f, 1, Budget())[0]]
    [[[1, 0], [0, 1]], [[0, 4], [1/4, 0]]]
    """
    # A translation never changes the terms of highest degree, but it changes the linear terms of a quadratic f.
    n, size = f.dim, 2 if f.degree <= 1 else 3
    forms = [f.B] if size == 2 else f.Q
    entries = (((i, j, k)[-size:], form[j, k]) for i, form in enumerate(forms) for j in range(n) for k in range(n))
    # A key holds the index of the component of f, then the indices of the variables of the monomial.
    coefficients = {index: value for index, value in entries if value != 0}
    # e_i is the product of the coprime integers of `base` with exponents `scales[i]`. In y_i = e_i x_i a coefficient c
    # gets the logarithm log |c| + row . log e, where row is a row of M; log e is the shortest least-squares solution.
    base = _coprime_base(integer for c in coefficients.values() for integer in (abs(c.p), c.q))
    logarithms = [[fmpq(_exponent(c.p, b) - _exponent(c.q, b)) for b in base] for c in coefficients.values()]
    scales = [[fmpq(0)] * len(base) for _ in range(n)]
    if base:
        M = fmpq_mat([[fmpq((index[0] == k) - index[1:].count(k)) for k in range(n)] for index in coefficients])
        L, G = fmpq_mat(logarithms), M.transpose() * M
        right_side = M.transpose() * L
        for j in range(len(base)):
            equations = fmpq_mat([[*(G * G).tolist()[i], right_side[i, j]] for i in range(n)])
            special_solution = next(v for v in reversed(nullspace(QQ, equations)) if v[-1] != 0)
            shortest_solution = G * fmpq_mat(n, 1, [w / special_solution[-1] for w in special_solution[:-1]])
            for i in range(n):
                scales[i][j] = shortest_solution[i, 0]
        logarithms = (L + M * fmpq_mat(scales)).tolist()
    # A coefficient in y, irrational in general, is represented by its sign times an index of its absolute value.
    indices: dict[tuple[fmpq, ...], int] = {}
    numbers = {
        key: indices.setdefault(tuple(row), len(indices) + 1) * (1 if c > 0 else -1)
        for (key, c), row in zip(coefficients.items(), logarithms, strict=True)
    }
    matrices: list[fmpq_mat] = []
    for permutation in _search_signed_permutations(numbers, n, sign, budget):
        if permutation is None or len(matrices) >= MAX_FOUND:
            return matrices, False
        S = fmpq_mat(n, n)
        for i, (image, s) in enumerate(permutation):
            powers = [a - b for a, b in zip(scales[i], scales[image], strict=True)]
            if all(e.q == 1 for e in powers):
                S[image, i] = math.prod((fmpq(b) ** int(e.p) for b, e in zip(base, powers, strict=True)), start=fmpq(s))
        if S.det() != 0:
            matrices.append(S)
    return matrices, True


def _coprime_base(integers: Iterable[fmpz]) -> list[fmpz]:
    """Return coprime integers > 1, none a perfect power, such that the given integers are products of their powers."""
    remaining_integers, base = list(integers), list[fmpz]()
    while remaining_integers:
        number = remaining_integers.pop()
        if number == 1:
            continue
        base_element = next((b for b in base if b.gcd(number) > 1), None)
        if base_element is not None:
            divisor = base_element.gcd(number)
            base.remove(base_element)
            remaining_integers += [number // divisor, divisor, base_element // divisor]
        elif number.is_perfect_power():
            k = next(k for k in range(2, number.bit_length() + 1) if number.root(k) ** k == number)
            remaining_integers.append(number.root(k))
        else:
            base.append(number)
    return sorted(base)


def _exponent(number: fmpz, b: fmpz) -> int:
    """Return the largest k such that b^k divides the number."""
    count = 0
    while number % b == 0:
        number, count = number // b, count + 1
    return count


def _search_signed_permutations(
    numbers: dict[tuple[int, ...], int], n: int, sign: int, budget: Budget
) -> Iterator[list[tuple[int, int]] | None]:
    """Yield lists of (image, sign) that map the table of `numbers` to `sign` times itself; None at the work limit."""
    size = len(next(iter(numbers), (0, 0)))
    # The image k of a variable with the sign -1 is encoded as ~k. The table has the coefficients for all signs.
    signed_numbers = {
        tuple(~k if s < 0 else k for k, s in zip(index, signs, strict=True)): number * math.prod(signs)
        for index, number in numbers.items()
        for signs in product((1, -1), repeat=size)
    }
    # For each variable the equations with it and no later variable, as a function that takes the entries of an index
    # out of a list, with the number that must result; those with a coefficient come first.
    equations = [
        [
            (itemgetter(*index), numbers.get(index, 0) * sign)
            for index in sorted(product(range(last + 1), repeat=size), key=lambda index: index not in numbers)
            if max(index) == last and index[1] <= index[-1]
        ]
        for last in range(n)
    ]

    def is_consistent(images: list[int]) -> bool:
        for checked_count, (entries_of, number) in enumerate(equations[len(images) - 1], 1):
            if signed_numbers.get(entries_of(images), 0) != number:
                count_work(2 + 1.5 * checked_count)
                return False
        count_work(2 + 1.5 * len(equations[len(images) - 1]))
        return True

    def extend(images: list[int]) -> Iterator[list[tuple[int, int]] | None]:
        if budget.is_spent:
            yield None
        elif len(images) == n:
            yield [(~k, -1) if k < 0 else (k, 1) for k in images]
        else:
            for k in range(n):
                if k not in images and ~k not in images:
                    for extension in ([*images, k], [*images, ~k]):
                        if is_consistent(extension):
                            yield from extend(extension)

    return extend([])
