"""Integrals and densities of a map, as functions of a point and eps: claimed functions, and functions from theorems.

For f = J grad H, with a cubic H and any constant skew J, the Kahan map Phi_f conserves

    H + (2 eps/3) grad H^T (I - eps f')^{-1} f  =  H + grad H . (x~ - x)/3  =  H + O(eps^2)    ("modified H"),

where x~ = Phi_f(x). For homogeneous H and J = [[0, I], [-I, 0]] the modified H is -1/6 of H~ = eps^{-1} x^T J x~ in
petrera-suris-2016. The map preserves the volume form dx/phi, i.e. phi(x~) = phi(x) det dPhi(x), for
phi = det(I - eps f'(x)); the denominator phi is called the density here. Sources: cmoq-2013; petrera-suris-2016, eqs.
(eq: CMOQ integral), (tH), (eq: CMOQ measure).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import mul
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.matrices import det
from kahanmaps.algebra.polynomials import (
    RationalFunction,
    coefficients_in,
    degree_in,
    evaluate,
    is_weighted_homogeneous,
    names_of,
    primitive_part,
    ring,
    substitute,
)
from kahanmaps.algebra.printing import format_polynomial, format_rational_function
from kahanmaps.algebra.roots import Root
from kahanmaps.algebra.work import count_work
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.iterates import iterates_in
from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

_MAX_CONDITION = 200  # maximal number of characters of a condition


class PhaseFunction(ABC):
    """A function of x and eps, with a name and a printed formula."""

    name: str
    formula: str
    condition: str = ""  # the condition on symbols and eps for the claim, as text of `where`
    scales_with_eps: bool = False  # whether it is known to be a power of eps times a function of eps x

    @abstractmethod
    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        """Return the value at a point over `field`; None at a pole.

        Raises SingularStep if the function contains a map and the point is an indeterminacy point of this map.
        """

    @property
    @abstractmethod
    def seed_data(self) -> tuple[Any, ...]:
        """Data that determine the function; `derive_seed` derives random seeds from them."""


class ClaimedFunction(PhaseFunction):
    """A rational function of the variables and eps (its last variable) in a claim of a file or of the user.

    `root`, if given, is the value of the variable before eps. If the function contains x~, `map_` is the map x -> x~.
    """

    def __init__(
        self, name: str, function: RationalFunction, root: Root | None = None, map_: MapFamily | None = None
    ) -> None:
        self.name = name
        self.root = root
        self.map = map_
        self.function = function
        self.iterates = iterates_in(*function.names)
        self.formula = format_rational_function(function)
        if self.iterates and map_ is None:
            raise InputError(f"found {name}, a function of x and its iterates, expected one of x alone here")

    @property
    def scales_with_eps(self) -> bool:  # type: ignore[override]  # a property here
        weights = [1] * (len(self.function.names) - 1) + [-1]
        if self.root is not None:
            weights[-2] = 0
        return all(is_weighted_homogeneous(p, weights) for p in (self.function.numerator, self.function.denominator))

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return ("claimed", self.function)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        points = [tuple(point)]
        if self.map is not None and self.iterates:
            map_at_eps = self.map.at(eps, field)
            while len(points) <= self.iterates:
                points.append(map_at_eps.step(points[-1]))
        return self.on(field, eps, points)

    def on(self, field: Field, eps: Any, points: Sequence[Sequence[Any]]) -> Any:
        """Return the value at successive points x, x~, ... of an orbit; None at a pole. Further points are ignored."""
        with field.working():
            values = () if self.root is None else (self.root.over(field),)
            coordinates = [entry for point in points[: self.iterates + 1] for entry in point]
            return self.function.value(field, (*coordinates, *values, field.convert(eps)))


def orbit_about(map_at_eps: Map, x: tuple[Any, ...], length: int) -> list[tuple[Any, ...]]:
    """Return an orbit of `length` steps with x in the middle, or at the beginning if the inverse map is not known.

    With x in the middle, the coordinates of the points are rational functions of x of lower degree.
    """
    points, steps_back = [x], 0
    try:
        inverse = map_at_eps.inverse
        steps_back = length // 2
    except InputError:
        inverse = map_at_eps
    for _ in range(steps_back):
        points.insert(0, inverse.step(points[0]))
    while len(points) <= length:
        points.append(map_at_eps.step(points[-1]))
    return points


def at_eps(
    function: RationalFunction, eps: fmpq | None, root: Root | None = None, k: int = 0
) -> tuple[fmpq_mpoly, fmpq_mpoly]:
    """Return the numerator and the denominator of `function`, at eps if eps is given; the denominator may become 0.

    If `root` is given, the k-th variable (from 0) stands for it, and both are reduced modulo its minimal polynomial.
    """
    numerator, denominator = function.numerator, function.denominator
    if eps is not None:
        numerator, denominator = substitute(numerator, {"eps": eps}), substitute(denominator, {"eps": eps})
    return (numerator, denominator) if root is None else (root.remainder(numerator, k), root.remainder(denominator, k))


def where(dim: int, *polynomials: fmpq_mpoly | Sequence[fmpq_mpoly]) -> str:
    """Return the condition on symbols and eps under which no polynomial vanishes identically; empty if it always holds.

    Args:
        dim: the number of coordinates, the first variables of the polynomials; the others are symbols and eps (not 0).
        polynomials: nonzero polynomials; a sequence of polynomials means that not all of them may vanish identically.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y, a, b, eps = ring(["x", "y", "a", "b", "eps"]).gens()
    >>> where(2, a*x + b*y), where(2, (10*eps - 1)*eps*x, a*y), where(2, a*x + eps), where(1, [a*x, b*x])
    ('where a, b are not all 0', 'where 10*eps - 1 is not 0 and a is not 0', '', 'where a, b are not all 0')
    """
    conditions: list[str] = []
    for group in ([group] if isinstance(group, fmpq_mpoly) else group for group in polynomials):
        names = names_of(group[0])
        coefficients = [c for polynomial in group for c in coefficients_in(polynomial, dim)]
        if "eps" in names[dim:]:  # eps, the last variable, is not 0: divide each coefficient by its power of eps
            lowest_orders = [min(int(monomial[-1]) for monomial in c.monoms()) for c in coefficients]
            coefficients = [
                c.context().from_dict({(*m[:-1], int(m[-1]) - order): value for m, value in c.terms()})
                for c, order in zip(coefficients, lowest_orders, strict=True)
            ]
        symbols = {name for c in coefficients for name in names if name not in c.unused_gens()}
        if len(symbols) == 1:
            # Polynomials in one symbol have the common zeros of their greatest common divisor.
            coefficients = [reduce(lambda gcd, c: gcd.gcd(c), coefficients)]
        if not any(c.is_constant() for c in coefficients):
            texts = list(dict.fromkeys(format_polynomial(primitive_part(c)[1]) for c in coefficients))
            conditions.append(f"{', '.join(texts)} {'is not' if len(texts) == 1 else 'are not all'} 0")
    text = f"where {' and '.join(dict.fromkeys(conditions))}" if conditions else ""
    return text if len(text) <= _MAX_CONDITION else "where it is defined and not identically 0"


class ImageFunction(PhaseFunction):
    """A function of a point x and its image x~ under the Kahan map of J grad H."""

    def __init__(self, hamiltonian: CubicHamiltonian) -> None:
        self.hamiltonian = hamiltonian
        self.map = KahanFamily(hamiltonian.system)


def modified(H: fmpq_mpoly, gradient: Sequence[fmpq_mpoly], phi: Map, point: Sequence[Any]) -> Any:
    """Return H + grad H . (x~ - x)/3 at the point x, where x~ is the image of x under the map `phi`."""
    field, image = phi.field, phi.step(point)
    with field.working():
        total = field.zero
        for x, x_image, partial_derivative in zip(point, image, gradient, strict=True):
            total = total + evaluate(partial_derivative, field, point) * (x_image - x)
        return evaluate(H, field, point) + total * field.convert(fmpq(1, 3))


class ModifiedHamiltonian(ImageFunction):
    """H + grad H . (x~ - x)/3, which tends to H as eps -> 0; x~ is the image of x under the Kahan map of J grad H."""

    def __init__(self, hamiltonian: CubicHamiltonian, letter: str = "H") -> None:
        super().__init__(hamiltonian)
        self.name = f"modified {letter}"
        self.formula = f"{letter} + (2 eps/3) grad {letter}^T (I - eps f')^(-1) f, f = J grad {letter}"

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return ("modified", self.hamiltonian.H, self.hamiltonian.J)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return modified(self.hamiltonian.H, self.hamiltonian.gradient, self.map.at(eps, field), point)


class PaperIntegral(ImageFunction):
    """H~ = eps^{-1} x^T J x~ = -6 H + O(eps^2) of petrera-suris-2016, for homogeneous H and J = [[0, I], [-I, 0]]."""

    def __init__(self, hamiltonian: CubicHamiltonian, letter: str = "H", index: str = "") -> None:
        if not (hamiltonian.is_homogeneous and hamiltonian.is_standard):
            raise InputError("H~ = eps^(-1) x^T J x~ is an integral for homogeneous H and the standard J only")
        super().__init__(hamiltonian)
        self.name = f"{letter}~{index}"
        # The formula has x^, not x~: it is also conserved by maps of associated systems, for which x~ is another image.
        self.formula = (
            f"{self.name} = eps^(-1) x^T J x^ = -6 (modified {letter}{index}), "
            f"x^ the image of x under the Kahan map of J grad {letter}{index}"
        )

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return ("paper", self.hamiltonian.H)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        phi = self.map.at(eps, field)
        image = phi.step(point)
        m = len(image) // 2
        with phi.field.working():
            total = phi.field.zero
            for i in range(m):
                total = total + point[i] * image[m + i] - point[m + i] * image[i]
            return total / phi.eps


class CommutantIntegral(ImageFunction):
    """The integral eps^{-1} x^T J C x~ with C = (A^T)^k, k = `power`, which commutes with f'(x) for every x.

    For k = 0 it is H~. It has rational coefficients even if chi has irrational roots. Over the splitting field of chi,
    the functions for k < m span the same space as the K~_s of all associated systems (docs/mathematics.md).
    """

    def __init__(self, hamiltonian: CubicHamiltonian, A: fmpq_mat, power: int, letter: str = "H") -> None:
        super().__init__(hamiltonian)
        self.power, self.matrix = power, (A**power).transpose()
        self.name = f"{letter}~_{power}"
        self.formula = f"{self.name} = eps^(-1) x^T J {'A^T' if power == 1 else f'(A^T)^{power}'} x~"

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return ("commutant", self.hamiltonian.H, self.hamiltonian.J, self.matrix)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        phi = self.map.at(eps, field)
        image = phi.step(point)
        with field.working():
            column = field.convert_matrix(self.hamiltonian.J * self.matrix) * field.column(image)
            return (field.column(point).transpose() * column)[0, 0] / phi.eps


class ClaimedIntegral(ClaimedFunction):
    """A rational function of the variables and eps that is claimed to be conserved, at `eps` or (None) at every eps.

    `condition` says for which symbols and eps it is defined; `is_constant` whether it is constant at `eps`.
    """

    def __init__(
        self,
        name: str,
        function: RationalFunction,
        eps: fmpq | None = None,
        root: Root | None = None,
        map_: MapFamily | None = None,
    ) -> None:
        super().__init__(name, function, root, map_)
        dim = len(function.names) - 1 - (root is not None)
        self.condition = integral_condition(function, dim, eps, root)
        numerator, denominator = at_eps(function, eps, root, dim)
        self.is_constant = not denominator.is_zero() and is_constant(numerator, denominator, dim, root)


def integral_condition(integral: RationalFunction, dim: int, eps: fmpq | None, root: Root | None = None) -> str:
    """Return the condition on symbols and eps under which an integral I is defined.

    Args:
        integral: I, a rational function of `dim` coordinates, then of symbols and eps.
        dim: the dimension.
        eps: half the time step, an exact number, or None for every eps.
        root: the algebraic number that the only symbol stands for, if any.

    Returns:
        The condition as text; empty if I is defined for all symbols and eps, or for none.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> for text in ("x/((10*eps - 1)*y)", "x/y"):
    ...     print([integral_condition(parse_rational_function(text, ["x", "y", "eps"]), 2, None)])
    ['where 10*eps - 1 is not 0']
    ['']
    """
    _, denominator = at_eps(integral, eps, root, dim)
    return "" if denominator.is_zero() else where(dim, denominator)


def is_constant(numerator: fmpq_mpoly, denominator: fmpq_mpoly, dim: int, root: Root | None = None) -> bool:
    """Whether numerator/denominator does not depend on the first `dim` variables; `denominator` must not be 0."""
    monomial, coefficients = denominator.monoms()[0][:dim], list[fmpq_mpoly]()
    # `coefficients`: those of `monomial` in numerator and denominator. They are polynomials in the other variables.
    for polynomial in (numerator, denominator):
        terms = {(*(0,) * dim, *m[dim:]): value for m, value in polynomial.terms() if m[:dim] == monomial}
        coefficients.append(polynomial.context().from_dict(terms))
    difference = numerator * coefficients[1] - denominator * coefficients[0]
    return bool((difference if root is None else root.remainder(difference, dim)).is_zero())


class DeterminantDensity(PhaseFunction):
    """The function phi = det(I - eps f'(x)), a density of the Kahan map if f is Hamiltonian."""

    name = "phi"
    formula = "phi = det(I - eps f'(x))"
    # No condition is needed: phi is 1 at eps = 0, and at an eps for which phi is identically 0 there is no Kahan map.

    def __init__(self, system: QuadraticSystem) -> None:
        self.map = KahanFamily(system)

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return (self.formula, self.map.system.rhs)

    def value(self, field: Field, eps: Any, point: Sequence[Any]) -> Any:
        return self.map.at(eps, field).determinant(point)


class ClaimedDensity(ClaimedFunction):
    """A rational function of the variables and eps that is claimed to be a density, at `eps` or (None) at every eps.

    `condition` is that of `density_condition`, which may raise InputError.
    """

    def __init__(self, function: RationalFunction, eps: fmpq | None = None, root: Root | None = None) -> None:
        super().__init__("phi", function, root)
        self.condition = density_condition(function, len(function.names) - 1 - (root is not None), eps, root)
        self.formula = f"phi = {self.formula}"


def density_condition(phi: RationalFunction, dim: int, eps: fmpq | None, root: Root | None = None) -> str:
    """Return the condition on symbols and eps that phi is defined and not 0; for phi = 0 the law for dx/phi is trivial.

    Args:
        phi: a rational function of `dim` coordinates, then of symbols and eps.
        dim: the dimension.
        eps: half the time step, an exact number, or None for every eps.
        root: the algebraic number that the only symbol stands for, if any.

    Returns:
        The condition on symbols and eps that neither phi nor its denominator is identically 0, as text; empty if the
        condition always holds.

    Raises:
        InputError: if phi is identically 0 or 0/0 at the given eps and root.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> for text in ("a*x + b*y", "(10*eps - 1)*x", "x/(a*y)", "a*x + y"):
    ...     phi = parse_rational_function(text, ["x", "y", "a", "b", "eps"])
    ...     print([density_condition(phi, 2, None)])
    ['where a, b are not all 0']
    ['where 10*eps - 1 is not 0']
    ['where a is not 0']
    ['']
    """
    numerator, denominator = at_eps(phi, eps, root, dim)
    if numerator.is_zero():
        text = format_rational_function(phi)
        value_text = "0/0" if denominator.is_zero() else "identically 0"
        eps_and_root_text = " and ".join([f"eps = {eps}"] * (eps is not None) + [f"a {root}"] * (root is not None))
        explanation = f", which is {value_text} at {eps_and_root_text}" if text != "0" else ""
        raise InputError(
            f"found the density {quoted(text) if explanation else text}{explanation}, "
            "expected a function that is not zero: the measure is dx/phi"
        )
    return where(dim, numerator) if denominator.is_zero() else where(dim, numerator, denominator)


def jacobian_determinant_fraction(map_at_eps: Map, x: Sequence[Any], image: Sequence[Any]) -> tuple[Any, Any]:
    """Return numerator and denominator of det dPhi(x); for a Kahan map det(I + eps f'(x~)) and det(I - eps f'(x)).

    For a composition of maps, the numerator and the denominator are products over its factors.
    """
    factors, points = zip(*map_at_eps.stages(x), strict=True)
    numerators = [
        det(factor.numerator_matrix(point, next_point))
        for factor, point, next_point in zip(factors, points, (*points[1:], image), strict=True)
    ]
    denominators = [factor.determinant(point) for factor, point in zip(factors, points, strict=True)]
    with map_at_eps.field.working():
        return reduce(mul, numerators), reduce(mul, denominators)


@dataclass(frozen=True)
class Normalized:
    """An integral `function` = (alpha I + beta)/gamma, made from an integral I, and its limit `leading` as eps -> 0.

    The `coefficients` alpha, beta and gamma are polynomials in the symbols and eps without a common factor. `leading`
    is None if I is constant.
    """

    function: RationalFunction
    leading: RationalFunction | None
    coefficients: tuple[fmpq_mpoly, fmpq_mpoly, fmpq_mpoly]

    @property
    def is_shifted(self) -> bool:
        """Whether beta is not 0: I tends to a constant as eps -> 0, and this constant was subtracted."""
        return not self.coefficients[1].is_zero()

    def combination(self, name: str) -> str:
        """Return the integral as a formula in I (called `name`), the symbols and eps, e.g. "(F1 - 1)/eps^2"."""
        target_ring = ring([name, *(variable for variable in self.function.names if variable != name)])
        alpha, beta, gamma = (coefficient.project_to_context(target_ring) for coefficient in self.coefficients)
        return format_rational_function(RationalFunction(alpha * target_ring.gen(0) + beta, gamma))


def normalized(function: RationalFunction, dim: int) -> Normalized:
    """Normalize an integral I: return an integral (alpha I + beta)/gamma with a nonconstant limit as eps -> 0.

    If a map conserves I, it conserves (alpha I + beta)/gamma for all functions alpha, beta, gamma of eps and the
    parameters; a search returns any one of them. Let I = const + eps^k H + ..., like the published integrals
    (1 - eps^2 x^2)/(1 - eps^2 y^2) of the Euler top. Then the errors of I are those of H times eps^k, too small to show
    how well H is conserved. So the constant is subtracted, and the difference is divided by eps^k.

    Args:
        function: an integral I, for every eps, of a map that approximates a flow; a rational function of the variables,
            the symbolic parameters and, last, eps.
        dim: the number of variables.

    Returns:
        The normalized integral, exact; I itself if I is constant or normalized. The limit is in lowest terms; its
        numerator and denominator have coprime integer coefficients and positive leading coefficients.

    >>> from kahanmaps.algebra.parsing import parse_rational_function
    >>> result = normalized(parse_rational_function("(1 - eps^2*x^2)/(1 + 2*eps^2*y^2)", ["x", "y", "eps"]), 2)
    >>> [format_rational_function(F) for F in (result.function, result.leading)], result.combination("F")
    (['(x^2 + 2*y^2)/(2*y^2*eps^2 + 1)', 'x^2 + 2*y^2'], '(-F + 1)/eps^2')
    """
    P, Q = function.numerator, function.denominator
    eps = P.context().gens()[-1]
    alpha, beta, gamma = eps**0, eps * 0, eps**0  # invariant of the loop: alpha I + beta = gamma P/Q
    unchanged_result = Normalized(function, None, (alpha, beta, gamma))
    if P.is_zero():
        return unchanged_result
    while True:
        count_work(20 + len(P) + len(Q))
        # Divide by factors that do not depend on x, which every map conserves.
        numerator, denominator = _content(P, dim), _content(Q, dim)
        P, Q = P / numerator, Q / denominator
        alpha, beta, gamma = alpha * denominator, beta * denominator, gamma * numerator
        p, q = _lowest_order_terms(P), _lowest_order_terms(Q)
        common_factor = p.gcd(q)
        p, q = p / common_factor, q / common_factor
        if degree_in(p, dim) or degree_in(q, dim):
            break
        # P/Q = p/q + O(eps), and p/q does not depend on x: subtract it. P and Q are not divisible by eps (their
        # contents are 1). The loop ends if I depends on x: the lowest power of eps in P(x) Q(y) - P(y) Q(x) bounds that
        # in q P - p Q.
        P, alpha, beta = q * P - p * Q, q * alpha, q * beta - p * gamma
        if P.is_zero():
            return unchanged_result
    scale = primitive_part(p)[0] / primitive_part(q)[0]
    P, gamma = P / scale, gamma * scale
    common_factor = reduce(lambda left, right: left.gcd(right), (alpha, beta, gamma))
    coefficients = (alpha / common_factor, beta / common_factor, gamma / common_factor)
    leading = RationalFunction(primitive_part(p)[1], primitive_part(q)[1])
    return Normalized(RationalFunction(P, Q), leading, coefficients)


def measured_integrals(file: SystemFile) -> dict[str, RationalFunction]:
    """Return the integrals that a file claims, by name, in the form that is evaluated along orbits.

    If an integral tends to a constant as eps -> 0, it is replaced by its normalized form, and its name by the formula.

    >>> from kahanmaps.documents.catalog import load
    >>> list(measured_integrals(load("euler_top"))), list(measured_integrals(load("volterra_periodic_3")))
    (['(-F1 + 1)/eps^2', '(-F2/2 + 1/2)/eps^2'], ['I1', 'I2'])
    """
    integrals = {}
    for name, function in file.integrals.items():
        if file.map.has_eps and file.map.time_steps and file.map.root is None:
            result = normalized(function, file.dim)
            if result.is_shifted:
                name, function = result.combination(name), result.function
        integrals[name] = function
    return integrals


def _content(polynomial: fmpq_mpoly, dim: int) -> fmpq_mpoly:
    """Return the gcd of the coefficients of all monomials in the first `dim` variables; 1 if it is a number."""
    content = reduce(lambda left, right: left.gcd(right), coefficients_in(polynomial, dim))
    return content / content if content.is_constant() else content


def _lowest_order_terms(polynomial: fmpq_mpoly) -> fmpq_mpoly:
    """Return the terms of lowest order in eps (the last variable), divided by their power of eps."""
    order = min(int(monomial[-1]) for monomial in polynomial.monoms())
    terms: dict[tuple[int, ...], fmpq] = {}
    for monomial, value in polynomial.terms():
        if monomial[-1] == order:
            terms[(*map(int, monomial[:-1]), 0)] = value
    return polynomial.context().from_dict(terms)
