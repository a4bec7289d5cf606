"""What the tests of whole analyses share: an answer known from elsewhere, and how an analysis differs from it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flint import fmpz_poly
from search_helpers import at_residues, ranks

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.laboratory.analysis import Analysis
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.modular_points import ModularMap

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
