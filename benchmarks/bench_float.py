"""Float orbits: the kernels of kahanmaps against C, and against integrators of the flow, by ratios of one run.

`python benchmarks/bench_float.py` prints a table; `measure()` gives its rows. The work is a family member with m = 3
(dimension 6): one orbit to its end, one with every point delivered, and an ensemble of 100,000 initial points, by the
normal form and by generic elimination; and Euler's top in dimension 3, for which no normal form is used. `kernels.c` is
compiled here with gcc -O3 -march=native, and gives the limit: the same steps without a test for what may go wrong.
Results are compared before times are. Contestants take turns, so that a busy machine slows down all of them, and the
best time of each counts. The integrators solve another problem, the flow: they are what one would use instead.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from flint import fmpq

from kahanmaps import System, lyapunov, normal_form, random_member_with_eigenvalues
from kahanmaps.maps.floats.float_orbit import FloatEnsemble, FloatOrbit
from kahanmaps.maps.floats.planar_blocks import planar_blocks
from kahanmaps.maps.kernels import has_numba

EPS = fmpq(1, 10)
LANES = 100_000
REPEATS = 5
ONE, MANY, GENERIC = "one orbit, m = 3", "100,000 initial points, m = 3", "100,000 initial points, d = 6, elimination"
TOP_ONE, TOP_MANY = "one orbit, 10,000,000 steps, Euler top", "1,000,000 starts, 100 steps, Euler top"
EXPONENTS = "Lyapunov spectrum, 200,000 steps, Euler top"
POINTS, GENERIC_ONE, FLOW = "one orbit, every point in x", "one orbit, d = 6, elimination", "one orbit against the flow"


class Table:
    """Rows of contestants, each with a ratio to the first one of its work."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._waiting: list[tuple[dict[str, Any], float, Callable[[], float]]] = []

    def add(self, contestant: str, work: str, steps: float, run: Callable[[], float], note: str = "") -> None:
        """A contestant: `run` returns the seconds of one repetition of `steps`, lanes times steps."""
        row = {"contestant": contestant, "work": work, "seconds": float("inf"), "ratio": None, "note": note}
        self.rows.append(row)
        self._waiting.append((row, steps, run))

    def run(self) -> None:
        """Time those who wait in turns, so that a busy machine slows down all of them."""
        for _ in range(REPEATS):
            for row, steps, run in self._waiting:
                row["seconds"] = min(row["seconds"], run() / steps)
        for row, _, _ in self._waiting:
            first = next(other for other in self.rows if other["work"] == row["work"] and other["seconds"])
            row["ratio"] = first["seconds"] / row["seconds"]
        self._waiting.clear()

    def skip(self, contestant: str, work: str, note: str) -> None:
        """A contestant that is not there."""
        self.rows.append({"contestant": contestant, "work": work, "seconds": None, "ratio": None, "note": note})


def compiled(folder: str) -> Any:
    """The C kernels, or None without a compiler."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return None
    library = Path(folder) / "kernels.so"
    source = Path(__file__).with_name("kernels.c")
    subprocess.run([compiler, "-O3", "-march=native", "-shared", "-fPIC", source, "-o", library], check=True)
    return ctypes.CDLL(str(library))


def measure() -> list[dict[str, Any]]:
    """All rows: contestant, work, seconds a step (and start), ratio of speeds to the first row of the work, note."""
    member = random_member_with_eigenvalues([1, -2, 3], seed=7)
    system, form = member.chosen.system, normal_form(member)
    blocks = planar_blocks(form, EPS)
    # Starts on bounded stretches: near 0 every orbit is regular for a while, so that no contestant meets anything odd.
    starts = np.random.default_rng(7).uniform(-0.005, 0.005, (LANES, 6))
    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(folder)
        _one_orbit(table, library, system, form, blocks)
        table.run()
        _ensembles(table, library, system, form, blocks, starts)
        table.run()
        _generic(table, library, system, starts)
        table.run()
        _top(table, library)
        table.run()
    _exponents(table)
    table.run()
    _every_point(table, system, form)
    table.run()
    _flow(table, system, form)
    table.run()
    return table.rows


def _pointer(array: Any) -> Any:
    return array.ctypes.data_as(ctypes.c_void_p)


def _planar_coefficients(blocks: Any) -> Any:
    return np.ascontiguousarray(blocks.coefficients.real)


def _timed(function: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def _one_orbit(table: Table, library: Any, system: Any, form: Any, blocks: Any) -> None:
    steps = 3_000_000
    start = [fmpq(1, 100 + k) for k in range(6)]
    k = _planar_coefficients(blocks)
    z0 = blocks.to_state @ np.array([float(entry.p) / float(entry.q) for entry in start])
    ensemble = FloatEnsemble(system, EPS, [start], form=form, kernel="numpy")
    ensemble.advance(10)
    expected = ensemble.x[0]

    def by_c(name: str) -> Callable[[], float]:
        def run() -> float:
            z = z0.copy()
            return _timed(lambda: getattr(library, name)(_pointer(z), _pointer(k), ctypes.c_size_t(steps)))

        z = z0.copy()
        getattr(library, name)(_pointer(z), _pointer(k), ctypes.c_size_t(10))
        _agree(blocks.to_x @ z, expected, name)
        return run

    def by_us(kernel: str, form: Any, count: int) -> Callable[[], float]:
        def run() -> float:
            item = FloatEnsemble(system, EPS, [start], form=form, kernel=kernel, threads=1)
            item.advance(1)
            return _timed(lambda: item.advance(count))

        item = FloatEnsemble(system, EPS, [start], form=form, kernel=kernel, threads=1)
        item.advance(10)
        _agree(item.x[0], expected, kernel)
        return run

    if library is None:
        table.skip("C", ONE, "no gcc")
    else:
        table.add("C, expanded", ONE, steps, by_c("expanded_one"), "the limit")
        table.add("C, Cramer", ONE, steps, by_c("planar_one"), "the limit")
    if has_numba():
        table.add("numba normal form", ONE, steps, by_us("numba", form, steps))
        table.add("numba generic", ONE, steps / 10, by_us("numba", None, steps // 10))
    else:
        table.skip("numba", ONE, "numba is not installed")
    table.add("Python floats, normal form", ONE, 30_000, by_us("numpy", form, 30_000))
    table.add("Python floats, generic", ONE, 30_000, by_us("numpy", None, 3_000))


def _every_point(table: Table, system: Any, form: Any) -> None:
    start = [fmpq(1, 100 + k) for k in range(6)]

    def run(kernel: str, count: int) -> Callable[[], float]:
        def walk() -> None:
            for _ in FloatOrbit(system, EPS, start, count, form=form, kernel=kernel).portions():
                pass

        return lambda: _timed(walk)

    if has_numba():
        table.add("numba normal form", POINTS, 3_000_000, run("numba", 3_000_000))
    table.add("Python floats, normal form", POINTS, 30_000, run("numpy", 30_000))


def _ensembles(table: Table, library: Any, system: Any, form: Any, blocks: Any, starts: Any) -> None:
    steps = 4000
    k = _planar_coefficients(blocks)
    z0 = np.ascontiguousarray(blocks.to_state @ starts.T)
    size = ctypes.c_size_t
    checked = FloatEnsemble(system, EPS, starts, form=form, kernel="numpy")
    checked.advance(20)
    expected = checked.x

    def by_c(name: str, numbers: Any) -> Callable[[], float]:
        def take(z: Any, count: int) -> None:
            getattr(library, name)(_pointer(z), size(3), size(LANES), _pointer(numbers), size(count))

        z = z0.copy()
        take(z, 20)
        _agree((blocks.to_x @ z).T, expected, name)

        def run() -> float:
            z = z0.copy()
            return _timed(lambda: take(z, steps))

        return run

    def by_us(kernel: str, threads: int, count: int) -> Callable[[], float]:
        def run() -> float:
            ensemble = FloatEnsemble(system, EPS, starts, form=form, kernel=kernel, threads=threads)
            ensemble.advance(20)
            _agree(ensemble.x, expected, kernel)
            return _timed(lambda: ensemble.advance(count))

        return run

    if library is None:
        table.skip("C SIMD", MANY, "no gcc")
    else:
        table.add("C SIMD, any cubic", MANY, steps * LANES, by_c("planar_many", k), "the limit")
        table.add(
            "C SIMD, canonical cubics",
            MANY,
            steps * LANES,
            by_c("canonical_many", 1 * (blocks.coefficients.real[:, 0] == 1)),
            "the same formula",
        )
    if has_numba():
        table.add("numba, 1 thread", MANY, steps * LANES, by_us("numba", 1, steps))
        table.add("numba, 2 threads", MANY, steps * LANES, by_us("numba", 2, steps))
    else:
        table.skip("numba", MANY, "numba is not installed")
    table.add("numpy", MANY, 50 * LANES, by_us("numpy", 1, 50))


def _generic(table: Table, library: Any, system: Any, starts: Any) -> None:
    steps = 30
    size = ctypes.c_size_t
    tensor = np.array(
        [
            [[float((2 * entry * EPS).p) / float((2 * entry * EPS).q) for entry in row] for row in Q.tolist()]
            for Q in system.Q
        ]
    )
    checked = FloatEnsemble(system, EPS, starts, kernel="numpy")
    checked.advance(2)
    expected = checked.x

    def by_c() -> float:
        z = np.ascontiguousarray(starts.T)
        library.generic_many(_pointer(z), size(LANES), _pointer(tensor), size(2))
        _agree(z.T, expected, "C generic")
        return _timed(lambda: library.generic_many(_pointer(z), size(LANES), _pointer(tensor), size(steps)))

    def by_us(kernel: str, threads: int, count: int) -> Callable[[], float]:
        def run() -> float:
            ensemble = FloatEnsemble(system, EPS, starts, kernel=kernel, threads=threads)
            ensemble.advance(2)
            _agree(ensemble.x, expected, kernel)
            return _timed(lambda: ensemble.advance(count))

        return run

    if library is None:
        table.skip("C SIMD", GENERIC, "no gcc")
    else:
        table.add("C SIMD, no pivoting", GENERIC, steps * LANES, by_c, "the limit")
    if has_numba():
        table.add("numba, 1 thread", GENERIC, steps * LANES, by_us("numba", 1, steps))
        table.add("numba, 2 threads", GENERIC, steps * LANES, by_us("numba", 2, steps))
    table.add("numpy", GENERIC, 3 * LANES, by_us("numpy", 1, 3))


TOP = {"x": "y*z", "y": "-2*z*x", "z": "x*y"}


def _top(table: Table, library: Any) -> None:
    """A system of dimension 3 that is treated like any other."""
    count, steps, long, size = 1_000_000, 100, 10_000_000, ctypes.c_size_t
    top, e = System(TOP), ctypes.c_double(0.1)
    starts = np.random.default_rng(7).uniform(-1, 1, (count, 3))
    checked = FloatEnsemble(top, EPS, starts, kernel="numpy")
    checked.advance(10)
    expected = checked.x

    def many_by_c() -> float:
        v = np.ascontiguousarray(starts.T)
        library.top_many(_pointer(v), size(count), e, size(10))
        _agree(v.T, expected, "C, Euler top")
        return _timed(lambda: library.top_many(_pointer(v), size(count), e, size(steps)))

    def one_by_c() -> float:
        v = starts[0].copy()
        return _timed(lambda: library.top_one(_pointer(v), e, size(long)))

    def by_us(starts: Any, kernel: str, steps: int) -> Callable[[], float]:
        def run() -> float:
            ensemble = FloatEnsemble(top, EPS, starts, kernel=kernel, threads=1)
            ensemble.advance(10)
            _agree(ensemble.x, expected[: len(starts)], kernel)
            return _timed(lambda: ensemble.advance(steps))

        return run

    def by_numpy() -> float:
        x, y, z = _top_by_numpy(starts, 10)
        _agree(np.stack([x, y, z], axis=1), expected, "numpy by hand")
        return _timed(lambda: _top_by_numpy(starts, steps // 10))

    if library is None:
        table.skip("C", TOP_ONE, "no gcc")
    else:
        table.add("C", TOP_ONE, long, one_by_c, "the limit")
        table.add("C SIMD", TOP_MANY, count * steps, many_by_c, "the limit")
    if has_numba():
        table.add("numba", TOP_ONE, long, by_us(starts[:1], "numba", long))
        table.add("numba, 1 thread", TOP_MANY, count * steps, by_us(starts, "numba", steps))
    table.add("numpy", TOP_MANY, count * steps // 10, by_us(starts, "numpy", steps // 10))
    table.add("numpy by hand, 4096 starts at a time", TOP_MANY, count * steps // 10, by_numpy, "without any test")


def _top_by_numpy(starts: Any, steps: int) -> list[Any]:
    images = []
    for at in range(0, len(starts), 4096):
        x, y, z = starts[at : at + 4096].T.copy()
        for _ in range(steps):
            X, Y, Z = 0.1 * x, 0.1 * y, 0.1 * z
            a, p, q, r = 1 + 2 * X * X, Z + X * Y, Y - 2 * X * Z, X + Y * Z
            w = 1 / (a + 2 * Z * p - Y * q)
            x, y, z = (
                (a * x + p * y + q * z) * w,
                ((1 - Y * Y) * y - 2 * p * x - 2 * r * z) * w,
                (q * x + r * y + (1 + 2 * Z * Z) * z) * w,
            )
        images.append((x, y, z))
    return [np.concatenate(parts) for parts in zip(*images, strict=True)]


def _exponents(table: Table) -> None:
    start, steps = np.array([1.0, 0.5, 0.25]), 200_000

    def by_numpy() -> None:
        x, frame, logs, one = start, np.eye(3), np.zeros(3), np.eye(3)
        for _ in range(steps // 20):
            before = 0.1 * np.array([[0, x[2], x[1]], [-2 * x[2], 0, -2 * x[0]], [x[1], x[0], 0]])
            x = np.linalg.solve(one - before, x)
            after = 0.1 * np.array([[0, x[2], x[1]], [-2 * x[2], 0, -2 * x[0]], [x[1], x[0], 0]])
            frame, R = np.linalg.qr(np.linalg.solve(one - before, (one + after) @ frame))
            logs += np.log(np.abs(np.diag(R)))

    table.add("numpy by hand", EXPONENTS, steps // 20, lambda: _timed(by_numpy))
    table.add("kahanmaps", EXPONENTS, steps, lambda: _timed(lambda: lyapunov(System(TOP), start, eps=EPS, steps=steps)))


def _flow(table: Table, system: Any, form: Any) -> None:
    """200 points of the grid of time step 1/5, of the map and of the flow."""
    start, points = [fmpq(1, 10_000 + k) for k in range(6)], 200
    x0 = np.array([float(entry.p) / float(entry.q) for entry in start])
    grid = np.arange(points + 1) * 0.2
    Q = np.array([[[float(entry.p) / float(entry.q) for entry in row] for row in form_.tolist()] for form_ in system.Q])

    def mapped() -> float:
        orbit = FloatOrbit(system, EPS, start, 500 * points, form=form, kernel="numba" if has_numba() else "numpy")
        return _timed(lambda: [None for _ in orbit.portions()])

    table.add("the map, normal form", FLOW, 500 * points, mapped)
    try:
        from scipy.integrate import solve_ivp
    except ImportError:
        table.skip("scipy DOP853 at 1e-10", FLOW, "scipy is not installed")
    else:

        def field(_: float, x: Any) -> Any:
            return Q @ x @ x

        def dop853() -> None:
            result = solve_ivp(field, (0, grid[-1]), x0, "DOP853", t_eval=grid, rtol=1e-10, atol=1e-10)
            if not result.success:
                raise SystemExit("DOP853 did not reach the end")

        table.add("scipy DOP853 at 1e-10", FLOW, points, lambda: _timed(dop853), "the flow, on the grid")
    try:
        import heyoka
    except ImportError:
        table.skip("heyoka", FLOW, "heyoka is not installed")
        return
    names = heyoka.make_vars(*(f"x{k}" for k in range(6)))
    sides = [
        sum(float(Q[i, j, k]) * names[j] * names[k] for j in range(6) for k in range(6) if Q[i, j, k]) for i in range(6)
    ]
    integrator = heyoka.taylor_adaptive(list(zip(names, sides, strict=True)), list(x0), tol=1e-10)

    def taylor() -> float:
        integrator.time = 0.0
        integrator.state[:] = x0
        return _timed(lambda: integrator.propagate_grid(grid))

    table.add("heyoka at 1e-10", FLOW, points, taylor, "the flow, on the grid, compiled before")


def _agree(found: Any, expected: Any, who: str) -> None:
    """Some steps of regular orbits near 0: what remains of 16 digits after changes of coordinates of condition 1e3."""
    error = np.abs(found - expected).max() / np.abs(expected).max()
    if not error < 1e-9:
        raise SystemExit(f"{who} does not agree with the others: relative distance {error:.1e}")


def main() -> None:
    """Print the table."""
    rows = measure()
    for work in dict.fromkeys(row["work"] for row in rows):
        print(f"{work}")
        for row in rows:
            if row["work"] == work:
                speed = f"{1e-6 / row['seconds']:10.3f} M/s {row['ratio']:8.3f}" if row["seconds"] else " " * 23
                print(f"  {row['contestant']:<28}{speed}  {row['note']}")


if __name__ == "__main__":
    main()
