"""The Kahan (Hirota-Kimura) map of a quadratic system, over any field.

Throughout the library, eps is the paper's epsilon and the time step is 2 eps. For f(x) = Q(x, x) + B x + c, x~ solves

    (x~ - x) / (2 eps) = Q(x, x~) + B (x + x~)/2 + c,

which is linear in x~; explicitly, Phi(x, eps) = x + 2 eps (I - eps f'(x))^{-1} f(x). Its inverse is Phi(., -eps), and
its Jacobi matrix is (I - eps f'(x))^{-1} (I + eps f'(x~)). Source: petrera-suris-2016, eqs. (eq: Kahan gen), (eq: Phi
gen), (Jac).

Like every map (implicit.py), Phi has an equation M(x) x~ = r(x), with M = I - eps f' and r = (I + eps B) x + 2 eps c.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from flint import fmpq_mpoly

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.polynomials import names_of, ring
from kahanmaps.algebra.printing import format_polynomial
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.convention import time_step as time_step_at
from kahanmaps.maps.equation import Equation
from kahanmaps.maps.implicit import ElementaryMap, Map, MapFamily, nonzero_eps
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem, SystemOver, as_system

if TYPE_CHECKING:
    from kahanmaps.family.associated import AssociatedSystem, FamilyMember


class HasMap(Protocol):
    """An object with a map, such as a system file."""

    @property
    def map(self) -> MapFamily: ...


# The values that `as_map` accepts.
SystemLike: TypeAlias = (
    "str | Path | Mapping[Any, Any] | Sequence[Any] | HasMap | QuadraticSystem | MapFamily | Map | CubicHamiltonian "
    "| FamilyMember | AssociatedSystem"
)


class KahanMap(ElementaryMap):
    """The Kahan map Phi(., eps) of a quadratic system over a field (by default the rationals).

    `eps` is an exact number (int, Fraction, text, fmpq) or an element of the field, not zero; the time step is 2 eps.
    It is also substituted for eps in the coefficients of the system. `values` are the values of the other symbols in
    the field. Results are exact over QQ and GF(p), and enclosures over RR(bits). If the system is already over a field
    (`SystemOver`), eps may be any element of it.

    M and r are computed from the tensor f''; over most fields this is faster than an evaluation of the equation.

    >>> system = QuadraticSystem.from_text(["x", "y"], ["x*y", "-x^2"])
    >>> phi = KahanMap(system, "1/2")
    >>> phi.step(["1", "1/3"])
    (7/8, -13/24)
    >>> phi.inverse_step(phi.step(["1", "1/3"]))
    (1, 1/3)
    """

    def __init__(
        self,
        system: SystemLike | SystemOver,
        eps: Any = None,
        field: Field = QQ,
        values: Sequence[Any] = (),
        coefficient_eps: Any = None,
        *,
        time_step: Any = None,
        h: Any = None,
    ) -> None:
        """`coefficient_eps`, by default `eps`, is the eps in the coefficients; an inverse keeps it and has -eps."""
        if eps is None:
            eps = resolve_eps(eps, time_step, h)
        if not isinstance(system, QuadraticSystem | SystemOver):
            system = as_system(system)
        if isinstance(system, SystemOver):
            self.local, self.eps = system, eps
            self._arguments: tuple[Any, ...] = (system,)
        else:
            self.system, self.values, self.variables = system, tuple(values), system.variables
            self.eps = nonzero_eps(eps, field)
            self._coefficient_eps = self.eps if coefficient_eps is None else coefficient_eps
            remaining_values = iter(self.values)
            self.local = system.over(
                field, [self._coefficient_eps if x == "eps" else next(remaining_values) for x in system.symbols]
            )
            self._arguments = (system, field, self.values, self._coefficient_eps)
        self.field, self.dim = self.local.field, self.local.dim

    def denominator_name(self, backward: bool) -> str:
        return f"I {'+' if backward else '-'} eps f'(x)"

    @cached_property
    def inverse(self) -> KahanMap:
        """The inverse map Phi(., -eps) of the same vector field (an eps in the coefficients does not change)."""
        with self.field.working():  # outside of this context, -eps would have FLINT's default precision
            return KahanMap(self._arguments[0], -self.eps, *self._arguments[1:])

    def denominator_matrix(self, point: Sequence[Any]) -> Any:
        """Return the matrix I - eps f'(x)."""
        x = self.point(point)
        with self.field.working():
            return self._identity - self.local.jacobian(x) * self.eps

    def linear_system(self, x: tuple[Any, ...]) -> tuple[Any, Any]:
        """Return M = I - eps f'(x) and r = (I + eps B) x + 2 eps c."""
        column = self.field.column(x)
        rhs = column + (self.local.B * column + self.local.c * self.field.convert(2)) * self.eps
        return self.denominator_matrix(x), rhs

    def numerator_matrix(self, point: Sequence[Any], image: Sequence[Any]) -> Any:
        """Return the matrix I + eps f'(x~)."""
        return self.inverse.denominator_matrix(image)

    @cached_property
    def _identity(self) -> Any:
        with self.field.working():
            return self.field.identity(self.dim)

    @cached_property
    def equation(self) -> Equation:
        """The equation (I - eps f'(x)) x~ - (I + eps B) x - 2 eps c = 0."""
        field, eps, n = self.field, self.eps, self.dim
        exponents = tuple(tuple(int(i == k) for i in range(n + 1)) for k in range(n + 1))
        # Linear terms are averaged, B (x + x~)/2, so that eps B occurs in the matrix and in the right-hand side.
        with field.working():
            tensor = (self.local.tensor * -eps).entries()
            B, c = (self.local.B * eps).entries(), (self.local.c * (-2 * eps)).entries()
            one, zero = field.one, field.zero
            terms = []
            for i in range(n):
                matrix = [
                    [
                        *enumerate(tensor[(i * n + j) * n : (i * n + j + 1) * n]),
                        (n, -B[i * n + j] + (one if i == j else zero)),
                    ]
                    for j in range(n)
                ]
                rhs = [*((j, -B[i * n + j] - (one if i == j else zero)) for j in range(n)), (n, c[i])]
                terms.append(tuple(tuple((k, e) for k, e in form if not field.is_zero(e)) for form in (*matrix, rhs)))
        return Equation(field, exponents, tuple(terms))

    @property
    def flow(self) -> tuple[Any, Any] | None:
        """The flow as ((system as text, values of its symbols), time step 2 eps); None for a `SystemOver`."""
        if isinstance(self._arguments[0], SystemOver):
            return None
        symbols = self._coefficient_eps if "eps" in self.system.symbols else None, *self.values
        with self.field.working():
            return (str(self.system), symbols), time_step_at(self.eps)

    def __reduce__(self) -> tuple[Any, ...]:
        return KahanMap, (self._arguments[0], self.eps, *self._arguments[1:])


class KahanFamily(MapFamily):
    """The Kahan map of a quadratic system; if its coefficients contain eps, the map is an adjusted Kahan map.

    >>> KahanFamily(QuadraticSystem.from_text(["x"], ["x^2"])).at("1/2").step(["1/5"])
    (1/4,)
    """

    title = "Kahan map"
    denominator_name = "det(I - eps f')"

    def __init__(self, system: QuadraticSystem) -> None:
        self.system = system
        self.variables = system.variables
        self._cached_map: KahanMap | None = None

    @property
    def symbols(self) -> tuple[str, ...]:
        return tuple(name for name in self.system.symbols if name != "eps")

    @property
    def scales_with_eps(self) -> bool:
        return self.system.is_homogeneous and "eps" not in self.system.symbols

    @property
    def seed_data(self) -> tuple[Any, ...]:
        return self.system.rhs

    @property
    def digits(self) -> int:
        return self.system.digits

    def at(self, eps: Any, over: Field = QQ, values: Sequence[Any] = ()) -> KahanMap:
        """Return the map Phi(., eps) over a field. Raises InputError for eps = 0, BadPrime if it has no reduction."""
        cached_map = self._cached_map
        if (
            cached_map is None
            or cached_map.field is not over
            or cached_map.eps is not eps
            or cached_map.values != tuple(values)
        ):
            self._cached_map = cached_map = KahanMap(self.system, eps, over, values)
        return cached_map

    @cached_property
    def rows(self) -> tuple[tuple[fmpq_mpoly, ...], ...]:  # type: ignore[override]  # read only
        """The rows of (I - eps f'(x) | -r) with r = (I - eps f'(x)) x + 2 eps f(x), polynomials in the `names`."""
        context = ring(self.names)
        *x, eps = context.gens()
        variables = [context.gen(self.names.index(name)) for name in names_of(self.system.rhs[0])]
        rows = []
        for i, (gradient, f) in enumerate(zip(self.system.jacobian(self.names), self.system.rhs, strict=True)):
            row = [int(i == j) - eps * derivative for j, derivative in enumerate(gradient)]
            product = sum((entry * y for entry, y in zip(row, x, strict=False)), context.constant(0))
            rows.append((*row, -product - 2 * eps * f.compose(*variables, ctx=context)))
        return tuple(rows)

    def to_record(self) -> dict[str, list[str]]:
        return {"rhs": [format_polynomial(polynomial) for polynomial in self.system.rhs]}

    def __str__(self) -> str:
        return str(self.system)

    def __repr__(self) -> str:
        return f"Kahan({', '.join(self.variables)})"


def as_map(value: SystemLike) -> MapFamily:
    """Convert a value to a map; a system stands for its Kahan map.

    The value is a map (a map at a fixed eps becomes a map that does not depend on eps), a system, a system file, a
    member of the family, a catalogue name, a path, or equations: text, a dictionary {variable: expression}, or a list
    of equations of SymPy.
    Raises InputError for any other value.
    """
    if isinstance(value, QuadraticSystem):
        return KahanFamily(value)
    if isinstance(value, MapFamily):
        return value
    # Names and paths are read by a higher layer, which is imported only if needed.
    map_: MapFamily = import_module("kahanmaps.documents.inline").as_file(value).map
    return map_
