"""A birational map as data: the equation M(x, eps) x~ = r(x, eps) for the image x~ of a point x.

M is a matrix and r a vector of polynomials. Kahan's choice is M = I - eps f', r = (I + eps B) x + 2 eps c; a map given
by rational functions has for M the diagonal of their denominators; discretizations that are linear in the new point
have it as they stand. Three values say it all, and everything else asks them:

* `MapFamily` is the map over Q, eps and all. A new discretization is a function that returns an `ImplicitMap`.
* `Map` is the map over one field at one eps: images, the inverse map, Jacobi matrices. It is made of factors, most
  maps of one: a `ElementaryMap`, that has an equation.
* `Equation` has the coefficients of M and r over that field (equation.py). The evaluators go from factor to factor and
  start from their equations; the generic one, over any field, is here.

In homogeneous coordinates (X : Z), x = X/Z, the equation says that L(X, Z) (X~ : Z~) = 0 for an n x (n + 1) matrix
L = (M | -r) of forms of one degree. Where that degree is 1, exchanging the two points gives the inverse map.
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, reduce
from operator import mul
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpz

from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import QQ, Field, integer, rational
from kahanmaps.algebra.matrices import det, solve
from kahanmaps.algebra.polynomials import RationalFunction, digits_of, names_of, ring
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.algebra.roots import Root
from kahanmaps.displayed import DisplayedAsFormula
from kahanmaps.errors import BadPrime, InputError, SingularMatrix, SingularStep
from kahanmaps.maps.equation import Equation, equation_of
from kahanmaps.maps.inverse import Rows, inverse_rows, why_not_birational
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.integer_steps import IntegerSteps
from kahanmaps.systems.polynomial import PolynomialField


class Map:
    """Birational maps over a field, one after the other; `eps` is that of all, or None where they differ."""

    field: Field
    eps: Any
    dim: int
    variables: tuple[str, ...] = ()

    def __init__(self, parts: Sequence[Map], eps: Any, variables: tuple[str, ...]) -> None:
        self.parts, self.eps, self.variables = tuple(parts), eps, variables
        self.field, self.dim = parts[0].field, parts[0].dim

    @cached_property
    def factors(self) -> tuple[ElementaryMap, ...]:
        """The maps with an equation of which this one takes a step of each, the first one first: evaluators do so."""
        return tuple(factor for part in self.parts for factor in part.factors)

    @cached_property
    def inverse(self) -> Map:
        """The inverse map. Raises InputError where it is not known."""
        return Map([part.inverse for part in reversed(self.parts)], self.eps, self.variables)

    @cached_property
    def flow(self) -> tuple[Any, Any] | None:
        """The flow that it approximates, where that is one: of which field, and for which time."""
        flows = [part.flow for part in self.parts]
        known_flows = [flow for flow in flows if flow is not None]
        if len(known_flows) < len(flows) or any(field != known_flows[0][0] for field, _ in known_flows):
            return None
        with self.field.working():
            return known_flows[0][0], sum((time for _, time in known_flows), self.field.zero)

    def __repr__(self) -> str:
        eps = "different eps" if self.eps is None else f"eps={self.field.format(self.eps)}"
        step = "" if self.flow is None else f", time step {self.field.format(self.flow[1])}"
        return f"Map({', '.join(self.variables)}; {eps}{step}, over {self.field})"

    def written(self) -> dict[str, Any]:
        """What it is, as plain data for records: eps is None where it differs, the time step where there is no flow."""
        eps, step = (None if x is None else self.field.format(x) for x in (self.eps, self.flow and self.flow[1]))
        return {"map": repr(self), "eps": eps, "time_step": step}

    @property
    def equations(self) -> tuple[Equation, ...]:
        """Those of the factors."""
        return tuple(factor.equation for factor in self.factors)

    @property
    def is_bilinear(self) -> bool:
        """Whether all the equations are linear in the old point, as they are in the new one."""
        return all(equation.degree == 1 for equation in self.equations)

    def denominator_name(self, backward: bool) -> str:
        """What the matrix M(x) is called, for the map or, seen from it, for its inverse."""
        return "M'(x)" if backward else "M(x)"

    def point(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """The values as a point over the map's field. Raises InputError for a wrong length or inexact numbers."""
        if isinstance(values, str):
            raise InputError(f"found the text {values[:60]!r}, expected a sequence: parse_point reads points from text")
        if not hasattr(values, "__len__"):
            raise InputError(f"found {values!r}, expected a sequence of {self.dim} exact numbers")
        if len(values) != self.dim:
            named = f": {', '.join(self.variables)}" if self.variables else ""
            raise InputError(f"found a point with {len(values)} coordinates, expected {self.dim}{named}")
        return tuple(self.field.convert(value) for value in values)

    def __call__(self, *point: Any) -> Any:
        """The image of a point, of phi((1, 2)) and phi(1, 2) alike; phi() is phi, for who writes phi.inverse()."""
        if not point:
            return self
        return self.step(point[0] if len(point) == 1 and hasattr(point[0], "__len__") else point)

    def __matmul__(self, other: Map) -> Map:
        """A step of `other` and then one of this, as one map. Raises InputError for another dimension or field."""
        if not isinstance(other, Map):
            return NotImplemented
        if (self.field, self.dim) != (other.field, other.dim):
            raise InputError(f"found maps {self!r} and {other!r}, expected one field and one dimension")
        eps = self.eps if self.eps == other.eps else None
        return Map([other, self], eps, self.variables)

    def __pow__(self, power: int) -> Map:
        """So many steps as one map, of the inverse for a negative number, the identity for 0."""
        power = integer(power, "the power")
        if power:
            return Map([self if power > 0 else self.inverse] * abs(power), self.eps, self.variables)
        n, one = self.dim, self.field.one
        units = tuple(tuple(int(i == k) for i in range(n + 1)) for k in range(n + 1))
        rows = [[((n, one),) if j == i else () for j in range(n)] + [((i, -one),)] for i in range(n)]  # 1 x~ - x
        flow = self.flow and (self.flow[0], self.field.zero)
        return ElementaryMap(Equation(self.field, units, tuple(map(tuple, rows))), self.eps, None, self.variables, flow)

    def __eq__(self, other: object) -> bool:
        """Whether the equations of the steps are the same, one after the other."""
        if not isinstance(other, Map):
            return NotImplemented
        if (self.field, self.dim, self.variables) != (other.field, other.dim, other.variables):
            return False
        mine, theirs = ([(equation.exponents, equation.terms) for equation in map_.equations] for map_ in (self, other))
        return mine == theirs

    def __hash__(self) -> int:
        return hash((self.dim, self.variables))

    def step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """The image x~ of a point. Raises SingularStep where det M(x) = 0."""
        x = self.point(point)
        if self.field is QQ:
            image = self.integer_step(IntegerPoint.from_rationals(x))
            if image is None:
                raise self._singular(x)
            return image.rationals()
        return self.generic_step(x)

    def integer_step(self, point: IntegerPoint, max_bits: int | None = None) -> IntegerPoint | None:
        """The image of an integer point, for maps over QQ; None where the map has no value.

        What has more than `max_bits` after a factor goes no further: it is returned as it is.
        """
        for factor in self.factors:
            image = factor.integer_steps.step(point)
            if image is None or (max_bits is not None and image.exceeding(max_bits)):
                return image
            point = image
        return point

    def generic_step(self, x: tuple[Any, ...]) -> tuple[Any, ...]:
        """The image of a point, by one linear system over the field for each factor, whatever the field is."""
        image = x
        for factor in self.factors:
            with self.field.working():
                try:
                    image = tuple(solve(*factor.linear_system(image)).entries())
                except SingularMatrix as error:
                    raise self._singular(x) from error
        return image

    def inverse_step(self, point: Sequence[Any]) -> tuple[Any, ...]:
        """The preimage of a point. Raises SingularStep where the inverse map has no value there."""
        return self.inverse.step(point)

    def stages(self, point: Sequence[Any]) -> Iterator[tuple[ElementaryMap, tuple[Any, ...]]]:
        """Every factor with the point that it is applied to. Raises SingularStep."""
        x = self.point(point)
        for k, factor in enumerate(self.factors):
            x = self.factors[k - 1].step(x) if k else x
            yield factor, x

    def determinant(self, point: Sequence[Any]) -> Any:
        """det M(x), the denominator of the map; of several factors the product at the points on the way."""
        first, *others = (factor.determinant(x) for factor, x in self.stages(point))
        with self.field.working():
            return reduce(mul, others, first)

    def jacobian(self, point: Sequence[Any]) -> Any:
        """The Jacobi matrix dPhi(x), M(x)^{-1} N(x, x~) for one factor. Raises SingularStep."""
        slopes = [factor.jacobian(x) for factor, x in self.stages(point)]
        with self.field.working():
            return reduce(lambda total, slope: slope * total, slopes)

    def _singular(self, point: tuple[Any, ...]) -> SingularStep:
        coordinates = ",".join(self.field.format(entry) for entry in point)
        if len(coordinates) > 200:
            coordinates = f"{coordinates[:100]}...{coordinates[-80:]}"
        return SingularStep(
            f"{det_of(self.denominator_name(False))} = 0 at the point {coordinates} "
            f"for eps = {self.field.format(self.eps)}: the map is not defined there",
            point,
            self.eps,
        )


class ElementaryMap(Map):
    """The map of an equation M(x) x~ = r(x) over a field; `backward` gives the equation of its inverse when asked for.

    Without it the equation is to be of degree 1, so that exchanging the two points gives the inverse. A map that knows
    a faster way to its matrices (KahanMap) overrides them.
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
        """The flow that it approximates, where it is known: of which field, and for which time."""
        return self._flow

    @property
    def equation(self) -> Equation:
        """The equation of a step."""
        return self._equation

    @cached_property
    def inverse(self) -> ElementaryMap:
        """The inverse map. Raises InputError where it is not known."""
        backward = self._equation.transposed() if self._backward is None else self._backward()
        return ElementaryMap(backward, self.eps, lambda: self._equation, self.variables)

    def linear_system(self, x: tuple[Any, ...]) -> tuple[Any, Any]:
        """M(x), and r(x) as a column."""
        n = self.dim
        with self.field.working():
            rows = self._equation.rows(self._equation.monomials([*x, self.field.one]), self.field.zero)
        matrix = self.field.matrix(n, n, [entry for row in rows for entry in row[:n]])
        return matrix, self.field.column([-row[-1] for row in rows])

    def denominator_matrix(self, point: Sequence[Any]) -> Any:
        """The matrix M(x)."""
        return self.linear_system(self.point(point))[0]

    def numerator_matrix(self, point: Sequence[Any], image: Sequence[Any]) -> Any:
        """The matrix N(x, x~) = d(r - M x~)/dx at fixed x~, with dPhi(x) = M(x)^{-1} N(x, x~)."""
        one, zero, n = self.field.one, self.field.zero, self.dim
        X, after = [*point, one], [*image, one]
        columns = []
        with self.field.working():
            for k in range(n):
                slopes = []  # of the monomials, by X_k
                for exponent in self._equation.exponents:
                    slope = self.field.convert(exponent[k])
                    if exponent[k]:
                        for i, (entry, e) in enumerate(zip(X, exponent, strict=True)):
                            for _ in range(e - (i == k)):
                                slope = slope * entry
                    slopes.append(slope)
                L = self._equation.rows(slopes, zero)
                columns.append([-sum((a * b for a, b in zip(row, after, strict=True)), zero) for row in L])
            return self.field.matrix(n, n, [columns[k][i] for i in range(n) for k in range(n)])

    def determinant(self, point: Sequence[Any]) -> Any:
        """det M(x), the denominator of the map."""
        if self.field is QQ:
            return self.integer_steps.determinant(IntegerPoint.from_rationals(self.point(point)))
        with self.field.working():
            return det(self.denominator_matrix(point))

    def jacobian(self, point: Sequence[Any]) -> Any:
        """The Jacobi matrix dPhi(x) = M(x)^{-1} N(x, x~). Raises SingularStep."""
        x = self.point(point)
        image = self.step(x)
        with self.field.working():
            return solve(self.denominator_matrix(x), self.numerator_matrix(x, image))

    @cached_property
    def integer_steps(self) -> IntegerSteps:
        """The stepper on integer points, for maps over QQ."""
        equation = self.equation
        return IntegerSteps(equation.exponents, equation.terms)

    def __repr__(self) -> str:
        name, eps = type(self).__name__, self.field.format(self.eps)
        return f"{name}({', '.join(self.variables)}; eps={eps}, over {self.field})"


def det_of(name: str) -> str:
    """The determinant of a matrix with this name, in words.

    >>> det_of("M(x)"), det_of("I - eps f'(x)")
    ('det M(x)', "det(I - eps f'(x))")
    """
    return f"det({name})" if " " in name else f"det {name}"


class MapFamily(DisplayedAsFormula, ABC):
    """A birational map over Q in named variables, which may depend on eps and on symbols: numbers without a value."""

    variables: tuple[str, ...]
    title: str  # what kind of map it is, in a word or two
    time_steps: int = 1  # of 2 eps each, by which a step advances the flow that it approximates; 0 without one
    denominator_name = "det M"
    root: Root | None = None  # the algebraic number in the coefficients, where there is one

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
        """What formulas of the map are polynomials in: the variables, the symbols, eps."""
        return (*self.variables, *self.symbols, "eps")

    @property
    def has_eps(self) -> bool:
        """Whether the map depends on eps."""
        return True

    @property
    def image(self) -> tuple[RationalFunction, ...] | None:
        """The coordinates of x~ as functions of the `names`, where the map is given by them; else None."""
        return None

    @property
    def real_approximation(self) -> MapFamily:
        """The map with rational coefficients from which floats start. Raises InputError where it is not real."""
        return self

    @property
    def unsupported_reason(self) -> str:
        """Empty, or why what needs rational coefficients is not to be had."""
        if self.root is None:
            return ""
        return (
            f"found a parameter that is a {self.root}, expected rational ones: algebraic numbers are for analyze, "
            "orbit, ensemble, lyapunov, check-commute, check-integrals, check-measure, find-integrals, find-density, "
            "find-commuting, degrees, heights, cycles, convert and portraits"
        )

    @property
    def kind(self) -> str:
        """What kind of map it is, with an article."""
        return f"{'an' if self.title[0] in 'aeiou' else 'a'} {self.title}"

    @property
    @abstractmethod
    def subject(self) -> tuple[Any, ...]:
        """All that determines the map, as `derive_seed` takes it."""

    @property
    @abstractmethod
    def digits(self) -> int:
        """About how many decimal digits the longest coefficient has, over one denominator."""

    @abstractmethod
    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> Map:
        """The map over a field, at eps: an exact number, or an element of the field, not zero.

        `values` are those of the symbols, elements of the field.
        """

    rows: Rows  # of (M | -r), polynomials in the `names`

    @property
    def inverse_rows(self) -> Rows:
        """The rows of the inverse map, found by elimination. Raises InputError where they are not."""
        return inverse_rows(self.rows)

    @property
    def matrix(self) -> list[list[fmpq_mpoly]]:
        """The entries of M, polynomials in the `names`."""
        return [list(row[:-1]) for row in self.rows]

    @abstractmethod
    def written(self) -> dict[str, Any]:
        """The map as text, for records."""


@dataclass(frozen=True, eq=False)
class ImplicitMap(MapFamily):
    """The map of M(x, eps) x~ = r(x, eps): `rows` are those of (M | -r).

    Entries are polynomials over Q in the variables, then symbols, if there are any, then eps. `backward` are the rows
    of the inverse map where they are known; else, where M and r are of degree 1 in the variables, exchanging the points
    gives it, and elimination elsewhere. `title` says in a word or two what kind of map it is, `time_steps` is 1 where
    it approximates a flow for the time 2 eps, that of `of_field` in the first of the variables, where that is known.

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
    _last: list[tuple[Field, Any, ElementaryMap]] = field(default_factory=list, init=False, repr=False)

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
        """Whether eps occurs."""
        return any("eps" not in entry.unused_gens() for row in self.rows for entry in row)

    @property
    def subject(self) -> tuple[Any, ...]:
        return (self.variables, *(entry for row in self.rows for entry in row))

    @cached_property
    def inverse_rows(self) -> Rows:
        """The rows of the inverse map, those given or found by elimination. Raises InputError where they are not."""
        return inverse_rows(self.rows) if self.backward is None else self.backward

    @cached_property
    def equations(self) -> tuple[fmpq_mpoly, ...]:
        """M x~ - r, polynomials in x, the new point with names like x_new, symbols and eps; all of them are 0.

        >>> x, eps = ring(["x", "eps"]).gens()
        >>> ImplicitMap(("x",), ((1 - eps*x, -x),), "Riccati").equations
        (-x*x_new*eps - x + x_new,)
        """
        n, ending = len(self.variables), "_new"
        while any(name + ending in self.variables for name in self.variables):
            ending += "_"
        context = ring((*self.variables, *(name + ending for name in self.variables), *self.names[n:]))
        old = [*context.gens()[:n], *context.gens()[2 * n :]]
        new = [*context.gens()[n : 2 * n], context.constant(1)]
        return tuple(
            sum((entry.compose(*old, ctx=context) * y for entry, y in zip(row, new, strict=True)), context.constant(0))
            for row in self.rows
        )

    def written(self) -> dict[str, list[str]]:
        return {"equations": [f"{format_polynomial(equation)} = 0" for equation in self.equations]}

    @cached_property
    def image(self) -> tuple[RationalFunction, ...] | None:
        """The coordinates of x~ as functions of the names, where M is diagonal; else None."""
        if any(not entry.is_zero() for i, row in enumerate(self.rows) for j, entry in enumerate(row[:-1]) if i != j):
            return None
        return tuple(RationalFunction(-row[-1], row[i]) for i, row in enumerate(self.rows))

    def __str__(self) -> str:
        if self.image is None:
            return "\n".join(self.written()["equations"])
        named = zip(self.variables, self.image, strict=True)
        return "\n".join(f"{name}~ = {format_rational_function(function)}" for name, function in named)

    @cached_property
    def digits(self) -> int:
        return digits_of(entry for row in self.rows for entry in row)

    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> ElementaryMap:
        """The map over a field, at eps. Raises InputError for eps = 0, BadPrime where it has no reduction."""
        element = nonzero_eps(eps, over) if self.has_eps else over.convert(eps)
        for cached_field, at, map_at_eps in self._last:
            if cached_field is over and at is element:
                return map_at_eps
        point = (*values, element)
        equation = equation_of(self.rows, over, point)
        is_needed = self.backward is not None or equation.degree > 1
        backward = (lambda: equation_of(self.inverse_rows, over, point)) if is_needed else None
        map_at_eps = ElementaryMap(equation, element, backward, self.variables)
        self._last[:] = [] if values else [(over, element, map_at_eps)]  # a map with symbols is not kept
        return map_at_eps

    def __repr__(self) -> str:
        return f"ImplicitMap({self.title} in {', '.join(self.variables)})"


def nonzero_eps(eps: Any, over: Field) -> Any:
    """eps as an element of the field. Raises InputError where it is 0, BadPrime where only the prime makes it so."""
    element = over.convert(eps)
    if element == 0:
        if isinstance(eps, int | str | Fraction | fmpz | fmpq) and rational(eps) != 0:
            raise BadPrime(
                f"the prime {over.characteristic} divides the numerator of eps = {eps}: take another prime",
                over.characteristic,
            )
        raise InputError("found eps = 0, expected another number: at eps = 0 a map with a time step is the identity")
    return element


def why_no_map(map_: ImplicitMap, root: Root | None = None) -> str:
    """Empty, or what is wrong with a map that somebody has written down, found at random points modulo primes.

    It must have values, and where an inverse map is given too, lead back from them. A point says so by chance with
    probability below 2^-40 for equations of any size that can be read, and these are three points. With a `root` the
    only symbol stands for it, and primes are those that have one.
    """
    rng = random.Random(f"map {derive_seed(0, *map_.subject, *(e for row in map_.backward or () for e in row))}")
    tried = 0
    while tried < 3:
        over = random_prime_field(rng)
        x = tuple(over.random(rng) for _ in range(map_.dim))
        try:
            values = [over.random(rng) if root is None else root.over(over) for _ in map_.symbols]
            local = map_.at(over.random(rng), over, values)
            image = local.step(x)
            if local.jacobian(x).det() == 0:
                return "found a map whose image is not the whole space: det dPhi is 0 everywhere"
            preimage = x if map_.backward is None else local.inverse.step(image)
        except BadPrime:
            continue
        except SingularStep:
            return "found a map that has no value at random points: the new point is not determined"
        tried += 1
        if preimage != x:
            return "found a map that does not lead back from the images of random points, expected the inverse map"
    return "" if map_.backward is not None else why_not_birational(map_.rows)
