"""Maps that are not Kahan's, of the catalogue and of examples: what their files state is proved or measured again."""

import json
from pathlib import Path

import pytest
from flint import fmpq
from helpers import quick, refuses

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load, map_names
from kahanmaps.documents.files import SystemFile, parse_system, read_system
from kahanmaps.documents.structured_facts import relations
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.laboratory import Laboratory, verdict_on
from kahanmaps.laboratory.preserve.hirota_kimura import hirota_kimura_basis
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.systems.quadratic import QuadraticSystem

every_map = pytest.mark.parametrize("name", map_names())
EXAMPLES = {
    path.stem: read_system(path) for path in sorted((Path(__file__).parents[2] / "examples" / "maps").glob("*.toml"))
}
FILES = {name: load(name) for name in map_names()}
every_file = pytest.mark.parametrize("file", [*FILES.values(), *EXAMPLES.values()], ids=lambda file: file.name)
# The flows whose Kahan maps were repaired: x' and y' for eps -> 0, and the degree of their integral.
UNREPAIRED = {
    "repaired_octahedral": ("2*x*y", "-2*y^2 - 4*x^2 - 6*x - 6", 4),
    "repaired_icosahedral": ("x*(2 + 2*x + 3*y)", "-y*(3 + 4*x + 3*y)", 6),
}


@every_file
def test_a_file_reads_back_equal(file):
    again = parse_system(file.to_toml(), file.name)
    assert again == file
    assert json.loads(json.dumps(file.document)) == again.document


@every_file
def test_what_is_claimed_to_be_preserved_is_proved(file):
    if file.integrals:
        assert {str(finding.verdict) for finding in check_integrals(file).findings} == {"proved"}
    if file.density is not None:
        assert {str(finding.verdict) for finding in check_measure(file).findings} == {"proved"}


@pytest.mark.parametrize("name", EXAMPLES)
def test_another_claim_of_an_example_is_refuted(name):  # so the checks can fail
    file = EXAMPLES[name]
    wrong = parse_rational_function(f"{file.variables[0]}^2 + 1", [*file.variables, "eps"])
    assert str(check_integrals(file, extra={"wrong": wrong}).verdict) == "refuted"
    assert str(check_measure(file, extra=wrong).verdict) == "refuted"


@every_map
def test_the_degrees_are_those_that_are_stated(name):
    known = FILES[name].catalog
    terms = min(len(known["degrees"]), 5)  # the others measures the slow test below
    assert list(degree_growth(FILES[name].map, None, max_terms=terms).degrees[1:]) == known["degrees"][:terms]


@pytest.mark.parametrize("name", [name for name in map_names() if "growth" in FILES[name].catalog])
@pytest.mark.slow
def test_the_growth_is_the_one_that_is_stated(name):
    known = FILES[name].catalog
    growth = degree_growth(FILES[name].map, None, max_degree=20_000)
    assert list(growth.degrees[1:])[: len(known["degrees"])] == known["degrees"][: len(growth.degrees) - 1]
    assert str(growth.growth if not growth.looks_exponential else "exponential") == known["growth"]
    if "dynamical_degree" in known:
        root = known["dynamical_degree"].replace("x", "t")
        said = "dynamical degree 2" if root == "t - 2" else root
        assert said in growth.growth_text.replace("root of ", "")


@pytest.mark.parametrize("name", quick(map_names(), ["lyness", "mcmillan", "fibonacci", "hky"]))
def test_the_dimensions_of_the_relations_are_those_that_are_stated(name):
    file = FILES[name]
    maps = Laboratory(file).maps
    for stated in relations(file.catalog, file.variables):
        functions = list(map(str, stated.functions))
        assert hirota_kimura_basis(maps, stated.functions, functions).dimension == stated.dimension


@pytest.mark.parametrize("name", quick(map_names(), ["lyness", "mcmillan"]))
def test_the_blind_analysis_gives_the_stated_verdict(name):
    known = FILES[name].catalog
    analysis = analyze(FILES[name])
    assert analysis.conclusion.kind == known["verdict"]
    assert analysis.integral_count == known.get("codimension", analysis.integral_count)


@pytest.mark.parametrize("name", quick(UNREPAIRED, ["repaired_octahedral"]))
def test_without_the_terms_in_eps_the_repaired_maps_are_kahan_s_and_not_integrable(name):
    *rhs, degree = UNREPAIRED[name]
    flow = SystemFile.from_system(QuadraticSystem.from_text(["x", "y"], rhs))
    assert degree_growth(flow.map, None, max_terms=6).degrees[1:] == (2, 4, 8, 16, 32, 64)
    assert find_integrals(flow, max_degree=6).codimension == 0
    F = next(iter(FILES[name].integrals.values()))
    assert str(verdict_on(flow.map, F, None, is_density=False)[0]) == "refuted"
    (integral,) = find_integrals(flow, flow=True).integrals
    assert (str(integral.verdict), integral.function.numerator.total_degree()) == ("proved", degree)

    def gap(eps):
        images = (map_.at(eps, QQ).step((fmpq(1, 3), fmpq(2, 5))) for map_ in (FILES[name].map, flow.map))
        return [a - b for a, b in zip(*images, strict=True)]

    # The terms change a step by eps^3 at most.
    gaps = zip(gap(fmpq(1, 10**4)), gap(fmpq(1, 10**5)), strict=True)
    assert all(abs(first / second) > 900 for first, second in gaps)


def test_five_steps_of_lyness_and_eight_of_todd_close_for_a_1():
    for name, period in (("lyness", 5), ("todd", 8)):
        laboratory = Laboratory(load(name, {"a": 1}))
        assert {len(map_.orbit(20)) for map_ in laboratory.maps} == {period}
        assert {len(map_.orbit(20)) for map_ in Laboratory(load(name)).maps} == {20}


def test_maps_of_different_kinds_commute_or_not():
    # The Kahan map of x' = x^2 is x/(1 - 2 eps x); of x' = 3 x^2 at a third of eps it is the same.
    texts = ('[map]\nimage = ["x/(1 - 2*eps*x)"]', '[system]\nrhs = ["x^2 + eps^2*x^2"]')
    bilinear = '[bilinear]\nequations = ["X - x = eps*(x + X)"]'
    entry, other, third = (parse_system(f'variables = ["x"]\n{text}') for text in (*texts, bilinear))
    assert str(check_commute(entry, other).verdict) == "proved"
    assert str(check_commute(entry, third).verdict) == "refuted"
    settings = Settings(eps=fmpq(1, 5))
    assert str(check_commute(entry, entry, settings, fmpq(1, 3)).verdict) == "proved"
    report = check_commute(third, entry, settings, fmpq(1, 3))
    assert str(report.verdict) == "refuted"
    assert "the map of g is taken at eps2 = 1/3" in report.notes[0]


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name != "rescaled-top"])
def test_what_is_for_quadratic_systems_says_which_kind_of_map_it_found(name):
    file = EXAMPLES[name]
    for ask in (lambda: file.system, lambda: with_symbols(file), lambda: with_symbols(file, list(file.parameters))):
        refuses("expected a quadratic vector field", ask)
    refuses(f"{file.name} is of kind .{file.kind}.: Pi", check_poisson, file)
