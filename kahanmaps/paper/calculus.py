"""Vectors, matrices, systems, their Kahan maps, and derivatives, over any field: what the letters are computed with.

Numbers are elements of `K`, vectors are columns. Values are remembered by the identity of what they were computed from,
because the claims ask for the same things again and again.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, wraps
from typing import Any, TypeVar, cast

from flint import fmpq

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.matrices import det, rank, solve, trace
from kahanmaps.maps.kahan import KahanMapOver
from kahanmaps.systems.quadratic import SystemOver

Method = TypeVar("Method", bound=Callable[..., Any])


def remembered(method: Method) -> Method:
    """Remember the values of a method by the identity of its arguments, which are kept, so that it stays theirs."""
    name = method.__name__

    @wraps(method)
    def wrapper(self: Calculus, *arguments: Any, **options: int) -> Any:
        key = (name, *(a if isinstance(a, int) else id(a) for a in arguments), *options.items())
        if key not in self._memory:
            self._memory[key] = (method(self, *arguments, **options), arguments)
        return self._memory[key][0]

    return cast(Method, wrapper)


@dataclass(eq=False, kw_only=True)
class Calculus(ABC):
    """Numbers, vectors, systems and Kahan maps over the field `K` in some even dimension.

    `draw` gives vectors by name (random ones at a point, indeterminates in a proof); `step_eps` is the eps that the
    maps are computed with. `method` and `error_of_second` are for controls: the explicit Euler method instead of
    Kahan's, a tensor f'' that is not the derivative of f'.
    """

    K: Field
    eps: Any
    draw: Callable[[str], Any]
    step_eps: Any = None
    method: str = "kahan"
    error_of_second: Any = None
    used: set[str] = field(default_factory=set)
    _memory: dict[Any, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.step_eps is None:
            self.step_eps = self.eps

    @property
    @abstractmethod
    def n(self) -> int:
        """The dimension 2m."""

    @property
    def m(self) -> int:
        """Half the dimension."""
        return self.n // 2

    @abstractmethod
    def lifted(self) -> Any:
        """The same objects over the dual numbers K[d]/(d^2)."""

    # ---- numbers, vectors and matrices --------------------------------------------------------------------------

    def number(self, above: int, below: int = 1) -> Any:
        """The rational number above/below as an element of K."""
        return self.K.convert(fmpq(above, below))

    @cached_property
    def I(self) -> Any:  # noqa: E743 (the paper's letter)
        """The identity matrix."""
        return self.K.identity(self.n)

    @cached_property
    def x(self) -> Any:
        """The point."""
        return self.vector("x")

    def vector(self, name: str) -> Any:
        """A vector of its own: the point x, another point, a direction."""
        if name not in self._memory:
            self.used.add(name)
            self._memory[name] = self.draw(name)
        return self._memory[name]

    def forget(self, kept: tuple[str, ...] = ()) -> None:
        """Forget what was computed, but for the vectors that were drawn and the values of the methods `kept`."""
        drawn = {
            key: value
            for key, value in self._memory.items()
            if isinstance(key, str) and key not in ("lifted", "inhomogeneous")
        }
        drawn |= {key: value for key, value in self._memory.items() if not isinstance(key, str) and key[0] in kept}
        self._memory.clear()
        self._memory.update(drawn)

    def scalar(self, name: str) -> Any:
        """A number of its own."""
        return self.vector(name)[0, 0]

    @remembered
    def unit(self, k: int) -> Any:
        """The k-th unit vector."""
        return self.K.column([self.K.one if i == k else self.K.zero for i in range(self.n)])

    def zeros(self, rows: int, columns: int) -> Any:
        """The zero matrix."""
        return self.K.matrix(rows, columns, [self.K.zero] * (rows * columns))

    def solve(self, matrix: Any, right: Any) -> Any:
        """matrix^{-1} right."""
        return solve(matrix, right)

    def inverse(self, matrix: Any) -> Any:
        """matrix^{-1}."""
        return solve(matrix, self.I)

    def det(self, matrix: Any) -> Any:
        """The determinant."""
        return det(matrix)

    def trace(self, matrix: Any) -> Any:
        """The trace."""
        return trace(matrix)

    def dot(self, left: Any, right: Any) -> Any:
        """left^T right, a number."""
        return (left.transpose() * right)[0, 0]

    def sum(self, terms: Sequence[Any]) -> Any:
        """The sum of numbers, vectors or matrices (at least one)."""
        total = terms[0]
        for term in terms[1:]:
            total = total + term
        return total

    def columns(self, vectors: Sequence[Any]) -> Any:
        """The matrix with these columns."""
        rows = zip(*(vector.entries() for vector in vectors), strict=True)
        return self.K.matrix(self.n, len(vectors), [entry for row in rows for entry in row])

    def rank(self, matrix: Any) -> int:
        """The rank."""
        return rank(self.K, matrix)

    def power(self, matrix: Any, exponent: int) -> Any:
        """matrix^exponent, exponent >= 0."""
        result = self.I
        for _ in range(exponent):
            result = result * matrix
        return result

    # ---- any system and its Kahan map ---------------------------------------------------------------------------

    def value(self, f: SystemOver, x: Any) -> Any:
        """f(x)."""
        return self.K.column(f.value(x.entries()))

    @remembered
    def jac(self, f: SystemOver, x: Any) -> Any:
        """The Jacobi matrix f'(x)."""
        return f.jacobian(x.entries())

    def second(self, f: SystemOver, v: Any) -> Any:
        """The matrix f''v, with f'(x + v) = f'(x) + f''v."""
        second = f.hessian_times(v.entries())
        return second if self.error_of_second is None else second + self.error_of_second * v[0, 0]

    @remembered
    def step(self, f: SystemOver, x: Any, times: int = 1) -> Any:
        """Phi_f(x, eps), or Phi_f(x, times eps)."""
        eps = self.step_eps * self.number(times)
        if self.method == "euler":
            return x + self.value(f, x) * (eps * self.number(2))
        return self.K.column(KahanMapOver(f, eps).step(x.entries()))

    def jacobian_of_step(self, f: SystemOver, x: Any) -> Any:
        """dPhi_f(x, eps)."""
        if self.method == "euler":
            return self.I + self.jac(f, x) * (self.step_eps * self.number(2))
        return KahanMapOver(f, self.step_eps).jacobian(x.entries())

    @remembered
    def minus_eps_jac(self, f: SystemOver, x: Any) -> Any:
        """I - eps f'(x)."""
        return self.I - self.jac(f, x) * self.eps

    @remembered
    def plus_eps_jac(self, f: SystemOver, x: Any) -> Any:
        """I + eps f'(x)."""
        return self.I + self.jac(f, x) * self.eps

    @remembered
    def one_minus_square(self, f: SystemOver, x: Any) -> Any:
        """I - eps^2 f'(x)^2."""
        jacobian = self.jac(f, x)
        return self.I - jacobian * jacobian * (self.eps * self.eps)

    # ---- derivatives --------------------------------------------------------------------------------------------

    def slope(self, function: Callable[[Any, Any], Any], x: Any, v: Any) -> Any:
        """The derivative at x, along v, of a number-valued function of (objects, point): exact, by dual numbers."""
        return function(self.lifted(), self._moving(x, v)).slope

    @remembered
    def _moving(self, x: Any, v: Any) -> Any:
        """x + d v."""
        dual: Any = self.lifted().K
        return dual.matrix(self.n, 1, [dual.dual(a, b) for a, b in zip(x.entries(), v.entries(), strict=True)])

    def second_slope(self, function: Callable[[Any, Any], Any], x: Any, v: Any, w: Any) -> Any:
        """The second derivative of a number-valued function at x along v and w."""

        def along_w(o: Any, x: Any) -> Any:
            dual: Any = o.K
            return o.slope(function, x, dual.lift_matrix(w))

        return self.slope(along_w, x, v)

    def gradient(self, function: Callable[[Any, Any], Any], x: Any) -> Any:
        """The gradient at x of a number-valued function of (objects, point), a column."""
        return self.K.column([self.slope(function, x, self.unit(k)) for k in range(self.n)])
