"""What the tests of the searches for integrals and densities share: short systems, exact orbits, residues of functions.

Formulas are read here by Python with fractions, not by the library that wrote them.
"""

import ast
import operator
import random
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import islice
from typing import Any

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import rank
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.checks.settings import random_starts
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.errors import SingularStep
from kahanmaps.laboratory.analysis import Analysis, analyze
from kahanmaps.laboratory.modular_points import ModularMap
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

PRIME = 2**61 - 1
OPERATIONS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}


@cache
def analysis_of(name: str) -> Analysis:
    """The analysis of a system of the catalogue, once for all tests: nobody is to change it."""
    return analyze(load(name))


@cache
def integrals_of(name: str, *symbols: str) -> IntegralSearch:
    """The integrals of the Kahan map of a system of the catalogue, once for all tests."""
    return find_integrals(load(name), symbols=symbols)


def system(names: str, *rhs: str, **parameters: Any) -> SystemFile:
    """A system file: the names of the variables with spaces between them, the right-hand sides, the parameters."""
    lines = [f"variables = {list(names.split())}", "[system]", f"rhs = {list(rhs)}", "[parameters]"]
    lines += [f"{name} = '{value}'" for name, value in parameters.items()]
    return parse_system("\n".join(lines))


def random_system(dim: int, seed: int) -> SystemFile:
    """All coefficients random: nothing is conserved."""
    rng = random.Random(seed)
    names = [f"x{k}" for k in range(dim)]
    terms = ["1", *names, *(f"{a}*{b}" for i, a in enumerate(names) for b in names[i:])]
    rhs = ["+".join(f"({rng.randint(-9, 9)})*{term}" for term in terms) for _ in names]
    return SystemFile.from_system(QuadraticSystem.from_text(names, rhs))


def value_of(formula: str, names: Sequence[str], point: Sequence[Any], eps: Any, **more: Any) -> Fraction:
    """The value of a formula at a rational point."""
    numbers = {name: Fraction(str(value)) for name, value in zip(names, point, strict=True)}
    numbers |= {name: Fraction(str(value)) for name, value in (more | {"eps": eps}).items()}
    return _number(ast.parse(formula.replace("^", "**"), mode="eval").body, numbers)


def _number(node: ast.AST, numbers: Mapping[str, Fraction]) -> Fraction:
    match node:
        case ast.Constant(int(value)):
            return Fraction(value)
        case ast.Name(name):
            return numbers[name]
        case ast.UnaryOp(sign, operand):
            value = _number(operand, numbers)
            return -value if isinstance(sign, ast.USub) else value
        case ast.BinOp(left, ast.Pow(), ast.Constant(int(power))):
            return _number(left, numbers) ** power
        case ast.BinOp(left, operation, right):
            return OPERATIONS[type(operation)](_number(left, numbers), _number(right, numbers))
    raise AssertionError(f"found {ast.dump(node)} in a formula")


def values_on_orbits(
    file: SystemFile, formula: str, eps: Sequence[Any], *, starts: int = 3, steps: int = 4, **more: Any
) -> list[set[Fraction]]:
    """The values of a formula along exact orbits over Q, one set for each eps and start; `more` are for its symbols.

    An orbit ends at a pole of the map; where it starts at a pole of the formula, another takes its place.
    """
    results: list[set[Fraction]] = []
    for step in eps:
        kahan = KahanMap(file.system, step)
        expected = len(results) + starts
        for x in islice(random_starts(file.system.dim, 5), 10 * starts):
            values = set()
            try:
                for _ in range(steps + 1):
                    values.add(value_of(formula, file.variables, x, step, **more))
                    x = kahan.step(x)
            except (SingularStep, ZeroDivisionError):
                pass
            if values and len(results) < expected:
                results.append(values)
    return results


def gradient(function: RationalFunction, map_: ModularMap, point: Sequence[int]) -> list[int]:
    """Q grad P - P grad Q modulo the prime of the map; the function is one of the variables, then symbols and eps."""
    field = GF(map_.prime)
    values = map_.values if len(function.names) > map_.dim + 1 else ()
    at = [field.convert(c) for c in (*point, *values, map_.eps)]
    P, Q = function.numerator, function.denominator
    p, q = evaluate(P, field, at), evaluate(Q, field, at)
    return [
        int(evaluate(P.derivative(k), field, at) * q - evaluate(Q.derivative(k), field, at) * p)
        for k in range(map_.dim)
    ]


def ranks(result: Sequence[RationalFunction], known: Sequence[RationalFunction], map_: ModularMap) -> tuple[int, ...]:
    """The numbers of independent functions among those found, those known, and all of them."""
    point = map_.random_point()
    rows = [[gradient(entry, map_, point) for entry in functions] for functions in (result, known)]
    return rank(rows[0], map_.prime), rank(rows[1], map_.prime), rank([*rows[0], *rows[1]], map_.prime)


def at_residues(function: RationalFunction, map_: ModularMap, point: Sequence[int]) -> int:
    """The value of a function of the variables and eps modulo the prime of the map."""
    field = GF(map_.prime)
    return int(function.value(field, [field.convert(c) for c in (*point, map_.eps)]))
