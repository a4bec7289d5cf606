"""Shortest linear recurrences of integer sequences, their kinds of growth, and their exact growth rates.

The shortest linear recurrence over Q of a sequence of integers has integer coefficients and leading coefficient 1
(fatou-1906). So the recurrence is computed modulo one large prime (massey-1969), its coefficients are lifted to
integers, and it is checked exactly on every term. Terms that were not needed to determine the recurrence are evidence
for it, but no proof that it holds for all terms.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from typing import Any

import flint
from flint import arb, fmpq, fmpq_mat, fmpq_poly, fmpz_mod_ctx, fmpz_mod_poly_ctx, fmpz_poly

from kahanmaps.algebra.fields import integer
from kahanmaps.algebra.printing import attributes, format_univariate, plain
from kahanmaps.display_protocols import ResultPart
from kahanmaps.invariants.growth import Growth

_PRIME = 2**521 - 1  # a Mersenne prime; coefficients of up to 520 bits can be lifted
_MODULAR_CONTEXT = fmpz_mod_poly_ctx(fmpz_mod_ctx(_PRIME))
_BITS = 256  # working precision of the roots
_MAX_CLASSES = 12  # maximal number of residue classes of n, each with its own polynomial


@dataclass(frozen=True)
class GrowthRate(ResultPart):
    """The largest modulus of characteristic roots, if it is itself a root; for positive a_n it is lim a_n^(1/n).

    `minimal_polynomial` is irreducible over Q, `enclosure` is the text of a ball that provably contains the number, and
    `digits` is the rounded number. `multiplicity` is that of the root; above 1 the growth has a polynomial factor.
    """

    minimal_polynomial: fmpz_poly
    enclosure: str
    digits: str
    multiplicity: int

    @property
    def text(self) -> str:
        """The number as text: exact if it is an integer, otherwise rounded and with its minimal polynomial."""
        if self.minimal_polynomial.degree() == 1:
            return str(-self.minimal_polynomial[0])
        return f"{self.digits}, root of {format_univariate(fmpq_poly(self.minimal_polynomial))}"

    def __float__(self) -> float:
        return float(self.digits)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; coefficients are text, in ascending order."""
        coefficients = plain(self.minimal_polynomial.coeffs())
        size = attributes(self, value="digits", enclosure="enclosure")
        return {**size, "minimal_polynomial": coefficients, "multiplicity": self.multiplicity}


def growth_rate(minimal_polynomial: fmpz_poly, ball: arb, multiplicity: int) -> GrowthRate:
    """Return, as a GrowthRate, the root of an irreducible polynomial that lies in the ball."""
    if minimal_polynomial.degree() == 1:
        integer_text = str(-minimal_polynomial[0])
        return GrowthRate(minimal_polynomial, integer_text, integer_text, multiplicity)
    return GrowthRate(minimal_polynomial, ball.str(40), ball.str(21, radius=False), multiplicity)


def polynomial_growth(power: int) -> Growth:
    """Return the kind of growth of n^power."""
    classes = (Growth.BOUNDED, Growth.LINEAR, Growth.QUADRATIC)
    return classes[power] if power < 3 else Growth.POLYNOMIAL


@dataclass(frozen=True)
class Recurrence(ResultPart):
    """The shortest linear recurrence of a_0, a_1, ..., which holds for all `terms` given terms.

    `characteristic` is monic with integer coefficients; [c_0, c_1, ..., 1] in ascending order stand for
    a_{n+order} + ... + c_1 a_{n+1} + c_0 a_n = 0. If x^k divides it, the recurrence without this factor holds from the
    term k (`preperiod`) on. `checked` terms were not needed to determine the recurrence. If it was derived from other
    results, the first `measured` values were measured, and the recurrence gives the others.

    >>> recurrence = find_recurrence([2 * n * n + 1 for n in range(12)])
    >>> recurrence.characteristic, recurrence.order, recurrence.checked, str(recurrence.growth)
    (x^3 + (-3)*x^2 + 3*x + (-1), 3, 6, 'quadratic')
    >>> recurrence.closed_form, recurrence.rate.text
    ('2*n^2 + 1', '1')
    """

    values: tuple[int, ...]
    characteristic: fmpz_poly
    measured: int | None = None

    @property
    def terms(self) -> int:
        """The number of given terms: the recurrence was computed from some of them and checked on the others."""
        return len(self.values) if self.measured is None else self.measured

    @property
    def order(self) -> int:
        """The order of the recurrence, which includes the length of the preperiod."""
        return int(self.characteristic.degree())

    @property
    def checked(self) -> int:
        """The number of terms that satisfy the recurrence and were not needed to determine it."""
        return self.terms - 2 * self.order if self.measured is None else self.terms

    @cached_property
    def factors(self) -> tuple[tuple[fmpz_poly, int], ...]:
        """The irreducible factors over Q of the characteristic polynomial, except x, with their multiplicities."""
        factors = self.characteristic.factor()[1]
        return tuple((factor, int(k)) for factor, k in factors if factor[0] != 0)

    @cached_property
    def preperiod(self) -> int:
        """The largest k for which x^k divides `characteristic`; the first k terms are the preperiod."""
        return next(k for k in count() if self.characteristic[k] != 0)

    @cached_property
    def is_polynomial(self) -> bool:
        """Whether all nonzero roots of `characteristic` are roots of unity (decided exactly)."""
        return all(int(factor.is_cyclotomic()) for factor, _ in self.factors)

    @property
    def power(self) -> int:
        """The exponent k if the terms grow as n^k, or as n^k r^n with r > 1; 0 for a sequence that ends in zeros."""
        if not self.factors:
            return 0
        if self.is_polynomial or self.rate is None:
            return max(k for _, k in self.factors) - 1
        return self.rate.multiplicity - 1

    @property
    def growth(self) -> Growth:
        """The kind of growth of the terms."""
        if not self.factors:
            return Growth.ZERO
        return polynomial_growth(self.power) if self.is_polynomial else Growth.EXPONENTIAL

    @cached_property
    def rate(self) -> GrowthRate | None:
        """The growth rate; None for a sequence that ends in zeros, and if no positive root has the largest modulus."""
        if not self.factors:
            return None
        if self.is_polynomial:
            return GrowthRate(fmpz_poly([-1, 1]), "1", "1", max(k for _, k in self.factors))
        # The largest positive root is searched for; balls show whether another root has a larger modulus.
        largest_root: tuple[arb, fmpz_poly, int] | None = None
        with flint.ctx.workprec(_BITS):
            moduli = []
            for factor, multiplicity in self.factors:
                roots: Any = factor.complex_roots()  # pairs (root, multiplicity); the stubs of python-flint are wrong
                for root, _ in roots:
                    moduli.append(abs(root))
                    # FLINT detects real roots: the imaginary part of their ball is exactly 0.
                    if root.imag == 0 and root.real > 0 and (largest_root is None or root.real > largest_root[0]):
                        largest_root = (root.real, factor, multiplicity)
            if largest_root is None or any(modulus > largest_root[0] for modulus in moduli):
                return None
            ball, factor, multiplicity = largest_root
            return growth_rate(factor, ball, multiplicity)

    @cached_property
    def closed_form(self) -> str | None:
        """The polynomials in n that give a_n, one for each residue class of n; None if the growth is exponential.

        The polynomials hold from n = `preperiod` on. The value is None also if there are more than 12 residue classes.
        """
        if not self.is_polynomial or not self.factors:
            return "0" if not self.factors else None
        period = math.lcm(*(int(factor.is_cyclotomic()) for factor, _ in self.factors))
        size = max(k for _, k in self.factors)
        if period > _MAX_CLASSES:
            return None
        polynomials = []
        for residue in range(period):
            n0 = next(n for n in count(self.preperiod) if n % period == residue)
            nodes = [n0 + period * k for k in range(size)]  # nodes of a polynomial of degree below `size`
            powers = fmpq_mat(size, size, [fmpq(n) ** k for n in nodes for k in range(size)])
            column = fmpq_mat(size, 1, [fmpq(self.predict(n)) for n in nodes])
            polynomials.append(format_univariate(fmpq_poly(powers.solve(column).entries()), "n"))
        if len(set(polynomials)) == 1:
            return polynomials[0]
        return "; ".join(
            f"{polynomial} for n = {residue} mod {period}" for residue, polynomial in enumerate(polynomials)
        )

    @property
    def closed_form_text(self) -> str | None:
        """The closed form, with the first n for which it holds, unless this is 0."""
        condition = f" for n >= {self.preperiod}"
        if not self.closed_form or not self.preperiod:
            return self.closed_form
        return f"{self.closed_form}, all" + condition if ";" in self.closed_form else self.closed_form + condition

    @property
    def characteristic_text(self) -> str:
        """The characteristic polynomial as a product of irreducible factors over Q.

        >>> find_recurrence([2 * n * n + 1 for n in range(12)]).characteristic_text
        '(t - 1)^3'
        """
        factors = [(f"({format_univariate(fmpq_poly(factor))})", k) for factor, k in self.factors]
        factors = [("t", self.preperiod)] * bool(self.preperiod) + factors
        return " ".join(text + (f"^{k}" if k > 1 else "") for text, k in factors) or "1"

    def __str__(self) -> str:
        return self.text

    @property
    def text(self) -> str:
        """The recurrence as an equation, with the number of terms that confirm it."""
        if self.measured is not None:
            return f"{self.equation}, derived from the singularity patterns; {self.terms} measured terms agree"
        return f"{self.equation}, found from {self.terms - self.checked} terms, confirmed by {self.checked} more"

    @property
    def equation(self) -> str:
        """The recurrence as an equation."""
        numbers_with_lag = [(-self.characteristic[k], self.order - k) for k in range(self.order - 1, -1, -1)]
        terms = [f"{'+' if number >= 0 else ''}{number}*a(n-{k})" for number, k in numbers_with_lag]
        terms = [term for term in terms if not term.startswith(("+0*", "-0*"))]
        right_side = "".join(terms).replace("+1*", "+").replace("-1*", "-").removeprefix("+") or "0"
        condition_text = f" for n >= {self.order}"
        return f"a(n) = {right_side}{condition_text}"

    def predict(self, n: int) -> int:
        """Return a_n; the recurrence extends the sequence beyond the given terms.

        >>> find_recurrence([1, 2, 4, 8, 16]).predict(10)
        1024
        """
        values, coefficients = list(self.values), [int(c) for c in self.characteristic.coeffs()[:-1]]
        while len(values) <= n:
            last_values = values[len(values) - self.order :]
            values.append(-sum(c * value for c, value in zip(coefficients, last_values, strict=True)))
        return values[n]

    def to_json(self) -> dict[str, Any]:
        """Return plain data; coefficients are text, in ascending order."""
        return {
            **attributes(self, "order", "preperiod", "terms", "checked"),
            "characteristic": plain(self.characteristic.coeffs()),
            "factors": [{"factor": str(factor), "multiplicity": k} for factor, k in self.factors],
            **attributes(self, "growth", "power", "rate", "closed_form", "text"),
        }


def find_recurrence(values: Sequence[int]) -> Recurrence | None:
    """Return the shortest linear recurrence over Q of an integer sequence a_0, a_1, ...; None if it is not accepted.

    A recurrence of order k is determined by the first 2k terms. It is accepted if it holds for all terms, and if there
    are at least max(2, k/3) further terms. It may hold only after a preperiod, whose length is counted in k. Raises
    InputError if a value is not an integer.

    >>> find_recurrence([1, 6, 36, 216, 1296]).rate.text
    '6'
    >>> find_recurrence([1, 2, 3, 5, 8, 13, 21]).rate.text
    '1.61803398874989484820, root of t^2 - t - 1'
    >>> find_recurrence([2, 3, 5, 7, 11, 13, 17, 19]) is None
    True
    """
    values = [integer(value, "an entry") for value in values]
    if len(values) < 2:
        return None
    polynomial = _MODULAR_CONTEXT.minpoly(list(values))
    order = int(polynomial.degree())
    if len(values) < 2 * order + needed_checks(order):
        return None
    # The shortest recurrence of an integer sequence has integer coefficients (Fatou's lemma), so that the residues of
    # least absolute value are candidates for them. The following test is exact, and rejects wrong candidates.
    integer_coefficients = [int(c) for c in polynomial.coeffs()]
    integer_coefficients = [c - _PRIME if 2 * c > _PRIME else c for c in integer_coefficients]
    for n in range(len(values) - order):
        if sum(c * value for c, value in zip(integer_coefficients, values[n : n + order + 1], strict=True)) != 0:
            return None
    return Recurrence(tuple(values), fmpz_poly(integer_coefficients))


def needed_checks(order: int) -> int:
    """Return the number of terms, beyond those that determine a recurrence of this order, that must confirm it."""
    return max(2, -(-order // 3))
