"""Exact orbits, every iterate: kahanmaps against what one would write with other exact libraries.

    python benchmarks/bench_exact.py [--quick]

Peers get the best formulation that was found for them. The last iterate of every contestant has to be equal to that of
kahanmaps. Ratios are to kahanmaps with reduced rationals in x, which is what most peers deliver; what is less work
(one common denominator, normal coordinates alone) has a line of its own.
"""

from __future__ import annotations

import math
import os
import sys
from collections import deque
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import islice
from typing import Any

from flint import fmpq, fmpq_mat, fmpz, fmpz_mat
from work import Absent, Row, Work, gp_version, peer, require_equal, row, run_gp, say, table, timed, with_chi, work

from kahanmaps import QQ, KahanMap, Orbit, QuadraticSystem
from kahanmaps.maps.normal_form.planes_point import NormalSteps, PlanesPoint

Pairs = list[tuple[fmpz, fmpz]]  # the coordinates in lowest terms, denominators positive
Runner = Callable[[Work, int], tuple[float, Pairs]]  # time and last iterate
GROUP, GROWTH = "Exact orbits, every iterate", "How the time of a whole orbit grows"
FIELDS = "Exact orbits where chi does not split"
SPLIT = {3: "(t - 1)*(t + 2)*(t - 3)", 4: "(t - 1)*(t + 2)*(t - 3)*(t + 4)"}
UNSPLIT = ("t^3 - t - 1", "t^3 - 7*t + 3", "(t - 1)*(t^2 - 3)", "(t^2 - 2)*(t^2 + t + 1)")

# kahanmaps -----------------------------------------------------------------------------------------------------------


def _normal(work: Work, steps: int, deliver: Callable[[PlanesPoint], Any]) -> PlanesPoint:
    last = None
    for last in islice(NormalSteps(work.normal_form, work.eps).points(work.start), steps + 1):
        deliver(last)
    assert last is not None
    return last


def normal_reduced(work: Work, steps: int) -> tuple[float, Pairs]:
    """Normal form; every iterate in x, all coordinates in lowest terms."""
    seconds, last = timed(lambda: _normal(work, steps, PlanesPoint.lowest_terms))
    return seconds, last.lowest_terms()


def normal_common(work: Work, steps: int) -> tuple[float, Pairs]:
    """Normal form; every iterate in x over one common denominator, not reduced to the last bit."""
    seconds, last = timed(lambda: _normal(work, steps, PlanesPoint.over_common_denominator))
    above, below = last.over_common_denominator()
    return seconds, _pairs(fmpq(entry, below) for entry in above)


def normal_only(work: Work, steps: int) -> tuple[float, Pairs]:
    """Normal form; every iterate as primitive triples in the planes, x put together for the last alone."""
    seconds, last = timed(lambda: _normal(work, steps, lambda point: None))
    return seconds, last.lowest_terms()


def generic(work: Work, steps: int) -> tuple[float, Pairs]:
    """What kahanmaps does without the normal form: linear systems on integers over one denominator."""

    def run() -> Any:
        return deque(Orbit(KahanMap(work.system, work.eps), work.start, steps, max_digits=None), maxlen=1)[0]

    seconds, last = timed(run)
    return seconds, last.value.lowest_terms()


# FLINT through python-flint ------------------------------------------------------------------------------------------


def fmpq_solve(work: Work, steps: int) -> tuple[float, Pairs]:
    """Rationals entry by entry and fmpq_mat.solve."""
    n = work.system.dim

    def run() -> fmpq_mat:
        x = fmpq_mat(n, 1, list(work.start))
        for _ in range(steps):
            entries = [fmpq(int(i == j)) for i in range(n) for j in range(n)]
            for i in range(n):
                slopes = (work.system.Q[i] * x * (2 * work.eps)).entries()
                for j in range(n):
                    entries[i * n + j] -= slopes[j]
            x = fmpq_mat(n, n, entries).solve(x)
        return x

    seconds, x = timed(run)
    return seconds, _pairs(x.entries())


def integer_tensor(system: QuadraticSystem) -> tuple[fmpz, fmpz_mat]:
    """L and L f'' as an n^2 x n matrix, for the least L > 0 with which it is integral."""
    tensor, below = system.over(QQ).tensor.numer_denom()
    return below, tensor


def fmpz_solve(work: Work, steps: int) -> tuple[float, Pairs]:
    """Integers over one denominator and fmpz_mat.solve, content removed by gcds."""
    n, eps = work.system.dim, work.eps
    common, tensor = integer_tensor(work.system)

    def run() -> tuple[fmpz_mat, fmpz]:
        column, below = fmpq_mat(n, 1, list(work.start)).numer_denom()
        for _ in range(steps):
            matrix = fmpz_mat(n, n, (tensor * column * -eps.p).entries())
            for i in range(n):
                matrix[i, i] += eps.q * common * below
            solution: Any = matrix.solve(column * (eps.q * common))
            column, below = solution.numer_denom()
            content = below
            for entry in column.entries():
                content = content.gcd(entry)
            if content != 1:
                column, below = fmpz_mat(n, 1, [entry // content for entry in column.entries()]), below // content
        return column, below

    seconds, (column, below) = timed(run)
    return seconds, _pairs(fmpq(entry, below) for entry in column.entries())


def fmpz_rref(work: Work, steps: int) -> tuple[float, Pairs]:
    """Integers over one denominator and FLINT's fraction-free fmpz_mat.rref, content removed by gcds."""
    n, eps = work.system.dim, work.eps
    common, tensor = integer_tensor(work.system)

    def run() -> tuple[list[fmpz], fmpz]:
        column, below = fmpq_mat(n, 1, list(work.start)).numer_denom()
        above = column.entries()
        for _ in range(steps):
            entries = (tensor * fmpz_mat(n, 1, above) * -eps.p).entries()
            scale = eps.q * common
            rows = [[*entries[i * n : (i + 1) * n], scale * above[i]] for i in range(n)]
            for i in range(n):
                rows[i][i] += scale * below
            solved, below, _ = fmpz_mat(rows).rref()
            above = [solved[i, n] for i in range(n)]
            content = below
            for entry in above:
                content = content.gcd(entry)
            above, below = [entry // content for entry in above], below // content
        return above, below

    seconds, (above, below) = timed(run)
    return seconds, _pairs(fmpq(entry, below) for entry in above)


# Rationals in Python -------------------------------------------------------------------------------------------------


def _eliminate(rows: list[list[Any]]) -> list[Any]:
    """The solution of a square system with its right side as last column, by Gaussian elimination on field elements."""
    n = len(rows)
    for k in range(n):
        pivot = next(i for i in range(k, n) if rows[i][k] != 0)
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b if j > k else a for j, (a, b) in enumerate(zip(rows[i], rows[k], strict=True))]
    x = [rows[0][0]] * n
    for i in reversed(range(n)):
        total = rows[i][n]
        for j in range(i + 1, n):
            total = total - rows[i][j] * x[j]
        x[i] = total / rows[i][i]
    return x


def _by_elimination(work: Work, steps: int, number: Callable[[int, int], Any]) -> tuple[float, Pairs]:
    n = work.system.dim

    def convert(value: fmpq) -> Any:
        return number(int(value.p), int(value.q))

    slopes = [[[convert(2 * work.eps * entry) for entry in line] for line in Q.tolist()] for Q in work.system.Q]

    def run() -> list[Any]:
        x = [convert(entry) for entry in work.start]
        for _ in range(steps):
            rows = []
            for i in range(n):
                line = [int(i == j) - sum(a * b for a, b in zip(slopes[i][j], x, strict=True)) for j in range(n)]
                rows.append([*line, x[i]])
            x = _eliminate(rows)
        return x

    seconds, x = timed(run)
    return seconds, _pairs(fmpq(int(entry.numerator), int(entry.denominator)) for entry in x)


def gmpy2_elimination(work: Work, steps: int) -> tuple[float, Pairs]:
    """gmpy2.mpq and elimination written by hand."""
    return _by_elimination(work, steps, peer("gmpy2").mpq)


def fraction_elimination(work: Work, steps: int) -> tuple[float, Pairs]:
    """fractions.Fraction and elimination written by hand."""
    return _by_elimination(work, steps, Fraction)


def sympy_solve(work: Work, steps: int) -> tuple[float, Pairs]:
    """sympy's DomainMatrix over QQ, with the fastest ground types it finds."""
    os.environ.setdefault("SYMPY_GROUND_TYPES", "flint")
    sympy = peer("sympy")
    from sympy.polys.matrices import DomainMatrix

    n, QQ = work.system.dim, sympy.QQ

    def convert(value: fmpq) -> Any:
        return QQ(int(value.p), int(value.q))

    def matrix(entries: list[list[Any]], columns: int) -> Any:
        return DomainMatrix(entries, (n, columns), QQ).to_dfm_or_ddm()

    slopes = [
        matrix([[convert(2 * work.eps * entry) for entry in line] for line in Q.tolist()], n) for Q in work.system.Q
    ]

    def run() -> Any:
        x = matrix([[convert(entry)] for entry in work.start], 1)
        for _ in range(steps):
            entries = [[-line[0] for line in slopes[i].matmul(x).to_ddm()] for i in range(n)]
            for i in range(n):
                entries[i][i] += 1
            x = matrix(entries, n).lu_solve(x)
        return x

    seconds, x = timed(run)
    return seconds, _pairs(fmpq(int(line[0].numerator), int(line[0].denominator)) for line in x.to_ddm())


# PARI/GP -------------------------------------------------------------------------------------------------------------

# Steps from (X, W) to the solution of M Y = B, of integers over one denominator.
GP_STEPS = [
    "reduced(Y, d) = {my(g = gcd(content(Y), d)); [Y/g, d/g]}",
    "over(Y) = {my(d = denominator(Y)); [Y*d, d]}",
    "by_solve(M, B, W) = over(matsolve(M, B))",
    "by_image(M, B, W) = over(matinverseimage(M, B))",
    "by_kernel(M, B, W) = {my(Y = over(matker(matconcat([M, -B]))[, 1])[1], n = #B);"
    " Y /= content(Y); [Y[1..n], Y[n+1]]}",
    "by_inverse(M, B, W) = over(M^-1 * B)",
    "by_adjoint(M, B, W) = {my(A = matadjoint(M)); reduced(A*B, M[1, ]*A[, 1])}",
    "by_cramer(M, B, W) = reduced(vector(#B, j, my(N = M); N[, j] = B; matdet(N))~, matdet(M))",
    # Elimination by hand, two columns at a time, without fractions. What the minors of order 3 share with W goes by
    # one gcd, later what they share with the pivot before. (Bareiss with exact divisions and without gcds is 1.1
    # times as slow, matsolve 3 times.)
    "exact(a, b) = a \\ b",
    'iferr(install(diviiexact, "GG", exact), E, )',
    "by_elimination(M, B, W) = {my(n = #B, D = vector(n), Y = vectorv(n), shared = W, c, c1, c2, e, r, s);"
    " M = matconcat([M, B]);"
    " forstep(k = 1, n - 1, 2, D[k] = M[k, k]*M[k+1, k+1] - M[k, k+1]*M[k+1, k]; if(k == n - 1, break);"
    " for(i = k + 2, n, c1 = M[k, k+1]*M[i, k] - M[k, k]*M[i, k+1]; c2 = M[k+1, k]*M[i, k+1] - M[k+1, k+1]*M[i, k];"
    " for(j = k + 2, n + 1, M[i, j] = D[k]*M[i, j] + c1*M[k+1, j] + c2*M[k, j]));"
    " c = shared; for(i = k + 2, n, for(j = k + 2, n + 1, if(c > 1, c = gcd(c, M[i, j]))));"
    " if(c > 1, for(i = k + 2, n, for(j = k + 2, n + 1, M[i, j] = exact(M[i, j], c)))); shared = abs(D[k]));"
    " e = 1; forstep(k = n - 1, 1, -2,"
    " r = e*M[k, n+1] - sum(j = k + 2, n, M[k, j]*Y[j]); s = e*M[k+1, n+1] - sum(j = k + 2, n, M[k+1, j]*Y[j]);"
    " Y[k] = r*M[k+1, k+1] - s*M[k, k+1]; Y[k+1] = M[k, k]*s - M[k+1, k]*r;"
    " if(k == n - 1, e = D[k]; c = gcd(gcd(e, Y[k]), Y[k+1]); e /= c; Y[k] /= c; Y[k+1] /= c,"
    " Y[k] /= D[k]; Y[k+1] /= D[k]; c = denominator([Y[k], Y[k+1]]); if(c > 1, Y *= c; e *= c))); reduced(Y, e)}",
]

# Steps x -> (I - eps f'(x))^(-1) x; T[k] are the matrices with f'(x) = (sum of x_k T[k]) / L, eps = p/q. Over one
# denominator W the system is M y = q L X with M = q L W I - p sum X_k T[k].
_GP = [
    *GP_STEPS,
    "slopes(X) = sum(k = 1, n, X[k] * T[k])",
    "whole(X, W) = q*L*W*matid(n) - p*slopes(X)",
    "orbit(step, N) = {my(d = denominator(start), r = [start*d, d]);"
    " for(k = 1, N, r = step(whole(r[1], r[2]), q*L*r[1], r[2])); r[1]/r[2]}",
    "rational(N) = {my(x = start); for(k = 1, N, x = matsolve(matid(n) - p/q/L*slopes(x), x)); x}",
]


def _by_gp(work: Work, steps: int, orbit: str) -> tuple[float, Pairs]:
    n = work.system.dim
    common, tensor = integer_tensor(work.system)
    slopes = tensor.tolist()
    matrices = [
        "[" + ";".join(",".join(str(slopes[i * n + j][k]) for j in range(n)) for i in range(n)) + "]" for k in range(n)
    ]
    return gp_orbit(
        [
            f"n = {n}; p = {work.eps.p}; q = {work.eps.q}; L = {common}",
            f"T = [{','.join(matrices)}]",
            f"start = [{','.join(str(entry) for entry in work.start)}]~",
            *_GP,
        ],
        orbit.format(steps),
    )


def gp_orbit(program: list[str], orbit: str, enough: float = 3.0) -> tuple[float, Pairs]:
    """The best time of some runs, until so many seconds are spent, and the point that an expression gives."""
    best, spent, repeat = float("inf"), 0.0, 1
    for _ in range(7):
        milliseconds, *numbers = run_gp(
            [
                *program,
                f"gettime(); for(k = 1, {repeat}, last = {orbit}); seconds = gettime()",
                "concat([seconds], concat([[numerator(x), denominator(x)] | x <- Vec(last)]))",
            ]
        )
        seconds = int(milliseconds) / 1000
        spent += seconds
        if seconds < 0.03:  # GP counts in milliseconds
            repeat *= 30
            continue
        best = min(best, seconds / repeat)
        if spent >= enough:
            break
    integers = [fmpz(entry) for entry in numbers]
    return best, list(zip(integers[::2], integers[1::2], strict=True))


def gp_rational(work: Work, steps: int) -> tuple[float, Pairs]:
    """PARI/GP, matsolve on rationals."""
    return _by_gp(work, steps, "rational({})")


def gp_solve(work: Work, steps: int) -> tuple[float, Pairs]:
    """PARI/GP, matsolve on integers over one denominator."""
    return _by_gp(work, steps, "orbit(by_solve, {})")


def gp_adjoint(work: Work, steps: int) -> tuple[float, Pairs]:
    """PARI/GP, matadjoint on integers over one denominator, content removed by gcds."""
    return _by_gp(work, steps, "orbit(by_adjoint, {})")


def gp_elimination(work: Work, steps: int) -> tuple[float, Pairs]:
    """PARI/GP, fraction-free elimination on integers written by hand."""
    return _by_gp(work, steps, "orbit(by_elimination, {})")


def gp_others(work: Work, steps: int) -> list[tuple[str, float, Pairs]]:
    """PARI/GP in the formulations that are slower: for the choice of those above."""
    steps_of = ("by_image", "by_kernel", "by_inverse", "by_cramer")
    return [(step, *_by_gp(work, steps, f"orbit({step}, {{}})")) for step in steps_of]


# The tables ----------------------------------------------------------------------------------------------------------


def _pairs(values: Any) -> Pairs:
    return [(value.p, value.q) for value in values]


# Name, function; the first is what ratios are to.
KAHANMAPS: list[tuple[str, Runner]] = [
    ("kahanmaps, normal form: reduced rationals in x", normal_reduced),
    ("kahanmaps, normal form: x over one common denominator", normal_common),
    ("kahanmaps, normal form: normal coordinates alone", normal_only),
    ("kahanmaps without normal form", generic),
]
PEERS: list[tuple[str, Runner]] = [
    ("FLINT: fmpz_mat.rref (fraction-free), integers over one denominator", fmpz_rref),
    ("FLINT: fmpz_mat.solve, integers over one denominator", fmpz_solve),
    ("FLINT: fmpq_mat.solve, rationals", fmpq_solve),
    ("PARI/GP: fraction-free elimination by hand, integers", gp_elimination),
    ("PARI/GP: matadjoint, integers", gp_adjoint),
    ("PARI/GP: matsolve, integers", gp_solve),
    ("PARI/GP: matsolve, rationals", gp_rational),
    ("sympy: DomainMatrix over QQ, lu_solve", sympy_solve),
    ("gmpy2.mpq: elimination by hand", gmpy2_elimination),
]
FRACTION: tuple[str, Runner] = ("fractions.Fraction: elimination by hand", fraction_elimination)


def contest(work: Work, steps: int, contestants: Sequence[tuple[str, Runner]]) -> list[Row]:
    """The contestants on one work, compared with the first of them."""
    base_name, base = contestants[0]
    best, expected = base(work, steps)
    digits = max(len(entry.str()) for pair in expected for entry in pair)
    what = f"m = {work.m}, N = {steps}, last iterate of up to {digits:,} digits in numerator and denominator"
    times = {base_name: best}
    for name, run in contestants[1:]:
        try:
            times[name], last = run(work, steps)
        except Absent as reason:
            say(f"  {name}: left out, {reason}")
            continue
        require_equal(name, last, expected)
        best = min(best, base(work, steps)[0])  # once more, lest a busy moment in the beginning spoil all ratios
        say(f"  {what}: {name}: {times[name] / best:.3g}")
    times[base_name] = best
    return [row(GROUP, name, what, seconds, seconds / best) for name, seconds in times.items()]


def over_fields(quick: bool = False) -> list[Row]:
    """Members with chi of every kind, relative to one of the same dimension whose chi splits, drawn in the same way."""
    rows, steps = [], 40 if quick else 80
    for chi in UNSPLIT:
        field = with_chi(chi)
        base = with_chi(SPLIT[field.m])
        split, complete = normal_reduced(base, steps)
        seconds, last = normal_reduced(field, steps)
        slow, expected = generic(field, steps)
        require_equal(chi, last, expected)
        split = min(split, normal_reduced(base, steps)[0])
        digits, others = (max(len(entry.str()) for pair in item for entry in pair) for item in (last, complete))
        what = f"m = {base.m}, N = {steps}, chi = {chi}, "
        what += f"last iterate of up to {digits:,} digits in numerator and denominator"
        rows.append(
            row(
                FIELDS,
                "kahanmaps, chi that splits: reduced rationals in x",
                what,
                split,
                1.0,
                f"up to {others:,} digits",
            )
        )
        rows.append(
            row(FIELDS, "kahanmaps, this chi, normal form: reduced rationals in x", what, seconds, seconds / split)
        )
        rows.append(row(FIELDS, "kahanmaps, this chi, without normal form", what, slow, slow / split))
        say(f"  {what}: {seconds / split:.3g}, without normal form {slow / split:.3g}")
    return rows


def growth(steps: Sequence[int] = (80, 320)) -> list[Row]:
    """The exponents of N in the time for N iterates."""
    first, last = steps
    rows = []
    for name, run in (KAHANMAPS[2], KAHANMAPS[0]):
        early, _ = run(work(), first)
        late, _ = run(work(), last)
        exponent = math.log(late / early) / math.log(last / first)
        rows.append(row(GROWTH, name, f"m = 3, N = {first} to {last}", late, exponent, "exponent of N, not a ratio"))
        say(f"  {name}: N^{exponent:.2f}")
    return rows


def measure(quick: bool = False) -> list[Row]:
    """All rows."""
    try:
        say(f"  PARI/GP is {gp_version()}")
    except Absent as reason:
        say(f"  PARI/GP: left out, {reason}")
    if quick:
        return [
            *contest(work(), 20, [KAHANMAPS[0], FRACTION]),
            *contest(work(), 40, [*KAHANMAPS, *PEERS]),
            *growth(steps=(40, 160)),
        ]
    return [
        *contest(work(), 80, [*KAHANMAPS, *PEERS]),
        *contest(work(), 40, [*KAHANMAPS, *PEERS, FRACTION]),
        *contest(work(4), 40, [*KAHANMAPS, *PEERS]),
        *growth(),
    ]


if __name__ == "__main__":
    print(table(measure("--quick" in sys.argv[1:])))
