"""Quadratic systems x' = f(x) = Q(x, x) + B x + c with rational coefficients.

Source: petrera-suris-2016, eq. (eq: diff eq gen). `QuadraticSystem` is the system over Q, in the named variables;
`SystemOver` is the same carried into a field, with everything the Kahan map needs: value, Jacobian, polarisation.
Both work from the constant tensor f'' instead of Q = f''/2, so that they make sense modulo 2 as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz, fmpz_mat

from kahanmaps.algebra.fields import Field, rational
from kahanmaps.algebra.numerals import check_names
from kahanmaps.algebra.polynomials import degree, evaluate, names_of, ring
from kahanmaps.algebra.text import format_polynomial, parse_polynomial
from kahanmaps.displayed import DisplayedAsFormula
from kahanmaps.errors import InputError

# f'' has dim^3 entries: 10^6 of them at the largest dimension.
MAX_DIMENSION = 100
LONG_COEFFICIENTS = 2_000  # digits, with which equations in them are no longer set up and solved


@dataclass(frozen=True, eq=False)
class QuadraticSystem(DisplayedAsFormula):
    """x' = Q(x, x) + B x + c: one symmetric matrix `Q[i]` a component, the matrix `B`, the vector `c`, all over Q.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y - x", "1/2*x^2"])
    >>> system.Q[0]
    [  0, 1/2]
    [1/2,   0]
    >>> system.is_homogeneous
    False
    """

    variables: tuple[str, ...]
    Q: tuple[fmpq_mat, ...]
    B: fmpq_mat
    c: tuple[fmpq, ...]
    _over: dict[Field, SystemOver] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        n = len(self.variables)
        if n == 0:
            raise InputError("found a system without variables, expected at least one")
        if n > MAX_DIMENSION:
            raise InputError(f"found a system of dimension {n}, expected at most {MAX_DIMENSION}")
        check_names(self.variables)
        if len(self.Q) != n or len(self.c) != n or (self.B.nrows(), self.B.ncols()) != (n, n):
            raise InputError(
                f"found {len(self.Q)} quadratic forms, a {self.B.nrows()} x {self.B.ncols()} matrix B and "
                f"{len(self.c)} constants, expected {n}, {n} x {n} and {n} for {n} variables"
            )
        for name, form in zip(self.variables, self.Q, strict=True):
            if (form.nrows(), form.ncols()) != (n, n) or form != form.transpose():
                raise InputError(f"the quadratic form of {name}' must be a symmetric {n} x {n} matrix")

    @classmethod
    def from_polynomials(cls, rhs: Sequence[fmpq_mpoly]) -> QuadraticSystem:
        """The system with these right-hand sides, in the variables of their ring.

        Raises InputError where their number is not that of the variables, or a degree exceeds 2.
        """
        if not rhs:
            raise InputError("found no right-hand side, expected one for every variable")
        names = names_of(rhs[0])
        n = len(names)
        if len(rhs) != n:
            raise InputError(
                f"found {len(rhs)} right-hand sides for the {n} variables {', '.join(names)}, expected {n}"
            )
        forms, linear, constants = [], [fmpq(0)] * (n * n), [fmpq(0)] * n
        for i, polynomial in enumerate(rhs):
            if degree(polynomial) > 2:
                raise InputError(
                    f"the right-hand side of {names[i]}' has degree {degree(polynomial)}, expected at most 2: "
                    "Kahan's discretization is defined for quadratic systems"
                )
            form = [fmpq(0)] * (n * n)
            for monomial, coefficient in polynomial.terms():
                where = [j for j, exponent in enumerate(monomial) for _ in range(exponent)]
                if len(where) == 2:
                    form[where[0] * n + where[1]] += coefficient / 2
                    form[where[1] * n + where[0]] += coefficient / 2
                elif len(where) == 1:
                    linear[i * n + where[0]] = coefficient
                else:
                    constants[i] = coefficient
            forms.append(fmpq_mat(n, n, form))
        return cls(names, tuple(forms), fmpq_mat(n, n, linear), tuple(constants))

    @classmethod
    def from_text(
        cls, variables: Sequence[str], rhs: Sequence[str], parameters: dict[str, Any] | None = None
    ) -> QuadraticSystem:
        """The system with these right-hand sides written as text; parameters are exact numbers."""
        check_names(variables)
        constants = {name: rational(value) for name, value in (parameters or {}).items()}
        return cls.from_polynomials([parse_polynomial(text, variables, constants) for text in rhs])

    @property
    def dim(self) -> int:
        """The number of variables."""
        return len(self.variables)

    @cached_property
    def is_homogeneous(self) -> bool:
        """Whether B = 0 and c = 0."""
        return not any(entry != 0 for entry in self.B.entries()) and not any(entry != 0 for entry in self.c)

    @cached_property
    def rhs(self) -> tuple[fmpq_mpoly, ...]:
        """The components of f as polynomials."""
        n, context = self.dim, ring(self.variables)
        polynomials = []
        for i in range(n):
            terms: dict[tuple[int, ...], fmpq] = {(0,) * n: self.c[i]}
            for j in range(n):
                terms[_exponents(n, j)] = self.B[i, j]
                for k in range(j, n):
                    entry = self.Q[i][j, k]
                    if entry != 0:
                        terms[_exponents(n, j, k)] = entry if j == k else 2 * entry
            polynomials.append(context.from_dict({m: value for m, value in terms.items() if value != 0}))
        return tuple(polynomials)

    @cached_property
    def divergence(self) -> fmpq_mpoly:
        """The trace of f'(x), a polynomial of degree at most 1."""
        context = ring(self.variables)
        total = context.constant(0)
        for i, polynomial in enumerate(self.rhs):
            total = total + polynomial.derivative(i)
        return total

    @property
    def is_divergence_free(self) -> bool:
        """Whether the flow preserves the volume."""
        return bool(self.divergence.is_zero())

    def scaled(self, factor: Any) -> QuadraticSystem:
        """The system x' = factor f(x). Its Kahan map at eps is that of f at factor eps."""
        by = rational(factor)
        return QuadraticSystem(
            self.variables, tuple(form * by for form in self.Q), self.B * by, tuple(entry * by for entry in self.c)
        )

    def transformed(self, matrix: fmpq_mat) -> QuadraticSystem:
        """The system x' = C f(x) for a constant matrix C = `matrix`."""
        n = self.dim
        forms = []
        for i in range(n):
            form = fmpq_mat(n, n)
            for j in range(n):
                if matrix[i, j] != 0:
                    form = form + self.Q[j] * matrix[i, j]
            forms.append(form)
        constants = (matrix * fmpq_mat(n, 1, list(self.c))).entries()
        return QuadraticSystem(self.variables, tuple(forms), matrix * self.B, tuple(constants))

    def reordered(self, variables: Sequence[str]) -> QuadraticSystem:
        """The same system with its variables in another order.

        >>> QuadraticSystem.from_text(["y", "x"], ["x^2", "x*y"]).reordered(["x", "y"]).rhs
        (x*y, x^2)
        """
        n, at = self.dim, [self.variables.index(name) for name in variables]
        if len(at) != n or len(set(at)) != n:
            raise InputError(f"found the variables {', '.join(variables)}, expected {', '.join(self.variables)}")

        def moved(matrix: fmpq_mat) -> fmpq_mat:
            return fmpq_mat(n, n, [matrix[i, j] for i in at for j in at])

        return QuadraticSystem(
            tuple(variables), tuple(moved(self.Q[i]) for i in at), moved(self.B), tuple(self.c[i] for i in at)
        )

    def over(self, field_of_numbers: Field) -> SystemOver:
        """The same system with its coefficients in another field. Raises BadPrime where GF(p) does not allow it."""
        found = self._over.get(field_of_numbers)
        if found is None:
            if len(self._over) >= 8:  # random primes come and go
                self._over.clear()
            found = self._over[field_of_numbers] = SystemOver(field_of_numbers, self)
        return found

    @cached_property
    def integer_form(self) -> tuple[fmpz, fmpz_mat, fmpz_mat, fmpz_mat]:
        """(L, T, LB, Lc): the least L > 0 with L f'', L B, L c integral, L f'' as the n^2 x n matrix T,
        row i n + j of which gives the coefficients of the linear form L (f' - B)[i, j]."""
        n = self.dim
        tensor = _tensor(self)
        below = fmpz(1)
        for entry in [*tensor, *self.B.entries(), *self.c]:
            below = below.lcm(entry.q)

        def integers(entries: Sequence[fmpq]) -> list[fmpz]:
            return [entry.p * (below // entry.q) for entry in entries]

        return (
            below,
            fmpz_mat(n * n, n, integers(tensor)),
            fmpz_mat(n, n, integers(self.B.entries())),
            fmpz_mat(n, 1, integers(self.c)),
        )

    @cached_property
    def digits(self) -> int:
        """About how many decimal digits the longest of the integers in `integer_form` has."""
        below, *matrices = self.integer_form
        entries = (entry for matrix in matrices for entry in matrix.entries())
        return int(max(below.bit_length(), *(entry.bit_length() for entry in entries)) * 0.30103) + 1

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, QuadraticSystem):
            return NotImplemented
        mine = (self.variables, self.Q, self.B, self.c)
        return mine == (other.variables, other.Q, other.B, other.c)

    def __hash__(self) -> int:
        # B and Q would make it slow; equal systems have equal hashes all the same.
        return hash((self.variables, self.c))

    def __str__(self) -> str:
        pairs = zip(self.variables, self.rhs, strict=True)
        return "\n".join(f"{name}' = {format_polynomial(polynomial)}" for name, polynomial in pairs)


class SystemOver:
    """A quadratic system with coefficients in `field`; points are sequences of its elements, matrices FLINT's.

    Made from a rational system, or by `from_tensor` from coefficients that the rationals do not hold.
    """

    def __init__(self, field: Field, system: QuadraticSystem) -> None:
        n = system.dim
        self.field = field
        self.dim = n
        self._rhs: tuple[fmpq_mpoly, ...] | None = system.rhs
        self.B = field.convert_matrix(system.B)
        self.c = field.column([field.convert(entry) for entry in system.c])
        self._tensor = field.convert_matrix(fmpq_mat(n * n, n, _tensor(system)))

    @classmethod
    def from_tensor(cls, field: Field, tensor: Any, B: Any = None, c: Any = None) -> SystemOver:
        """The system with f'' = `tensor`, an n^2 x n matrix over the field; row i n + j gives d f_i'/dx_j.

        Without `B` and `c` it is homogeneous. The characteristic must not be 2.
        """
        system = cls.__new__(cls)
        n = tensor.ncols()
        system.field, system.dim, system._rhs, system._tensor = field, n, None, tensor
        system.B = field.matrix(n, n, [field.zero] * (n * n)) if B is None else B
        system.c = field.column([field.zero] * n) if c is None else c
        return system

    @property
    def tensor(self) -> Any:
        """f'' as an n^2 x n matrix: entry (i n + j, k) is the derivative of f_i by x_j and x_k."""
        return self._tensor

    def transformed(self, matrix: Any) -> SystemOver:
        """The system x' = C f(x) for a constant matrix C = `matrix` over the field."""
        n, field = self.dim, self.field
        with field.working():
            rows = matrix * field.matrix(n, n * n, self._tensor.entries())
            tensor = field.matrix(n * n, n, rows.entries())
            return SystemOver.from_tensor(field, tensor, matrix * self.B, matrix * self.c)

    def hessian_times(self, vector: Sequence[Any]) -> Any:
        """The matrix f''(v), with f'(x + v) = f'(x) + f''(v)."""
        with self.field.working():
            return self.field.matrix(self.dim, self.dim, (self._tensor * self.field.column(vector)).entries())

    def jacobian(self, point: Sequence[Any]) -> Any:
        """The Jacobi matrix f'(x)."""
        with self.field.working():
            return self.hessian_times(point) + self.B

    def value(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """f(x)."""
        if self._rhs is None:
            return self.polarised(point, point)
        return tuple(evaluate(polynomial, self.field, point) for polynomial in self._rhs)

    def polarised(self, x: Sequence[Any], y: Sequence[Any]) -> tuple[Any, ...]:
        """Q(x, y) + B (x + y)/2 + c, the right-hand side of the Kahan map's defining equation (not modulo 2)."""
        half = self.field.convert(fmpq(1, 2))
        column_x, column_y = self.field.column(x), self.field.column(y)
        with self.field.working():
            return tuple(
                (self.hessian_times(x) * column_y * half + self.B * (column_x + column_y) * half + self.c).entries()
            )


def _tensor(system: QuadraticSystem) -> list[fmpq]:
    """The entries 2 Q[i][j, k] of f'', i slowest."""
    return [2 * entry for form in system.Q for entry in form.entries()]


def _exponents(n: int, *indices: int) -> tuple[int, ...]:
    exponents = [0] * n
    for index in indices:
        exponents[index] += 1
    return tuple(exponents)
