"""Algebraic numbers as values of parameters: `root of t^2 - 2`, `root of t^2 - 2 near 1.4`.

Identities over Q cannot distinguish conjugate roots: exact results hold in Q[t]/g for the class of t, hence for every
root of g. Modulo a prime, any root of g represents t; real values use the real root that `near` selects.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from functools import cached_property
from typing import Any, NamedTuple

import flint
from flint import arb, fmpq, fmpq_mpoly, fmpq_poly, fmpz, nmod_poly

from kahanmaps.algebra.bounds import Bound, BoundField, CoefficientSize, log2
from kahanmaps.algebra.etale import EtaleAlgebra
from kahanmaps.algebra.fields import QQ, BallField, ComplexBallField, Field, PrimeField
from kahanmaps.algebra.functions import FunctionField
from kahanmaps.algebra.parsing import parse_number, parse_polynomial, point_entries
from kahanmaps.algebra.polynomials import evaluate, ring
from kahanmaps.algebra.printing import format_univariate
from kahanmaps.errors import BadPrime, InputError, UnknownName, quoted

MAX_DEGREE = 12  # maximal degree of the minimal polynomial of an algebraic number
_ROOT_TEXT = re.compile(r"\s*root\s+of\b\s*(?P<g>.*?)(?:\s+near\s+(?P<near>\S+))?\s*", re.DOTALL)
_SQUARE_ROOT_TEXT = re.compile(r"\s*(?P<sign>-?)\s*sqrt\((?P<number>[^()]*)\)\s*")
_GUARD_BITS = 64  # bits of working precision beyond the requested ones


class Root:
    """A root of the monic irreducible `polynomial`: the real root closest to `near`, or any root if `near` is None.

    >>> root = parse_root("root of 2*t^2 - 4 near 1.4")
    >>> root, root.number_field, root == parse_root("root of t^2 - 2 near 3/2")
    (root of t^2 - 2 near 1.414, QQ[t]/(t^2 - 2), True)
    """

    def __init__(self, polynomial: fmpq_poly, near: fmpq | None = None) -> None:
        if polynomial.degree() < 1 or polynomial.degree() > MAX_DEGREE:
            raise InputError(
                f"found a root of {format_univariate(polynomial)}, expected a degree from 1 to {MAX_DEGREE}"
            )
        factors = polynomial.factor()[1]
        if len(factors) != 1 or factors[0][1] != 1:
            factors_text = ", ".join(format_univariate(factor) for factor, _ in factors)
            g = format_univariate(polynomial)
            reason = f"it is a power of {factors_text}" if len(factors) == 1 else f"its factors are {factors_text}"
            raise InputError(f"found a root of {g}, expected an irreducible polynomial: {reason}")
        self.polynomial = polynomial / polynomial.leading_coefficient()
        self.near = near
        self._near_text = "" if near is None else QQ.format(near)
        if near is not None:
            with suppress(InputError):  # the error is raised later, when the real number is needed
                # Replace `near` by the root to 4, 8, ... digits, the fewest that select it: equal roots get equal text.
                root = self._real(256)
                for digits in (4, 8, 16, 32, 64):
                    text = root.str(digits, radius=False)
                    with suppress(InputError):
                        if self._real(256, parse_number(text)).overlaps(root):
                            self.near, self._near_text = parse_number(text), text
                            break

    @property
    def degree(self) -> int:
        """The degree of the number field."""
        return int(self.polynomial.degree())

    @cached_property
    def number_field(self) -> EtaleAlgebra:
        """Q[t]/g for g = `polynomial`; the class of t is the root."""
        return EtaleAlgebra(self.polynomial)

    def over(self, field: Field) -> Any:
        """Return the root as an element of a field: GF(p), or a field that contains this root.

        Raises BadPrime if GF(p) contains no root, InputError for other fields.
        """
        if isinstance(field, EtaleAlgebra) and field == self.number_field:
            return field.generator
        if isinstance(field, PrimeField):
            return field.convert(self.residues(field)[0])
        if isinstance(field, BallField | ComplexBallField):
            return field.convert(self._real(field.bits))
        if isinstance(field, BoundField):
            # q times the root is an algebraic integer b; Cauchy's bound holds for all conjugates of b.
            q = fmpz(self.polynomial.denom())
            size = 1 + max(abs(self.polynomial[k] * q ** (self.degree - k)) for k in range(self.degree))
            return Bound(field, CoefficientSize(0, log2(fmpz(size.p // size.q + 1))), int(q), {})
        if isinstance(field, FunctionField) and field.modulus is not None:
            return field.variables[-1]
        raise InputError(f"a {self} is no element of {field}")

    def remainder(self, polynomial: fmpq_mpoly, k: int) -> fmpq_mpoly:
        """Reduce a polynomial modulo `self.polynomial` in its k-th variable; the result is 0 if the root is a zero."""
        x = polynomial.context().gens()[k]
        return polynomial % sum((x**j * c for j, c in enumerate(self.polynomial.coeffs())), 0 * x)

    def real_approximation(self, bits: int = 256) -> fmpq:
        """Return a rational approximation of the real root with this number of bits."""
        midpoint = self._real(bits).mid()
        mantissa, exponent = midpoint.man_exp()
        return fmpq(mantissa) * fmpq(2) ** int(exponent)

    def residues(self, field: PrimeField) -> list[int]:
        """Return the distinct roots of the polynomial in GF(p), as integers. Raises BadPrime if there are none."""
        p = field.prime
        if p >= 2**63:
            raise InputError(f"found a prime of {p.bit_length()} bits, expected at most 63 with a {self}")
        coefficients = [int(field.convert(c)) for c in self.polynomial.coeffs()]
        roots = sorted(int(root) for root, _ in nmod_poly(coefficients, p).roots())
        if not roots:
            raise BadPrime(f"{format_univariate(self.polynomial)} has no root modulo {p}: use another prime", p)
        return roots

    @property
    def decimal(self) -> str:
        """Text such as `, about 1.41421356237310` for the real root; empty if no real root is determined."""
        try:
            return f", about {self._real(64).str(15, radius=False)}"
        except InputError:
            return ""

    def _real(self, bits: int, near: fmpq | None = None) -> arb:
        near = self.near if near is None else near
        with flint.ctx.workprec(bits + _GUARD_BITS):
            roots: Any = self.polynomial.numer().complex_roots()  # FLINT's stubs declare a less precise type
            real_roots: list[arb] = [root.real for root, _ in roots if root.imag.is_zero()]
            if not real_roots:
                raise InputError(f"a {self} is not real: use exact or mod:P arithmetic")
            center = arb(0 if near is None else near)
            closest, *others = sorted(real_roots, key=lambda root: float(abs(root - center)))
            if others and (near is None or not abs(closest - center) < abs(others[0] - center)):  # balls may overlap
                texts = ", ".join(root.str(6, radius=False) for root in real_roots)
                example = real_roots[-1].str(4, radius=False)
                raise InputError(f"a {self} may be {texts}: say which, e.g. near {example}")
            return closest

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Root) and bool(self.polynomial == other.polynomial) and self.near == other.near

    def __hash__(self) -> int:
        return hash(str(self))

    def __repr__(self) -> str:
        near_text = f" near {self._near_text}" if self._near_text else ""
        return f"root of {format_univariate(self.polynomial)}{near_text}"


class AlgebraicPoint(NamedTuple):
    """A point over Q[t]/g: its coordinates are polynomials in t, a `root` of g.

    >>> point = parse_algebraic_point("1, 2*t/3", {"t": parse_root("root of t^2 + 1")}, {})
    >>> point.over(point.root.number_field), point.over(PrimeField(5))
    ((1, 2/3*t), (1, 3))
    """

    root: Root
    entries: tuple[fmpq_mpoly, ...]

    def over(self, field: Field) -> tuple[Any, ...]:
        """Return the point over a field that contains the root. Raises BadPrime and InputError like `Root.over`."""
        root = self.root.over(field)
        return tuple(evaluate(entry, field, (root,)) for entry in self.entries)

    def real_approximation(self) -> tuple[fmpq, ...]:
        """Return a rational approximation of the point. Raises InputError if the root is not real."""
        root = self.root.real_approximation()
        return tuple(evaluate(entry, QQ, (root,)) for entry in self.entries)


def parse_algebraic_point(
    text: str, roots: Mapping[str, Root], constants: Mapping[str, fmpq]
) -> AlgebraicPoint | tuple[fmpq, ...]:
    """Parse a point whose coordinates are polynomials in one algebraic number and constants.

    Args:
        text: the coordinates in the form of `parse_point`, with names allowed.
        roots: algebraic numbers by name.
        constants: rational numbers by name.

    Returns:
        The exact point; it is a tuple of rational numbers if no algebraic number occurs.

    Raises:
        InputError: for invalid text, with the number of the coordinate, and if two different algebraic numbers occur.
    """
    entries = []
    for number, (start, end) in enumerate(point_entries(text), 1):
        try:
            entries.append(parse_polynomial(text[start:end], tuple(roots), constants))
        except UnknownName as error:
            hint = "an algebraic number in a point is given by -p NAME='root of t^2 - 2'"
            raise InputError(f"entry {number}: {error}\n{hint}") from None
        except InputError as error:
            raise InputError(f"entry {number}: {error}") from None
    occurring_indices = [k for k, name in enumerate(roots) if any(name not in entry.unused_gens() for entry in entries)]
    if len(occurring_indices) > 1:
        names = " and ".join(list(roots)[k] for k in occurring_indices)
        raise InputError(f"found the algebraic numbers {names} in a point, expected one")
    if not occurring_indices:
        return tuple(entry.leading_coefficient() if entry else fmpq(0) for entry in entries)
    name, root = list(roots.items())[occurring_indices[0]]
    generator = ring([name]).gens()[0]
    values = [generator if k == occurring_indices[0] else generator * 0 for k in range(len(roots))]
    return AlgebraicPoint(root, tuple(entry.compose(*values, ctx=generator.context()) for entry in entries))


def parse_root(text: str) -> Root | None:
    """Parse `root of g`, `root of g near r` or `sqrt(2)`; return None for other text. Raises InputError.

    >>> print(parse_root("-sqrt(2)"), parse_root("1/2"))
    root of t^2 - 2 near -1.414 None
    """
    square_root_match = _SQUARE_ROOT_TEXT.fullmatch(text)
    if square_root_match is not None:
        number = parse_number(square_root_match["number"])
        sign = -1 if square_root_match["sign"] else 1  # any number of the same sign selects the root
        return Root(fmpq_poly([-number, 0, 1]), fmpq(sign) if number > 0 else None)
    form_match = _ROOT_TEXT.fullmatch(text)
    if form_match is None:
        return None
    names = sorted(set(re.findall(r"[A-Za-z_]\w*", form_match["g"])))
    if len(names) != 1:
        raise InputError(f"found {quoted(text)}, expected a polynomial in one variable, e.g. root of t^2 - 2")
    terms = {int(e): c for (e,), c in parse_polynomial(form_match["g"], names).terms()}
    coefficients = [terms.get(k, fmpq(0)) for k in range(max(terms, default=0) + 1)]
    return Root(fmpq_poly(coefficients), None if form_match["near"] is None else parse_number(form_match["near"]))
