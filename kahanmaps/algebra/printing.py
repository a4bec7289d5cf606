"""Exact values as text: numbers, polynomials and rational functions in several notations, and data for JSON and CSV.

Within its limits, parsing.py reads the text returned by a `format_...` function back as the same value.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from io import StringIO
from math import isfinite, prod
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_poly

from kahanmaps.algebra.parsing import wrong_kind
from kahanmaps.algebra.polynomials import RationalFunction, common_denominator, names_of, primitive_part

_MAX_FACTORED_TERMS = 2000  # maximal number of terms of a polynomial that is factored for printing
_ONE = fmpq(1)


def format_number(value: fmpq) -> str:
    """Return the number as `p` or `p/q` in lowest terms, of any length.

    >>> format_number(fmpq(-2, 4)), format_number(fmpq(3))
    ('-1/2', '3')
    """
    if not isinstance(value, fmpq):
        raise wrong_kind(value, "an exact number (fmpq)", "make one with parse_number('1/10')")
    return str(value)


def format_point(point: Sequence[fmpq]) -> str:
    """Return the numbers of a point, separated by commas: the inverse of `parse_point`.

    >>> format_point((fmpq(1, 2), fmpq(-1, 3), fmpq(0)))
    '1/2,-1/3,0'
    """
    return ",".join(format_number(entry) for entry in point)


def format_polynomial(polynomial: fmpq_mpoly) -> str:
    """Return the polynomial as text, its terms in the order of its ring: the inverse of `parse_polynomial`.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> format_polynomial(x**3/3 + fmpq(2, 3)*x*y**2 - y)
    'x^3/3 + 2/3*x*y^2 - y'
    """
    if not isinstance(polynomial, fmpq_mpoly):
        raise wrong_kind(polynomial, "a polynomial (fmpq_mpoly)", "make one with parse_polynomial")
    names = names_of(polynomial)
    texts: list[str] = []
    for monomial, coefficient in polynomial.terms():
        if coefficient < 0:
            texts.append(" - " if texts else "-")
            coefficient = -coefficient
        elif texts:
            texts.append(" + ")
        powers = [n if k == 1 else f"{n}^{k}" for n, k in zip(names, monomial, strict=True) if k]
        product = "*".join(powers if coefficient.p == 1 and powers else [str(coefficient), *powers])
        texts.append(f"{product}/{coefficient.q}" if coefficient.p == 1 and powers and coefficient.q != 1 else product)
    return "".join(texts) or "0"


def format_univariate(polynomial: fmpq_poly, name: str = "t") -> str:
    """Return a polynomial in one variable as text.

    >>> format_univariate(fmpq_poly([-2, 0, 1]))
    't^2 - 2'
    """
    text = ""
    for power in range(polynomial.degree(), -1, -1):
        coefficient = polynomial[power]
        if coefficient == 0:
            continue
        absolute, sign = abs(coefficient), "-" if coefficient < 0 else "+"
        power_text = "" if power == 0 else name if power == 1 else f"{name}^{power}"
        number = "" if absolute == 1 and power_text else format_number(absolute) + ("*" if power_text else "")
        text += f" {sign} {number}{power_text}" if text else f"{'-' if sign == '-' else ''}{number}{power_text}"
    return text or "0"


def format_rational_function(function: RationalFunction) -> str:
    """Return the quotient as text, with brackets only where needed: the inverse of `parse_rational_function`.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> format_rational_function(RationalFunction(x + 1, 2*y)), format_rational_function(RationalFunction(x, y**2))
    ('(x/2 + 1/2)/y', 'x/y^2')
    """
    if not isinstance(function, RationalFunction):
        raise wrong_kind(function, "a RationalFunction", "make one with parse_rational_function")
    numerator_text = format_polynomial(function.numerator)
    if function.numerator.is_zero() or function.denominator.is_one():
        return numerator_text
    denominator_text = format_polynomial(function.denominator)
    if len(function.numerator) > 1:
        numerator_text = f"({numerator_text})"
    # Brackets are needed unless the denominator is a name or a power of a name: a/2*y would be read as a*y/2.
    if any(sign in denominator_text for sign in "*+- "):
        denominator_text = f"({denominator_text})"
    return f"{numerator_text}/{denominator_text}"


def format_factored(function: RationalFunction) -> str:
    """Return the quotient as text; numerator and denominator are factored over Q if that makes the text shorter.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> format_factored(RationalFunction(2*x**3*y - 2*x*y, (x - y)**2)), format_factored(RationalFunction(x + 1, 2*y))
    ('2*x*y*(x^2 - 1)/(x - y)^2', '(x/2 + 1/2)/y')
    """
    factors_and_constant = shorter_factors(function)
    return format_rational_function(function) if factors_and_constant is None else format_product(*factors_and_constant)


def shorter_factors(function: RationalFunction) -> tuple[list[tuple[fmpq_mpoly, int]], fmpq] | None:
    """Return ([(P_i, e_i), ...], c) with function = c prod P_i^e_i, P_i primitive; None if this form is not shorter.

    Numerator and denominator are each split into irreducible factors over Q, or into variables and one polynomial.
    Common factors of numerator and denominator are canceled.
    """
    factors, constant, is_shorter = list[tuple[fmpq_mpoly, int]](), fmpq(1), False
    for sign, polynomial in ((1, function.numerator), (-1, function.denominator)):
        if len(polynomial) == 0 or len(polynomial) > _MAX_FACTORED_TERMS:
            return None
        content, primitive = primitive_part(polynomial)
        constant *= content**sign
        powers = [(primitive_part(g)[1], int(k)) for g, k in primitive.factor()[1]]
        variables = [power for power in powers if len(power[0]) == 1]
        cofactor = primitive / prod(g**k for g, k in variables) if variables else primitive
        factorizations = [powers, [*variables, *([(cofactor, 1)] if len(cofactor) > 1 else [])]]
        shortest = min(factorizations, key=lambda powers: len(format_product(powers)))
        is_shorter |= len(shortest) > 1 or any(k > 1 for _, k in shortest)
        for g, k in shortest:
            index = next((n for n, (factor, _) in enumerate(factors) if factor == g), None)
            if index is None:
                factors.append((g, sign * k))
            else:  # a common factor of numerator and denominator
                factors[index] = g, factors[index][1] + sign * k
    return ([(g, k) for g, k in factors if k], constant) if is_shorter else None


def format_product(factors: Sequence[tuple[fmpq_mpoly, int]], constant: fmpq = _ONE) -> str:
    """Return a number times powers of polynomials as text, short polynomials first, negative powers as denominator.

    >>> from kahanmaps.algebra.polynomials import ring
    >>> x, y = ring(["x", "y"]).gens()
    >>> format_product([(x + y, 2), (y, -1), (x - 1, -3)], fmpq(-2, 3)), format_product([(x + y, 1)])
    ('-2*(x + y)^2/(3*y*(x - 1)^3)', 'x + y')
    """
    factor_texts = []
    for number, powers in numerator_and_denominator(factors, constant):
        bases = [(f"({format_polynomial(g)})" if len(g) > 1 else format_polynomial(g), k) for g, k in powers]
        powers_text = [base + (f"^{k}" if k > 1 else "") for base, k in bases]
        factor_texts.append(([str(number)] if number > 1 else []) + powers_text)
    numerator, denominator = ("*".join(texts) for texts in factor_texts)
    if len(factors) == 1 and factors[0][1] == 1 and constant == 1:
        return format_polynomial(factors[0][0])
    sign = "-" if constant < 0 else ""
    if not denominator:
        return f"{sign}{numerator or 1}"
    return (
        f"{sign}{numerator or 1}/({denominator})"
        if len(factor_texts[1]) > 1
        else f"{sign}{numerator or 1}/{denominator}"
    )


def numerator_and_denominator(
    factors: Sequence[tuple[fmpq_mpoly, int]], constant: fmpq
) -> list[tuple[int, list[tuple[fmpq_mpoly, int]]]]:
    """Return the numerator and the denominator of a product of powers.

    Each is a pair: a positive integer, and powers (polynomial, exponent) with short polynomials first.
    """

    def sort_key(power: tuple[fmpq_mpoly, int]) -> tuple[int, list[int]]:
        return len(power[0]), [-int(e) for e in power[0].monoms()[0]]

    return [
        (number, sorted(((g, sign * k) for g, k in factors if sign * k > 0), key=sort_key))
        for sign, number in ((1, abs(int(constant.p))), (-1, int(constant.q)))
    ]


# Formulas in any notation.


def first_terms(polynomial: fmpq_mpoly, characters: int) -> fmpq_mpoly:
    """Return the sum of the first terms that fit into about this number of characters; it may be 0 or `polynomial`.

    >>> from kahanmaps.algebra.parsing import parse_polynomial
    >>> first_terms(parse_polynomial("(x + y)^20", ["x", "y"]), 30)
    x^20 + 20*x^19*y + 190*x^18*y^2
    """
    terms: dict[tuple[int, ...], fmpq] = {}
    names, characters_left = names_of(polynomial), characters
    for monomial, value in terms_of(polynomial):
        # Estimate the length of a number: converting a coefficient of a million digits to text takes seconds.
        characters_left -= int((value.p.bit_length() + value.q.bit_length()) * 0.30103) + 3
        characters_left -= sum(len(name) + 2 for name, exponent in zip(names, monomial, strict=True) if exponent)
        if characters_left < 0:
            break
        terms[monomial] = value
    return polynomial if len(terms) == len(polynomial) else polynomial.context().from_dict(terms)


@dataclass(frozen=True)
class Notation:
    """The notation of a language: `name`, `number` and `power` format a name, a positive number and a power of a name.

    `signs` are the minus of the first term, the plus and the minus of later terms. `gap` separates terms, `times`
    factors. `enclosed` puts brackets around a sum, `fraction` formats a quotient, `row` groups a sum or a product.
    Terms are in the order of the ring. If `eps_first` is True, eps is the first factor of each term.
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
        """Return the terms of a polynomial as text, each with its sign.

        >>> from kahanmaps.algebra.parsing import parse_polynomial
        >>> PLAIN.terms(parse_polynomial("3/2*x^2*z - y", ["x", "y", "z"]))
        ['3/2*x^2*z', '- y']
        """
        names = names_of(polynomial)
        order = sorted(range(len(names)), key=lambda k: self.eps_first and names[k] != "eps")
        variables = {k: self.name(names[k]) for k in order}
        first_minus, plus, minus = self.signs
        terms: list[str] = []
        for monomial, coefficient in terms_of(polynomial):
            powers = ((variables[k], monomial[k]) for k in order if monomial[k])
            factors = [name if exponent == 1 else self.power(name, exponent) for name, exponent in powers]
            if not factors or abs(coefficient) != 1:  # 1 and -1 are printed as constant terms only
                factors.insert(0, self.number(abs(coefficient)))
            sign = (minus if terms else first_minus) if coefficient < 0 else plus if terms else ""
            terms.append(sign + self.times.join(factors))
        return terms or [self.number(fmpq(0))]

    def polynomial(self, polynomial: fmpq_mpoly) -> str:
        """Return the formula of a polynomial."""
        return self.row(self.gap.join(self.terms(polynomial)))

    def rational(self, function: RationalFunction) -> str:
        """Return the formula of a quotient, without nested fractions, factored if that is shorter.

        Numerator and denominator start with a positive term. Common factors are not canceled, as in `RationalFunction`.
        """
        factors_and_constant = shorter_factors(function)
        if factors_and_constant is None:
            is_negative, *polynomials = integer_fraction(function)
            numerator, denominator = map(self.polynomial, polynomials)
            is_polynomial = polynomials[1].is_one()
        else:
            is_negative, (numerator_factors, denominator_factors) = (
                factors_and_constant[1] < 0,
                numerator_and_denominator(*factors_and_constant),
            )
            numerator, denominator = self._product(*numerator_factors), self._product(*denominator_factors)
            is_polynomial = denominator_factors == (1, [])
        absolute_value = numerator if is_polynomial else self.fraction(numerator, denominator)
        return self.row(self.signs[0] + absolute_value) if is_negative else absolute_value

    def _product(self, number: int, powers: Sequence[tuple[fmpq_mpoly, int]]) -> str:
        """Return the formula of a product: first the number and the variables, then the sums in brackets."""
        if number == 1 and [k for _, k in powers] == [1]:
            return self.polynomial(powers[0][0])
        variables = [g**k for g, k in powers if len(g) == 1]
        factor_texts = [self.polynomial(prod(variables[1:], start=variables[0] * number))] if variables else []
        if not variables and (number > 1 or not powers):
            factor_texts = [self.number(fmpq(number))]
        for g, k in powers:
            if len(g) > 1:
                base = self.enclosed(self.polynomial(g))
                factor_texts.append(base if k == 1 else self.power(base, k))
        return factor_texts[0] if len(factor_texts) == 1 and variables else self.row(self.times.join(factor_texts))


PLAIN = Notation(str, str, "{}^{}".format)


def integer_fraction(function: RationalFunction) -> tuple[bool, fmpq_mpoly, fmpq_mpoly]:
    """Return (is_negative, P, Q): the quotient is -P/Q if `is_negative`, else P/Q.

    P and Q have integer coefficients and a positive first term. If the quotient is a polynomial P, the result is
    (False, P, 1), even if P has fractions as coefficients or a negative first term.
    """
    numerator, denominator = function.numerator, function.denominator
    if function.is_polynomial or numerator.is_zero():
        return False, numerator, numerator.context().constant(1)
    factor = fmpq(common_denominator(numerator))
    signs = [1 if polynomial.coefficient(0) > 0 else -1 for polynomial in (numerator, denominator)]
    return signs[0] != signs[1], numerator * (factor * signs[0]), denominator * (factor * signs[1])


def terms_of(polynomial: fmpq_mpoly) -> Iterator[tuple[tuple[int, ...], fmpq]]:
    """Yield pairs of exponents and coefficient in the order of the ring, lazily for callers that need only a few."""
    for k in range(len(polynomial)):
        yield tuple(int(exponent) for exponent in polynomial.monomial(k)), polynomial.coefficient(k)


# Plain data.

_MAX_EXACT = 2**53  # integers up to this size are exact in every JSON reader


def plain(value: Any) -> Any:
    """Convert a value to plain data: by its `to_json` if it has one; a sequence to a list, a large integer to text.

    >>> from flint import fmpq
    >>> plain([fmpq(1, 2), 7, 2**61 - 1, fmpq_mat([[1, -3]]), {"eps": None}])
    ['1/2', 7, '2305843009213693951', [['1', '-3']], {'eps': None}]
    """
    if value is None or isinstance(value, bool | float) or (isinstance(value, int) and abs(value) < _MAX_EXACT):
        return value
    if hasattr(value, "to_json"):
        return value.to_json()
    if isinstance(value, Mapping):
        return {name: plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, fmpq_mat) or type(value).__module__ == "numpy":
        return plain(value.tolist())
    return format_polynomial(value) if isinstance(value, fmpq_mpoly) else str(value)


def json_float(value: Any) -> float | str:
    """Return a float as a JSON number, or as the text inf, -inf or nan."""
    number = float(value)
    return number if isfinite(number) else repr(number)


def all_fields(value: Any, /, **others: str) -> dict[str, Any]:
    """Return all fields of a dataclass as plain data, nested ones included; `key="field"` stores it under `key`."""
    keys = {field: key for key, field in others.items()}
    return {keys.get(f.name, f.name): _field_data(getattr(value, f.name)) for f in fields(value) if f.name[0] != "_"}


def _field_data(value: Any) -> Any:
    if is_dataclass(value) and not hasattr(value, "to_json"):
        return all_fields(value)
    return [_field_data(entry) for entry in value] if isinstance(value, list | tuple) else plain(value)


def attributes(value: Any, /, *names: str, **others: str) -> dict[str, Any]:
    """Return {name: attribute of the value, as plain data}; `key="attribute"` stores the attribute under `key`."""
    attribute_of = {**dict(zip(names, names, strict=True)), **others}
    return {key: plain(getattr(value, attribute)) for key, attribute in attribute_of.items()}


# An integer, p/q or a decimal. The exponent is bounded: a program that reads 1e999999999 would run out of memory.
NUMBER = re.compile(r"[+-]?(?:[0-9]+/0*[1-9][0-9]*|(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?)")
# Text that a spreadsheet would run as a formula. An apostrophe before it marks it as text. If text already has such
# apostrophes, one more is added, so that removing one apostrophe always restores the original.
_FORMULA = re.compile(r"'*[=+\-@\t\r\n]")


def spreadsheet_safe(text: str) -> str:
    """Add an apostrophe to text that a spreadsheet would run as a formula; numbers do not change.

    >>> [spreadsheet_safe(text) for text in ("-3", "-1/2", "=HYPERLINK(1)", "-x", "'-x")]
    ['-3', '-1/2', "'=HYPERLINK(1)", "'-x", "''-x"]
    """
    return "'" + text if _FORMULA.match(text) and not NUMBER.fullmatch(text) else text


def csv_line(cells: Iterable[str]) -> str:
    """Return a line of a CSV file."""
    # Some versions of the csv module quote "\r" or "\n" in a cell only if the terminator contains it.
    line = StringIO(newline="")
    csv.writer(line, lineterminator="\r\n").writerow(cells)
    return line.getvalue().removesuffix("\r\n") + "\n"
