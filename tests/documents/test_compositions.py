"""Maps of other files one after the other: read, written out whole, and refused with all that is wrong."""

import json
import re

import pytest
from flint import fmpq
from helpers import refuses, together

from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system, read_system
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.errors import SystemFileError
from kahanmaps.maps.kahan import KahanFamily

FIELD = 'variables = ["x", "y"]\nparameters.a = 2\n[system]\nrhs = ["x*(a - y)", "y*(x - 1)"]\n'
START, EPS = (fmpq(1, 2), fmpq(1, 3)), "1/10"


def written(tmp_path, of, head="", name="word.toml"):
    (tmp_path / "field.toml").write_text(FIELD)
    path = tmp_path / name
    path.write_text(f"{head}\n[composition]\nof = [{of}]\n")
    return path


def test_a_word_in_files_catalogue_and_tables_is_what_its_letters_do(tmp_path):
    swap = '{ map = { variables = ["x", "y"], map = { image = ["b*y", "x/b"] } }, involution = true }'
    field = '{ file = "field.toml", inverse = true, parameters = { a = "b + 1" } }'
    of = f'{field}, {swap}, {{ system = "lotka_volterra", power = 2 }}'
    file = read_system(written(tmp_path, of, 'parameters.b = "1/2"'))
    first = KahanFamily(parse_system(FIELD, parameters={"a": "3/2"}).system).at(EPS).inverse
    last = load("lotka_volterra").map.at(EPS)
    x, y = first.step(START)
    expected = last.step(last.step((y / 2, 2 * x)))
    assert file.map.at(EPS).step(START) == expected
    assert file.map.at(EPS).inverse.step(expected) == START
    assert file.variables == ("x", "y")
    assert file.map.has_eps
    assert not file.map.time_steps


def test_the_document_says_all_by_itself_and_keeps_its_parameters(tmp_path):
    table = '{ map = { variables = ["u", "v"], map = { image = ["b*v", "u"] } } }'
    of = f'{{ file = "field.toml", parameters = {{ a = "b" }} }}, {table}'
    file = read_system(written(tmp_path, of, "parameters.b = 5"))
    (tmp_path / "field.toml").unlink()
    assert not re.search("field.toml|catalog", json.dumps(file.document))
    assert parse_system(file.to_toml(), file.name) == file
    other = parse_system(file.to_toml(), file.name, {"b": 7})
    assert other.map.at(EPS).step(START) != file.map.at(EPS).step(START)


@together(
    "of, sentence",
    [
        ("", "found [], expected a list of maps"),
        ('{ file = "none.toml" }', "No such file"),
        ('{ file = "word.toml" }', "as a part of itself"),
        ('{ system = "eul" }', "found the unknown system 'eul'"),
        ('{ file = "field.toml", power = 0 }', "expected an integer other than 0"),
        ('{ file = "field.toml", power = 65 }', "more than 64 steps"),
        ('{ file = "field.toml", inverse = 1 }', "expected true or false"),
        ('{ file = "field.toml", turn = 1 }', "unknown key"),
        ('{ file = "field.toml", parameters = "a=7" }', "found 'a=7', expected a table of numbers"),
        ('{ file = "./word.toml" }', "as a part of itself"),
        ('{ file = "field.toml", system = "riccati" }', "expected exactly one"),
        ('{ file = "field.toml", involution = true }', "whose square is not the identity"),
        ('{ file = "field.toml", parameters = { a = "1/0" } }', "division by 0"),
        ('{ file = "field.toml" }, { system = "euler_top" }', "the same dimension: got 2, 3"),
        (
            '{ file = "field.toml" }, { map = { variables = ["y", "x"], map = { image = ["x", "y"] } } }',
            "in the same order",
        ),
        ('{ map = { variables = ["x", "y"], map = { image = ["x^2", "y"] } } }', "at least 2 preimages"),
    ],
)
def test_a_wrong_composition_says_what_is_wrong(tmp_path, of, sentence):
    refuses(re.escape(sentence), read_system, written(tmp_path, of), error=SystemFileError)


# Parts that share the symbol b, and such as have a b of their own.
WITHOUT = (
    '{ map = { variables = ["x", "y"], map = { image = ["b*y + c", "x"] } }, parameters = { b = "c" } }',
    '{ map = { variables = ["x", "y"], parameters = { b = 7 }, map = { image = ["b*y", "x"] } } }',
)
SHARED = (
    '{ file = "field.toml", parameters = { a = "b/(b + 1)" } }',
    '{ system = "lyness", inverse = true, parameters = { a = "b^2" } }',
    '{ map = { variables = ["x", "y"], map = { image = ["b*y + c", "x"] } } }',
    '{ file = "inner.toml", parameters = { d = "b - 1" } }',
)


@pytest.mark.parametrize("of", [*WITHOUT, ", ".join(WITHOUT + SHARED)])
def test_parts_share_a_symbol_and_are_given_functions_of_it(tmp_path, of):
    part = '{ map = { variables = ["x", "y"], map = { image = ["d*y", "x + c*d"] } } }'
    written(tmp_path, part, "[parameters]\nc = 3\nd = 1", name="inner.toml")
    path = written(tmp_path, of, "[parameters]\nb = 5\nc = 2")
    map_ = map_with_symbols(read_system(path), ["b"])
    assert map_.symbols == ("b",)
    for b in ("5", "-2/7"):
        number = fmpq(*map(int, b.split("/")))
        entry = read_system(path, {"b": b}).map.at(EPS)
        assert map_.at(EPS, values=[number]).step(START) == entry.step(START)
        assert map_.at(EPS, values=[number]).inverse.step(START) == entry.inverse.step(START)
        if of not in WITHOUT:
            assert entry.step(START) != map_.at(EPS, values=[number + 1]).step(START)


def test_a_symbol_that_a_part_cannot_have_is_refused(tmp_path):
    path = written(tmp_path, '{ system = "lyness", parameters = { a = "1/(b - b)" } }', "parameters.b = 5")
    refuses("division by 0", read_system, path, error=SystemFileError)
    family = '[family]\nA = [["p", "0"], ["0", "p"]]\nH = "x1^3"\n[parameters]\np = 2\n'
    (tmp_path / "member.toml").write_text(family)
    file = read_system(written(tmp_path, '{ file = "member.toml", parameters = { p = "b" } }', "parameters.b = 5"))
    refuses(r"found the symbols p in a \[family\] file, expected numbers", map_with_symbols, file, ["b"])
    of = '{ system = "lyness", parameters = { a = "1/b" } }'
    map_ = map_with_symbols(read_system(written(tmp_path, of, "parameters.b = 5")), ["b"])
    refuses("a pole at these values of the symbols", map_.at, 1, values=[fmpq(0)])
