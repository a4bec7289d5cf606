"""Maps that are not Kahan's, from files: read, refused with all mistakes, and put to the test by the commands."""

import json
from pathlib import Path

import pytest
from flint import fmpq

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.files import parse_system, read_system
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.singular.singularities import singularities, symbolic_denominator

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "maps").glob("*.toml"))
NAMES = [path.stem for path in EXAMPLES]


def example(name):
    return read_system(EXAMPLES[NAMES.index(name)])


@pytest.mark.parametrize("path", EXAMPLES, ids=NAMES)
def test_a_file_of_any_kind_reads_back_equal(path):
    file = read_system(path)
    again = parse_system(file.to_toml(), file.name)
    assert again == file
    assert json.loads(json.dumps(file.document)) == again.document


@pytest.mark.parametrize("path", EXAMPLES, ids=NAMES)
def test_what_the_example_says_that_it_preserves_is_proved(path):
    file = read_system(path)
    if file.integrals:
        assert str(check_integrals(file).verdict) == "proved"
    assert str(check_measure(file).verdict) == "proved"


@pytest.mark.parametrize("path", EXAMPLES, ids=NAMES)
def test_another_claim_of_the_example_is_refuted(path):  # so the checks can fail
    file = read_system(path)
    first = file.variables[0]
    wrong = parse_rational_function(f"{first}^2 + 1", [*file.variables, "eps"])
    assert str(check_integrals(file, extra={"wrong": wrong}).verdict) == "refuted"
    assert str(check_measure(file, extra=wrong).verdict) == "refuted"


def test_maps_of_different_kinds_commute_or_not():
    # The Kahan map of x' = x^2 is x/(1 - 2 eps x); of x' = 3 x^2 at a third of eps it is the same.
    one = parse_system('variables = ["x"]\n[map]\nimage = ["x/(1 - 2*eps*x)"]')
    other = parse_system('variables = ["x"]\n[system]\nrhs = ["x^2 + eps^2*x^2"]')
    third = parse_system('variables = ["x"]\n[bilinear]\nequations = ["X - x = eps*(x + X)"]')
    assert str(check_commute(one, other).verdict) == "proved"
    assert str(check_commute(one, third).verdict) == "refuted"
    settings = Settings(eps=fmpq(1, 5))
    assert str(check_commute(one, one, settings, fmpq(1, 3)).verdict) == "proved"
    report = check_commute(third, one, settings, fmpq(1, 3))
    assert str(report.verdict) == "refuted"
    assert "the map of g is taken at eps2 = 1/3" in report.notes[0]


def test_degrees_and_singularities_of_a_qrt_map_are_those_of_an_elliptic_fibration():
    # Quadratic growth; x^2 y^2 - x^2 - y^2 + x y is a pencil of biquadratic curves. 2 n^2 + 1: Bellon 1999.
    map_ = example("mcmillan").map
    assert degree_growth(map_, max_terms=6).degrees == (1, 3, 9, 19, 33, 51, 73)
    run = singularities(map_, "1/3")
    assert {(h.polynomial, h.confined_at) for h in run.hypersurfaces} == {("y - 1", 3), ("y + 1", 3)}
    assert symbolic_denominator(map_) == [("y - 1", 1), ("y + 1", 1)]


@pytest.mark.parametrize("name", [name for name in NAMES if name != "rescaled-top"])
def test_what_is_for_quadratic_systems_says_which_kind_of_map_it_found(name):
    file = example(name)
    for ask in (lambda: file.system, lambda: with_symbols(file), lambda: with_symbols(file, list(file.parameters))):
        with pytest.raises(InputError, match="expected a quadratic vector field"):
            ask()
    with pytest.raises(InputError, match=f"{file.name} is of kind .{file.kind}.: Pi"):
        check_poisson(file)
