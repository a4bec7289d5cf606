"""Many orbits modulo a prime p < 2^61 at once, as arrays.

Stepping takes no inverse. Where chi splits into linear factors modulo p, every plane of the normal form goes by itself
in homogeneous coordinates (normal_form/planar_block.py). Any other map goes as (X : Z), x = X/Z: its equation
(M | -r) is a matrix of forms of (X, Z), and the elimination multiplies rows instead of dividing them. The results are
the same, and those of `Orbit` over GF(p).

Two kernels: "numpy" works on whole arrays; "numba" is compiled, and needs the extra `fast`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kahanmaps.algebra.fields import GF, PrimeField
from kahanmaps.errors import BadPrime, InputError
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.floats.blocks import require_same_system
from kahanmaps.maps.implicit import BirationalMap, StepOver
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.kernels import choose_kernel
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.maps.orbits.iteration import require_steps
from kahanmaps.systems.quadratic import QuadraticSystem

Residues = NDArray[np.uint64]
Integers = NDArray[np.int64]
Factor = tuple[Any, ...]

BITS = 61
_SMALL = 1 << 31
_LANES = 8192  # so many numbers of an array at a time stay in the cache


def _sum(arrays: Iterable[Any]) -> Any:
    first, *others = arrays
    for array in others:
        first += array
    return first


class ResidueArithmetic:
    """Arrays of residues modulo p < 2^61 in numpy.

    For p < 2^31 four products fit into 64 bits. Otherwise the sum X of up to four products a b is taken in two parts,
    b = b1 2^31 + b0 with b1 < 2^30: r = (sum of a b1) - q p, then 2^31 r + (sum of a b0) - q' p, where the quotients by
    p are taken in doubles and rounded down. The first is below 2^32, the second below 2^34, and the doubles are wrong
    by less than 2^-16: both remainders are between -p/2^16 and p + p/2^16, and need only be known modulo 2^64.
    """

    def __init__(self, prime: int) -> None:
        self.prime = prime
        self.p = np.uint64(prime)
        self.small = prime < _SMALL
        self._signed = np.int64(prime)
        self._inverse = 1.0 / prime

    def array(self, values: Any) -> Residues:
        """Python integers below p, as an array."""
        return np.array(values, dtype=np.uint64)

    def left(self, a: Residues) -> Factor:
        """The array as a left factor, prepared once for many products."""
        return (a,) if self.small else (a.view(np.int64), a.view(np.int64) * self._inverse)

    def right(self, b: Residues) -> Factor:
        """The array as a right factor."""
        if self.small:
            return (b,)
        high, low = b.view(np.int64) >> 31, b.view(np.int64) & 0x7FFFFFFF
        return high, high.astype(np.float64), low, low.astype(np.float64)

    def mul(self, a: Residues, b: Residues) -> Residues:
        """a b."""
        return self.dot((self.left(a), self.right(b)))

    def dot(self, *pairs: tuple[Factor, Factor]) -> Residues:
        """The sum of up to four products, each of a left factor and a right one."""
        if self.small:
            total: Residues = _sum(a * b for (a,), (b,) in pairs)
            return total % self.p
        quotient = np.floor(_sum(share * high for (_, share), (_, high, _, _) in pairs))
        rest = _sum(a * high for (a, _), (high, _, _, _) in pairs) - quotient.astype(np.int64) * self._signed
        rough = _sum(share * low for (_, share), (_, _, _, low) in pairs)
        rough += rest * (self._inverse * 2147483648.0)
        rest <<= 31
        rest += _sum(a * low for (a, _), (_, _, low, _) in pairs)
        rest -= np.floor(rough).astype(np.int64) * self._signed
        return self._corrected(rest)

    def _corrected(self, remainder: Integers) -> Residues:
        """The residue of a number between -p and 2 p."""
        found: Residues = remainder.view(np.uint64)
        found = np.minimum(found, found + self.p)
        found = np.minimum(found, found - self.p)
        return found

    def add(self, a: Residues, b: Residues) -> Residues:
        """a + b."""
        total = a + b
        found: Residues = np.minimum(total, total - self.p)
        return found

    def negative(self, a: Residues) -> Residues:
        """-a."""
        return np.where(a == 0, a, self.p - a)

    def linear(self, matrix: Residues, x: Residues) -> Residues:
        """The matrix (rows x n) times the columns x (n x lanes)."""
        found = np.zeros((matrix.shape[0], x.shape[1]), dtype=np.uint64)
        for k in range(0, matrix.shape[1], 4):
            columns = range(k, min(k + 4, matrix.shape[1]))
            pairs = [(self.left(matrix[:, j, None]), self.right(x[j][None, :])) for j in columns]
            found = self.add(found, self.dot(*pairs))
        return found

    def inverses(self, a: Residues) -> Residues:
        """The inverses of a whole array without zeros, with one division."""
        if len(a) == 0:
            return a
        if len(a) == 1:
            return self.array([pow(int(a[0]), -1, self.prime)])
        half = len(a) // 2
        left, right = a[:half], a[half : 2 * half]
        both = self.inverses(np.concatenate([self.mul(left, right), a[2 * half :]]))
        return np.concatenate([self.mul(both[:half], right), self.mul(both[:half], left), both[half:]])


class ModularEnsemble:
    """Orbits of many starts under one map modulo p < 2^61; a system stands for its Kahan map, with the time step 2 eps.

    `starts` is a sequence of points of exact numbers, or an integer array with a point in each row. With the normal
    form `form` of the system (`normal_form`) and where chi splits modulo p, `method` is "planes"; else "elimination".
    `kernel` is "numpy" or "numba" (on so many `threads`); None: numba if it is installed. An orbit ends where the map
    has no value: `singular_at` is then the index of its last point, at which it stays, else -1. Raises BadPrime where
    the system or eps have no reduction modulo p, InputError for a wrong start, kernel or form and a prime too large.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> ensemble = ModularEnsemble(system, "1/2", [[1, 2], [3, 4], [5, 1]], 7, kernel="numpy")
    >>> ensemble.advance(3)
    >>> ensemble.x.tolist(), ensemble.status, ensemble.singular_at.tolist()
    ([[0, 5], [3, 4], [5, 6]], ['completed', 'singular', 'singular'], [-1, 0, 2])
    """

    def __init__(
        self,
        system: QuadraticSystem | BirationalMap,
        eps: Any,
        starts: Any,
        prime: int,
        *,
        form: NormalForm | None = None,
        kernel: str | None = None,
        threads: int = 1,
        backward: bool = False,
    ) -> None:
        if isinstance(prime, int) and prime.bit_length() > BITS:
            raise InputError(
                f"found a prime of {prime.bit_length()} bits, expected at most {BITS}: use Orbit over GF(p)"
            )
        self.field = field = GF(prime)
        self.system = system
        self.prime = prime
        self.arithmetic = ResidueArithmetic(prime)
        # Montgomery's form needs an odd modulus.
        self.kernel = "numpy" if prime == 2 else choose_kernel(kernel, long=True)
        if threads < 1:
            raise InputError(f"found {threads} threads, expected at least 1")
        map_ = as_map(system)
        forward = map_.at(eps, field)
        chosen = forward.inverse if backward else forward
        if not chosen.is_bilinear:
            if kernel == "numba":
                raise InputError("the kernel numba is for equations that are linear in the old point: take numpy")
            self.kernel = "numpy"
        self.threads = threads if self.kernel == "numba" else 1
        x = _residues(starts, system.dim, field)
        if form is not None:
            require_same_system(form, map_)
        splitting = _split(form, field, chosen.eps)
        self._walker: _Planes | _General | _Word
        if splitting is None:
            walkers = [_General(one, self.arithmetic, self.kernel) for one in chosen.factors]
            self._walker = walkers[0] if len(walkers) == 1 else _Word(walkers)
        else:
            self._walker = _Planes(splitting, self.arithmetic, self.kernel)
        self.steps = 0
        self.singular_at: Integers = np.full(len(x), -1, dtype=np.int64)
        self._state = self._walker.enter(np.ascontiguousarray(x.T))

    @property
    def method(self) -> str:
        """ "planes" or "elimination"."""
        return self._walker.method

    def __len__(self) -> int:
        return len(self.singular_at)

    def advance(self, steps: int) -> None:
        """Takes so many steps more with all orbits that have not ended."""
        require_steps(steps)
        if self.threads == 1:
            self._walker.walk(self._state, steps, self.steps, self.singular_at)
        else:
            # For numba the lanes come first in the state, and kernels release the interpreter's lock.
            size = -(-len(self) // self.threads) or 1
            pieces = [slice(low, low + size) for low in range(0, len(self), size)]
            with ThreadPoolExecutor(self.threads) as pool:
                walks = [
                    pool.submit(self._walker.walk, self._state[piece], steps, self.steps, self.singular_at[piece])
                    for piece in pieces
                ]
                for walk in walks:
                    walk.result()
        self.steps += steps

    @property
    def x(self) -> Integers:
        """The points, one in each row: those that the last step reached."""
        return np.ascontiguousarray(self._walker.leave(self._state).T).view(np.int64)

    @property
    def status(self) -> list[str]:
        """ "completed" or, where the map had no value, "singular", for each orbit."""
        return ["completed" if at < 0 else "singular" for at in self.singular_at.tolist()]


def _residues(starts: Any, dim: int, field: PrimeField) -> Residues:
    """The starts as an array (starts x dim) of residues."""
    if isinstance(starts, np.ndarray) and np.issubdtype(starts.dtype, np.integer):
        if starts.ndim != 2 or starts.shape[1] != dim:
            raise InputError(f"found an array of the shape {starts.shape}, expected rows of {dim} integers")
        prime = np.uint64(field.prime) if np.issubdtype(starts.dtype, np.unsignedinteger) else np.int64(field.prime)
        return (starts % prime).astype(np.uint64)
    rows = [list(start) for start in starts]
    for row in rows:
        if len(row) != dim:
            raise InputError(f"found a start with {len(row)} coordinates, expected {dim}")
    return np.array([[int(field.convert(value)) for value in row] for row in rows], dtype=np.uint64).reshape(-1, dim)


def _split(form: NormalForm | None, field: PrimeField, eps: Any) -> Splitting | None:
    """The planes, if there is one for each root of chi modulo p."""
    if form is None:
        return None
    try:
        splitting = Splitting(form, field, eps)
    except BadPrime:
        return None
    # Modulo 2 the coordinates 2 eps (u, v) are zero.
    return splitting if field.prime > 2 and all(plane.degree == 1 for plane in splitting.planes) else None


def _montgomery(prime: int) -> tuple[np.uint64, int]:
    """-1/p modulo R, and R modulo p, for R = 2^64."""
    return np.uint64(-pow(prime, -1, 1 << 64) % (1 << 64)), (1 << 64) % prime


class _Planes:
    """Steps in the planes; the state is (3, planes, lanes), for numba (lanes, planes, 3) in Montgomery form."""

    method = "planes"

    def __init__(self, splitting: Splitting, arithmetic: ResidueArithmetic, kernel: str) -> None:
        self.arithmetic, self.compiled = arithmetic, kernel == "numba"
        p, n = arithmetic.prime, splitting.dim
        unit = [[int(i == j) for i in range(n)] for j in range(n)]
        field = splitting.field
        columns = [splitting.triples([field.convert(e) for e in row]) for row in unit]
        self._into = arithmetic.array(
            [[int(column[k][half]) for column in columns] for k in range(n // 2) for half in (0, 1)]
        )
        scale = pow(int(2 * splitting.eps), -1, p)
        matrices = [splitting.matrix(k) for k in range(n // 2)]
        self._out = arithmetic.array([[int(e) * scale % p for R in matrices for e in R[i]] for i in range(n)])
        self._coefficients = arithmetic.array([_step_coefficients(plane.block, p) for plane in splitting.planes])
        if self.compiled:
            from kahanmaps.maps.residues.numba_kernel import kernels

            self._compiled = kernels()[0]
            self._n, self._R = _montgomery(p)
            self._coefficients = _times(self._coefficients, self._R, arithmetic)

    def enter(self, x: Residues) -> Residues:
        """The state of the points in the columns of x."""
        z = self.arithmetic.linear(self._into, x)
        state = np.stack([z[0::2], z[1::2], np.ones_like(z[0::2])])
        if self.compiled:
            state = np.ascontiguousarray(_times(state, self._R, self.arithmetic).transpose(2, 1, 0))
        return state

    def leave(self, state: Residues) -> Residues:
        """The points, in columns."""
        arithmetic = self.arithmetic
        U, V, W = np.ascontiguousarray(state.transpose(2, 1, 0)) if self.compiled else state
        inverse = arithmetic.inverses(W.ravel()).reshape(W.shape)
        z = np.empty((2 * len(U), U.shape[1]), dtype=np.uint64)
        z[0::2], z[1::2] = arithmetic.mul(U, inverse), arithmetic.mul(V, inverse)
        return arithmetic.linear(self._out, z)

    def walk(self, state: Residues, steps: int, first: int, singular_at: Integers) -> None:
        """Steps in place."""
        if self.compiled:
            self._compiled(state, self._coefficients, self.arithmetic.p, self._n, steps, first, singular_at)
            return
        width = max(1, _LANES // state.shape[1])
        for low in range(0, state.shape[2], width):
            self._walk_some(state[:, :, low : low + width], steps, first, singular_at[low : low + width])

    def _walk_some(self, state: Residues, steps: int, first: int, singular_at: Integers) -> None:
        arithmetic = self.arithmetic
        dot, left, right = arithmetic.dot, arithmetic.left, arithmetic.right
        lanes = np.flatnonzero(singular_at < 0)
        U, V, W = (np.ascontiguousarray(part[:, lanes]) for part in state)
        b, c2, d3, a3, b2, c1, q0, q1, q2 = (right(column[:, None]) for column in self._coefficients.T)
        for step in range(steps):
            U_left, V_left, V_right, W_right = left(U), left(V), right(V), right(W)
            UU, UV, VV = left(dot((U_left, right(U)))), left(dot((U_left, V_right))), left(dot((V_left, V_right)))
            below = dot((left(W), W_right), (UU, q0), (UV, q1), (VV, q2))
            U_next = dot((U_left, W_right), (UU, b), (UV, c2), (VV, d3))
            V_next = dot((V_left, W_right), (UU, a3), (UV, b2), (VV, c1))
            if not below.all():
                bad = ~below.all(axis=0)
                for part, values in zip(state, (U, V, W), strict=True):
                    part[:, lanes[bad]] = values[:, bad]
                singular_at[lanes[bad]] = first + step
                lanes = lanes[~bad]
                if len(lanes) == 0:
                    return
                U_next, V_next, below = (values[:, ~bad] for values in (U_next, V_next, below))
            U, V, W = U_next, V_next, below
        for part, values in zip(state, (U, V, W), strict=True):
            part[:, lanes] = values


def _step_coefficients(block: Any, p: int) -> list[int]:
    """What U^2, UV and V^2 are multiplied by, in the images of U, V and W."""
    a, b, c, d = (int(e) for e in (block.a, block.b, block.c, block.d))
    return [e % p for e in (b, 2 * c, 3 * d, -3 * a, -2 * b, -c, *(int(e) for e in block.D))]


def _times(values: Residues, factor: int, arithmetic: ResidueArithmetic) -> Residues:
    return arithmetic.mul(values, arithmetic.array([factor]))


class _General:
    """Steps by elimination; the state is (dim + 1, lanes), for numba (lanes, width) in Montgomery form."""

    method = "elimination"

    def __init__(self, map_over: StepOver, arithmetic: ResidueArithmetic, kernel: str) -> None:
        equation = map_over.equation
        assert map_over.field.characteristic == arithmetic.prime
        self.arithmetic, self.compiled = arithmetic, kernel == "numba"
        p, n = arithmetic.prime, equation.dim
        self.size = n
        self._exponents = equation.exponents if equation.degree > 1 else None
        self._forms = np.zeros((n, n + 1, len(equation.exponents)), dtype=np.uint64)
        for i, row in enumerate(equation.terms):
            for j, entry in enumerate(row):
                for k, coefficient in entry:
                    self._forms[i, j, k] = int(coefficient) if j < n else -int(coefficient) % p
        if self.compiled:
            from kahanmaps.maps.residues.numba_kernel import kernels

            self._compiled = kernels()[1]
            self._n, self._R = _montgomery(p)
            padded = np.zeros((n, n + 1, -(-(n + 1) // 4) * 4), dtype=np.uint64)
            padded[:, :, : n + 1] = _times(self._forms, self._R, arithmetic)
            self._forms = padded

    def enter(self, x: Residues) -> Residues:
        """The state of the points in the columns of x."""
        state = np.concatenate([x, np.ones((1, x.shape[1]), dtype=np.uint64)])
        if self.compiled:
            padded = np.zeros((x.shape[1], self._forms.shape[2]), dtype=np.uint64)
            padded[:, : self.size + 1] = _times(state, self._R, self.arithmetic).T
            state = padded
        return state

    def leave(self, state: Residues) -> Residues:
        """The points, in columns."""
        X = np.ascontiguousarray(state.T) if self.compiled else state
        return self.arithmetic.mul(X[: self.size], self.arithmetic.inverses(X[self.size])[None, :])

    def walk(self, state: Residues, steps: int, first: int, singular_at: Integers) -> None:
        """Steps in place."""
        if self.compiled:
            p, one = self.arithmetic.p, np.uint64(self._R)
            self._compiled(state, self._forms, one, p, self._n, steps, first, singular_at)
            return
        width = max(1, _LANES // (self.size * self.size // 4 + 1))
        for low in range(0, state.shape[1], width):
            self._walk_some(state[:, low : low + width], steps, first, singular_at[low : low + width])

    def _walk_some(self, state: Residues, steps: int, first: int, singular_at: Integers) -> None:
        lanes = np.flatnonzero(singular_at < 0)
        X = np.ascontiguousarray(state[:, lanes])
        for step in range(steps):
            image = self._step(X)
            good = image[-1] != 0
            if not good.all():
                state[:, lanes[~good]] = X[:, ~good]
                singular_at[lanes[~good]] = first + step
                lanes, image = lanes[good], image[:, good]
                if len(lanes) == 0:
                    return
            X = image
        state[:, lanes] = X

    def _step(self, X: Residues) -> Residues:
        """The images, the last coordinate 0 where there is none."""
        arithmetic, n, lanes = self.arithmetic, self.size, X.shape[1]
        values = X if self._exponents is None else self._monomials(X, self._exponents)
        M = arithmetic.linear(self._forms.reshape(n * (n + 1), -1), values).reshape(n, n + 1, lanes)
        for column in range(n):
            self._pivot(M, column)
            pivot = M[column, column]
            pivot_right, row = arithmetic.right(pivot[None, :]), arithmetic.left(M[column, column + 1 :])
            for i in range(n):
                if i != column:
                    factor = arithmetic.negative(M[i, column])
                    M[i, column + 1 :] = arithmetic.dot(
                        (arithmetic.left(M[i, column + 1 :]), pivot_right),
                        (row, arithmetic.right(factor[None, :])),
                    )
                    if i < column:
                        M[i, i] = arithmetic.mul(M[i, i], pivot)
        image = np.empty_like(X)
        total = np.ones(lanes, dtype=np.uint64)
        for i in range(n):
            image[i] = arithmetic.mul(M[i, n], total)
            total = arithmetic.mul(total, M[i, i])
        image[n] = total
        total = M[n - 1, n - 1]
        for i in range(n - 2, -1, -1):
            image[i] = arithmetic.mul(image[i], total)
            total = arithmetic.mul(total, M[i, i])
        return image

    def _monomials(self, X: Residues, exponents: Sequence[tuple[int, ...]]) -> Residues:
        """The values of monomials at the points in the columns of X."""
        values = np.ones((len(exponents), X.shape[1]), dtype=np.uint64)
        for value, exponent in zip(values, exponents, strict=True):
            for x, power in zip(X, exponent, strict=True):
                for _ in range(power):
                    value[:] = self.arithmetic.mul(value, x)
        return values

    @staticmethod
    def _pivot(M: Residues, column: int) -> None:
        """Brings a row that is not zero in this column to its place, in the lanes where another one is there."""
        lanes = np.flatnonzero(M[column, column] == 0)
        if len(lanes):
            rows = column + np.argmax(M[column:, column, lanes] != 0, axis=0)
            M[rows, :, lanes], M[column, :, lanes] = M[column, :, lanes].T.copy().T, M[rows, :, lanes].copy()


class _Word:
    """Steps of several factors one after the other; the state is that of each."""

    method = "elimination"

    def __init__(self, factors: Sequence[_General]) -> None:
        self._factors = factors
        self.enter, self.leave = factors[0].enter, factors[0].leave

    def walk(self, state: Residues, steps: int, first: int, singular_at: Integers) -> None:
        """Steps in place; an orbit that ends stays where it was before its step."""
        by_lane = self._factors[0].compiled
        for step in range(first, first + steps):
            before = state.copy()
            for one in self._factors:
                one.walk(state, 1, step, singular_at)
            ended = singular_at == step
            if by_lane:
                state[ended] = before[ended]
            else:
                state[:, ended] = before[:, ended]
