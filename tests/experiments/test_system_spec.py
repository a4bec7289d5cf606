"""Recipes: plain data that say how to come by a system, the same for the same system, and what is made of them."""

import json

import pytest
from flint import fmpq, fmpq_poly

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.experiments.options import FAMILY
from kahanmaps.experiments.results.records import canonical
from kahanmaps.experiments.results.system_spec import document_text, family_spec, find_file, spec_of, system_from
from kahanmaps.family.random_members import (
    random_eigenvalues,
    random_member,
    random_member_with_chi,
    random_member_with_eigenvalues,
)

ROTOR = 'name = "rotor"\nvariables = ["x", "y"]\n[parameters]\na = "2"\n[system]\nrhs = ["a*y", "-x*y"]\n'
CATALOG = '[catalog]\ntitle = "Rotor"\nfacts = ["Measured: it turns."]\n'


def drawn(**values: object) -> SystemFile:
    """The random member of a recipe, with values as a spec has them."""
    return system_from(
        family_spec({k: FAMILY[k].read(v) if k in FAMILY else v for k, v in values.items()}), {}.__getitem__
    )


# Random members


@pytest.mark.parametrize(
    ("values", "member"),
    [
        ({"m": 2}, lambda: random_member_with_eigenvalues(random_eigenvalues(2, 0), 0)),
        ({"m": 3, "seed": 7, "size": 5}, lambda: random_member_with_eigenvalues(random_eigenvalues(3, 7), 7, 5)),
        ({"m": 3, "seed": 7, "draw": "generic", "size": 4}, lambda: random_member(3, 7, 4)),
        ({"eigenvalues": "1/2,-3", "seed": 7}, lambda: random_member_with_eigenvalues([fmpq(1, 2), -3], 7)),
        ({"chi": "2*t^2 - 4", "seed": 7, "size": 3}, lambda: random_member_with_chi(fmpq_poly([-2, 0, 1]), 7, 3)),
    ],
)
def test_a_random_member_is_the_one_that_the_library_draws(values, member):
    assert drawn(**values).member == member()


def test_signs_pick_an_associated_system():
    plain, other = drawn(m=2, seed=1).member, drawn(m=2, seed=1, signs="1,-1").member
    assert (other.A, other.H, other.signs) == (plain.A, plain.H, (1, -1))


# Files


def test_every_system_of_the_catalogue_reads_back_equal():
    for name in names():
        documents: dict[str, str] = {}
        recipe = json.loads(canonical(spec_of(load(name), documents)))
        assert system_from(recipe, documents.__getitem__) == load(name)


@pytest.mark.parametrize(
    ("text", "is_same"),
    [
        (ROTOR + CATALOG, True),  # what is told about a system is not the system
        ("# a remark\n" + ROTOR.replace('"2"', "2.0"), True),
        (ROTOR.replace('"2"', '"3"'), False),
        (ROTOR.replace("-x*y", "x*y"), False),
        (ROTOR.replace("rotor", "motor"), False),  # reports print the name
        (ROTOR + '[integrals]\nI = "x^2"\n', False),
        (ROTOR + '[density]\nphi = "x"\n', False),
    ],
)
def test_a_recipe_is_another_one_when_the_file_says_something_else(text, is_same):
    documents: dict[str, str] = {}
    recipe = spec_of(parse_system(ROTOR), documents)
    assert documents == {recipe["document"]: document_text(parse_system(ROTOR))}
    assert (spec_of(parse_system(text), {}) == recipe) is is_same


@pytest.mark.parametrize(("reference", "name"), [("lorenz", "lorenz"), ("./rotor.toml", "rotor")])
def test_a_word_is_a_name_of_the_catalogue_and_a_path_is_relative_to_the_folder(tmp_path, reference, name):
    for file in ("lorenz", "rotor.toml"):
        (tmp_path / file).write_text(ROTOR)
    assert find_file(reference, tmp_path).name == name
