"""The limits of searches and checks: what keeps to one is done in full; what is one larger is left out and told."""

from collections.abc import Callable
from importlib import import_module
from math import comb, log2
from pathlib import Path

import numpy as np
import pytest
from helpers import EULER_TOP, LORENZ, LOTKA_VOLTERRA

from kahanmaps.algebra.fields import RR, _prime_field
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.small_systems import solve_system
from kahanmaps.algebra.written.text import parse_polynomial, parse_rational_function
from kahanmaps.checks import expand
from kahanmaps.checks.commute import check_commute, commutativity
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.expand import expansion
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.structured_facts import relation_functions
from kahanmaps.errors import KahanmapsError
from kahanmaps.family.draw import draw_with_eigenvalues
from kahanmaps.invariants.phase_functions import where
from kahanmaps.laboratory import analysis, defaults
from kahanmaps.laboratory.cycles import cycle_census
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve import densities, hirota_kimura, search
from kahanmaps.laboratory.preserve.darboux import darboux_spaces
from kahanmaps.laboratory.preserve.darboux.affine_functions import affine_darboux
from kahanmaps.laboratory.preserve.darboux.cofactors import determinant_polynomial
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.hirota_kimura import orbit_profile
from kahanmaps.laboratory.preserve.identities import verdict_on
from kahanmaps.laboratory.preserve.inherited import inherited_integrals
from kahanmaps.laboratory.preserve.poisson import hamiltonian_structure
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.singular import singularities
from kahanmaps.laboratory.symmetry import symmetries
from kahanmaps.laboratory.symmetry.commuting import commuting_systems
from kahanmaps.laboratory.symmetry.commuting_space import commuting_space
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries
from kahanmaps.maps.floats import ensemble, steps
from kahanmaps.maps.floats.lyapunov import lyapunov_exponents
from kahanmaps.maps.kahan import Kahan
from kahanmaps.maps.orbits import iteration
from kahanmaps.maps.orbits.orbit import orbit
from kahanmaps.maps.polarised import polarised_map
from kahanmaps.paper.verifier import VerifyOptions
from kahanmaps.paper.verify import verify, verify_universal
from kahanmaps.systems.quadratic import QuadraticSystem

MEMBER = SystemFile.from_member(draw_with_eigenvalues([1, 2], 1), "pair")
PLANE = 'variables = ["x", "y"]\n[system]\nrhs = ["x*y", "y"]\n'
WITHOUT_DENSITY = parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x^2 + y", "y^2 + 1"]\n')
STEP = '{map = {variables = ["x"], system = {rhs = ["x^2"]}}, power = 3}'
ROTATION = QuadraticSystem.from_text(["x", "y"], ["y", "-x"])
SQUARES = QuadraticSystem.from_text(["x", "y"], ["x^2", "2*y^2"])  # commutes with a x^2, b y^2


def refused(call: Callable[[], object]) -> str:
    """What is said instead of an answer; empty where there is one."""
    try:
        call()
    except KahanmapsError as error:
        return str(error)
    return ""


def undecided(found) -> str:
    return "; ".join(found.undecided)


def solved(*equations: str):
    x, y = ring(["x", "y"]).gens()
    return solve_system([parse_polynomial(text, ["x", "y"]) for text in equations], (x, y), float("inf"))


def notes(report) -> str:
    return "; ".join(report.notes)


LIMITS: list[tuple[str, int, Callable[[], str], str]] = [
    # what is limited, the least limit that leaves nothing out, a search, and what it says under a smaller one alone
    ("algebra.small_systems.MAX_PARTS", 2, lambda: solved("x^3 - x", "y").reason, "there are more than"),
    (
        "algebra.small_systems.MAX_QUOTIENT",
        4,
        lambda: solved("x^2 + y^2 - 5", "x*y - 2").reason,
        "there are 4 solutions",
    ),
    (
        "algebra.fields.MAX_PRIME_BITS",
        61,
        lambda: refused(lambda: _prime_field.__wrapped__(2**61 - 1)),
        "found a modulus of 61 bits",
    ),
    ("algebra.fields.MAX_BALL_BITS", 64, lambda: refused(lambda: RR.__wrapped__(64)), "found the precision 64"),
    (
        "systems.quadratic.MAX_DIMENSION",
        1,
        lambda: refused(lambda: QuadraticSystem.from_text(["x"], ["x"])),
        "found a system of dimension 1",
    ),
    (
        "maps.polarised.MAX_DEGREE",
        3,
        lambda: refused(lambda: polarised_map([parse_polynomial("x^3", ["x", "eps"])])),
        "found the degree 3",
    ),
    ("laboratory.cycles.MAX_PRIME", 8, lambda: refused(lambda: cycle_census(EULER_TOP, 1, 7)), "found the prime 7"),
    ("laboratory.cycles.MAX_DIMENSION", 3, lambda: refused(lambda: cycle_census(EULER_TOP, 1, 7)), "of dimension 3"),
    (
        "maps.floats.lyapunov.MAX_NUMBERS",
        18,
        lambda: refused(lambda: lyapunov_exponents(LORENZ, np.ones((2, 3)), "1/100", 3)),
        "found 2 starts",
    ),
    (
        "maps.orbits.orbit._TOO_FAR",
        40,
        lambda: refused(lambda: orbit(LORENZ, [1, 2, 3], "1/9", steps=40)),
        "step 40 is too far",
    ),
    (
        "maps.orbits.orbit._LARGE_DIMENSION",
        4,
        lambda: orbit(MEMBER.system, [1, 2, 3, 4], "1/9", steps=1000).why,
        "not looked for in dimension 4",
    ),
    (
        "maps.orbits.orbit._LONG_INPUT",
        4,  # bits of 9
        lambda: orbit(MEMBER.system, [1, 2, 3, -4], "1/9", steps=24).why,
        "not looked for, for so few steps",
    ),
    (
        "invariants.phase_functions._LONGEST_CONDITION",
        len("where a is not 0"),
        lambda: where(1, ring(["x", "a", "eps"]).gens()[1]),
        "where it has a value",
    ),
    (
        "documents.document._LONGEST_NAME",
        4,
        lambda: refused(lambda: parse_system(f'name = "pair"\n{PLANE}')),
        "expected printable text",
    ),
    (
        "documents.document.MAX_DIMENSION",
        2,
        lambda: refused(lambda: parse_system(PLANE)),
        "found 2 variables",
    ),
    (
        "documents.reader.MAX_DIMENSION",
        2,
        lambda: refused(lambda: parse_system('[family]\nA = [[1, 0], [0, 1]]\nH = "x1^3"\n')),
        "found 2 rows",
    ),
    (
        "documents.composition._MOST_FACTORS",
        3,
        lambda: refused(lambda: parse_system(f"[composition]\nof = [{STEP}]\n")),
        "found more than",
    ),
    (
        "documents.structured_facts.MAX_MONOMIALS",
        10,
        lambda: refused(lambda: relation_functions("degree <= 3", ["x", "y"])),
        "which is 10 monomials",
    ),
    (
        "documents.structured_facts.MAX_MONOMIALS",
        2,
        lambda: refused(lambda: relation_functions(["x", "1"], ["x", "y"])),
        "found 2 functions",
    ),
    ("checks.settings.MAX_STEPS", 5, lambda: refused(lambda: Settings(steps=5)), "found 5 steps"),
    (
        "checks.theorems.MAX_FACTORS",
        2,
        lambda: notes(check_commute(MEMBER)),
        "chi has 2 factors",
    ),
    (
        "checks.theorems.MAX_FACTORS",
        2,
        lambda: str(len(check_integrals(MEMBER).findings)),
        "5",
    ),
    (
        "checks.expand.MAX_DIMENSION",
        2,
        lambda: str(expansion(commutativity(ROTATION, ROTATION, None, ("f", "g")))),
        "None",
    ),
    (
        "paper.verify.MAX_M",
        2,
        lambda: refused(lambda: verify(MEMBER, options=VerifyOptions(sections=(6,)))),
        "found a member with m = 2",
    ),
    (
        "paper.verify.MAX_M",
        1,
        lambda: refused(lambda: verify_universal(1, options=VerifyOptions(sections=(6,)))),
        "found m = 1",
    ),
    (
        "laboratory.preserve.identities.MAX_DIMENSION",
        2,
        lambda: str(
            verdict_on(ROTATION, parse_rational_function("x^2 + y^2", ["x", "y", "eps"]), None, is_density=False)[0]
        ),
        "supported",
    ),
    (
        "laboratory.preserve.poisson.poisson_tensors._MAX_UNKNOWNS",
        3 * 20,  # entries, times the monomials of degree 3 in three variables
        lambda: find_poisson(load("lorenz"), 3, integrals=()).reason,
        "degrees above 2 were not tried",
    ),
    (
        "laboratory.preserve.poisson.poisson_tensors._MAX_UNKNOWNS",
        3,
        lambda: find_poisson(load("lorenz"), 0, integrals=()).reason,
        "a tensor in dimension 3 has too many entries",
    ),
    (
        "laboratory.preserve.darboux.darboux_polynomials._MOST_TERMS",
        20,
        lambda: darboux_polynomials(load("euler_top"), 3).reason,
        "degrees above 2 were not tried: polynomials in dimension 3 have too many terms",
    ),
    (
        "laboratory.preserve.darboux.darboux_polynomials._MOST_PRODUCTS",
        10,
        lambda: darboux_polynomials(load("lotka_volterra"), 2).reason,
        "10 products of cofactors",
    ),
    (
        "laboratory.preserve.darboux.affine_functions.MAX_EXTACTIC_DIMENSION",
        2,
        lambda: affine_darboux(LOTKA_VOLTERRA).reason,
        "variables: only factors of the right-hand sides were tried",
    ),
    (
        "laboratory.preserve.darboux.affine_functions.LONG_COEFFICIENTS",
        LOTKA_VOLTERRA.digits,
        lambda: affine_darboux(LOTKA_VOLTERRA).reason,
        "coefficients of more than",
    ),
    (
        "laboratory.preserve.darboux.cofactors._MAX_DIMENSION",
        3,
        lambda: str(determinant_polynomial(Kahan(EULER_TOP))),
        "None",
    ),
    (
        "laboratory.preserve.darboux.cofactors.LONG_COEFFICIENTS",
        EULER_TOP.digits,
        lambda: str(determinant_polynomial(Kahan(EULER_TOP))),
        "None",
    ),
    (
        "laboratory.preserve.densities._MAX_UNKNOWNS",
        comb(2 + 3, 3),
        lambda: find_densities(WITHOUT_DENSITY, max_degree=3).reason,
        "no polynomial of degree at most 2,",
    ),
    (
        "laboratory.preserve.hirota_kimura.MAX_UNKNOWNS",
        10,
        lambda: str(len(orbit_profile(Laboratory(load("euler_top")).maps).nullities)),
        "1",
    ),
    (
        "laboratory.preserve.hirota_kimura.MAX_INDEPENDENT",
        10,
        lambda: str(len(orbit_profile(Laboratory(load("euler_top")).maps).nullities)),
        "1",
    ),
    (
        "laboratory.preserve.inherited.MAX_DIMENSION",
        4,
        lambda: f"[{inherited_integrals(load('henon_heiles').system).text}]",
        "[]",
    ),
    (
        "laboratory.symmetry.symmetries.MAX_LINEAR",
        3,
        lambda: undecided(linear_symmetries(EULER_TOP)),
        "infinitesimal symmetries are computed up to dimension",
    ),
    (
        "laboratory.symmetry.symmetries.MAX_SIGNED",
        3,
        lambda: undecided(linear_symmetries(EULER_TOP)),
        "signed permutations are tried up to dimension",
    ),
    (
        "laboratory.symmetry.symmetries.LONG_COEFFICIENTS",
        EULER_TOP.digits,
        lambda: undecided(linear_symmetries(EULER_TOP)),
        "other matrices are searched for coefficients of up to",
    ),
    (
        "laboratory.symmetry.signed_permutations.MAX_FOUND",
        2,
        lambda: undecided(linear_symmetries(QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2"]))),
        "not all were tried",
    ),
    (
        "laboratory.symmetry.commuting.MAX_UNKNOWNS",
        4,
        lambda: undecided(commuting_systems(LOTKA_VOLTERRA, "linear")),
        "g has 4 unknown coefficients",
    ),
    (
        "laboratory.symmetry.commuting.LONG_COEFFICIENTS",
        LOTKA_VOLTERRA.digits,
        lambda: undecided(commuting_systems(LOTKA_VOLTERRA, "linear")),
        "other g are searched for coefficients of up to",
    ),
    (
        "laboratory.symmetry.commuting.MAX_SPACE",
        2,
        lambda: undecided(commuting_systems(SQUARES, "linear")),
        "have dimension 2, and equations are solved up to",
    ),
    (
        "laboratory.symmetry.commuting_space.MAX_DIMENSION",
        2,
        lambda: str(len(commuting_space(SQUARES, "linear").fields)),
        "1",
    ),
]


@pytest.mark.parametrize(("name", "least", "search", "told"), LIMITS, ids=[row[0] for row in LIMITS])
def test_a_limit_is_the_largest_size_that_is_tried(name, least, search, told, monkeypatch):
    module, _, limit = f"kahanmaps.{name}".rpartition(".")
    monkeypatch.setattr(import_module(module), limit, least)
    assert told not in search()
    monkeypatch.setattr(import_module(module), limit, least - 1)
    assert told in search()


DOCS = Path(__file__).parents[1] / "docs"
LABORATORY = (DOCS / "laboratory.md").read_text(encoding="utf-8")
EVERY = range(1, 9)  # dimensions; 8 stands for all above


def test_the_degrees_that_are_tried_in_each_dimension_are_those_of_the_documentation():
    table = {row[1][:12]: row[2:-1] for row in (line.split("|") for line in LABORATORY.splitlines()) if len(row) == 11}
    found = {name.strip(): [int(cell.split()[0]) for cell in row] for name, row in list(table.items())[2:]}
    fits = [[d for d in range(densities._MAX_DEGREE + 1) if comb(n + d, d) <= densities._MAX_UNKNOWNS] for n in EVERY]
    assert found == {
        "relations a": [hirota_kimura._MAX_DEGREE.get(n, 4) for n in EVERY],
        "polynomials": [search._COFACTOR_DEGREE.get(n, 2) for n in EVERY],
        "φ, degree (": [max(degrees) for degrees in fits],
    }


@pytest.mark.parametrize(
    "promise",
    [
        f"at most {hirota_kimura.MAX_UNKNOWNS} monomials",
        f"leave more than {hirota_kimura.MAX_INDEPENDENT} monomials",
        f"(at most {densities._MAX_DEGREE}, and {densities._MAX_UNKNOWNS} monomials)",
        f"Where they span more than {darboux_spaces.LARGEST_SPAN} dimensions",
        f"multiplied out up to dimension {expand.MAX_DIMENSION} within",
        f"Degrees end at {defaults.ITERATE_DEGREE} (`--max-degree`) or after {defaults.SECONDS['degrees']:.0f} seconds",
        f"Above dimension {singularities.WRITTEN_DIMENSION} `degrees` takes random points",
        f"`singularities` goes up to dimension {singularities.MAX_DIMENSION}",
        f"signed permutations up to dimension {symmetries.MAX_SIGNED}",
        f"constant Hamiltonian structures are sought up to dimension {hamiltonian_structure.MAX_DIMENSION}",
        f"in dimension at most {symmetries.MAX_GENERAL} all rational matrices",
        f"by default {analysis._SECONDS[2]:.0f} in dimension 2, {analysis._MOST_SECONDS:.0f} from dimension 6",
        "followed for {1} steps in the plane ({2}, {3}, {0} in".format(
            singularities._LEAST_REACH, *(singularities._REACH[n] for n in (2, 3, 4))
        ),
        "{1}, {2}, {3}, {0} where orders repeat".format(
            singularities._LEAST_ALONG, *(singularities._ALONG[n] for n in (2, 3, 4))
        ),
    ],
)
def test_a_limit_that_the_documentation_names_is_the_one_in_force(promise):
    assert promise in LABORATORY


@pytest.mark.parametrize(
    ("page", "promise"),
    [
        ("orbits.md", f"that has lost {-log2(steps.NEAR):.0f} of its 53 bits counts as near-singular"),
        ("orbits.md", f"a start of more than {iteration.LONGEST_INPUT:,} digits is refused"),
        ("cli.md", f"block integrals of the normal form, looked at every {ensemble.SAMPLED} steps"),
    ],
)
def test_so_are_those_of_orbits(page, promise):
    assert promise in (DOCS / page).read_text(encoding="utf-8")
