"""The objects that the paper denotes by letters, at a point x over a field K; claims are functions of the objects.

The notation is that of the paper: A, J, H (with the chain H_0, H_1, ...), f_i, the roots of chi, B_i and the associated
g and K, x and eps; x~ is the image of x under the map of f. Numbers are elements of `K`: the rationals, GF(p), rational
functions, an algebra Q[t]/chi, complex balls, dual numbers, or bounds for degrees and coefficients. Vectors are
columns. Hypotheses are not checked here, since controls violate them on purpose.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, wraps
from typing import Any, TypeVar, cast

from flint import fmpq

from kahanmaps.algebra.duals import DualField
from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.matrices import det, rank, solve, trace
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.hamiltonian import standard_structure
from kahanmaps.systems.quadratic import SystemOver

Method = TypeVar("Method", bound=Callable[..., Any])
# The fields of `PaperObjects` that consist of elements of K: numbers, matrices, tuples of these, a system.
_IN_K = (
    *("A", "J", "d3H", "eps", "roots", "associate_matrices", "known_chi", "hessian_of_quadratic_part"),
    *("gradient_of_linear_part", "lower_terms", "B_at_root", "step_eps", "base", "error_of_second"),
)


def cache_by_id(method: Method) -> Method:
    """Cache the values of a method by the `id` of its arguments; the cache keeps the arguments alive."""
    name = method.__name__

    @wraps(method)
    def wrapper(self: PaperObjects, *arguments: Any, **options: int) -> Any:
        key = (name, *(a if isinstance(a, int) else id(a) for a in arguments), *options.items())
        if key not in self._cache:
            self._cache[key] = (method(self, *arguments, **options), arguments)
        return self._cache[key][0]

    return cast(Method, wrapper)


@dataclass(eq=False, kw_only=True)
class PaperObjects:
    """The paper's objects over the field `K`.

    `d3H` are the third derivatives of H as an n^2 x n matrix: row i n + j gives the linear form d_i d_j H. `draw` gives
    x and other vectors by name (random at a point, indeterminate in a proof). `step_eps` is the eps of the maps;
    `B_at_root` is the value of B_i at lambda_i. Controls change `step_eps`, `B_at_root`, `method` (to the explicit
    Euler method), and `error_of_second`, an error of f''.

    A method whose name ends with an underscore takes the paper's index: `f_i(i)` is f_i, and `H_tilde_(i, x)` is H~_i.
    """

    K: Field
    eps: Any
    draw: Callable[[str], Any]
    step_eps: Any = None
    method: str = "kahan"
    error_of_second: Any = None
    used: set[str] = field(default_factory=set)  # names of the vectors used so far, and "roots" if roots were used
    _cache: dict[Any, Any] = field(default_factory=dict)
    A: Any
    d3H: Any
    J: Any = None  # by default [[0, I], [-I, 0]]
    roots: tuple[Any, ...] | None
    hessian_of_quadratic_part: Any = None  # for an inhomogeneous H
    gradient_of_linear_part: Any = None
    B_at_root: Any = None
    base: SystemOver | None = None  # f_0, if it is given by a rational system
    sign_vectors: tuple[tuple[int, ...], ...] | None = None  # the associated systems to be tested; None: all
    associate_matrices: tuple[Any, ...] | None = None  # their matrices B, if given without the roots of chi
    indices_to_test: tuple[int, ...] | None = None  # indices i for which a claim "for all i" is tested; None: all
    order: int = 3  # order in eps^2 up to which series are expanded
    lower_terms: tuple[Any, Any] | None = None  # Hesse matrix and gradient at 0 of the terms added to H
    known_chi: tuple[Any, ...] | None = None  # coefficients of chi in K, constant term first
    varied: bool = True  # whether variations are applied; False for the control

    def __post_init__(self) -> None:
        if self.step_eps is None:
            self.step_eps = self.eps
        if self.B_at_root is None:
            self.B_at_root = -self.K.one
        if self.J is None:
            self.J = self.K.convert_matrix(standard_structure(self.n))

    @property
    def n(self) -> int:
        """The dimension 2m."""
        return int(self.A.nrows())

    @property
    def m(self) -> int:
        """The number m, half the dimension."""
        return self.n // 2

    # ---- numbers, vectors and matrices --------------------------------------------------------------------------

    def number(self, numerator: int, denominator: int = 1) -> Any:
        """Return the rational number numerator/denominator as an element of K."""
        return self.K.convert(fmpq(numerator, denominator))

    @cached_property
    def I(self) -> Any:  # noqa: E743 (the paper's letter)
        """The identity matrix."""
        return self.K.identity(self.n)

    @cached_property
    def x(self) -> Any:
        """The point."""
        return self.vector("x")

    def vector(self, name: str) -> Any:
        """Return the vector with this name, independent of others: the point x, another point, or a direction."""
        if name not in self._cache:
            self.used.add(name)
            self._cache[name] = self.draw(name)
        return self._cache[name]

    def forget(self, kept_methods: tuple[str, ...] = ()) -> None:
        """Discard all computed values, except the drawn vectors and the values of the methods `kept_methods`."""
        computed_names = ("over_dual_numbers", "inhomogeneous")  # other text keys are the names of drawn vectors
        for key in list(self._cache):
            if key in computed_names if isinstance(key, str) else key[0] not in kept_methods:
                del self._cache[key]

    def scalar(self, name: str) -> Any:
        """Return the number with this name, independent of others."""
        return self.vector(name)[0, 0]

    @cache_by_id
    def unit(self, k: int) -> Any:
        """Return the k-th unit vector."""
        return self.K.column([self.K.one if i == k else self.K.zero for i in range(self.n)])

    def zeros(self, rows: int, columns: int) -> Any:
        """Return the zero matrix."""
        return self.K.matrix(rows, columns, [self.K.zero] * (rows * columns))

    solve, det, trace = staticmethod(solve), staticmethod(det), staticmethod(trace)

    def inverse(self, matrix: Any) -> Any:
        """Return matrix^{-1}."""
        return solve(matrix, self.I)

    def dot(self, left: Any, right: Any) -> Any:
        """Return left^T right, a number."""
        return (left.transpose() * right)[0, 0]

    def sum(self, terms: Sequence[Any]) -> Any:
        """Return the sum of a non-empty sequence of numbers, vectors or matrices."""
        total = terms[0]
        for term in terms[1:]:
            total = total + term
        return total

    def columns(self, vectors: Sequence[Any]) -> Any:
        """Return the matrix with these columns."""
        rows = zip(*(vector.entries() for vector in vectors), strict=True)
        return self.K.matrix(self.n, len(vectors), [entry for row in rows for entry in row])

    def tensor(self, u: Any, v: Any, w: Any) -> Any:
        """Return u (x) v (x) w as an n^2 x n matrix, in the format of the third derivatives of H."""
        return self.K.column([a * b for a in u.entries() for b in v.entries()]) * w.transpose()

    def rank(self, matrix: Any) -> int:
        """Return the rank of a matrix."""
        return rank(self.K, matrix)

    def power(self, matrix: Any, exponent: int) -> Any:
        """Return matrix^exponent, exponent >= 0."""
        result = self.I
        for _ in range(exponent):
            result = result * matrix
        return result

    # ---- any system and its Kahan map ---------------------------------------------------------------------------

    def value(self, f: SystemOver, x: Any) -> Any:
        """Return f(x)."""
        return self.K.column(f.value(x.entries()))

    @cache_by_id
    def jac(self, f: SystemOver, x: Any) -> Any:
        """Return the Jacobi matrix f'(x)."""
        return f.jacobian(x.entries())

    def second(self, f: SystemOver, v: Any) -> Any:
        """Return the matrix f''v, for which f'(x + v) = f'(x) + f''v."""
        matrix = f.hessian_times(v.entries())
        return matrix if self.error_of_second is None else matrix + self.error_of_second * v[0, 0]

    @cache_by_id
    def step(self, f: SystemOver, x: Any, times: int = 1) -> Any:
        """Return Phi_f(x, `times` eps)."""
        eps = self.step_eps * self.number(times)
        if self.method == "euler":
            return x + self.value(f, x) * (eps * self.number(2))
        return self.K.column(KahanMap(f, eps).step(x.entries()))

    def jacobian_of_step(self, f: SystemOver, x: Any) -> Any:
        """Return dPhi_f(x, eps)."""
        if self.method == "euler":
            return self.I + self.jac(f, x) * (self.step_eps * self.number(2))
        return KahanMap(f, self.step_eps).jacobian(x.entries())

    @cache_by_id
    def minus_eps_jac(self, f: SystemOver, x: Any) -> Any:
        """I - eps f'(x)."""
        return self.I - self.jac(f, x) * self.eps

    @cache_by_id
    def plus_eps_jac(self, f: SystemOver, x: Any) -> Any:
        """I + eps f'(x)."""
        return self.I + self.jac(f, x) * self.eps

    @cache_by_id
    def one_minus_square(self, f: SystemOver, x: Any) -> Any:
        """I - eps^2 f'(x)^2."""
        jacobian = self.jac(f, x)
        return self.I - jacobian * jacobian * (self.eps * self.eps)

    # ---- derivatives --------------------------------------------------------------------------------------------

    def slope(self, function: Callable[[Any, Any], Any], x: Any, v: Any) -> Any:
        """Return the derivative at x along v of the scalar function(objects, point), by dual numbers."""
        return function(self.over_dual_numbers(), self._dual_point(x, v)).slope

    @cache_by_id
    def _dual_point(self, x: Any, v: Any) -> Any:
        """Return the dual number x + d v."""
        dual: Any = self.over_dual_numbers().K
        return dual.matrix(self.n, 1, [dual.dual(a, b) for a, b in zip(x.entries(), v.entries(), strict=True)])

    def second_slope(self, function: Callable[[Any, Any], Any], x: Any, v: Any, w: Any) -> Any:
        """Return the second derivative at x along v and w of the scalar function(objects, point)."""

        def along_w(o: Any, x: Any) -> Any:
            dual: Any = o.K
            return o.slope(function, x, dual.lift_matrix(w))

        return self.slope(along_w, x, v)

    def gradient(self, function: Callable[[Any, Any], Any], x: Any) -> Any:
        """Return the gradient at x, a column, of the scalar function(objects, point)."""
        return self.K.column([self.slope(function, x, self.unit(k)) for k in range(self.n)])

    # ---- A, f and x ---------------------------------------------------------------------------------------------

    @cached_property
    def AT(self) -> Any:
        """The transpose of A."""
        return self.A.transpose()

    @cached_property
    def df(self) -> Any:
        """f_0'(x)."""
        return self.jac(self.f, self.x)

    @cached_property
    def fx(self) -> Any:
        """f_0(x)."""
        return self.value(self.f, self.x)

    @cached_property
    def x_tilde(self) -> Any:
        """x~ = Phi_f(x, eps)."""
        return self.step(self.f, self.x)

    # ---- H and its chain ----------------------------------------------------------------------------------------

    def _square_matrix(self, column: Any) -> Any:
        return self.K.matrix(self.n, self.n, column.entries())

    @cache_by_id
    def hess(self, x: Any, i: int = 0) -> Any:
        """Return the Hesse matrix nabla^2 H_i = A^i nabla^2 H_0 at x (by definition of the chain)."""
        hessian = self._square_matrix(self.d3H * x)
        if self.hessian_of_quadratic_part is not None:
            hessian = hessian + self.hessian_of_quadratic_part
        return self.A_to(i) * hessian

    @cache_by_id
    def A_to(self, i: int) -> Any:
        """A^i."""
        return self.power(self.A, i)

    @cache_by_id
    def grad(self, x: Any, i: int = 0) -> Any:
        """Return nabla H_i(x) = A^i nabla H_0(x)."""
        gradient = self._square_matrix(self.d3H * x) * x * self.number(1, 2)
        if self.hessian_of_quadratic_part is not None:
            gradient = gradient + self.hessian_of_quadratic_part * x + self.gradient_of_linear_part
        return self.A_to(i) * gradient

    def H(self, x: Any, i: int = 0) -> Any:
        """Return H_i(x) by Euler's formula for each degree; nabla H_i = A^i nabla H_0 if this is a gradient."""
        return self.potential(self.A_to(i), x)

    def gradient_of_chain(self, i: int, x: Any) -> Any:
        """Return the gradient at x of the function `H`(x, i), by differentiation."""
        return self.gradient(lambda o, x: o.H(x, i), x)

    def potential(self, matrix: Any, x: Any) -> Any:
        """Return K(x) for the function K with K(0) = 0 and nabla K = `matrix` nabla H_0, if there is one."""
        value = self.dot(x, matrix * (self._square_matrix(self.d3H * x) * x)) * self.number(1, 6)
        if self.hessian_of_quadratic_part is not None:
            value = value + self.dot(x, matrix * (self.hessian_of_quadratic_part * x)) * self.number(1, 2)
            value = value + self.dot(x, matrix * self.gradient_of_linear_part)
        return value

    @cached_property
    def f(self) -> SystemOver:
        """The system f = f_0 = J nabla H_0."""
        return self.base if self.base is not None else self.hamiltonian_system(self.I)

    @cache_by_id
    def f_i(self, i: int) -> SystemOver:
        """The system f_i = J nabla H_i = J A^i nabla H_0."""
        return self.f if i == 0 else self.hamiltonian_system(self.A_to(i))

    def hamiltonian_system(self, matrix: Any) -> SystemOver:
        """The system J `matrix` nabla H_0."""
        n, K = self.n, self.K
        JM = self.J * matrix
        tensor = K.matrix(n * n, n, (JM * K.matrix(n, n * n, self.d3H.entries())).entries())
        if self.hessian_of_quadratic_part is None:
            return SystemOver(K, tensor)
        return SystemOver(K, tensor, JM * self.hessian_of_quadratic_part, JM * self.gradient_of_linear_part)

    # ---- the associated systems ---------------------------------------------------------------------------------

    @property
    def lam(self) -> tuple[Any, ...]:
        """The roots of chi, where chi^2 is the characteristic polynomial of A: its double eigenvalues."""
        self.used.add("roots")
        if self.roots is None:
            raise LookupError("the roots of chi do not lie in this field")
        return self.roots

    @property
    def each(self) -> range:
        """The indices i of the roots lambda_i."""
        return range(len(self.lam))

    @property
    def tested_indices(self) -> Sequence[int]:
        """The indices i at which a claim "for all i" is tested."""
        return self.each if self.indices_to_test is None else self.indices_to_test

    @cache_by_id
    def lagrange(self, i: int) -> list[Any]:
        """Return the coefficients of the polynomial B_i of degree < m with B_i(lambda_i) = -1 and B_i(lambda_j) = 1.

        Lagrange's formula: B_i(lambda) = 1 + (B_i(lambda_i) - 1) prod_{j != i} (lambda - lambda_j)/(lambda_i -
        lambda_j).
        """
        product, denominator = [self.K.one], self.K.one
        for j in self.each:
            if j != i:
                product = _times_linear(self.K, product, self.lam[j])
                denominator = denominator * (self.lam[i] - self.lam[j])
        factor = (self.B_at_root - self.K.one) / denominator
        coefficients = [coefficient * factor for coefficient in product]
        coefficients[0] = coefficients[0] + self.K.one
        return coefficients

    def polynomial_in_A(self, coefficients: Sequence[Any]) -> Any:
        """Return the polynomial in A with these coefficients, constant term first."""
        return self.sum([self.A_to(k) * coefficient for k, coefficient in enumerate(coefficients)])

    @cache_by_id
    def B(self, i: int) -> Any:
        """B_i."""
        return self.polynomial_in_A(self.lagrange(i))

    def B_signs(self, signs: Sequence[int]) -> Any:
        """B_s, the product of the B_i with s_i = -1."""
        product = self.I
        for i, sign in enumerate(signs):
            if sign < 0:
                product = product * self.B(i)
        return product

    def associates(self) -> Iterator[Any]:
        """Yield the matrices B of the associated systems J B nabla H_0: one of each pair B, -B, except for I, -I."""
        if self.associate_matrices is not None:
            yield from self.associate_matrices
            return
        for signs in self.all_signs():
            if ("B", signs) not in self._cache:
                self._cache["B", signs] = self.B_signs(signs)
            yield self._cache["B", signs]

    def all_signs(self) -> tuple[tuple[int, ...], ...]:
        """The sign vectors s of the associated systems J B_s nabla H_0 that are tested."""
        count = len(self.lam)
        if self.sign_vectors is not None:
            return self.sign_vectors
        if count == 1:
            return ((-1,),)
        return tuple((1, *other_signs) for other_signs in itertools.product((1, -1), repeat=count - 1))[1:]

    @cache_by_id
    def g(self, B: Any) -> SystemOver:
        """The associated system g = J B nabla H_0 = J nabla K."""
        return self.hamiltonian_system(B)

    def g_i(self, i: int) -> SystemOver:
        """Return g_i, the system associated to f by B_i."""
        return self.g(self.B(i))

    def Kf(self, B: Any, x: Any) -> Any:
        """Return K(x), where nabla K = B nabla H_0 and K(0) = 0."""
        return self.potential(B, x)

    @cached_property
    def chi_of_roots(self) -> list[Any]:
        """The coefficients of prod (t - lambda_i), constant term first, including the leading coefficient 1."""
        product = [self.K.one]
        for root in self.lam:
            product = _times_linear(self.K, product, root)
        return product

    @property
    def chi(self) -> Sequence[Any]:
        """The coefficients of chi, constant term first."""
        return self.known_chi if self.known_chi is not None else self.chi_of_roots

    def horner(self, k: int) -> Any:
        """C_k(A) = A^(m-1-k) + c_(m-1) A^(m-2-k) + ... + c_(k+1), Horner's polynomial of chi = sum c_k t^k."""
        return self.sum([self.A_to(j - k - 1) * self.chi[j] for j in range(k + 1, self.m + 1)])

    # ---- integrals and the Poisson tensor -----------------------------------------------------------------------

    @cache_by_id
    def integral(self, g: SystemOver, x: Any) -> Any:
        """Return x^T J y/eps with y = Phi_g(x): H~ for g = f, K~ for an associated g."""
        return self.dot(x, self.J * self.step(g, x)) / self.eps

    @cache_by_id
    def H_tilde(self, x: Any) -> Any:
        """H~(x, eps)."""
        return self.integral(self.f, x)

    @cache_by_id
    def H_tilde_(self, i: int, x: Any) -> Any:
        """H~_i = eps^{-1} x^T J (A^T)^i x~, a perturbation of -6 H_i."""
        image = self.A_to(i).transpose() * self.step(self.f, x)
        return self.dot(x, self.J * image) / self.eps

    @cache_by_id
    def modified_K(self, B: Any, x: Any) -> Any:
        """Return K + (2 eps/3) nabla K^T (I - eps g')^{-1} g for the associated g; it tends to K for eps -> 0."""
        g = self.f if B is self.I else self.g(B)
        increment = self.solve(self.minus_eps_jac(g, x), self.value(g, x))
        return self.potential(B, x) + self.dot(B * self.grad(x), increment) * self.eps * self.number(2, 3)

    def modified_H(self, x: Any) -> Any:
        """H + (2 eps/3) nabla H^T (I - eps f')^{-1} f."""
        return self.modified_K(self.I, x)

    def Pi(self, x: Any) -> Any:
        """The Poisson tensor J - eps^2 f'(x)^2 J."""
        return self.J - self.square(x) * self.J * (self.eps * self.eps)

    # ---- f'^2 as a combination of I and the B_i -----------------------------------------------------------------

    @cache_by_id
    def square(self, x: Any) -> Any:
        """f'(x)^2."""
        return self.jac(self.f, x) * self.jac(self.f, x)

    @cache_by_id
    def projector(self, i: int) -> Any:
        """Return the projector onto the eigenspace for lambda_i: prod_{j != i} (A - lambda_j)/(lambda_i - lambda_j)."""
        product = self.I
        for j in self.each:
            if j != i:
                product = product * (self.A - self.I * self.lam[j]) * (self.K.one / (self.lam[i] - self.lam[j]))
        return product

    @cache_by_id
    def eigenvalue_of_square(self, i: int, x: Any) -> Any:
        """Return -D_i, the eigenvalue of f'^2 on the eigenspace of A^T for lambda_i; D_i = det f' on this plane."""
        return self.trace(self.projector(i).transpose() * self.square(x)) * self.number(1, 2)

    def block_determinant(self, i: int, x: Any) -> Any:
        """Return D_i, the determinant of f'(x) on the eigenspace of A^T for lambda_i, a plane."""
        return -self.eigenvalue_of_square(i, x)

    @cache_by_id
    def eighth_of_trace(self, x: Any) -> Any:
        """tr f'^2/8."""
        return self.trace(self.square(x)) * self.number(1, 8)

    @cache_by_id
    def p0(self, x: Any) -> Any:
        """Return p_0 = (4 - m)/8 tr f'^2; for m = 3 this is the paper's 1/8 tr f'^2."""
        return self.eighth_of_trace(x) * self.number(4 - self.m)

    @cache_by_id
    def q(self, i: int, x: Any) -> Any:
        """q_i = 1/8 tr (B_i^T f'^2)."""
        return self.trace(self.B(i).transpose() * self.square(x)) * self.number(1, 8)

    @cache_by_id
    def coefficient_of_power(self, k: int, x: Any) -> Any:
        """Return pi_k, where f'^2 = sum_k pi_k (A^T)^k; for m = 3 these are the paper's p, q, r."""
        value = self.p0(x) if k == 0 else self.K.zero
        for i in self.each:
            value = value + self.lagrange(i)[k] * self.q(i, x)
        return value

    @cache_by_id
    def s(self, i: int, x: Any) -> Any:
        """s_i = 1 - eps^2 (p_0 + sum_j q_j - 2 q_i), the factor of det(I - eps f') that belongs to lambda_i."""
        total = self.p0(x) - self.q(i, x) * self.number(2)
        for j in self.each:
            total = total + self.q(j, x)
        return self.K.one - self.eps * self.eps * total

    @cache_by_id
    def reciprocals(self, x: Any) -> Any:
        """sum_i 1/s_i."""
        return self.sum([self.K.one / self.s(i, x) for i in self.each])

    @cache_by_id
    def P0(self, x: Any) -> Any:
        """P_0 = ((m - 2)^2 + (4 - m) sum 1/s_j)/4; for m = 3 this is the paper's (1/s_0 + 1/s_1 + 1/s_2 + 1/s_3)/4."""
        m = self.m
        return (self.number((m - 2) ** 2) + self.number(4 - m) * self.reciprocals(x)) * self.number(1, 4)

    @cache_by_id
    def Q(self, i: int, x: Any) -> Any:
        """Q_i = (2 - m + sum 1/s_j - 2/s_i)/(4 eps^2)."""
        numerator = self.number(2 - self.m) + self.reciprocals(x) - self.number(2) / self.s(i, x)
        return numerator / (self.number(4) * self.eps * self.eps)

    # ---- variations ---------------------------------------------------------------------------------------------

    def over_dual_numbers(self) -> PaperObjects:
        """The objects over the dual numbers K[d]/(d^2)."""
        if "over_dual_numbers" not in self._cache:
            dual = DualField(self.K)

            def lift(value: Any) -> Any:
                if value is None:
                    return None
                if isinstance(value, tuple):
                    return tuple(map(lift, value))
                if isinstance(value, SystemOver):
                    return SystemOver(dual, lift(value.tensor), lift(value.B), lift(value.c))
                return dual.lift_matrix(value) if hasattr(value, "entries") else dual.convert(value)

            dual_fields = {name: lift(getattr(self, name)) for name in _IN_K}
            self._cache["over_dual_numbers"] = self.replace(
                K=dual, draw=lambda name: dual.lift_matrix(self.vector(name)), **dual_fields
            )
        objects: PaperObjects = self._cache["over_dual_numbers"]
        return objects

    def replace(self, **changes: Any) -> PaperObjects:
        """Return objects with some of the data replaced, and an empty cache."""
        current = {entry.name: getattr(self, entry.name) for entry in fields(PaperObjects)}
        return PaperObjects(**{**current, "_cache": {}, **changes})

    def inhomogeneous(self) -> PaperObjects:
        """Add random quadratic and linear terms to H such that A nabla^2 H = nabla^2 H A^T still holds.

        The quadratic part has the Hesse matrix X = sum_u sum_i A^i u u^T C_i(A)^T over three vectors u, where C_i are
        Horner's polynomials of chi: A X - X A^T = sum_u (chi(A) u u^T - u u^T chi(A)^T) = 0. The linear part is
        arbitrary.
        """
        if self.hessian_of_quadratic_part is not None:
            return self
        if "inhomogeneous" not in self._cache:
            X = self.zeros(self.n, self.n)
            linear = self.zeros(self.n, 1)
            if self.lower_terms is not None:
                X, linear = self.lower_terms
            elif self.varied:
                linear = self.vector("linear")
                for name in ("u1", "u2", "u3"):
                    u = self.vector(name)
                    for i in range(self.m):
                        X = X + self.A_to(i) * u * (self.horner(i) * u).transpose()
            base = self.base
            self._cache["inhomogeneous"] = self.replace(
                hessian_of_quadratic_part=X,
                gradient_of_linear_part=linear,
                base=base and SystemOver(self.K, base.tensor, self.J * X, self.J * linear),
                draw=self.vector,
            )
        objects: PaperObjects = self._cache["inhomogeneous"]
        return objects

    def arbitrary_system(self, is_homogeneous: bool = False) -> SystemOver:
        """Return a quadratic system f = Q + B x + c whose Q, B and c are random."""
        n, K = self.n, self.K
        rows: dict[tuple[int, int], Any] = {}
        for j in range(n):
            for k in range(j, n):
                rows[j, k] = rows[k, j] = self.vector(f"f'' {j} {k}")
        tensor = [rows[j, k][i, 0] for i in range(n) for j in range(n) for k in range(n)]
        if is_homogeneous:
            return SystemOver(K, K.matrix(n * n, n, tensor))
        linear = self.columns([self.vector(f"B {j}") for j in range(n)])
        return SystemOver(K, K.matrix(n * n, n, tensor), linear, self.vector("c"))

    def arbitrary_system_over_the_algebra(self) -> SystemOver:
        """Return a planar quadratic system over Q[A^T]: a sum of terms M_a(x) M_b(x) e and M_c(x) e', and a constant.

        M_a(x) = sum_k (a^T (A^T)^k x) C_k(A)^T with Horner's polynomials C_k of chi and random vectors a, b, c, e, e'.
        Since chi(A) = 0, M_a is linear over Q[A^T]; every Q[A^T]-valued linear form has this form.
        """
        n, K = self.n, self.K

        def linear_form(name: str) -> list[Any]:
            power_vectors = [self.A_to(k) * self.vector(name) for k in range(self.m)]
            horner = [self.horner(k).transpose() for k in range(self.m)]
            return [self.sum([h * p[j, 0] for h, p in zip(horner, power_vectors, strict=True)]) for j in range(n)]

        rows: list[list[Any]] = [[K.zero] * (n * n) for _ in range(n)]
        for term in ("1", "2"):
            a, b, e = linear_form(f"a{term}"), linear_form(f"b{term}"), self.vector(f"e{term}")
            for j, k in itertools.product(range(n), repeat=2):
                value = a[j] * (b[k] * e) + a[k] * (b[j] * e)
                for i in range(n):
                    rows[i][j * n + k] = rows[i][j * n + k] + value[i, 0]
        linear = self.columns([M * self.vector("e'") for M in linear_form("c")])
        return SystemOver(K, K.matrix(n * n, n, [entry for row in rows for entry in row]), linear, self.vector("f(0)"))

    def arbitrary_hamiltonian(self, has_standard_J: bool = False) -> PaperObjects:
        """Return objects with a random H, of terms of all degrees up to 3, and the standard J or a random skew J."""
        n, K = self.n, self.K
        entry_of: dict[tuple[int, ...], Any] = {}
        for i, j in itertools.combinations_with_replacement(range(n), 2):
            entries = self.vector(f"H {i} {j}")
            for k in range(j, n):
                for indices in itertools.permutations((i, j, k)):
                    entry_of[indices] = entries[k, 0]
        d3H = K.matrix(n * n, n, [entry_of[indices] for indices in itertools.product(range(n), repeat=3)])
        X = self.columns([self.vector(f"X {j}") for j in range(n)])
        J = self.columns([self.vector(f"J {j}") for j in range(n)])
        return self.replace(
            d3H=d3H,
            hessian_of_quadratic_part=X + X.transpose(),
            gradient_of_linear_part=self.vector("linear"),
            J=self.J if has_standard_J else J - J.transpose(),
            base=None,
            draw=self.vector,
        )

    def symplectic_normal_form(self) -> tuple[Any, Any]:
        """Return S and the companion matrix W of chi, for which A S = S diag(W, W^T) and S^T J S = J.

        A is self-adjoint for the form u^T J w. Hence e, A e, ..., A^{m-1} e span an isotropic space for any vector e.
        The basis dual to e, A e, ... is taken from the isotropic space spanned by h, A h, ... for another vector h.
        """
        m, K = self.m, self.K
        e, h = self.vector("e"), self.vector("h")
        U, V = ([self.A_to(i) * vector for i in range(m)] for vector in (e, h))
        gram = K.matrix(m, m, [self.dot(u, self.J * v) for u in U for v in V])
        column_blocks = [self.columns(U), self.columns(V) * solve(gram, K.identity(m))]
        S = K.matrix(self.n, self.n, [block[i, j] for i in range(self.n) for block in column_blocks for j in range(m)])
        return S, self.companion(self.chi)

    def companion(self, chi: Sequence[Any]) -> Any:
        """Return the companion matrix of a monic polynomial: its last column has the negative coefficients of chi."""
        m, one, zero = self.m, self.K.one, self.K.zero
        entries = [-chi[i] if j == m - 1 else one if i == j + 1 else zero for i in range(m) for j in range(m)]
        return self.K.matrix(m, m, entries)

    def block_diagonal(self, W: Any) -> Any:
        """Return diag(W, W^T) for an m x m matrix W."""
        m, zeros = self.m, [self.K.zero] * self.m
        rows = [[W[i, j] for j in range(m)] + zeros for i in range(m)]
        rows += [zeros + [W[j, i] for j in range(m)] for i in range(m)]
        return self.K.matrix(self.n, self.n, [entry for row in rows for entry in row])

    def is_zero(self, matrix: Any) -> bool:
        """Whether all entries are zero."""
        return all(self.K.is_zero(entry) for entry in matrix.entries())

    def is_standard(self, matrix: Any) -> bool:
        """Whether the matrix is [[0, I], [-I, 0]]."""
        expected = [self.number((j == i + self.m) - (i == j + self.m)) for i in range(self.n) for j in range(self.n)]
        return all(self.K.equal(a, b) for a, b in zip(matrix.entries(), expected, strict=True))

    def rank_of_cubic_equations(self) -> int:
        """Return the rank of the linear system A nabla^2 H = nabla^2 H A^T for the coefficients of a cubic H."""
        n, K = self.n, self.K
        index_of_pair = {pair: k for k, pair in enumerate(itertools.combinations(range(n), 2))}
        rows = []
        for a, b, c in itertools.combinations_with_replacement(range(n), 3):
            row = [K.zero] * (n * len(index_of_pair))
            # The entries (j, k) and (k, j) of the Hesse matrix of x_a x_b x_c contain x_l for {j, k, l} = {a, b, c}.
            for j, k, l in set(itertools.permutations((a, b, c))):
                factor = self.number({1: 6, 2: 2, 3: 1}[len({a, b, c})])  # the third derivative of x_a x_b x_c
                for i in range(n):  # add A_ij to entry (i, k) of A nabla^2 H and to entry (k, i) of nabla^2 H A^T
                    if i != k:
                        column = l * len(index_of_pair) + index_of_pair[min(i, k), max(i, k)]
                        row[column] = row[column] + self.A[i, j] * (factor if i < k else -factor)
            rows.append(row)
        return rank(K, K.matrix(len(rows), len(rows[0]), [entry for row in rows for entry in row]))


def _times_linear(K: Field, polynomial: Sequence[Any], root: Any) -> list[Any]:
    """Return (t - root) times a polynomial in t; both are lists of coefficients, constant term first."""
    product = [K.zero, *polynomial]
    for k, coefficient in enumerate(polynomial):
        product[k] = product[k] - root * coefficient
    return product
