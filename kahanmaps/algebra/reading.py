"""The terms of a polynomial as they are written, and the beginning of one that is too long to be shown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.polynomials import names_of


def first_terms(polynomial: fmpq_mpoly, characters: int) -> fmpq_mpoly:
    """The first terms that take about so many characters, perhaps none; exact, all if they fit.

    >>> from kahanmaps.algebra.text import parse_polynomial
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


def factors_of(
    coefficient: fmpq,
    exponents: Sequence[int],
    names: Sequence[str],
    power: Callable[[str, int], str],
    number: Callable[[fmpq], str],
) -> list[str]:
    """The factors of a term with a positive coefficient, as they are written; a 1 is left out before others.

    >>> factors_of(fmpq(3, 2), [2, 0, 1], ["x", "y", "z"], lambda name, k: f"{name}^{k}", str)
    ['3/2', 'x^2', 'z']
    """
    factors = [
        name if exponent == 1 else power(name, exponent)
        for name, exponent in zip(names, exponents, strict=True)
        if exponent
    ]
    if not factors or coefficient != 1:
        factors.insert(0, number(coefficient))
    return factors


def terms_of(polynomial: fmpq_mpoly) -> Iterator[tuple[tuple[int, ...], fmpq]]:
    """Exponents and coefficients in the order of the ring, one by one: of very many only the first may be wanted."""
    for k in range(len(polynomial)):
        yield tuple(int(exponent) for exponent in polynomial.monomial(k)), polynomial.coefficient(k)
