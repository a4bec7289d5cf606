"""The planes into which the normal form over K = Q[t]/chi splits over a field, and the conversion of points.

Over Q there is one plane for each irreducible factor g of chi, with coordinates in Q[t]/g. Over GF(p) there is one for
each factor of chi modulo p, with coordinates in GF(p^deg g). Over real balls there is one for each real root, and one,
with complex coordinates, for each pair of complex roots. In each plane the Kahan map is given by a `PlanarBlock`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from flint import acb, fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_mod_ctx, fmpz_mod_poly_ctx, fq_default_ctx

from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import QQ, BallField, Field, PrimeField
from kahanmaps.algebra.parsing import wrong_kind
from kahanmaps.algebra.printing import format_univariate
from kahanmaps.errors import BadPrime, InputError, SingularStep, counted
from kahanmaps.family.planar import NormalForm
from kahanmaps.maps.normal_form.planar_block import PlanarBlock, Triple


@dataclass(frozen=True, eq=False)
class Plane:
    """One plane: `name` is its root or its factor of chi, `degree` the degree of its field over the field of x.

    `residue` maps the coefficients of an element of K (elements of the field of x) to its value in the plane, and
    `coefficients` maps a value in the plane to `degree` elements of the field of x (two for a complex pair). `context`
    is FLINT's field of the plane if this field is an extension of GF(p), since elements do not determine it.
    """

    name: str
    degree: int
    block: PlanarBlock
    residue: Any
    coefficients: Any
    context: fq_default_ctx | None = None


class Splitting:
    """The planes of a normal form over QQ, GF(p) or real balls, for the map with this eps (the time step is 2 eps).

    `T` is the change x = T y from the coordinates y of the form, or None. Raises BadPrime if the form has no reduction
    modulo p, or chi has a repeated root modulo p.
    """

    def __init__(self, form: NormalForm, field: Field, eps: Any, T: fmpq_mat | None = None) -> None:
        if not isinstance(form, NormalForm):
            raise wrong_kind(form, "a normal form", "km.normal_form(member), km.system_normal_form(system).form are")
        self.form, self.field = form, field
        S = form.S if T is None else T * form.S
        with field.working():
            self.eps = field.convert(eps)
            self._scale = 2 * self.eps
            if self.eps == 0:
                raise BadPrime(f"eps = 0 in {field}: use another prime", field.characteristic)
            self._S_inverse = field.convert_matrix(S.inv())
            # The planes, and for each plane the elements of K that correspond to the basis of its field.
            if field is QQ or isinstance(field, PrimeField):
                planes, bases = _planes_by_factors(form, field)
            elif isinstance(field, BallField):
                planes, bases = _planes_over_balls(form, field)
            else:
                raise InputError(f"found the field {field}, expected QQ, GF(p) or real balls")
            self.planes: tuple[Plane, ...] = tuple(planes)
            rows = field.convert_matrix(S).tolist()
            m = form.m
            # x is the sum of M w over the planes: M is an entry of `_matrices`, w the coefficients of u, then of v.
            self._matrices = []
            for basis in bases:
                columns = []
                for first_column in (0, m):
                    for column in basis:
                        pairs = [zip(row[first_column : first_column + m], column, strict=True) for row in rows]
                        columns.append([sum((a * b for a, b in pair), field.zero) for pair in pairs])
                self._matrices.append(columns)

    @property
    def dim(self) -> int:
        """The dimension 2m."""
        return self.form.dim

    def matrix(self, plane: int) -> list[list[Any]]:
        """Return the rows of M for a plane: x is the sum of M w over all planes, w the coefficients of u, then of v."""
        return [list(row) for row in zip(*self._matrices[plane], strict=True)]

    def triples(self, x: Sequence[Any]) -> list[Triple]:
        """Return the homogeneous coordinates (2 eps u : 2 eps v : 1) of a point in every plane."""
        n, m = self.dim, self.form.m
        if len(x) != n:
            raise InputError(f"found a point with {counted(len(x), 'coordinate')}, expected {n}")
        with self.field.working():
            z = (self._S_inverse * self.field.matrix(n, 1, list(x))).entries()
            z = [entry * self._scale for entry in z]
            triples = []
            for plane in self.planes:
                U, V = plane.residue(z[:m]), plane.residue(z[m:])
                triples.append((U, V, U * 0 + 1))
            return triples

    def point(self, triples: Sequence[Triple]) -> tuple[Any, ...]:
        """Return the point with the homogeneous coordinates `triples` in the planes. Raises SingularStep if W = 0."""
        with self.field.working():
            coordinates = [self.field.zero] * self.dim
            for plane, (U, V, W), columns in zip(self.planes, triples, self._matrices, strict=True):
                if W == 0:
                    raise SingularStep("one of the planes is at infinity: the map has a pole here")
                values = [*plane.coefficients(U / W), *plane.coefficients(V / W)]
                for column, value in zip(columns, values, strict=True):
                    coordinates = [entry + factor * value for entry, factor in zip(coordinates, column, strict=True)]
            return tuple(entry / self._scale for entry in coordinates)


def _planes_by_factors(form: NormalForm, field: Field) -> tuple[list[Plane], list[list[list[Any]]]]:
    """Return the planes over Q or GF(p), one for each irreducible factor of chi, and a basis of each plane's field."""
    p = field.characteristic
    chi: Any
    elements: Any
    factors: Any
    if p:
        ring = fmpz_mod_poly_ctx(fmpz_mod_ctx(p))
        chi, *elements = (
            ring([fmpz(int(field.convert(c))) for c in f.coeffs()] or [0]) for f in (form.chi, *form.coefficients)
        )
        if any(exponent > 1 for _, exponent in chi.factor()[1]):
            raise BadPrime(f"chi has a repeated root modulo {p}: use another prime", p)
        factors = sorted((f for f, _ in chi.factor()[1]), key=lambda f: (f.degree(), [int(c) for c in f.coeffs()]))
    else:
        chi, elements, factors = form.chi, form.coefficients, rational_factors(form.chi)

    def polynomial(coefficients: Sequence[Any]) -> Any:
        return ring([fmpz(int(c)) for c in coefficients]) if p else fmpq_poly(list(coefficients))

    def plane_of(factor: Any) -> tuple[Plane, list[list[Any]]]:
        """Return the plane of a factor, and a basis of its field: coefficients in K of elements 0 in other planes."""
        degree, generator = int(factor.degree()), polynomial([0, 1])
        context: Any = None
        residue: Any
        coefficients: Any
        if degree == 1:
            root = -factor[0]
            name = f"t = {int(root)} mod {p}" if p else f"t = {root}"

            def residue(z: Sequence[Any]) -> Any:
                value = polynomial(z)(root)
                return field.convert(int(value)) if p else value

            def coefficients(value: Any) -> list[Any]:
                return [value]

        elif p:
            context = fq_default_ctx(modulus=factor)
            name = f"a factor of degree {degree} of chi mod {p}"

            def residue(z: Sequence[Any]) -> Any:
                return context([int(c) for c in (polynomial(z) % factor).coeffs()] or [0])

            def coefficients(value: Any) -> list[Any]:
                coefficients_in_field = [field.convert(int(c)) for c in value.to_list()]
                return coefficients_in_field + [field.zero] * (degree - len(coefficients_in_field))

        else:
            # An integral multiple of t is the generator.
            denominator = factor.denom()
            t_by_generator, generator = fmpq_poly([0, fmpq(1, denominator)]), fmpq_poly([0, denominator])
            algebra, name = (
                EtaleAlgebra(factor(t_by_generator) * denominator**degree),
                f"{format_univariate(factor)} = 0",
            )

            def residue(z: Sequence[Any]) -> Any:
                return algebra.convert(fmpq_poly(list(z))(t_by_generator))

            def coefficients(value: Any) -> Any:
                return value.coefficients

        block = PlanarBlock(*(residue(e.coeffs()) for e in elements))
        cofactor = chi // factor
        idempotent = cofactor * cofactor.xgcd(factor)[1] % chi
        powers = [idempotent * generator**k % chi for k in range(degree)]
        basis = [[field.convert(int(f[i]) if p else f[i]) for i in range(form.m)] for f in powers]
        return Plane(name, degree, block, residue, coefficients, context), basis

    planes, bases = zip(*map(plane_of, factors), strict=True)
    return list(planes), list(bases)


def rational_factors(chi: fmpq_poly) -> list[fmpq_poly]:
    """Return the monic irreducible factors over Q: linear factors by root, then others by degree and coefficients."""
    factors = [factor / factor.leading_coefficient() for factor, _ in chi.factor()[1]]
    return sorted(factors, key=lambda f: (f.degree(), [-c for c in f.coeffs()] if f.degree() == 1 else f.coeffs()))


def _planes_over_balls(form: NormalForm, field: BallField) -> tuple[list[Plane], list[list[list[Any]]]]:
    planes, bases = [], []
    chi_derivative = form.chi.derivative()
    for complex_root in form.chi.complex_roots():
        root: Any = complex_root[0]  # type: ignore[index]  # the stub omits the multiplicity
        if root.imag < 0:
            continue
        is_real = bool(root.imag == 0)
        root_ball: Any = root.real if is_real else root

        def value_at(coefficients: Sequence[Any], root_ball: Any = root_ball) -> Any:
            total = root_ball * 0
            for coefficient in reversed(coefficients):
                total = total * root_ball + coefficient
            return total

        block = PlanarBlock(*(value_at(_to_balls(c, field)) for c in form.coefficients))
        # chi / (t - root) by Horner's rule; divided by chi'(root), it is 1 at the root and 0 at all other roots.
        chi, denominator = (_to_balls(form.chi, field), value_at(_to_balls(chi_derivative, field)))
        quotient = [chi[-1]]
        for coefficient in chi[-2:0:-1]:
            quotient.append(quotient[-1] * root_ball + coefficient)
        idempotent = [entry / denominator for entry in reversed(quotient)]
        if is_real:
            planes.append(Plane(f"t = {root_ball.str(8, radius=False)}", 1, block, value_at, lambda value: [value]))
            bases.append([idempotent])
        else:
            name = f"t = {acb(root_ball).str(8, radius=False)} and its conjugate"
            planes.append(Plane(name, 2, block, value_at, lambda value: [value.real, value.imag]))
            bases.append([[2 * acb(e).real for e in idempotent], [-2 * acb(e).imag for e in idempotent]])
    return planes, bases


def _to_balls(element: fmpq_poly, field: BallField) -> list[Any]:
    return [field.convert(c) for c in element.coeffs()]
