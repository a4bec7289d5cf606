"""The facts of a [catalog] section that a program can use: degrees, growth, verdict, relations along an orbit.

    degrees = [3, 9, 19, 33, 51]          of the iterates Phi, Phi^2, ... on a generic line
    growth = "quadratic"                  bounded, linear, quadratic or exponential
    dynamical_degree = "x^2 - 2*x - 1"    the minimal polynomial of lim d_n^(1/n), its largest real root
    verdict = "integrable"                integrable, linearisable or not integrable
    codimension = 2                       of the smallest variety known to contain a generic orbit

    [[catalog.relations]]                 so many independent combinations vanish along a generic orbit
    monomials = ["x1^2", "x2^2", "x3^2", "1"]
    dimension = 2

All of them are for generic parameters and generic eps, so that relations know no parameters. What kind of evidence
there is, the facts in words say.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from math import comb
from typing import Any, NamedTuple

from flint import fmpq, fmpq_mpoly

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import monomials, ring
from kahanmaps.errors import InputError, quoted, show

GROWTHS = ("bounded", "linear", "quadratic", "exponential")
VERDICTS = ("integrable", "linearisable", "not integrable")
KEYS = ("degrees", "growth", "dynamical_degree", "verdict", "codimension", "relations")
MAX_MONOMIALS = 100_000
_UP_TO = re.compile(r"degree <= ([0-9]{1,3})")
_RELATION_KEYS = ("monomials", "dimension")


class ClaimedRelations(NamedTuple):
    """A Hirota-Kimura basis: along a generic orbit `dimension` independent combinations of `functions` vanish.

    `text` is how the file writes the functions; they are polynomials over Q in the variables of the system.
    """

    text: str
    functions: tuple[fmpq_mpoly, ...]
    dimension: int


def relations(section: Mapping[str, Any], variables: Sequence[str]) -> tuple[ClaimedRelations, ...]:
    """The relations of a [catalog] section, their functions as exact polynomials in `variables`.

    `section` is `SystemFile.catalog`. Empty where the section has none. Raises InputError for functions that cannot be
    read. Source: petrera-pfadler-suris-2009.

    >>> [found] = relations({"relations": [{"monomials": "degree <= 1", "dimension": 1}]}, ["x", "y"])
    >>> found.functions, found.dimension
    ((1, x, y), 1)
    """
    return tuple(
        ClaimedRelations(
            given if isinstance(given := table["monomials"], str) else ", ".join(given),
            relation_functions(given, variables),
            table["dimension"],
        )
        for table in section.get("relations", [])
    )


def relation_functions(given: str | Sequence[str], variables: Sequence[str]) -> tuple[fmpq_mpoly, ...]:
    """The functions that "degree <= d" or a list of polynomials stands for, as exact polynomials in `variables`.

    Raises InputError for anything else, for more than 100000 monomials, and for functions that are 0 or stand twice.
    Source: petrera-pfadler-suris-2009.

    >>> relation_functions(["x^2 + y^2", "1"], ["x", "y"])
    (x^2 + y^2, 1)
    """
    if isinstance(given, str):
        match = _UP_TO.fullmatch(given)
        if match is None:
            raise InputError(f'found {quoted(given)}, expected "degree <= d" or a list of polynomials')
        top = int(match[1])
        count = comb(top + len(variables), top)
        if count > MAX_MONOMIALS:
            raise InputError(f"found {quoted(given)}, which is {count} monomials, expected at most {MAX_MONOMIALS}")
        context = ring(variables)
        exponents = chain.from_iterable(monomials(len(variables), d) for d in range(top + 1))
        return tuple(context.from_dict({exponent: fmpq(1)}) for exponent in exponents)
    if len(given) > MAX_MONOMIALS:
        raise InputError(f"found {len(given)} functions, expected at most {MAX_MONOMIALS}")
    functions = tuple(parse_polynomial(text, variables) for text in given)
    seen = set()
    for k, function in enumerate(functions):
        if function.is_zero():
            raise InputError(f"found 0 as function {k + 1}, expected functions that are not zero")
        if str(function) in seen:
            raise InputError(f"found function {k + 1} twice, expected different ones")
        seen.add(str(function))
    return functions


def read_structured_facts(
    section: Mapping[str, Any], variables: Sequence[str] | None, mistake: Callable[[str, str], None]
) -> None:
    """Look through the structured facts of a [catalog] section; `mistake(key, sentence)` is told what is wrong."""
    degrees = section.get("degrees", [1])
    if not isinstance(degrees, list) or not degrees or not all(_is_count(d) and 0 < d < 10**100 for d in degrees):
        mistake(
            "catalog.degrees",
            f"found {show(degrees)}, expected a list of positive integers of at most 100 digits, d_1 first",
        )
    for key, known in (("growth", GROWTHS), ("verdict", VERDICTS)):
        if key in section and section[key] not in known:
            mistake(f"catalog.{key}", f"found {show(section[key])}, expected one of {', '.join(known)}")
    if "dynamical_degree" in section:
        _read_dynamical_degree(section["dynamical_degree"], mistake)
    codimension = section.get("codimension", 0)
    at_most = len(variables) if variables is not None else None
    if not _is_count(codimension) or (at_most is not None and codimension > at_most):
        bound = "an integer, 0 or more" if at_most is None else f"an integer from 0 to {at_most}, the dimension"
        mistake("catalog.codimension", f"found {show(codimension)}, expected {bound}")
    tables = section.get("relations", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        mistake("catalog.relations", f"found {show(tables)}, expected tables [[catalog.relations]]")
        return
    for k, table in enumerate(tables):
        _read_relation(f"catalog.relations[{k + 1}]", table, variables, mistake)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _read_dynamical_degree(given: Any, mistake: Callable[[str, str], None]) -> None:
    expected = "expected an irreducible polynomial in x with leading coefficient 1"
    if not isinstance(given, str):
        mistake("catalog.dynamical_degree", f"found {show(given)}, {expected}")
        return
    try:
        polynomial = parse_polynomial(given, ["x"])
    except InputError as error:
        mistake("catalog.dynamical_degree", str(error))
        return
    is_irreducible = not polynomial.is_constant() and [power for _, power in polynomial.factor()[1]] == [1]
    if not is_irreducible or polynomial.leading_coefficient() != 1:
        mistake("catalog.dynamical_degree", f"found {show(given)}, {expected}")


def _read_relation(
    path: str, table: Mapping[str, Any], variables: Sequence[str] | None, mistake: Callable[[str, str], None]
) -> None:
    for key in table:
        if key not in _RELATION_KEYS:
            mistake(f"{path}.{key}", f"unknown key, expected one of {', '.join(sorted(_RELATION_KEYS))}")
    for key in _RELATION_KEYS:
        if key not in table:
            mistake(f"{path}.{key}", "missing")
    given, dimension = table.get("monomials"), table.get("dimension", 0)
    count: int | None = None
    if given is not None:
        is_list = isinstance(given, list) and given and all(isinstance(text, str) for text in given)
        if not isinstance(given, str) and not is_list:
            mistake(f"{path}.monomials", f'found {show(given)}, expected "degree <= d" or a list of polynomials')
        elif variables is not None:
            try:
                count = len(relation_functions(given, variables))
            except InputError as error:
                mistake(f"{path}.monomials", str(error))
    if not _is_count(dimension) or (count is not None and dimension >= count):
        bound = "an integer, 0 or more" if count is None else f"an integer from 0 to {count - 1}"
        mistake(f"{path}.dimension", f"found {show(dimension)}, expected {bound}")
