"""What several test files share: the table of fields, strategies for rational systems and points, named systems.

Strategies draw plain data, so that hypothesis can shrink a failure to something one can compute by hand.
"""

import ast
import random
from collections.abc import Callable, Collection, Iterable, Sequence
from fractions import Fraction
from functools import cache, wraps
from inspect import signature
from pathlib import Path
from typing import Any

import pytest
from flint import arb, fmpq, fmpq_mat, fmpz
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from kahanmaps.algebra.fields import GF, QQ, RR, Field
from kahanmaps.algebra.polynomials import ring
from kahanmaps.documents.catalog import titles
from kahanmaps.errors import InputError, SingularStep
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

SMALLEST_LARGE_PRIME = 2**63 + 29

EXACT_FIELDS: list[Field] = [QQ, GF(2), GF(7), GF(2**61 - 1), GF(SMALLEST_LARGE_PRIME)]
FIELDS: list[Field] = [*EXACT_FIELDS, RR(128)]

parsed = cache(ast.parse)  # several tests read all files of the project

# Of what is in the catalogue, by name, without reading it all.
DIMENSION = {name: dim for name, (dim, _) in titles().items()}

# All but surrogates. This is the default of hypothesis, which takes seconds to make it in a fresh folder.
CHARACTERS = st.characters(exclude_categories=["Cs"])

# For tests that run once a field: fewer examples each, and GF(2), where most matrices are singular, is tolerated.
some = settings(suppress_health_check=[HealthCheck.filter_too_much])

# For cases beside others of the same test that are quick, or that see the same.
THOROUGH = (pytest.mark.slow, pytest.mark.thorough)

over_all_fields = pytest.mark.parametrize("field", FIELDS, ids=repr)
over_exact_fields = pytest.mark.parametrize("field", EXACT_FIELDS, ids=repr)

# x = (q1, q2, p1, p2); integrable as a flow for c = -6 and two other values, as a Kahan map never.
HENON_HEILES = QuadraticSystem.from_text(
    ["q1", "q2", "p1", "p2"], ["p1", "p2", "-q1 - 2*q1*q2", "-q2 - q1^2 + c*q2^2"], {"c": 1}
)
LOTKA_VOLTERRA = QuadraticSystem.from_text(["x", "y"], ["x*(2 - y)", "y*(3*x - 1)"])
LORENZ = QuadraticSystem.from_text(["x", "y", "z"], ["10*(y - x)", "x*(28 - z) - y", "x*y - 8/3*z"])
EULER_TOP = QuadraticSystem.from_text(["x1", "x2", "x3"], ["x2*x3", "-2*x3*x1", "x1*x2"])
FORCED_PLANE = QuadraticSystem.from_text(["x", "y"], ["x*y - 1", "y^2 + 2*x + 1/5"])
NAMED_SYSTEMS = {
    "henon_heiles": HENON_HEILES,
    "lotka_volterra": LOTKA_VOLTERRA,
    "lorenz": LORENZ,
    "euler_top": EULER_TOP,
    "forced_plane": FORCED_PLANE,
}

over_named_systems = pytest.mark.parametrize("system", NAMED_SYSTEMS.values(), ids=NAMED_SYSTEMS.keys())


def rationals(height: int = 20) -> st.SearchStrategy[fmpq]:
    """Rational numbers with numerator and denominator up to `height`."""
    return st.builds(fmpq, st.integers(-height, height), st.integers(1, height))


def points(dim: int, entries: st.SearchStrategy[Any] | None = None) -> st.SearchStrategy[tuple[Any, ...]]:
    """Points of `dim` coordinates, rational unless `entries` says otherwise."""
    return st.tuples(*[rationals() if entries is None else entries] * dim)


def from_forms(variables: Sequence[str], forms: Sequence[fmpq_mat], B: fmpq_mat, c: Sequence[fmpq]) -> QuadraticSystem:
    """The system x' = Q(x, x) + B x + c with the matrices `forms` of Q."""
    x = ring(variables).gens()
    n = len(x)
    squares = [sum((Q[j, k] * x[j] * x[k] for j in range(n) for k in range(n)), 0 * x[0]) for Q in forms]
    linear = [sum((B[i, j] * x[j] for j in range(n)), 0 * x[0]) for i in range(n)]
    return QuadraticSystem([a + b + e for a, b, e in zip(squares, linear, c, strict=True)])


@st.composite
def systems(
    draw: Any, dims: Sequence[int] = (1, 2, 3), entries: st.SearchStrategy[Any] | None = None, homogeneous: bool = False
) -> QuadraticSystem:
    """Quadratic systems with every coefficient drawn from `entries` (small rationals unless given)."""
    entry = rationals(6) if entries is None else entries
    n = draw(st.sampled_from(dims))
    forms = []
    for _ in range(n):
        form = fmpq_mat(n, n)
        for j in range(n):
            for k in range(j, n):
                form[j, k] = form[k, j] = fmpq(draw(entry))
        forms.append(form)
    linear, constants = fmpq_mat(n, n), [fmpq(0)] * n
    if not homogeneous:
        linear = fmpq_mat(n, n, [fmpq(draw(entry)) for _ in range(n * n)])
        constants = [fmpq(draw(entry)) for _ in range(n)]
    return from_forms(tuple(f"x{i + 1}" for i in range(n)), forms, linear, constants)


@st.composite
def systems_with_points(
    draw: Any,
    dims: Sequence[int] = (1, 2, 3),
    entries: st.SearchStrategy[Any] | None = None,
    homogeneous: bool = False,
    count: int = 1,
) -> tuple[Any, ...]:
    """A system and `count` points of its dimension: (system, x, ...)."""
    system = draw(systems(dims, entries, homogeneous))
    return (system, *(draw(points(system.dim, entries)) for _ in range(count)))


@st.composite
def matrices(draw: Any, rows: int, columns: int, entries: st.SearchStrategy[Any] | None = None) -> fmpq_mat:
    """Rational matrices of one size."""
    entry = rationals(9) if entries is None else entries
    return fmpq_mat(rows, columns, [fmpq(draw(entry)) for _ in range(rows * columns)])


def random_point(dim: int, seed: int, height: int = 9) -> tuple[fmpq, ...]:
    """A rational point that a seed determines."""
    rng = random.Random(seed)
    return tuple(QQ.random(rng, height) for _ in range(dim))


def step_or_none(phi: KahanMap, x: Sequence[Any]) -> tuple[Any, ...] | None:
    """The image of x, or None where the map is not defined."""
    try:
        return phi.step(x)
    except SingularStep:
        return None


def combine(*terms: tuple[Any, Sequence[Any]]) -> tuple[Any, ...]:
    """The linear combination of vectors: the sum of a v over the pairs (a, v)."""
    (first, start), *others = terms
    return tuple(sum((a * v[i] for a, v in others), first * entry) for i, entry in enumerate(start))


def agree(field: Field, left: Sequence[Any], right: Sequence[Any]) -> bool:
    """Whether two vectors are equal: exactly over an exact field, as far as balls can tell over another."""
    return len(left) == len(right) and all(field.equal(a, b) for a, b in zip(left, right, strict=True))


def encloses(ball: arb, number: fmpq) -> bool:
    """Whether the ball contains the number. FLINT's own `contains` rounds a fraction to 53 bits first."""
    middle, radius = ball.mid().man_exp(), ball.rad().man_exp()
    return abs(number - _dyadic(*middle)) <= _dyadic(*radius)


def fraction(number: fmpq | fmpz | int) -> Fraction:
    """The same number as Python's own Fraction, for computations that must not use FLINT."""
    number = fmpq(number)
    return Fraction(int(number.p), int(number.q))


def _dyadic(mantissa: fmpz, exponent: fmpz) -> fmpq:
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def quick(cases: Iterable[Any], which: Collection[Any]) -> list[Any]:
    """The cases as parameters of a test; those not among `which` are left to the thorough runs."""
    cases = list(cases)
    assert all(case in cases for case in which if isinstance(case, tuple))
    seldom = ((case if isinstance(case, tuple) else (case,), case in which) for case in cases)
    return [pytest.param(*values, marks=() if often else THOROUGH) for values, often in seldom]


def refuses(
    message: str, call: Callable[..., object], *args: Any, error: type[Exception] = InputError, **kwargs: Any
) -> None:
    """The call raises this error, and the regular expression `message` is found in its text."""
    with pytest.raises(error, match=message):
        call(*args, **kwargs)


def together(names: str, cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """One test of a long table whose cases take no time: each is tried, and those that fail are told together.

    As pytest.mark.parametrize, which makes a test of each case, and takes longer than such a case.
    """
    expected, rows = names.split(", "), list(cases)

    def of_all(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def run(**fixtures: Any) -> None:
            wrong = []
            for row in rows:
                values = row if len(expected) > 1 else (row,)
                try:
                    test(**fixtures, **dict(zip(expected, values, strict=True)))
                except (Exception, pytest.fail.Exception) as error:
                    wrong.append(f"{row!r:.300}\n    {type(error).__name__}: {error}")
            assert rows
            assert not wrong, f"{len(wrong)} of {len(rows)} cases\n" + "\n".join(wrong)

        own = signature(test)
        left = [parameter for name, parameter in own.parameters.items() if name not in expected]
        run.__signature__ = own.replace(parameters=left)  # type: ignore[attr-defined]  # what pytest reads
        return run

    return of_all


def table(path: Path) -> dict[str, list[str]]:
    """The lines of a text file below each of its headings `== NAME`, without remarks (`  # ...`) and empty lines."""
    result: dict[str, list[str]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        line = "" if line.startswith("# ") else line.partition("  # ")[0]
        if line.startswith("== "):
            lines = result.setdefault(line.removeprefix("== "), [])
        elif line:
            lines.append(line)
    return result


def random_skew_hamiltonian(m: int, rng: random.Random, bound: int = 3) -> fmpq_mat:
    """[[W, X], [Y, W^T]] with random integers from -bound to bound in W and in the skew blocks X and Y."""
    W = [[rng.randint(-bound, bound) for _ in range(m)] for _ in range(m)]
    X, Y = _random_skew(m, rng, bound), _random_skew(m, rng, bound)
    upper = [[*W[i], *X[i]] for i in range(m)]
    return fmpq_mat(upper + [[*Y[i], *(W[j][i] for j in range(m))] for i in range(m)])


def _random_skew(m: int, rng: random.Random, bound: int) -> list[list[int]]:
    skew = [[0] * m for _ in range(m)]
    for i in range(m):
        for j in range(i):
            skew[i][j] = rng.randint(-bound, bound)
            skew[j][i] = -skew[i][j]
    return skew
