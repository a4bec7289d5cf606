"""The structured facts of a [catalog] section: degrees, growth, verdict, and relations along orbits.

    degrees = [3, 9, 19, 33, 51]          of the iterates Phi, Phi^2, ... on a generic line
    growth = "quadratic"                  bounded, linear, quadratic or exponential
    dynamical_degree = "x^2 - 2*x - 1"    minimal polynomial of lim d_n^(1/n), the largest real root
    verdict = "integrable"                integrable, linearisable or not integrable
    codimension = 2                       of the smallest variety known to contain a generic orbit

    [[catalog.relations]]                 number of independent combinations that vanish along a generic orbit
    monomials = ["x1^2", "x2^2", "x3^2", "1"]
    dimension = 2

These facts hold for generic parameters and generic eps, hence relations do not contain parameters. The evidence for
them is stated in the `facts` of the section.
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
from kahanmaps.errors import InputError, show
from kahanmaps.sources import SOURCES

GROWTHS = ("bounded", "linear", "quadratic", "exponential")
VERDICTS = ("integrable", "linearisable", "not integrable")
FACT_KEYS = ("degrees", "growth", "dynamical_degree", "verdict", "codimension", "relations")
MAX_MONOMIALS = 100_000  # maximal number of monomials of one relation
_DEGREE_BOUND = re.compile(r"degree <= ([0-9]{1,3})")
_RELATION_KEYS = ("monomials", "dimension")


class ClaimedRelations(NamedTuple):
    """A Hirota-Kimura basis: `functions` are its polynomials over Q in the variables, as the file states in `text`.

    `dimension` is the dimension of the space of those linear combinations that vanish along a generic orbit.
    """

    text: str
    functions: tuple[fmpq_mpoly, ...]
    dimension: int


def relations(section: Mapping[str, Any], variables: Sequence[str]) -> tuple[ClaimedRelations, ...]:
    """Return the relations of a [catalog] section; their functions are exact polynomials in `variables`.

    `section` is `SystemFile.catalog`. The result is empty if the section states no relation. Raises InputError for a
    function that cannot be parsed. Source: petrera-pfadler-suris-2009.

    >>> [result] = relations({"relations": [{"monomials": "degree <= 1", "dimension": 1}]}, ["x", "y"])
    >>> result.functions, result.dimension
    ((1, x, y), 1)
    """
    return tuple(
        ClaimedRelations(
            texts if isinstance(texts := table["monomials"], str) else ", ".join(texts),
            relation_functions(texts, variables),
            table["dimension"],
        )
        for table in section.get("relations", [])
    )


def relation_functions(texts: str | Sequence[str], variables: Sequence[str]) -> tuple[fmpq_mpoly, ...]:
    """Return exact polynomials in `variables`: all monomials for "degree <= d", or those of a list of texts.

    Raises InputError for other texts, for more than 100000 monomials, and for functions that are 0 or occur twice.
    Source: petrera-pfadler-suris-2009.

    >>> relation_functions(["x^2 + y^2", "1"], ["x", "y"])
    (x^2 + y^2, 1)
    """
    match = _DEGREE_BOUND.fullmatch(texts) if isinstance(texts, str) else None
    if match is None and not (_are_texts(texts) and texts):
        raise InputError(f'found {show(texts)}, expected "degree <= d" or a list of polynomials')
    if match is not None:
        max_degree = int(match[1])
        count = comb(max_degree + len(variables), max_degree)
        if count > MAX_MONOMIALS:
            raise InputError(f"found {show(texts)}, which is {count} monomials, expected at most {MAX_MONOMIALS}")
        context = ring(variables)
        exponents = chain.from_iterable(monomials(len(variables), d) for d in range(max_degree + 1))
        return tuple(context.from_dict({exponent: fmpq(1)}) for exponent in exponents)
    if len(texts) > MAX_MONOMIALS:
        raise InputError(f"found {len(texts)} functions, expected at most {MAX_MONOMIALS}")
    functions = tuple(parse_polynomial(text, variables) for text in texts)
    earlier_texts = set()
    for k, function in enumerate(functions):
        if function.is_zero():
            raise InputError(f"found 0 as function {k + 1}, expected functions that are not zero")
        if str(function) in earlier_texts:
            raise InputError(f"found function {k + 1} twice, expected different ones")
        earlier_texts.add(str(function))
    return functions


def read_structured_facts(
    section: Mapping[str, Any], variables: Sequence[str] | None, mistake: Callable[[str, str], None]
) -> None:
    """Validate the values in a [catalog] section with valid keys; call `mistake(key, sentence)` for each mistake."""
    max_codimension = 10**9 if variables is None else len(variables)
    codimension_text = "an integer, 0 or more"
    if variables is not None:
        codimension_text = f"an integer from 0 to {max_codimension}, the dimension"
    rules: dict[str, tuple[Callable[[Any], bool], str]] = {
        **dict.fromkeys(("title", "convention"), (lambda value: isinstance(value, str), "text")),
        "sources": (lambda value: _are_texts(value) and set(value) <= set(SOURCES), "a list of keys of sources.py"),
        "facts": (_are_texts, "a list of texts"),
        "degrees": (
            lambda value: (
                isinstance(value, list) and bool(value) and all(type(d) is int and 0 < d < 10**100 for d in value)
            ),
            "a list of positive integers of at most 100 digits, d_1 first",
        ),
        "growth": (GROWTHS.__contains__, f"one of {', '.join(GROWTHS)}"),
        "verdict": (VERDICTS.__contains__, f"one of {', '.join(VERDICTS)}"),
        "dynamical_degree": (_is_minimal_polynomial, "an irreducible polynomial in x with leading coefficient 1"),
        "codimension": (lambda value: type(value) is int and 0 <= value <= max_codimension, codimension_text),
        "relations": (_are_tables, "tables [[catalog.relations]]"),
    }
    for key, (is_valid, expected) in rules.items():
        if key in section and not is_valid(section[key]):
            mistake(f"catalog.{key}", f"found {show(section[key])}, expected {expected}")
    tables = section.get("relations", [])
    for k, table in enumerate(tables if _are_tables(tables) else ()):
        path = f"catalog.relations[{k + 1}]"
        for key in (
            *(key for key in table if key not in _RELATION_KEYS),
            *(key for key in _RELATION_KEYS if key not in table),
        ):
            mistake(f"{path}.{key}", f"expected a table of {' and '.join(_RELATION_KEYS)}, no more and no less")
        count = 10**9
        if "monomials" in table and variables is not None:
            try:
                count = len(relation_functions(table["monomials"], variables))
            except InputError as error:
                mistake(f"{path}.monomials", str(error))
        dimension = table.get("dimension", 0)
        if type(dimension) is not int or not 0 <= dimension < count:
            expected = "an integer, 0 or more" if count == 10**9 else f"an integer from 0 to {count - 1}"
            mistake(f"{path}.dimension", f"found {show(dimension)}, expected {expected}")


def _are_texts(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(item, str) for item in value)


def _are_tables(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, dict) for item in value)


def _is_minimal_polynomial(text: Any) -> bool:
    try:
        polynomial = parse_polynomial(text, ["x"])
    except InputError:
        return False
    is_monic = not polynomial.is_constant() and polynomial.leading_coefficient() == 1
    return is_monic and [power for _, power in polynomial.factor()[1]] == [1]
