"""Parsing of functions of a point x and its iterates: x~ is the image of x under the map, x~~ that of x~.

Functions may be named by letters, which are defined after the formula: F0*F1~ - F1*F0~, F0 = x*y~, F1 = y. F0~ denotes
F0 with one more ~ after each variable.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import prod

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.parsing import is_name, parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.errors import InputError, quoted

MAX_ITERATES = 16  # maximal number of ~ after a name
_MAX_PRODUCTS = 1_000_000  # maximal number of products of terms that are formed when formulas replace letters


def iterates_in(*texts: str) -> int:
    """Return the maximal number of ~ after a name in the texts: 2 if x~~ occurs and x~~~ does not.

    >>> iterates_in("x*y~ - x~~", "x")
    2
    """
    return max((len(run) for text in texts for run in re.findall("~+", text)), default=0)


def with_iterates(variables: Sequence[str], count: int, others: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the variables, then all of them with ~, with ~~, ... up to `count` times ~, and then the names `others`.

    >>> with_iterates(["x", "y"], 1, ["eps"])
    ('x', 'y', 'x~', 'y~', 'eps')
    """
    return (*(name + "~" * k for k in range(count + 1) for name in variables), *others)


def parse_with_iterates(
    text: str, variables: Sequence[str], others: Sequence[str], constants: Mapping[str, fmpq]
) -> RationalFunction:
    """Parse a rational function of the variables, their iterates and the names `others`.

    Args:
        text: a formula; definitions of letters that occur in it may follow, separated by commas.
        variables: the names of the coordinates of a point.
        others: names without iterates, such as symbols and eps.
        constants: the values of other names in the formula.

    Returns:
        A function whose arguments are the names that `with_iterates` returns.

    Raises:
        InputError: if the text cannot be parsed, or if replacing the letters exceeds the work limit.

    >>> minor = parse_with_iterates("F*G~ - G*F~, F = x, G = y", ["x", "y"], ["eps"], {})
    >>> minor == parse_with_iterates("x*y~ - y*x~", ["x", "y"], ["eps"], {})
    True
    """
    if not isinstance(text, str) or "~" not in text:
        return parse_rational_function(text, (*variables, *others), constants)
    pieces, depth = [""], 0
    for character in text:  # split the text at commas outside brackets
        depth += (character == "(") - (character == ")")
        if character == "," and depth <= 0:
            pieces.append("")
        else:
            pieces[-1] += character
    formula, *definition_texts = pieces
    definitions = {}
    for piece in definition_texts:
        name, equals, value = (side.strip() for side in piece.partition("="))
        if not equals or not is_name(name):
            expected = "expected what a letter stands for: F0 = x*y~"
            raise InputError(f"found {quoted(piece.strip())} behind a comma, {expected}")
        definitions[name] = value
    shift, inner_shift = iterates_in(formula), iterates_in(*definitions.values())
    max_shift = shift + (inner_shift if definitions else 0)
    if max_shift > MAX_ITERATES:
        raise InputError(f"found a function of {max_shift} iterates of a point, expected at most {MAX_ITERATES}")
    names = with_iterates(variables, max_shift, others)
    if not definitions:
        return parse_rational_function(formula, names, constants)
    if len(definitions) < len(definition_texts) or {*definitions} & {*variables, *others, *constants}:
        names_given = ", ".join(definitions)
        raise InputError(
            f"found the letters {names_given}, expected each of them once, and no names that are already in use"
        )
    context, n = ring(names), len(variables)
    functions = [parse_polynomial(definition, names, constants) for definition in definitions.values()]
    letters = with_iterates(tuple(definitions), shift)
    function = parse_rational_function(formula, (*letters, *names), constants)
    fraction = (function.numerator, function.denominator)
    sizes = [len(P) for P in functions] * (shift + 1)
    monomials = [monomial for polynomial in fraction for monomial in polynomial.monoms()]
    if sum(prod(size ** int(e) for size, e in zip(sizes, m, strict=False)) for m in monomials) > _MAX_PRODUCTS:
        raise InputError("found a formula with too many terms after its letters are replaced")
    gens, coordinates = context.gens(), (max_shift + 1) * n

    def shift_iterates(P: fmpq_mpoly, steps: int) -> fmpq_mpoly:
        # P contains no variable of the last iterate, whose image is not in the ring.
        images = [gens[min(k + steps * n, coordinates - 1)] for k in range(coordinates)]
        return P.compose(*images, *gens[coordinates:], ctx=context)

    values = [shift_iterates(P, steps) for steps in range(shift + 1) for P in functions]
    numerator, denominator = (polynomial.compose(*values, *gens, ctx=context) for polynomial in fraction)
    return RationalFunction(numerator, denominator)
