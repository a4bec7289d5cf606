"""Quadratic systems x' = f(x) = Q(x, x) + B x + c, exact, possibly with symbols in the coefficients.

Source: petrera-suris-2016, eq. (eq: diff eq gen). `QuadraticSystem` is the system over Q, in named variables and
symbols; `SystemOver` is the system over another field, with the value, the Jacobian and the polarization that the Kahan
map needs. `SystemOver` uses the constant tensor f'' instead of Q = f''/2, so that it is also defined modulo 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ, Field, rational
from kahanmaps.algebra.parsing import check_names, parse_polynomial
from kahanmaps.algebra.polynomials import digits_of, evaluate, linear_combinations, names_of, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.display_protocols import LatexDisplay, shorten
from kahanmaps.errors import InputError, counted
from kahanmaps.systems.polynomial import PolynomialField

# f'' has dim^3 entries: 10^6 for the largest dimension.
MAX_DIMENSION = 100
LONG_COEFFICIENTS = 2_000  # number of digits; equations with longer coefficients are not set up and solved


@dataclass(frozen=True, eq=False)
class QuadraticSystem(PolynomialField, LatexDisplay):
    """A quadratic system x' = f(x).

    `rhs` are polynomials over Q in the variables and `symbols` (symbolic constants, possibly eps), of degree at most 2
    in the variables. Raises InputError for a wrong number of right-hand sides, and for a degree above 2.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y - x", "1/2*x^2"])
    >>> system.Q[0]
    [  0, 1/2]
    [1/2,   0]
    >>> system.is_homogeneous
    False
    """

    _systems_by_field: dict[Field, SystemOver] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rhs", tuple(self.rhs))
        if not self.rhs:
            raise InputError("found no right-hand side, expected one for every variable")
        names, n = self.variables, self.dim
        if n > MAX_DIMENSION:
            raise InputError(f"found a system of dimension {n}, expected at most {MAX_DIMENSION}")
        check_names(names)
        if len(self.rhs) != n:
            raise InputError(
                f"found {counted(len(self.rhs), 'right-hand side')}, expected {n}, one for each of {', '.join(names)}"
            )
        for name, polynomial in zip(names, self.rhs, strict=True):
            degree = max((sum(m[:n]) for m in polynomial.monoms()), default=0)
            if degree > 2 and self.symbols:
                raise InputError(
                    f"found right-hand sides of degree {degree} in the variables with {', '.join(self.symbols)} as "
                    "symbols, expected at most 2: give the parameter that makes them cubic a value"
                )
            if degree > 2:
                raise InputError(
                    f"the right-hand side of {name}' has degree {degree}, expected at most 2: "
                    "Kahan's discretization is defined for quadratic systems"
                )

    @classmethod
    def from_text(
        cls, variables: Sequence[str], rhs: Sequence[str], parameters: dict[str, Any] | None = None
    ) -> QuadraticSystem:
        """Parse right-hand sides; `parameters` maps names to exact numbers."""
        check_names(variables)
        constants = {name: rational(value) for name, value in (parameters or {}).items()}
        return cls(tuple(parse_polynomial(text, variables, constants) for text in rhs))

    @cached_property
    def is_homogeneous(self) -> bool:
        """Whether B = 0 and c = 0."""
        return all(sum(m[: self.dim]) == 2 for polynomial in self.rhs for m in polynomial.monoms())

    @property
    def _over_rationals(self) -> SystemOver:
        """The system over Q. Raises InputError if there are symbols."""
        if self.symbols:
            raise InputError(f"found the symbols {', '.join(self.symbols)} in the coefficients, expected numbers")
        return self.over(QQ)

    @cached_property
    def Q(self) -> tuple[fmpq_mat, ...]:
        """The symmetric matrices Q_i of the quadratic terms x^T Q_i x of f_i(x); only for systems without symbols."""
        n, entries = self.dim, (self._over_rationals.tensor / 2).entries()
        return tuple(fmpq_mat(n, n, entries[i * n * n : (i + 1) * n * n]) for i in range(n))

    @cached_property
    def B(self) -> fmpq_mat:
        """The matrix of the linear part; only for systems without symbols."""
        matrix: fmpq_mat = self._over_rationals.B
        return matrix

    @cached_property
    def c(self) -> tuple[fmpq, ...]:
        """The constant terms; only for systems without symbols."""
        return tuple(self._over_rationals.c.entries())

    def scaled(self, factor: Any) -> QuadraticSystem:
        """Return the system x' = factor f(x). Its Kahan map at eps is the Kahan map of f at factor * eps."""
        multiplier = rational(factor)
        return QuadraticSystem(tuple(polynomial * multiplier for polynomial in self.rhs), self.symbols)

    def transformed(self, matrix: fmpq_mat) -> QuadraticSystem:
        """Return the system x' = C f(x) for a constant matrix C = `matrix`."""
        return QuadraticSystem(linear_combinations(matrix, self.rhs), self.symbols)

    def composed(self, matrix: fmpq_mat, shift: Sequence[fmpq]) -> QuadraticSystem:
        """Return the system x' = f(P x + q) for P = `matrix` and q = `shift`, without symbols.

        >>> print(QuadraticSystem.from_text(["x"], ["x^2"]).composed(fmpq_mat([[2]]), [fmpq(1)]))
        x' = 4*x^2 + 4*x + 1
        """
        context = ring(self.variables)
        images = [a + q for a, q in zip(linear_combinations(matrix, context.gens()), shift, strict=True)]
        return QuadraticSystem(tuple(polynomial.compose(*images, ctx=context) for polynomial in self.rhs))

    def renamed(self, variables: Sequence[str]) -> QuadraticSystem:
        """Return the system with new names of its variables; only for systems without symbols."""
        context = ring(variables)
        return QuadraticSystem(tuple(p.compose(*context.gens(), ctx=context) for p in self.rhs))

    def reordered(self, variables: Sequence[str]) -> QuadraticSystem:
        """Return the system with its variables in another order.

        >>> QuadraticSystem.from_text(["y", "x"], ["x^2", "x*y"]).reordered(["x", "y"]).rhs
        (x*y, x^2)
        """
        positions = [self.variables.index(name) for name in variables]
        if len(positions) != self.dim or len(set(positions)) != self.dim:
            raise InputError(f"found the variables {', '.join(variables)}, expected {', '.join(self.variables)}")
        context = ring((*variables, *self.symbols))
        images = [context.gen(context.names().index(name)) for name in (*self.variables, *self.symbols)]
        return QuadraticSystem(tuple(self.rhs[i].compose(*images, ctx=context) for i in positions), self.symbols)

    def at(self, values: Sequence[Any]) -> QuadraticSystem:
        """Return the system with numbers substituted for its symbols."""
        context = ring(self.variables)
        images = [*context.gens(), *(context.constant(value) for value in values)]
        return QuadraticSystem(tuple(polynomial.compose(*images, ctx=context) for polynomial in self.rhs))

    def f(self, *point: Any, **named: Any) -> Any:
        """Return the right-hand sides at a point, like `SystemFile.f`. Raises InputError if there are symbols."""
        if self.symbols:
            raise InputError(f"found the symbols {', '.join(self.symbols)}, expected numbers: system.at(values).f(x)")
        values: Any = import_module("kahanmaps.maps.values")  # a module of a higher layer
        return values.values_at(self.rhs, self.variables, values.point_of(point, named))

    def jacobian(self, names: Sequence[str]) -> list[list[fmpq_mpoly]]:
        """Return the entries of f'(x), polynomials in `names`; these include the variables and the symbols."""
        context = ring(names)
        images = [context.gen(list(names).index(name)) for name in names_of(self.rhs[0])]
        return [[p.derivative(k).compose(*images, ctx=context) for k in range(self.dim)] for p in self.rhs]

    def over(self, field_of_numbers: Field, values: Sequence[Any] = ()) -> SystemOver:
        """Return the system over a field, with elements of the field for the symbols.

        Raises BadPrime if the prime divides the denominator of a coefficient.
        """
        if self.symbols:
            return SystemOver.of(field_of_numbers, self, values)
        system = self._systems_by_field.get(field_of_numbers)
        if system is None:
            if len(self._systems_by_field) >= 8:  # systems modulo random primes are not needed for long
                self._systems_by_field.clear()
            system = self._systems_by_field[field_of_numbers] = SystemOver.of(field_of_numbers, self)
        return system

    @cached_property
    def digits(self) -> int:
        """The approximate number of decimal digits of the longest coefficient, with all over a common denominator."""
        return digits_of(self.rhs)

    def __repr__(self) -> str:
        return f"QuadraticSystem({shorten(', '.join(str(self).splitlines()), 100)})"

    def __str__(self) -> str:
        pairs = zip(self.variables, self.rhs, strict=True)
        return "\n".join(f"{name}' = {format_polynomial(polynomial)}" for name, polynomial in pairs)


@dataclass(frozen=True, eq=False)
class SystemOver:
    """A quadratic system with coefficients in `field`; points are sequences of field elements, matrices are FLINT's.

    `tensor` is f'' as an n^2 x n matrix: entry (i n + j, k) is the derivative of f_i by x_j and x_k. If `B` and `c` are
    None, the system is homogeneous.
    """

    field: Field
    tensor: Any
    B: Any = None
    c: Any = None
    rational_system: QuadraticSystem | None = None  # the system from which this was made, if it has no symbols

    def __post_init__(self) -> None:
        n, field = self.dim, self.field
        if self.B is None:
            object.__setattr__(self, "B", field.matrix(n, n, [field.zero] * (n * n)))
        if self.c is None:
            object.__setattr__(self, "c", field.column([field.zero] * n))

    @classmethod
    def of(cls, field: Field, system: QuadraticSystem, values: Sequence[Any] = ()) -> SystemOver:
        """Return the system over a field, with elements of the field for its symbols.

        Raises BadPrime if the prime divides the denominator of a coefficient.
        """
        n, zero = system.dim, field.zero
        tensor, linear_entries, constants = [zero] * n**3, [zero] * (n * n), [zero] * n

        def add(entries: list[Any], index: int, value: Any) -> None:
            entries[index] = value if entries[index] is zero else entries[index] + value

        with field.working():
            for i, polynomial in enumerate(system.rhs):
                for monomial, coefficient in polynomial.terms():
                    # The indices of the variables in the monomial, each as often as it occurs.
                    indices = [j for j, exponent in enumerate(monomial[:n]) for _ in range(exponent)]
                    # The second derivative of c x_j^2 is 2 c. So f'' is defined modulo 2, though Q = f''/2 is not.
                    is_square = len(indices) == 2 and indices[0] == indices[1]
                    value = field.convert(coefficient * 2 if is_square else coefficient)
                    for exponent, symbol_value in zip(monomial[n:], values, strict=True):
                        for _ in range(exponent):  # in python-flint 0.9.0 a power of a ball around 0 is nan
                            value = value * symbol_value
                    if len(indices) == 2:
                        j, k = indices
                        add(tensor, (i * n + j) * n + k, value)
                        if j != k:
                            add(tensor, (i * n + k) * n + j, value)
                    elif len(indices) == 1:
                        add(linear_entries, i * n + indices[0], value)
                    else:
                        add(constants, i, value)
            matrices = field.matrix(n * n, n, tensor), field.matrix(n, n, linear_entries), field.column(constants)
        return cls(field, *matrices, None if system.symbols else system)

    @property
    def dim(self) -> int:
        """The number of variables."""
        return int(self.tensor.ncols())

    def transformed(self, matrix: Any) -> SystemOver:
        """Return the system x' = C f(x) for a constant matrix C = `matrix` over the field."""
        n, field = self.dim, self.field
        with field.working():
            rows = matrix * field.matrix(n, n * n, self.tensor.entries())
            return SystemOver(field, field.matrix(n * n, n, rows.entries()), matrix * self.B, matrix * self.c)

    def hessian_times(self, vector: Sequence[Any]) -> Any:
        """Return the matrix f''(v), which satisfies f'(x + v) = f'(x) + f''(v)."""
        with self.field.working():
            first_term, *other_terms = (
                derivative * self.field.convert(v) for derivative, v in zip(self._derivatives, vector, strict=True)
            )
            return sum(other_terms, first_term)

    @cached_property
    def _derivatives(self) -> list[Any]:
        """The matrices df'/dx_k. Their combination f''(v) takes a third of the time of a product with `tensor`."""
        n, entries = self.dim, self.tensor.entries()
        with self.field.working():
            return [self.field.matrix(n, n, entries[k::n]) for k in range(n)]

    def jacobian(self, point: Sequence[Any]) -> Any:
        """Return the Jacobi matrix f'(x)."""
        with self.field.working():
            return self.hessian_times(point) + self.B

    def value(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """Return f(x)."""
        if self.rational_system is None:
            return self.polarised(point, point)
        return tuple(evaluate(polynomial, self.field, point) for polynomial in self.rational_system.rhs)

    def polarised(self, x: Sequence[Any], y: Sequence[Any]) -> tuple[Any, ...]:
        """Return Q(x, y) + B (x + y)/2 + c, the right-hand side of the Kahan map's equation; not defined modulo 2."""
        one_half = self.field.convert(fmpq(1, 2))
        column_x, column_y = self.field.column(x), self.field.column(y)
        with self.field.working():
            mean = (column_x + column_y) * one_half
            return tuple((self.hessian_times(x) * column_y * one_half + self.B * mean + self.c).entries())


def as_system(value: Any) -> QuadraticSystem:
    """Convert a value that `maps.kahan.as_map` accepts to a quadratic system; of maps, only Kahan maps are accepted."""
    if isinstance(value, QuadraticSystem):
        return value
    system: QuadraticSystem = (
        import_module("kahanmaps.documents.inline").as_file(value).system
    )  # imported from a higher layer
    return system
