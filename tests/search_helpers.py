"""What the tests of the searches for integrals and densities share: short systems, exact orbits, residues of functions,
degrees computed slowly, answers known from elsewhere.

Formulas are read here by Python with fractions, not by the library that wrote them.
"""

import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

from flint import fmpq, fmpz_poly, nmod_poly
from helpers import table

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.modular_matrices import rank
from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, evaluate
from kahanmaps.checks.settings import random_starts
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.inline import System
from kahanmaps.errors import SingularStep
from kahanmaps.laboratory.analysis import Analysis, analyze
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap
from kahanmaps.laboratory.preserve.integrals import IntegralSearch, find_integrals
from kahanmaps.maps.explicit import explicit_map
from kahanmaps.maps.implicit import ImplicitMap
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.systems.quadratic import QuadraticSystem

PRIME = 2**61 - 1
FURTHER = table(Path(__file__).parent / "laboratory" / "further_systems.txt")
DEGENERATE = table(Path(__file__).parent / "laboratory" / "degenerate_systems.txt")


@cache
def file_of(name: str) -> SystemFile:
    """A system of further_systems.txt, of degenerate_systems.txt, or else of the catalogue."""
    equations = (FURTHER | DEGENERATE).get(name, [""])[0]
    hamiltonian = re.fullmatch(r"H\((.*)\) = (.*)", equations)
    if hamiltonian is not None:
        return System(hamiltonian=hamiltonian[2], variables=hamiltonian[1])
    return System(equations) if equations else load(name)


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
    return _file(names, ["[system]", f"rhs = {[*rhs]}"], parameters)


def map_file(names: str, *image: str, inverse: Sequence[str] = (), **parameters: Any) -> SystemFile:
    """The file of the map with this image."""
    lines = ["[map]", f"image = {[*image]}", f"inverse = {[*inverse]}"]
    return _file(names, lines if inverse else lines[:2], parameters)


def _file(names: str, lines: Sequence[str], parameters: Mapping[str, Any]) -> SystemFile:
    values = [f"{name} = '{value}'" for name, value in parameters.items()]
    return parse_system("\n".join([f"variables = {names.split()}", *lines, "[parameters]", *values]))


# x_{n+3} x_n = 3 + x_{n+1} + x_{n+2}
TODD = map_file("x y z", "y", "z", "(3 + y + z)/x", inverse=["(3 + x + y)/z", "x", "y"])


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
    text = re.sub(r"(?<!\w)\d+", r"Fraction(\g<0>)", formula.replace("^", "**"))
    return Fraction(eval(text, {"Fraction": Fraction}, numbers))


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


def is_density(file: SystemFile, formula: str, eps: Any, starts: int = 2, **more: Any) -> bool:
    """phi(x~) = det dPhi(x) phi(x) at rational points, the derivative of the map computed from its definition."""
    map_, tried = file.map.at(eps), 0
    for x in islice(random_starts(file.dim, 3), 4 * starts):
        try:
            image = map_.step(x)
            slope = Fraction(str(map_.jacobian(x).det()))
            after, before = (value_of(formula, file.variables, point, eps, **more) for point in (image, x))
        except (SingularStep, ZeroDivisionError):
            continue
        tried += 1
        if after != slope * before:
            return False
    return tried >= starts


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


def polynomial_degrees(system: QuadraticSystem, count: int, seed: int, eps: Any = None) -> list[int]:
    """The degrees by Cramer's rule on homogeneous coordinates, common factors divided out: no power series."""
    rng = random.Random(seed)
    field = GF(2**61 - 1)
    p, n = field.prime, system.dim
    eps = field.random(rng) if eps is None else field.convert(fmpq(*map(int, eps.split("/"))))
    local = system.over(field)
    zero, item = nmod_poly([0], p), field.one
    X = [nmod_poly([1], p), *(nmod_poly([rng.randrange(p), rng.randrange(p)], p) for _ in range(n))]
    results = []
    for _ in range(count):
        matrix = [
            [
                X[0] * ((i == j) * item - eps * local.B[i, j])
                - sum((X[k + 1] * (eps * local.tensor[i * n + j, k]) for k in range(n)), zero)
                for j in range(n)
            ]
            for i in range(n)
        ]
        right = [
            sum(
                (X[j + 1] * ((i == j) * item + eps * local.B[i, j]) for j in range(n)), X[0] * (2 * eps * local.c[i, 0])
            )
            for i in range(n)
        ]
        image = [determinant(matrix)]
        for j in range(n):
            image.append(determinant([[*row[:j], b, *row[j + 1 :]] for row, b in zip(matrix, right, strict=True)]))
        common = image[0]
        for entry in image[1:]:
            common = common.gcd(entry)
        X = [entry // common for entry in image]
        results.append(max(entry.degree() for entry in X))
    return results


def by_formulas(variables: str, image: str) -> ImplicitMap:
    """The map that formulas in some variables and eps give, "x,y" and "y; (1 + y)/x"."""
    names = variables.split(",")
    return explicit_map(names, [parse_rational_function(text, [*names, "eps"]) for text in image.split(";")])


def determinant(rows: list[list[nmod_poly]]) -> nmod_poly:
    """By expansion along the first row."""
    if len(rows) == 1:
        return rows[0][0]
    minors = (determinant([[*row[:j], *row[j + 1 :]] for row in rows[1:]]) for j in range(len(rows)))
    signed = (entry * minor * (-1) ** j for j, (entry, minor) in enumerate(zip(rows[0], minors, strict=True)))
    return sum(signed, nmod_poly([0], rows[0][0].modulus()))


Value = Callable[[ModularMap, Sequence[int]], int]


@dataclass(frozen=True)
class Answer:
    """What is known of a Kahan map for generic eps; None and () where nothing is.

    `dynamical_degree` is the minimal polynomial in x, `formulas` are integrals, `density` the value of phi modulo the
    prime of a map, `without_density` tells that there is no polynomial one of low degree.
    """

    integrals: int | None = None
    growth: str | None = None
    degrees: tuple[int, ...] = ()
    dynamical_degree: str | None = None
    formulas: tuple[RationalFunction, ...] = ()
    density: Value | None = None
    without_density: bool = False
    verdict: str | None = None


def residues_of(function: RationalFunction) -> Value:
    """The values of a function of the variables and eps modulo the prime of a map."""
    return lambda map_, point: at_residues(function, map_, point)


def verdict_of(growth: str) -> str:
    """What a kind of growth means for integrability."""
    return {"bounded": "linearisable", "exponential": "not integrable"}.get(growth, "integrable")


def minimal_polynomial(text: str) -> fmpz_poly:
    """The polynomial in x with integer coefficients."""
    terms = {int(monomial[0]): int(c.p) for monomial, c in parse_polynomial(text, ["x"]).terms()}
    return fmpz_poly([terms.get(k, 0) for k in range(max(terms) + 1)])


def same_measures(analysis: Analysis, known: Value) -> bool:
    """Whether every density found is the known one times an integral, modulo two primes at several points."""
    for map_ in Laboratory(analysis.file).maps:
        for density in analysis.densities.densities:
            for x, image in map_.pairs(3):
                a, b = known(map_, x), known(map_, image)
                c, d = (at_residues(density.function, map_, point) for point in (x, image))
                if a == 0 or c == 0 or (a * d - b * c) % map_.prime:
                    return False
    return True


def differences(analysis: Analysis, answer: Answer, least_degrees: int = 5) -> set[str]:
    """In what an analysis contradicts the answer or falls short of it; so many degrees at least have to be compared."""
    wrong = set()
    degrees = analysis.degrees.degrees[1:]
    common = min(len(degrees), len(answer.degrees))
    if answer.degrees and (
        common < min(least_degrees, len(answer.degrees)) or degrees[:common] != answer.degrees[:common]
    ):
        wrong.add("degrees")
    conclusion = analysis.conclusion
    if answer.growth is not None and conclusion.growth != answer.growth:
        wrong.add("growth")
    if answer.verdict is not None and conclusion.kind not in (
        (answer.verdict, "linear") if answer.verdict == "linearisable" else (answer.verdict,)
    ):
        wrong.add("verdict")
    rate = analysis.degrees.dynamical_degree  # None without a recurrence, and then there is nothing to compare
    if (
        answer.dynamical_degree is not None
        and rate is not None
        and rate.minimal_polynomial != minimal_polynomial(answer.dynamical_degree)
    ):
        wrong.add("dynamical degree")
    if answer.integrals is not None and conclusion.integrals != answer.integrals:
        wrong.add("count")
    functions = [integral.function for integral in analysis.integrals.integrals]
    number, _, together = ranks(functions, answer.formulas, Laboratory(analysis.file).maps[0])
    if number != len(functions) or (answer.integrals is not None and together > answer.integrals):
        wrong.add("formulas")
    if not all(entry.verdict.holds for entry in (*analysis.integrals.integrals, *analysis.densities.densities)):
        wrong.add("proofs")
    if answer.density is not None and not (analysis.densities.densities and same_measures(analysis, answer.density)):
        wrong.add("density")
    if answer.without_density and analysis.densities.densities:
        wrong.add("density")
    return wrong
