"""Formulas as they are written, in any notation, and the beginning of one that is too long to be shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import prod

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, names_of
from kahanmaps.algebra.written.text import shorter_factors, sides


def first_terms(polynomial: fmpq_mpoly, characters: int) -> fmpq_mpoly:
    """The first terms that take about so many characters, perhaps none; exact, all if they fit.

    >>> from kahanmaps.algebra.written.text import parse_polynomial
    >>> first_terms(parse_polynomial("(x + y)^20", ["x", "y"]), 30)
    x^20 + 20*x^19*y + 190*x^18*y^2
    """
    kept: dict[tuple[int, ...], fmpq] = {}
    names, left = names_of(polynomial), characters
    for monomial, value in terms_of(polynomial):
        # The length of a number without writing it: a coefficient of a million digits takes seconds.
        left -= int((value.p.bit_length() + value.q.bit_length()) * 0.30103) + 3
        left -= sum(len(name) + 2 for name, exponent in zip(names, monomial, strict=True) if exponent)
        if left < 0:
            break
        kept[monomial] = value
    return polynomial if len(kept) == len(polynomial) else polynomial.context().from_dict(kept)


@dataclass(frozen=True)
class Notation:
    """How a language writes formulas: names, positive numbers and powers, and what stands around terms and factors.

    `signs` are a minus before the first term, and plus and minus before others; `gap` stands between terms, `times`
    between factors. `enclosed` puts brackets around a sum, `fraction` one text above or before another, `row` holds a
    sum or a product together. Terms stand in the order of the ring, and in them, with `eps_first`, eps.
    """

    name: Callable[[str], str]
    number: Callable[[fmpq], str]
    power: Callable[[str, int], str]
    signs: tuple[str, str, str] = ("-", "+ ", "- ")
    gap: str = " "
    times: str = "*"
    fraction: Callable[[str, str], str] = "({})/({})".format
    enclosed: Callable[[str], str] = "({})".format
    row: Callable[[str], str] = str
    eps_first: bool = True

    def terms(self, polynomial: fmpq_mpoly) -> list[str]:
        """The terms with their signs.

        >>> from kahanmaps.algebra.written.text import parse_polynomial
        >>> PLAIN.terms(parse_polynomial("3/2*x^2*z - y", ["x", "y", "z"]))
        ['3/2*x^2*z', '- y']
        """
        names = names_of(polynomial)
        order = sorted(range(len(names)), key=lambda k: self.eps_first and names[k] != "eps")
        written = {k: self.name(names[k]) for k in order}
        first, plus, minus = self.signs
        found: list[str] = []
        for monomial, coefficient in terms_of(polynomial):
            powers = ((written[k], monomial[k]) for k in order if monomial[k])
            factors = [name if exponent == 1 else self.power(name, exponent) for name, exponent in powers]
            if not factors or abs(coefficient) != 1:  # a 1 is left out before others
                factors.insert(0, self.number(abs(coefficient)))
            sign = (minus if found else first) if coefficient < 0 else plus if found else ""
            found.append(sign + self.times.join(factors))
        return found or [self.number(fmpq(0))]

    def polynomial(self, polynomial: fmpq_mpoly) -> str:
        """A polynomial, exact."""
        return self.row(self.gap.join(self.terms(polynomial)))

    def rational(self, function: RationalFunction) -> str:
        """A quotient of polynomials, exact, without fractions inside the fraction, in factors where they are shorter.

        Both sides of a fraction start with a positive term. Common factors stay, as they do in `RationalFunction`.
        """
        found = shorter_factors(function)
        if found is None:
            is_negative, *parts = above_and_below(function)
            above, below = map(self.polynomial, parts)
            is_whole = parts[1].is_one()
        else:
            is_negative, (over, under) = found[1] < 0, sides(*found)
            above, below, is_whole = self._product(*over), self._product(*under), under == (1, [])
        whole = above if is_whole else self.fraction(above, below)
        return self.row(self.signs[0] + whole) if is_negative else whole

    def _product(self, number: int, powers: Sequence[tuple[fmpq_mpoly, int]]) -> str:
        """One side of a product as one row: the number and the variables together, then sums in brackets."""
        if number == 1 and [k for _, k in powers] == [1]:
            return self.polynomial(powers[0][0])
        variables = [g**k for g, k in powers if len(g) == 1]
        parts = [self.polynomial(prod(variables[1:], start=variables[0] * number))] if variables else []
        if not variables and (number > 1 or not powers):
            parts = [self.number(fmpq(number))]
        for g, k in powers:
            if len(g) > 1:
                base = self.enclosed(self.polynomial(g))
                parts.append(base if k == 1 else self.power(base, k))
        return parts[0] if len(parts) == 1 and variables else self.row(self.times.join(parts))


PLAIN = Notation(str, str, "{}^{}".format)


def above_and_below(function: RationalFunction) -> tuple[bool, fmpq_mpoly, fmpq_mpoly]:
    """Whether it is negative, and the sides of a fraction as they are written: no fractions, first terms positive.

    Polynomials have the denominator 1 and their own signs.
    """
    above, below = function.numerator, function.denominator
    if function.is_polynomial or above.is_zero():
        return False, above, above.context().constant(1)
    factor = fmpq(common_denominator(above))
    signs = [1 if part.coefficient(0) > 0 else -1 for part in (above, below)]
    return signs[0] != signs[1], above * (factor * signs[0]), below * (factor * signs[1])


def terms_of(polynomial: fmpq_mpoly) -> Iterator[tuple[tuple[int, ...], fmpq]]:
    """Exponents and coefficients in the order of the ring, one by one: of very many only the first may be wanted."""
    for k in range(len(polynomial)):
        yield tuple(int(exponent) for exponent in polynomial.monomial(k)), polynomial.coefficient(k)
