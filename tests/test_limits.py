"""Limits that users meet: what exceeds one is refused or reported, and the documentation names those in force."""

from collections.abc import Callable
from importlib import import_module
from math import comb, log2
from pathlib import Path

import pytest
from helpers import EULER_TOP, LORENZ, LOTKA_VOLTERRA

import kahanmaps as km
from kahanmaps.checks import judge
from kahanmaps.laboratory import analysis, defaults
from kahanmaps.laboratory.preserve import densities, hirota_kimura, search
from kahanmaps.laboratory.preserve.darboux import darboux_spaces
from kahanmaps.laboratory.preserve.poisson import hamiltonian_structure
from kahanmaps.laboratory.singular import singularities
from kahanmaps.laboratory.symmetry import symmetries
from kahanmaps.maps.floats import ensemble, steps
from kahanmaps.maps.orbits import iteration

MEMBER = km.SystemFile.from_member(km.draw_with_eigenvalues([1, 2], 1), "pair")
PLANE = 'variables = ["x", "y"]\n[system]\nrhs = ["x*y", "y"]\n'
CUBE = '{map = {variables = ["x"], system = {rhs = ["x^2"]}}, power = 3}'
WITHOUT_DENSITY = km.parse_system('variables = ["x", "y"]\n[system]\nrhs = ["x^2 + y", "y^2 + 1"]\n')


def refused(call: Callable[[], object]) -> str:
    """The message of a refusal; empty where there is none."""
    try:
        call()
    except km.KahanmapsError as error:
        return str(error)
    return ""


LIMITS: list[tuple[str, int, Callable[[], str], str]] = [
    # the limit, the least value that leaves nothing out, a call, and what it says under a smaller one alone
    ("systems.quadratic.MAX_DIMENSION", 2, lambda: refused(lambda: km.System(PLANE_TEXT)), "of dimension 2"),
    ("documents.document.MAX_DIMENSION", 2, lambda: refused(lambda: km.parse_system(PLANE)), "found 2 variables"),
    (
        "documents.document._MOST_FACTORS",
        3,
        lambda: refused(lambda: km.parse_system(f"[composition]\nof = [{CUBE}]\n")),
        "found more than",
    ),
    ("maps.orbits.orbit._TOO_FAR", 40, lambda: refused(lambda: km.orbit(LORENZ, [1, 2, 3], "1/9", 40)), "is too far"),
    ("laboratory.cycles.MAX_PRIME", 8, lambda: refused(lambda: km.cycles(EULER_TOP, 1, 7)), "found the prime 7"),
    ("checks.settings.MAX_STEPS", 5, lambda: refused(lambda: km.Settings(steps=5)), "found 5 steps"),
    ("paper.verify.MAX_M", 2, lambda: refused(lambda: km.verify(MEMBER, options=SIX)), "found a member with m = 2"),
    (
        "laboratory.preserve.poisson.poisson_tensors._MAX_UNKNOWNS",
        3 * 20,  # entries, times the monomials of degree 3 in three variables
        lambda: km.find_poisson("lorenz", 3, integrals=()).reason,
        "degrees above 2 were not tried",
    ),
    (
        "laboratory.preserve.densities._MAX_UNKNOWNS",
        comb(2 + 3, 3),
        lambda: km.find_density(WITHOUT_DENSITY, max_degree=3).reason,
        "no polynomial of degree at most 2,",
    ),
    (
        "laboratory.symmetry.symmetries.MAX_SIGNED",
        3,
        lambda: "; ".join(km.find_symmetry(EULER_TOP).undecided),
        "signed permutations are tried up to dimension",
    ),
    (
        "laboratory.symmetry.commuting.MAX_UNKNOWNS",
        4,
        lambda: "; ".join(km.commuting_systems(LOTKA_VOLTERRA, "linear").undecided),
        "g has 4 unknown coefficients",
    ),
]
PLANE_TEXT = "x' = x*y; y' = y"
SIX = km.VerifyOptions(sections=(6,))


@pytest.mark.parametrize(("name", "least", "call", "message"), LIMITS, ids=[row[0] for row in LIMITS])
def test_a_limit_is_the_largest_size_that_is_accepted(name, least, call, message, monkeypatch):
    module, _, limit = f"kahanmaps.{name}".rpartition(".")
    monkeypatch.setattr(import_module(module), limit, least)
    assert message not in call()
    monkeypatch.setattr(import_module(module), limit, least - 1)
    assert message in call()


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
        f"multiplied out up to dimension {judge.MAX_DIMENSION} within",
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
