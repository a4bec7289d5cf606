"""The n-th iterate alone, without those before it: kahanmaps' doublings against stepping and against elliptic curves.

    python benchmarks/bench_iterate.py [--quick]

Over Q in integers, over GF(2^61 - 1), and in balls. Stepping is the best there is: kahanmaps' own in normal form over
Q, FLINT's nmod_mat.solve modulo p. PARI's ellmul finds n T on the elliptic curves behind the planes, which is the
heart of the task without the way from x and back. A multiplication is one of two integers as long as the result, one
in every plane.
"""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable
from itertools import islice
from typing import Any

from bench_catalogue import EPS, START
from flint import fmpz, nmod, nmod_mat
from work import Absent, Row, Work, require_equal, row, run_gp, say, table, timed, work

from kahanmaps import Orbit, load
from kahanmaps.algebra.fields import GF, QQ, RR
from kahanmaps.maps.normal_form.iterate import NthIterate
from kahanmaps.maps.normal_form.planes_point import NormalSteps, PlanesPoint

OVER_Q, MODULO, BALLS = "The n-th iterate over Q", "The n-th iterate over GF(2^61 - 1)", "The n-th iterate in balls"
CATALOGUE = "The n-th iterate on elliptic curves of the catalogue"
PRIME = 2**61 - 1
JUMP, STEPPING = "kahanmaps: doublings", "kahanmaps: stepping in normal form"
ALONE = "kahanmaps: doublings, x over one denominator"
ELLIPTIC = "PARI/GP: ellmul, n T on the elliptic curves alone"


def iterate(work: Work, n: int) -> tuple[float, PlanesPoint]:
    """The iterate by doublings, from the start in x to primitive triples."""
    # A new one each time, since tables of values are kept for the next iterate.
    seconds, value = timed(lambda: NthIterate(work.normal_form, work.eps, QQ).value(work.start, n))
    assert isinstance(value, PlanesPoint)
    return seconds, value


def step(work: Work, n: int) -> tuple[float, PlanesPoint]:
    """The same by way of all iterates before it."""

    def run() -> PlanesPoint:
        return next(islice(NormalSteps(work.normal_form, work.eps).points(work.start), n, None))

    return timed(run, most=3)


def multiplication(point: PlanesPoint) -> float:
    """The time of one multiplication of the size of the result, summed over the planes."""
    total = 0.0
    for U, V, W in point.triples:
        longest: fmpz = max(U, V, W, key=lambda entry: entry.bit_length())
        other = longest + 2  # a square would be faster
        total += timed(lambda longest=longest, other=other: longest * other, enough=0.2, most=50)[0]
    return total


def _curves(work: Work) -> list[str]:
    """The coefficients of y^2 + 6 x y + 16 gamma y = x^3 + 3 gamma x^2, on which T = (0, 0), for every plane."""
    blocks, _ = NormalSteps(work.normal_form, work.eps).blocks(work.start)
    gammas = [1 - block.delta for block in blocks]
    return [f"[6, 3*({gamma}), 16*({gamma}), 0, 0]" for gamma in gammas]


def elliptic_curve(work: Work, n: int) -> float:
    """The time of n T on the curve of every plane over Q by PARI. Raises Absent."""
    program = [
        f"C = [ellinit(a) | a <- [{','.join(_curves(work))}]]",
        f"gettime(); R = [ellmul(E, [0, 0], {n}) | E <- C]; seconds = gettime()",
        "[seconds]",
    ]
    return int(run_gp(program)[0]) / 1000


def elliptic_curve_modulo(work: Work, n: int, repeat: int = 2000) -> float:
    """The time of n T on the curve of every plane over GF(2^61 - 1) by PARI. Raises Absent."""
    program = [
        f"C = [ellinit(a * Mod(1, {PRIME})) | a <- [{','.join(_curves(work))}]]",
        f"gettime(); for(k = 1, {repeat}, R = [ellmul(E, [0, 0], {n}) | E <- C]); seconds = gettime()",
        "[seconds]",
    ]
    return int(run_gp(program)[0]) / 1000 / repeat


def iterate_modulo(work: Work, n: int) -> tuple[float, list[int]]:
    """The iterate over GF(2^61 - 1) by doublings, x to x."""
    iterate = NthIterate(work.normal_form, work.eps, GF(PRIME))
    seconds, value = timed(lambda: iterate.value(work.start, n), enough=0.3, most=100)
    return seconds, [int(entry) for entry in value]


def step_modulo(work: Work, n: int) -> tuple[float, list[int]]:
    """The same by n times nmod_mat.solve."""
    dim = work.system.dim

    def reduced(entry: Any) -> int:
        return int(nmod(int(entry.p), PRIME) / nmod(int(entry.q), PRIME))

    slopes = nmod_mat(
        dim * dim, dim, [reduced(-2 * work.eps * entry) for Q in work.system.Q for entry in Q.entries()], PRIME
    )
    start = nmod_mat(dim, 1, [reduced(entry) for entry in work.start], PRIME)
    identity = nmod_mat(dim, dim, [int(i == j) for i in range(dim) for j in range(dim)], PRIME)

    def run() -> nmod_mat:
        x = start
        for _ in range(n):
            x = (identity + nmod_mat(dim, dim, (slopes * x).entries(), PRIME)).solve(x)
        return x

    seconds, x = timed(run, most=3)
    return seconds, [int(entry) for entry in x.entries()]


def over_rationals(work: Work, steps: list[int]) -> list[Row]:
    """Iterates against stepping and against ellmul; the results have to be equal."""
    rows: list[Row] = []
    for n in steps:
        seconds, point = iterate(work, n)
        count = seconds / multiplication(point)
        digits = max(W.bit_length() for _, _, W in point.triples) * 0.30103
        what = f"m = {work.m}, n = {n}, {digits:,.0f} digits in the largest plane"
        rows.append(row(OVER_Q, JUMP, what, seconds, 1.0, f"{count:.1f} multiplications of the final size"))
        slow, stepped = step(work, n)
        require_equal(STEPPING, stepped, point)
        rows.append(row(OVER_Q, STEPPING, what, slow, slow / seconds))
        say(f"  {what}: stepping {slow / seconds:.3g}, {count:.1f} multiplications")
        try:
            curve = elliptic_curve(work, n)
        except Absent as reason:
            say(f"  {ELLIPTIC}: left out, {reason}")
        else:
            rows.append(row(OVER_Q, ELLIPTIC, what, curve, curve / seconds, "not carried back to x"))
            say(f"  {what}: ellmul {curve / seconds:.3g}")
    return rows


def on_elliptic_curves(n: int) -> list[Row]:
    """Iterates of systems without normal form, the point n alone and by way of all the others."""
    rows = []
    for name in ("euler_top", "nahm_tetrahedral", "qrt_asymmetric", "todd", "repaired_octahedral"):
        map_over = load(name).map.at(EPS)

        def last(is_requested: Callable[[int], bool] | None, map_over: Any = map_over) -> Any:
            *_, point = Orbit(map_over, START[: map_over.dim], n, max_digits=None, is_requested=is_requested)
            return point.value

        seconds, point = timed(lambda last=last: last({n}.__contains__))
        slow, stepped = timed(lambda last=last: last(None), most=3)
        require_equal(name, stepped, point)
        what = f"{name}, n = {n}, {point.bits * 0.30103:,.0f} digits"
        rows.append(row(CATALOGUE, "kahanmaps: this point alone", what, seconds, 1.0))
        rows.append(row(CATALOGUE, "kahanmaps: all points before it as well", what, slow, slow / seconds))
        say(f"  {what}: stepping {slow / seconds:.3g}")
    return rows


def modulo_a_prime(work: Work, short: int = 10**4) -> list[Row]:
    """Iterates of three lengths; stepping up to `short`, where the results have to be equal."""
    slow, stepped = step_modulo(work, short)
    seconds, result = iterate_modulo(work, short)
    require_equal("nmod_mat.solve", stepped, result)
    entry = slow / short
    what = f"m = {work.m}, n = {short:,}"
    rows = [
        row(MODULO, JUMP, what, seconds, 1.0, f"as long as {seconds / entry:.0f} single steps of nmod_mat.solve"),
        row(MODULO, "FLINT: stepping by nmod_mat.solve", what, slow, slow / seconds),
    ]
    for exponent in (6, 18, 30):
        n = 10**exponent
        seconds, _ = iterate_modulo(work, n)
        what = f"m = {work.m}, n = 10^{exponent}"
        rows.append(
            row(MODULO, JUMP, what, seconds, 1.0, f"as long as {seconds / entry:.0f} single steps of nmod_mat.solve")
        )
        try:
            curve = elliptic_curve_modulo(work, n)
        except Absent as reason:
            say(f"  {ELLIPTIC}: left out, {reason}")
        else:
            rows.append(row(MODULO, ELLIPTIC, what, curve, curve / seconds, "compiled; not carried back to x"))
        say(f"  {MODULO}, n = 10^{exponent}: {seconds * 1e3:.2f} ms")
    return rows


def in_balls(work: Work, n: int = 10**6, bits: int = 400, check: int = 80) -> list[Row]:
    """One long iterate in balls; a short one has to contain the exact iterate."""
    field = RR(bits)
    iterate = NthIterate(work.normal_form, work.eps, field)
    exact = NthIterate(work.normal_form, work.eps, QQ).value(work.start, check)
    assert isinstance(exact, PlanesPoint)
    short: Any = iterate.value(work.start, check)
    with field.working():
        good = all(ball.overlaps(field.convert(x)) for ball, x in zip(short, exact.rationals(), strict=True))
    require_equal("the iterate in balls", good, True)
    seconds, value = timed(lambda: iterate.value(work.start, n), enough=0.3, most=100)
    accuracy = min(ball.rel_accuracy_bits() for ball in value)
    say(f"  balls: {seconds * 1e3:.2f} ms, {accuracy} bits")
    note = f"{accuracy} of {bits} bits left"
    return [row(BALLS, JUMP, f"m = {work.m}, n = {n:,}, ball:{bits}", seconds, None, note)]


def whole_process(n: int = 2000) -> list[Row]:
    """A far iterate in a process of its own, from the start of Python to x over one denominator."""
    command = [sys.executable, __file__, "--alone", str(n)]
    answer = subprocess.run(command, capture_output=True, text=True, check=True)
    seconds, megabytes, digits = map(float, answer.stdout.split())
    say(f"  {OVER_Q}, n = {n}, whole process: {seconds:.3g} s, {megabytes:.0f} MB")
    note = f"{megabytes:.0f} MB"
    return [row(OVER_Q, ALONE, f"m = 3, n = {n}, {digits:,.0f} digits in x, whole process", seconds, None, note)]


def alone(n: int) -> None:
    """What `whole_process` starts: prints seconds, megabytes and digits."""
    value = NthIterate(work().normal_form, work().eps, QQ).value(work().start, n)
    assert isinstance(value, PlanesPoint)
    _, below = value.over_common_denominator()
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, below.bit_length() * 0.30103)


def measure(quick: bool = False) -> list[Row]:
    """All rows."""
    steps = [80, 160] if quick else [80, 160, 320, 640]
    far = [] if quick else whole_process()
    curves = on_elliptic_curves(steps[-1] // 2)
    return [*over_rationals(work(), steps), *far, *curves, *modulo_a_prime(work()), *in_balls(work())]


if __name__ == "__main__" and "--alone" in sys.argv:
    alone(int(sys.argv[-1]))
elif __name__ == "__main__":
    print(table(measure("--quick" in sys.argv[1:])))
