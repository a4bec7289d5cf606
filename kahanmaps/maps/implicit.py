"""Birational maps given by an equation M(x, eps) x~ = r(x, eps) for the image x~ of a point x.

M is a matrix and r a vector of polynomials. For Kahan's method and f(x) = Q(x, x) + B x + c, M = I - eps f' and r =
(I + eps B) x + 2 eps c; for a map given by rational functions, M is the diagonal matrix of their denominators. Other
discretizations that are linear in the new point have this form as well. There are three kinds of objects:

* `MapFamily` is the map over Q, with eps as a parameter. Its subclass `ImplicitMap` is made from M and r. To add a
  discretization, write a function that returns an `ImplicitMap`.
* `Map` is the map over one field at one eps: images, the inverse map, Jacobi matrices. It is a composition of factors
  (usually one), each an `ElementaryMap` with an equation.
* `Equation` contains the coefficients of M and r over that field (equation.py). All evaluators use it. This module
  contains the generic evaluator over any field.

In homogeneous coordinates (X : Z), x = X/Z, the equation says that L(X, Z) (X~ : Z~) = 0 for an n x (n + 1) matrix L =
(M | -r) of forms of one degree. If this degree is 1, exchanging (X : Z) and (X~ : Z~) gives the inverse map.
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial, reduce
from importlib import import_module
from operator import attrgetter, mul
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import QQ, Field, integer, rational
from kahanmaps.algebra.matrices import det, solve
from kahanmaps.algebra.polynomials import RationalFunction, digits_of, names_of, ring
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.algebra.roots import Root
from kahanmaps.display_protocols import LatexDisplay
from kahanmaps.errors import BadPrime, InputError, SingularMatrix, SingularStep
from kahanmaps.maps.equation import Equation, equation_of
from kahanmaps.maps.inverse import Rows, inverse_rows, why_not_birational
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.integer_steps import IntegerSteps
from kahanmaps.maps.values import coordinates, is_float_array, point_of
from kahanmaps.systems.polynomial import PolynomialField


class Map(LatexDisplay):
    """A composition of birational maps over a field, each at one eps; `eps` is None if the maps have different eps.

    For a map that does not depend on eps, `has_eps` is False and `eps` is arbitrary.
    """

    field: Field
    eps: Any
    dim: int
    variables: tuple[str, ...] = ()
    has_eps: bool = True

    def __init__(self, parts: Sequence[Map], eps: Any, variables: tuple[str, ...]) -> None:
        self.parts, self.eps, self.variables = tuple(parts), eps, variables
        self.field, self.dim, self.has_eps = parts[0].field, parts[0].dim, any(part.has_eps for part in parts)

    @cached_property
    def factors(self) -> tuple[ElementaryMap, ...]:
        """The elementary maps whose composition is this map, in the order of application."""
        return tuple(factor for part in self.parts for factor in part.factors)

    @cached_property
    def inverse(self) -> Map:
        """The inverse map. Raises InputError if the inverse is not known."""
        return Map([part.inverse for part in reversed(self.parts)], self.eps, self.variables)

    @cached_property
    def flow(self) -> tuple[Any, Any] | None:
        """The flow that the map approximates, as (vector field, time); None if it approximates none."""
        flows = [part.flow for part in self.parts]
        known_flows = [flow for flow in flows if flow is not None]
        if len(known_flows) < len(flows) or any(field != known_flows[0][0] for field, _ in known_flows):
            return None
        with self.field.working():
            return known_flows[0][0], sum((time for _, time in known_flows), self.field.zero)

    def __repr__(self) -> str:
        eps_text = "different eps" if self.eps is None else f"eps={self.field.format(self.eps)}"
        time_step_text = "" if self.flow is None else f", time step {self.field.format(self.flow[1])}"
        return f"Map({', '.join(self.variables)}; {eps_text}{time_step_text}, over {self.field})"

    def to_record(self) -> dict[str, Any]:
        """Return plain data about the map; "eps" is None if factors differ in eps, "time_step" is None without flow."""
        eps, step = (None if x is None else self.field.format(x) for x in (self.eps, self.flow and self.flow[1]))
        return {"map": repr(self), "eps": eps, "time_step": step}

    @property
    def equations(self) -> tuple[Equation, ...]:
        """The equations of the factors."""
        return tuple(factor.equation for factor in self.factors)

    @property
    def is_bilinear(self) -> bool:
        """Whether the equations, which are linear in the new point x~, are also linear in the old point x."""
        return all(equation.degree == 1 for equation in self.equations)

    def denominator_name(self, backward: bool) -> str:
        """Return the name of the matrix M(x) of the map or, if `backward` is True, of the inverse map."""
        return "M'(x)" if backward else "M(x)"

    def point(self, values: Any) -> tuple[Any, ...]:
        """Convert a sequence, {variable: value} or a text such as "1,2" to a point over the field.

        Raises InputError for a wrong number of coordinates and for inexact numbers.
        """
        return coordinates(values, self.field, self.variables, self.dim)

    def __call__(self, *point: Any, **named: Any) -> Any:
        """Return the image of a point: phi((1, 2)), phi(1, 2), phi("1,2"), phi({"x": 1, "y": 2}) or phi(x=1, y=2).

        The image of an array of floats, of shape (dim,) or (points, dim), is an array of floats, with NaN if the map is
        not defined. Calling without arguments returns the map itself, so that `phi.inverse()` works.
        """
        if not point and not named:
            return self
        x = point_of(point, named)
        if is_float_array(x):
            return import_module("kahanmaps.maps.floats.steps").images_of(self, x)
        return self.step(x)

    def orbit(self, x0: Any, steps: int, **options: Any) -> Any:
        """Return the orbit of a point under this map, like `km.orbit(phi, x0, steps=steps)`."""
        return import_module("kahanmaps.maps.orbits.orbit").orbit(self, x0, steps=steps, **options)

    @property
    def time_step(self) -> Any:
        """The time step of the flow that the map approximates; None if it approximates none."""
        return None if self.flow is None else self.flow[1]

    @property
    def h(self) -> Any:
        """A short name for `time_step`."""
        return self.time_step

    def __matmul__(self, other: Map) -> Map:
        """Return the composition: first `other`, then this map. Raises InputError if dimensions or fields differ."""
        if not isinstance(other, Map):
            return NotImplemented
        if (self.field, self.dim) != (other.field, other.dim):
            raise InputError(f"the maps must have the same field and dimension: got {self!r} and {other!r}")
        eps = self.eps if self.eps == other.eps else None
        return Map([other, self], eps, self.variables)

    def __pow__(self, power: int) -> Map:
        """Return a power of the map: a power of the inverse for a negative exponent, the identity for 0."""
        power = integer(power, "the power")
        if power:
            return Map([self if power > 0 else self.inverse] * abs(power), self.eps, self.variables)
        n, one = self.dim, self.field.one
        exponents = tuple(tuple(int(i == k) for i in range(n + 1)) for k in range(n + 1))
        rows = [[((n, one),) if j == i else () for j in range(n)] + [((i, -one),)] for i in range(n)]  # x~ - x = 0
        flow = self.flow and (self.flow[0], self.field.zero)
        return ElementaryMap(
            Equation(self.field, exponents, tuple(map(tuple, rows))), self.eps, None, self.variables, flow
        )

    def __eq__(self, other: object) -> bool:
        """Return whether the factors have the same equations in the same order."""
        if not isinstance(other, Map):
            return NotImplemented
        if (self.field, self.dim, self.variables) != (other.field, other.dim, other.variables):
            return False
        own_equations, other_equations = (
            [(equation.exponents, equation.terms) for equation in map_.equations] for map_ in (self, other)
        )
        return own_equations == other_equations

    def __hash__(self) -> int:
        return hash((self.dim, self.variables))

    def step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """Return the image x~ of a point. Raises SingularStep if det M(x) = 0."""
        x = self.point(point)
        if self.field is QQ:
            image = self.integer_step(IntegerPoint.from_rationals(x))
            if image is None:
                raise self._singular(x)
            return image.rationals()
        return self.generic_step(x)

    def integer_step(self, point: IntegerPoint, max_bits: int | None = None) -> IntegerPoint | None:
        """Return the image of an integer point, for maps over QQ; None if the map is not defined at the point.

        If an intermediate point of a composition has more than `max_bits` bits, this point is returned instead.
        """
        for factor in self.factors:
            image = factor.integer_steps.step(point)
            if image is None or (max_bits is not None and image.exceeding(max_bits)):
                return image
            point = image
        return point

    def generic_step(self, x: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return the image of a point over any field, by one linear system for each factor."""
        image = x
        for factor in self.factors:
            with self.field.working():
                try:
                    image = tuple(solve(*factor.linear_system(image)).entries())
                except SingularMatrix as error:
                    raise self._singular(x) from error
        return image

    def inverse_step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """Return the preimage of a point. Raises SingularStep if the inverse map is not defined at the point."""
        return self.inverse.step(point)

    def stages(self, point: Sequence[Any]) -> Iterator[tuple[ElementaryMap, tuple[Any, ...]]]:
        """Yield the pairs (factor, point to which it is applied). Raises SingularStep if a factor is not defined."""
        x = self.point(point)
        for k, factor in enumerate(self.factors):
            x = self.factors[k - 1].step(x) if k else x
            yield factor, x

    def determinant(self, point: Sequence[Any]) -> Any:
        """Return det M(x); for several factors, the product of their det M, each at the point that the factor maps."""
        first_determinant, *other_determinants = (factor.determinant(x) for factor, x in self.stages(point))
        with self.field.working():
            return reduce(mul, other_determinants, first_determinant)

    def jacobian(self, point: Sequence[Any]) -> Any:
        """Return the Jacobi matrix dPhi(x), the product of the Jacobi matrices of the factors. Raises SingularStep."""
        jacobians = [factor.jacobian(x) for factor, x in self.stages(point)]
        with self.field.working():
            return reduce(lambda product, jacobian: jacobian * product, jacobians)

    def _singular(self, point: tuple[Any, ...]) -> SingularStep:
        coordinates_text = ",".join(self.field.format(entry) for entry in point)
        if len(coordinates_text) > 200:
            coordinates_text = f"{coordinates_text[:100]}...{coordinates_text[-80:]}"
        has_one_eps = self.has_eps and self.eps is not None  # factors of a composition may differ in eps
        eps_text = f" for eps = {self.field.format(self.eps)}" if has_one_eps else ""
        return SingularStep(
            f"{det_of(self.denominator_name(False))} = 0 at the point {coordinates_text}{eps_text}: "
            "the map is not defined there",
            point,
            self.eps,
        )


class ElementaryMap(Map):
    """The map of one equation M(x) x~ = r(x) over a field.

    `backward` is a function that returns the equation of the inverse, no lambda: maps are pickled. If it is None, the
    equation must have degree 1; x and x~ are then exchanged. KahanMap has faster methods for M, r and N (see
    `numerator_matrix`).
    """

    def __init__(
        self,
        equation: Equation,
        eps: Any,
        backward: Callable[[], Equation] | None = None,
        variables: tuple[str, ...] = (),
        flow: tuple[Any, Any] | None = None,
    ) -> None:
        self.field, self.dim, self.eps, self.variables = equation.over, equation.dim, eps, variables
        self._equation, self._backward, self._flow = equation, backward, flow

    @property
    def factors(self) -> tuple[ElementaryMap, ...]:
        """The map itself."""
        return (self,)

    @property
    def flow(self) -> tuple[Any, Any] | None:
        """The flow that the map approximates, as (vector field, time); None if no flow is known."""
        return self._flow

    @property
    def equation(self) -> Equation:
        """The equation M(x) x~ = r(x)."""
        return self._equation

    @cached_property
    def inverse(self) -> ElementaryMap:
        """The inverse map. Raises InputError if the inverse is not known."""
        backward = self._equation.transposed() if self._backward is None else self._backward()
        inverse = ElementaryMap(backward, self.eps, partial(attrgetter("equation"), self), self.variables)
        inverse.has_eps = self.has_eps
        return inverse

    def linear_system(self, x: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return the pair of the matrix M(x) and the column r(x)."""
        n = self.dim
        with self.field.working():
            rows = self._equation.rows(self._equation.monomials([*x, self.field.one]), self.field.zero)
        matrix = self.field.matrix(n, n, [entry for row in rows for entry in row[:n]])
        return matrix, self.field.column([-row[-1] for row in rows])

    def denominator_matrix(self, point: Sequence[Any]) -> Any:
        """Return the matrix M(x)."""
        return self.linear_system(self.point(point))[0]

    def numerator_matrix(self, point: Sequence[Any], image: Sequence[Any]) -> Any:
        """Return N(x, x~) = d(r - M x~)/dx at fixed x~, so that dPhi(x) = M(x)^{-1} N(x, x~)."""
        one, zero, n = self.field.one, self.field.zero, self.dim
        X, X_image = [*point, one], [*image, one]
        columns = []
        with self.field.working():
            for k in range(n):
                derivatives = []  # the derivatives of the monomials with respect to X_k
                for exponent in self._equation.exponents:
                    derivative = self.field.convert(exponent[k])
                    if exponent[k]:
                        for i, (entry, e) in enumerate(zip(X, exponent, strict=True)):
                            for _ in range(e - (i == k)):
                                derivative = derivative * entry
                    derivatives.append(derivative)
                L = self._equation.rows(derivatives, zero)
                columns.append([-sum((a * b for a, b in zip(row, X_image, strict=True)), zero) for row in L])
            return self.field.matrix(n, n, [columns[k][i] for i in range(n) for k in range(n)])

    def determinant(self, point: Sequence[Any]) -> Any:
        """Return det M(x), the denominator of the map."""
        if self.field is QQ:
            return self.integer_steps.determinant(IntegerPoint.from_rationals(self.point(point)))
        with self.field.working():
            return det(self.denominator_matrix(point))

    def jacobian(self, point: Sequence[Any]) -> Any:
        """Return the Jacobi matrix dPhi(x) = M(x)^{-1} N(x, x~). Raises SingularStep."""
        x = self.point(point)
        image = self.step(x)
        with self.field.working():
            return solve(self.denominator_matrix(x), self.numerator_matrix(x, image))

    @cached_property
    def integer_steps(self) -> IntegerSteps:
        """The object that computes steps on integer points, for maps over QQ."""
        equation = self.equation
        return IntegerSteps(equation.exponents, equation.terms)

    def __repr__(self) -> str:
        eps_text = f"eps={self.field.format(self.eps)}, " if self.has_eps else ""
        return f"{type(self).__name__}({', '.join(self.variables)}; {eps_text}over {self.field})"


def det_of(name: str) -> str:
    """Return the text for the determinant of the matrix with this name.

    >>> det_of("M(x)"), det_of("I - eps f'(x)")
    ('det M(x)', "det(I - eps f'(x))")
    """
    return f"det({name})" if " " in name else f"det {name}"


class MapFamily(LatexDisplay, ABC):
    """A birational map over Q in named variables, which may depend on eps and on symbolic parameters."""

    variables: tuple[str, ...]
    title: str  # the kind of map, in one or two words
    time_steps: int = 1  # a step approximates the flow for the time `time_steps` * 2 eps; 0 if it approximates none
    denominator_name = "det M"
    root: Root | None = None  # the algebraic number in the coefficients, if any

    @property
    def dim(self) -> int:
        """The number of variables."""
        return len(self.variables)

    @property
    def symbols(self) -> tuple[str, ...]:
        """The symbols in the coefficients, without eps."""
        return ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names in the polynomial ring of the map's formulas: the variables, then the symbols, then eps."""
        return (*self.variables, *self.symbols, "eps")

    @property
    def has_eps(self) -> bool:
        """Whether the map depends on eps."""
        return True

    @property
    def scales_with_eps(self) -> bool:
        """Whether eps Phi(x, eps), for the map Phi, is known to depend on eps x only: eps = 1 then covers every eps."""
        return False

    @property
    def image(self) -> tuple[RationalFunction, ...] | None:
        """The coordinates of x~ as functions of the `names`, if the map is explicit; otherwise None."""
        return None

    @property
    def real_approximation(self) -> MapFamily:
        """The map with rational approximations of its coefficients. Raises InputError if a coefficient is not real."""
        return self

    @property
    def unsupported_reason(self) -> str:
        """The reason why methods for rational coefficients do not apply; empty if they apply."""
        if self.root is None:
            return ""
        return (
            f"found a parameter that is a {self.root}, expected rational numbers: algebraic numbers are supported by "
            "analyze, orbit, ensemble, lyapunov, check-commute, check-integrals, check-measure, find-integrals, "
            "find-density, find-commuting, degrees, heights, cycles, convert and portraits"
        )

    @property
    def kind(self) -> str:
        """The kind of map as text, with an article."""
        return f"{'an' if self.title[0] in 'aeiou' else 'a'} {self.title}"

    @property
    @abstractmethod
    def seed_data(self) -> tuple[Any, ...]:
        """The data that determine the map, for `derive_seed`."""

    @property
    @abstractmethod
    def digits(self) -> int:
        """The approximate number of decimal digits of the longest coefficient, with all over a common denominator."""

    @abstractmethod
    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> Map:
        """Return the map over a field at eps, a nonzero exact number or element of the field.

        `values` are the values of the symbols, elements of the field.
        """

    def __call__(self, *point: Any, **named: Any) -> Any:
        """Return the image of a point under a map that does not depend on eps, like `Map.__call__`."""
        if self.has_eps or self.symbols:
            raise InputError('found no eps, expected an exact number: map.at("1/10")(x)')
        return self.at(1)(*point, **named)

    def __matmul__(self, other: MapFamily) -> MapFamily:
        """Return the composition: first `other`, then this map, at the same eps."""
        if not isinstance(other, MapFamily):
            return NotImplemented
        composed: MapFamily = import_module("kahanmaps.maps.composed").composed_map(other, self)
        return composed

    def __pow__(self, power: int) -> MapFamily:
        """Return a power of the map: a power of the inverse for a negative exponent, the identity for 0."""
        power = integer(power, "the power")
        powers = [(self, power)] if power else [(self, 1), (self, -1)]
        composed: MapFamily = import_module("kahanmaps.maps.composed").composed_map(*powers)
        return composed

    rows: Rows  # the rows of (M | -r), whose entries are polynomials in the `names`

    @property
    def inverse_rows(self) -> Rows:
        """The rows of the inverse map, computed by elimination. Raises InputError if the elimination fails."""
        return inverse_rows(self.rows)

    @property
    def matrix(self) -> list[list[fmpq_mpoly]]:
        """The entries of M, polynomials in the `names`."""
        return [list(row[:-1]) for row in self.rows]

    @abstractmethod
    def to_record(self) -> dict[str, Any]:
        """Return the map as plain data, for records."""


@dataclass(frozen=True, eq=False)
class ImplicitMap(MapFamily):
    """The map of an equation M(x, eps) x~ = r(x, eps), given by the `rows` of (M | -r).

    The entries are polynomials over Q in the variables, then symbols (if any), then eps. `backward` are the rows of the
    inverse map, if known. Otherwise the inverse is computed: by exchanging x and x~ if M and r have degree 1 in the
    variables, else by elimination. `title` is the kind of map in one or two words. `time_steps` is 1 if a step
    approximates a flow for the time 2 eps, else 0. `of_field` is the vector field of this flow in the first variables.

    >>> x, y, eps = ring(["x", "y", "eps"]).gens()
    >>> shear = ImplicitMap(("x", "y"), ((x.context().constant(1), 0 * x, -x - eps*y**2), (0 * x, y**0, -y)), "shear")
    >>> shear.at("1/2").step([1, 2])
    (3, 2)
    """

    variables: tuple[str, ...]
    rows: Rows
    title: str
    time_steps: int = 0
    backward: Rows | None = None
    of_field: PolynomialField | None = None
    _cached_maps: list[tuple[Field, Any, ElementaryMap]] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        n, names = len(self.variables), self.names
        for rows in (self.rows, self.backward or self.rows):
            if len(rows) != n or any(len(row) != n + 1 or any(names_of(e) != names for e in row) for row in rows):
                raise InputError(f"expected {n} rows of {n + 1} polynomials in {', '.join(names)}")

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """The symbols in the coefficients, without eps."""
        return names_of(self.rows[0][-1])[len(self.variables) : -1]

    @cached_property
    def has_eps(self) -> bool:
        """Whether eps occurs in the equation."""
        return any("eps" not in entry.unused_gens() for row in self.rows for entry in row)

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return (self.variables, *(entry for row in self.rows for entry in row))

    @cached_property
    def inverse_rows(self) -> Rows:
        """The rows of the inverse map, given or computed by elimination. Raises InputError if elimination fails."""
        return inverse_rows(self.rows) if self.backward is None else self.backward

    @cached_property
    def equations(self) -> tuple[fmpq_mpoly, ...]:
        """The entries of M x~ - r, polynomials in x, in x~ (with names such as x_new), in the symbols and eps.

        >>> x, eps = ring(["x", "eps"]).gens()
        >>> ImplicitMap(("x",), ((1 - eps*x, -x),), "Riccati").equations
        (-x*x_new*eps - x + x_new,)
        """
        n, ending = len(self.variables), "_new"
        while any(name + ending in self.variables for name in self.variables):
            ending += "_"
        context = ring((*self.variables, *(name + ending for name in self.variables), *self.names[n:]))
        x = [*context.gens()[:n], *context.gens()[2 * n :]]
        x_new = [*context.gens()[n : 2 * n], context.constant(1)]
        return tuple(
            sum((entry.compose(*x, ctx=context) * y for entry, y in zip(row, x_new, strict=True)), context.constant(0))
            for row in self.rows
        )

    def to_record(self) -> dict[str, list[str]]:
        return {"equations": [f"{format_polynomial(equation)} = 0" for equation in self.equations]}

    @cached_property
    def image(self) -> tuple[RationalFunction, ...] | None:
        """The coordinates of x~ as functions of `names`, if M is diagonal, otherwise None."""
        if any(not entry.is_zero() for i, row in enumerate(self.rows) for j, entry in enumerate(row[:-1]) if i != j):
            return None
        return tuple(RationalFunction(-row[-1], row[i]) for i, row in enumerate(self.rows))

    def __str__(self) -> str:
        if self.image is None:
            return "\n".join(self.to_record()["equations"])
        functions_by_name = zip(self.variables, self.image, strict=True)
        return "\n".join(f"{name}~ = {format_rational_function(function)}" for name, function in functions_by_name)

    @cached_property
    def digits(self) -> int:
        return digits_of(entry for row in self.rows for entry in row)

    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> ElementaryMap:
        """Return the map over a field at eps. Raises InputError for eps = 0, BadPrime if it has no reduction mod p."""
        eps_element = nonzero_eps(eps, over) if self.has_eps else over.convert(eps)
        for cached_field, cached_eps, map_at_eps in self._cached_maps:
            if cached_field is over and cached_eps is eps_element:
                return map_at_eps
        point = (*values, eps_element)
        equation = equation_of(self.rows, over, point)
        needs_inverse_rows = self.backward is not None or equation.degree > 1
        backward = partial(self._inverse_equation, over, point) if needs_inverse_rows else None
        map_at_eps = ElementaryMap(equation, eps_element, backward, self.variables)
        map_at_eps.has_eps = self.has_eps
        self._cached_maps[:] = [] if values else [(over, eps_element, map_at_eps)]  # maps with symbols are not cached
        return map_at_eps

    def _inverse_equation(self, over: Field, point: Sequence[Any]) -> Equation:
        return equation_of(self.inverse_rows, over, point)

    def __repr__(self) -> str:
        return f"ImplicitMap({self.title} in {', '.join(self.variables)})"


def nonzero_eps(eps: Any, over: Field) -> Any:
    """Convert eps to the field. Raises InputError if it is 0, BadPrime if it is 0 only modulo the prime."""
    element = over.convert(eps)
    if element == 0:
        if isinstance(eps, int | str | Fraction | fmpz | fmpq) and rational(eps) != 0:
            raise BadPrime(
                f"the prime {over.characteristic} divides the numerator of eps = {eps}: use another prime",
                over.characteristic,
            )
        raise InputError("found eps = 0, expected another number: at eps = 0 a map with a time step is the identity")
    return element


def why_no_map(map_: ImplicitMap, root: Root | None = None) -> str:
    """Return an error message for a map given by the user, tested at random points modulo primes; "" if all tests pass.

    The map must be defined and dominant, and a given inverse map must be its inverse. A wrong map passes the test at
    each of the three points with probability below 2^-40. `root`, if given, is the value of the only symbol; then only
    primes are used modulo which the root exists.
    """
    rng = random.Random(f"map {derive_seed(0, *map_.seed_data, *(e for row in map_.backward or () for e in row))}")
    passed_count = 0
    while passed_count < 3:
        field = random_prime_field(rng)
        x = tuple(field.random(rng) for _ in range(map_.dim))
        try:
            values = [field.random(rng) if root is None else root.over(field) for _ in map_.symbols]
            map_at_eps = map_.at(field.random(rng), field, values)
            image = map_at_eps.step(x)
            if map_at_eps.jacobian(x).det() == 0:
                return "the map is not dominant: det dPhi is identically 0"
            preimage = x if map_.backward is None else map_at_eps.inverse.step(image)
        except BadPrime:
            continue
        except SingularStep:
            return "the map is not defined at random points: the equations do not determine the new point"
        passed_count += 1
        if preimage != x:
            return "the given inverse is not the inverse of the map: it does not map the images of random points back"
    return "" if map_.backward is not None else why_not_birational(map_.rows)
