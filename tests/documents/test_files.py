"""System files: what is written reads back equal, and a wrong file is told all its mistakes at once, each with its key.

Whatever the bytes are, reading them gives a SystemFile or raises InputError (SystemFileError for the contents of the
file), and nothing else.
"""

from __future__ import annotations

import json
import random
import tomllib
from datetime import date
from fractions import Fraction

import pytest
from check_helpers import hamiltonians
from flint import fmpq, fmpq_mat, fmpq_poly
from helpers import rationals, systems
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kahanmaps.algebra.written.text import parse_polynomial, parse_rational_function
from kahanmaps.documents import files
from kahanmaps.documents.files import SystemFile, parse_system, read_system
from kahanmaps.documents.structured_facts import relations
from kahanmaps.documents.toml_text import to_toml
from kahanmaps.errors import InputError, SystemFileError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.cubics import cubic_space
from kahanmaps.family.draw import draw_with_chi, draw_with_eigenvalues
from kahanmaps.systems.hamiltonian import standard_structure

SYSTEM = """
name = "rotor"
variables = ["x", "y"]

[parameters]
a = "2/3"
b = -0.5

[system]
rhs = ["x*y - a*x", "b*x^2 + 1"]

[integrals]
I1 = "(x^2 + y^2)/(1 - eps^2*x^2)"
"two words" = "a*x + eps"

[density]
phi = "1 - eps^2*x^2"
"""

HAMILTONIAN = """
variables = ["x", "y", "z"]
[parameters]
c = "1/7"
[hamiltonian]
H = "x^3/3 + c*x*y^2 + z"
J = [["0", "c", 2], ["-c", "0", 0.25], [-2, "-1/4", 0]]
"""

STANDARD = """
variables = ["q1", "q2", "p1", "p2"]
[hamiltonian]
H = "p1^2/2 + p2^2/2 + q1^2*q2"
J = "standard"
"""

FAMILY = """
[family]
A = [["1", 0, 0, 0], [0, "a", 0, 0], [0, 0, 1, 0], [0, 0, 0, "a"]]
H = "x1^3 + 2*x2^2*x4"
signs = [1, -1]
[parameters]
a = 2
"""

HAND_WRITTEN = {"system": SYSTEM, "hamiltonian": HAMILTONIAN, "standard": STANDARD, "family": FAMILY}
over_hand_written = pytest.mark.parametrize("text", HAND_WRITTEN.values(), ids=HAND_WRITTEN.keys())


def mistakes(text: str | bytes, **parameters: object) -> list[tuple[str, str]]:
    """The mistakes of a file, key and sentence."""
    with pytest.raises(SystemFileError) as caught:
        parse_system(text, "example", parameters)
    assert caught.value.mistakes
    return list(caught.value.mistakes)


def keys(text: str | bytes, **parameters: object) -> list[str]:
    return [key for key, _ in mistakes(text, **parameters)]


def only_mistake(text: str | bytes, **parameters: object) -> tuple[str, str]:
    (found,) = mistakes(text, **parameters)
    return found


# Reading


def test_a_system_file_gives_the_system_with_parameters_inserted():
    file = parse_system(SYSTEM)
    x, y = file.system.variables, file.system.rhs
    assert x == ("x", "y")
    assert y == tuple(parse_polynomial(text, ["x", "y"]) for text in ("x*y - 2/3*x", "-x^2/2 + 1"))


def test_a_system_file_gives_its_claims_as_rational_functions_of_variables_and_eps():
    file = parse_system(SYSTEM)
    names = ["x", "y", "eps"]
    assert dict(file.integrals) == {
        "I1": parse_rational_function("(x^2 + y^2)/(1 - eps^2*x^2)", names),
        "two words": parse_rational_function("2/3*x + eps", names),
    }
    assert file.density == parse_rational_function("1 - eps^2*x^2", names)


def test_a_hamiltonian_file_gives_h_and_j():
    file = parse_system(HAMILTONIAN)
    assert file.hamiltonian is not None
    assert file.hamiltonian.H == parse_polynomial("x^3/3 + 1/7*x*y^2 + z", ["x", "y", "z"])
    c, d = fmpq(1, 7), fmpq(1, 4)
    assert file.hamiltonian.J == fmpq_mat([[0, c, 2], [-c, 0, d], [-2, -d, 0]])
    assert file.system == file.hamiltonian.system


def test_the_standard_structure_can_be_named():
    file = parse_system(STANDARD)
    assert file.hamiltonian is not None
    assert file.hamiltonian.J == standard_structure(4)


def test_a_family_file_means_the_associated_system_that_its_signs_pick():
    file = parse_system(FAMILY)
    assert file.member is not None
    assert file.member.signs == (1, -1)
    assert file.system == file.member.associate((1, -1)).system
    assert file.hamiltonian == file.member.chosen.hamiltonian


def test_a_family_file_needs_no_names_of_variables():
    assert parse_system(FAMILY).variables == ("x1", "x2", "x3", "x4")


def test_a_family_file_may_name_its_variables():
    text = 'variables = ["a1", "a2", "b1", "b2"]\n' + FAMILY.replace("x1", "a1").replace("x2", "a2").replace("x4", "b2")
    assert parse_system(text.replace("a = 2", "c = 2").replace('"a"', '"c"')).variables == ("a1", "a2", "b1", "b2")


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("0.1", fmpq(1, 10)),
        ('"0.1"', fmpq(1, 10)),
        ("1e-3", fmpq(1, 1000)),
        ("3.14159265358979323846264338327950288", fmpq(314159265358979323846264338327950288, 10**35)),
        ("-7", fmpq(-7)),
        ("0x10", fmpq(16)),
        ("1_000", fmpq(1000)),
        ('"-22/7"', fmpq(-22, 7)),
    ],
)
def test_a_parameter_is_read_exactly(written, value):
    file = parse_system(f'variables = ["x"]\n[parameters]\na = {written}\n[system]\nrhs = ["a*x"]')
    assert file.parameters == {"a": value}
    assert file.system.B[0, 0] == value


@pytest.mark.parametrize("written", ["0.1", '"0.1"', '"1/10"', "1e-1"])
def test_a_decimal_without_quotes_means_what_it_spells_in_a_right_hand_side(written):
    assert parse_system(f'variables = ["x"]\n[system]\nrhs = [{written}]').system.c == (fmpq(1, 10),)


@pytest.mark.parametrize("value", ["1/2", fmpq(1, 2), Fraction(1, 2), "0.5"])
def test_an_override_replaces_a_parameter_of_the_file(value):
    file = parse_system(SYSTEM, parameters={"a": value})
    assert file.parameters == {"a": fmpq(1, 2), "b": fmpq(-1, 2)}
    assert file.system.rhs[0] == parse_polynomial("x*y - x/2", ["x", "y"])


def test_an_override_is_kept_when_the_file_is_written():
    file = parse_system(SYSTEM, parameters={"a": "5/4"})
    assert parse_system(file.to_toml()) == file


def test_an_override_of_zero_may_change_the_degree():
    text = 'variables = ["x"]\n[parameters]\na = 1\n[system]\nrhs = ["a*x^3 + x"]'
    assert keys(text) == ["system.rhs[1]"]
    assert parse_system(text, parameters={"a": 0}).system.divergence == 1


def test_a_file_without_a_name_is_called_after_its_path(tmp_path):
    path = tmp_path / "my-pair.toml"
    path.write_text(STANDARD, encoding="utf-8")
    assert read_system(path).name == "my-pair"


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SYSTEM.replace("\n", "\r\n").encode())
    assert read_system(path) == parse_system(SYSTEM)


def test_files_that_say_different_things_are_not_equal():
    different = [
        SYSTEM,
        SYSTEM.replace("rotor", "motor"),
        SYSTEM.replace("2/3", "3/2"),
        SYSTEM.replace("+ 1", "+ 2"),
        SYSTEM.replace("I1", "I2"),
        SYSTEM.replace("a*x + eps", "a*x"),
        SYSTEM.replace('phi = "1 - ', 'phi = "2 - '),
        SYSTEM[: SYSTEM.index("[density]")],
        HAMILTONIAN,
        HAMILTONIAN.replace("+ z", ""),
        STANDARD,
        FAMILY,
        FAMILY.replace("signs = [1, -1]", ""),
    ]
    read = [parse_system(text) for text in different]
    assert all((read[i] == read[j]) == (i == j) for i in range(len(read)) for j in range(len(read)))
    assert read[0] != SYSTEM


# Round trips


@over_hand_written
def test_a_file_reads_back_equal(text):
    file = parse_system(text)
    assert parse_system(file.to_toml()) == file


@over_hand_written
def test_a_file_that_was_read_back_is_written_the_same(text):
    written = parse_system(text).to_toml()
    assert parse_system(written).to_toml() == written


@settings(max_examples=40)
@given(systems(dims=(1, 2, 3)))
def test_every_quadratic_system_reads_back_equal(system):
    file = SystemFile.from_system(system)
    again = parse_system(file.to_toml())
    assert again == file
    assert again.system == system


@settings(max_examples=40)
@given(hamiltonians(dims=(1, 2, 3)))
def test_every_hamiltonian_system_reads_back_equal(hamiltonian):
    file = SystemFile.from_hamiltonian(hamiltonian)
    again = parse_system(file.to_toml())
    assert again == file
    assert again.hamiltonian == hamiltonian


@settings(max_examples=20)
@given(hamiltonians(dims=(2,), standard=True))
def test_the_standard_structure_is_written_by_its_name(hamiltonian):
    file = SystemFile.from_hamiltonian(hamiltonian)
    assert 'J = "standard"' in file.to_toml()
    assert parse_system(file.to_toml()) == file


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("m", [1, 2, 3, 4])
def test_every_member_of_the_family_reads_back_equal(m, seed):
    rng = random.Random(seed)
    member = draw_with_eigenvalues([fmpq(rng.randint(-9, 9), rng.randint(1, 5)) + 20 * k for k in range(m)], seed)
    signs = tuple(rng.choice((1, -1)) for _ in member.factors)
    file = SystemFile.from_member(FamilyMember(member.A, member.H, signs), "a name")
    again = parse_system(file.to_toml())
    assert again == file
    assert again.member == file.member


def test_a_member_with_an_irreducible_chi_reads_back_equal():
    file = SystemFile.from_member(draw_with_chi(fmpq_poly([2, -2, -1, 1]), seed=3))
    assert parse_system(file.to_toml()) == file


def test_a_member_in_other_variables_reads_back_equal():
    A = fmpq_mat(2, 2, [3, 0, 0, 3])
    file = SystemFile.from_member(FamilyMember(A, cubic_space(A, ("q", "p")).basis[1]))
    assert file.variables == ("q", "p")
    assert parse_system(file.to_toml()) == file


printable = st.text().filter(str.isprintable)


@given(
    name=printable,
    claims=st.dictionaries(printable, st.sampled_from(["x", "eps*x^2/(1 - x)", "a/7"]), max_size=3),
    value=rationals(10**12),
)
@example(name='"""', claims={}, value=fmpq(0))
@example(name="'\\' [system]", claims={"[system]": "x", "": "a/7", ".": "x"}, value=fmpq(1))
@example(name="Ω 🌀", claims={"τ": "x", "a.b": "x", "#": "x", "_-": "x"}, value=fmpq(-1, 3))
def test_hostile_names_read_back_equal(name, claims, value):
    document = {"name": name, "variables": ["x"], "parameters": {"a": "1"}, "system": {"rhs": ["a*x"]}}
    model = parse_system('variables = ["x"]\n[parameters]\na = 1\n[system]\nrhs = ["a*x"]\n', parameters={"a": value})
    functions = {key: parse_rational_function(text, ["x", "eps"], {"a": value}) for key, text in claims.items()}
    document |= {"parameters": {"a": str(value)}, "integrals": claims}
    file = SystemFile(name, "system", {"a": value}, model.map, None, None, functions, None, document)
    assert parse_system(file.to_toml()) == file
    assert tomllib.loads(file.to_toml())["name"] == name


plain = st.one_of(st.text(), st.integers())


@given(st.text(), st.dictionaries(st.text(), st.one_of(plain, st.lists(plain), st.lists(st.lists(plain)))))
@example('"""', {"\n[system]\n": "\x7f\x00\u2028", "": "'\\'\r\t\b\f\x1f\x80\U0010ffff", "\x7f": -(10**3000), "-_": []})
def test_whatever_is_written_as_toml_reads_back_equal(name, table):
    document = {"name": name, "integrals": table}
    assert tomllib.loads(to_toml(document, ["name"], ["integrals"])) == document


@pytest.mark.parametrize("name", ["a\nb", "a\x1b[31m", "\x7f", "\u2028"])
def test_names_that_would_break_a_line_or_colour_a_terminal_are_refused(name):
    quoted = json.dumps(name).replace("\x7f", "\\u007f")
    with pytest.raises(SystemFileError, match="printable"):
        parse_system(f'name = {quoted}\nvariables = ["x"]\n[system]\nrhs = ["x"]')
    with pytest.raises(SystemFileError, match="printable"):
        parse_system(f'variables = ["x"]\n[system]\nrhs = ["x"]\n[integrals]\n{quoted} = "x"')


def test_integers_of_any_length_survive_with_quotes():
    digits = "9" * 20_000
    file = parse_system(f'variables = ["x"]\n[parameters]\na = "{digits}"\n[system]\nrhs = ["{digits}*x"]')
    assert file.parameters["a"] == fmpq(10) ** 20_000 - 1
    assert parse_system(file.to_toml()) == file


def test_hexadecimal_integers_of_any_length_survive_without_quotes():
    # Python prints no integer of more than 4300 digits, but reads it in this form.
    f = "0x" + "f" * 20_000
    file = parse_system(f'[family]\nA = [[{f}, 0], [0, {f}]]\nH = "x1^3"')
    assert file.member is not None
    assert file.member.A[0, 0] == fmpq(2) ** 80_000 - 1
    assert parse_system(file.to_toml()) == file


# Mistakes

OK = 'variables = ["x", "y"]\n[system]\nrhs = ["x*y", "y"]\n'
H_OK = 'variables = ["q", "p"]\n[hamiltonian]\nH = "q^3 + p^2"\nJ = "standard"\n'
A_OK = "A = [[1, 0], [0, 1]]"
F_OK = f'[family]\n{A_OK}\nH = "x1^3"\n'
RELATION = "[[catalog.relations]]\nmonomials = {}\ndimension = {}\n"

# (what is wrong, the file, the keys of the mistakes in order)
WRONG = [
    ("unknown key at the top", OK.replace("[system]", "colour = 1\n[system]"), ["colour"]),
    ("unknown section", OK + "[systems]\n", ["systems"]),
    ("unknown key in [system]", OK + "lhs = 1\n", ["system.lhs"]),
    ("unknown key in [hamiltonian]", H_OK + "K = 1\n", ["hamiltonian.K"]),
    ("unknown key in [family]", F_OK + 'B = "A"\n', ["family.B"]),
    ("unknown key in [density]", OK + '[density]\nphi = "x"\npsi = "y"\n', ["density.psi"]),
    ("unknown key in [catalog]", OK + '[catalog]\nauthor = "me"\n', ["catalog.author"]),
    ("two kinds", OK + '[hamiltonian]\nH = "x"\nJ = "standard"\n', ["file"]),
    ("no kind", 'variables = ["x"]\n', ["file"]),
    ("an empty file", "", ["file", "variables"]),
    ("a comment only", "# nothing\n", ["file", "variables"]),
    ("a kind that is no table", 'variables = ["x"]\nsystem = 3\n', ["system"]),
    ("a kind twice over", 'variables = ["x"]\n[[system]]\nrhs = ["x"]\n', ["system"]),
    ("parameters that are no table", "parameters = 3\n" + OK, ["parameters"]),
    ("integrals that are no table", "integrals = [1]\n" + OK, ["integrals"]),
    ("a density that is no table", 'density = "x"\n' + OK, ["density"]),
    ("a catalogue part that is no table", "catalog = 1\n" + OK, ["catalog"]),
    ("a name that is no text", "name = 5\n" + OK, ["name"]),
    ("missing variables", '[system]\nrhs = ["x"]\n', ["variables"]),
    ("variables as text", 'variables = "xy"\n[system]\nrhs = ["x"]\n', ["variables"]),
    ("no variables", "variables = []\n[system]\nrhs = []\n", ["variables"]),
    ("numbers as variables", "variables = [1, 2]\n[system]\nrhs = []\n", ["variables"]),
    ("a variable twice", 'variables = ["x", "x"]\n[system]\nrhs = ["1", "1"]\n', ["variables"]),
    ("a variable that is no name", 'variables = ["x y"]\n[system]\nrhs = ["1"]\n', ["variables"]),
    ("a Greek variable", 'variables = ["ε"]\n[system]\nrhs = ["1"]\n', ["variables"]),
    ("eps as a variable", 'variables = ["x", "eps"]\n[system]\nrhs = ["x", "eps"]\n', ["variables"]),
    ("eps as a parameter", "parameters.eps = 1\n" + OK, ["parameters.eps"]),
    ("a parameter that is a variable", "parameters.x = 1\n" + OK, ["variables"]),
    ("a parameter that is no name", 'parameters."2a" = 1\n' + OK, ["parameters.2a"]),
    ("101 variables", f"variables = {[f'x{k}' for k in range(101)]}\n[system]\nrhs = []\n", ["variables"]),
    ("missing rhs", 'variables = ["x"]\n[system]\n', ["system.rhs"]),
    ("rhs as a number", 'variables = ["x"]\n[system]\nrhs = 1\n', ["system.rhs"]),
    ("too few right-hand sides", 'variables = ["x", "y"]\n[system]\nrhs = ["x"]\n', ["system.rhs"]),
    ("too many right-hand sides", 'variables = ["x"]\n[system]\nrhs = ["x", "1"]\n', ["system.rhs"]),
    ("degree 3", OK.replace("x*y", "x*y*x"), ["system.rhs[1]"]),
    ("degree 3 that cancels not quite", OK.replace("x*y", "x^3 - x^2*(x - y)"), ["system.rhs[1]"]),
    ("a quotient", OK.replace("x*y", "x/y"), ["system.rhs[1]"]),
    ("a division by zero", OK.replace("x*y", "x/0"), ["system.rhs[1]"]),
    ("an unknown name", OK.replace("x*y", "x*z"), ["system.rhs[1]"]),
    ("a function", OK.replace("x*y", "sin(x)"), ["system.rhs[1]"]),
    ("something like code", OK.replace("x*y", "__import__('os')"), ["system.rhs[1]"]),
    ("a huge power", OK.replace("x*y", "x^1000000000"), ["system.rhs[1]"]),
    ("a tower of powers", OK.replace("x*y", "9^9^9^9"), ["system.rhs[1]"]),
    ("nested brackets", OK.replace("x*y", "(" * 5000 + "x" + ")" * 5000), ["system.rhs[1]"]),
    ("an empty right-hand side", OK.replace("x*y", ""), ["system.rhs[1]"]),
    ("a truth value as right-hand side", OK.replace('"x*y"', "true"), ["system.rhs[1]"]),
    ("a list as right-hand side", OK.replace('"x*y"', '["x"]'), ["system.rhs[1]"]),
    ("a date as right-hand side", OK.replace('"x*y"', "1979-05-27"), ["system.rhs[1]"]),
    ("nan as right-hand side", OK.replace('"x*y"', "nan"), ["system.rhs[1]"]),
    ("a truth value as parameter", "parameters.a = true\n" + OK, ["parameters.a"]),
    ("nan as parameter", "parameters.a = nan\n" + OK, ["parameters.a"]),
    ("inf as parameter", "parameters.a = -inf\n" + OK, ["parameters.a"]),
    ("a date as parameter", "parameters.a = 1979-05-27T07:32:00Z\n" + OK, ["parameters.a"]),
    ("a list as parameter", "parameters.a = [1]\n" + OK, ["parameters.a"]),
    ("a table as parameter", "parameters.a.b = 1\n" + OK, ["parameters.a"]),
    ("a formula as parameter", 'parameters.a = "1 + 1"\n' + OK, ["parameters.a"]),
    ("a parameter over zero", 'parameters.a = "1/0"\n' + OK, ["parameters.a"]),
    ("a parameter beyond all bounds", "parameters.a = 1e999999999\n" + OK, ["parameters.a"]),
    ("a parameter with a wrong value, used twice", 'parameters.a = ""\n' + OK.replace("x*y", "a*x"), ["parameters.a"]),
    ("missing H", 'variables = ["q", "p"]\n[hamiltonian]\nJ = "standard"\n', ["hamiltonian.H"]),
    ("missing J", 'variables = ["q", "p"]\n[hamiltonian]\nH = "q"\n', ["hamiltonian.J"]),
    ("H of degree 4", H_OK.replace("q^3", "q^4"), ["hamiltonian.H"]),
    ("J by another name", H_OK.replace("standard", "canonical"), ["hamiltonian.J"]),
    ("the standard J in odd dimension", H_OK.replace('"p"]', '"p", "r"]'), ["hamiltonian.J"]),
    ("a J that is not skew", H_OK.replace('"standard"', "[[0, 1], [1, 0]]"), ["hamiltonian.J"]),
    ("a J with a diagonal", H_OK.replace('"standard"', "[[1, 1], [-1, 0]]"), ["hamiltonian.J"]),
    ("a row of J too many", H_OK.replace('"standard"', "[[0, 1], [-1, 0], [0, 0]]"), ["hamiltonian.J"]),
    ("wrong rows of J", H_OK.replace('"standard"', "[[0], [1, 0, 0]]"), ["hamiltonian.J[1]", "hamiltonian.J[2]"]),
    ("a J with a variable in it", H_OK.replace('"standard"', '[[0, "q"], [0, 0]]'), ["hamiltonian.J[1][2]"]),
    ("a J with a truth value in it", H_OK.replace('"standard"', "[[0, true], [-1, 0]]"), ["hamiltonian.J[1][2]"]),
    ("a J that is a list of numbers", H_OK.replace('"standard"', "[0, 1]"), ["hamiltonian.J"]),
    ("an empty J", H_OK.replace('"standard"', "[]"), ["hamiltonian.J"]),
    ("missing A", '[family]\nH = "x1^3"\n', ["family.A"]),
    ("missing H of the family", f"[family]\n{A_OK}\n", ["family.H"]),
    ("an A that is not skew-Hamiltonian", F_OK.replace("[[1, 0], [0, 1]]", "[[1, 2], [0, 1]]"), ["family.A"]),
    ("an A of odd size", F_OK.replace("[[1, 0], [0, 1]]", "[[1]]"), ["family.A"]),
    ("an A with a short row", F_OK.replace("[0, 1]]", "[0]]"), ["family.A[2]"]),
    ("an A larger than the variables", 'variables = ["x1"]\n' + F_OK, ["family.A", "family.A[1]", "family.A[2]"]),
    ("an A of 101 rows", "[family]\nA = [" + "[1]," * 101 + ']\nH = "x1^3"\n', ["family.A"]),
    ("an H with lower terms", F_OK.replace("x1^3", "x1^3 + x1"), ["family.H"]),
    ("an H outside the space of A", FAMILY.replace("2*x2^2*x4", "x1*x2*x3"), ["family.H"]),
    ("too many signs", F_OK + "signs = [1, 1]\n", ["family.signs"]),
    ("a sign 2", F_OK + "signs = [2]\n", ["family.signs"]),
    ("a sign true", F_OK + "signs = [true]\n", ["family.signs"]),
    ("signs as text", F_OK + 'signs = "+"\n', ["family.signs"]),
    ("a sign of 20000 digits", F_OK + f"signs = [0x{'f' * 20000}]\n", ["family.signs"]),
    ("an integral over zero", OK + '[integrals]\nI = "x/(y - y)"\n', ["integrals.I"]),
    ("an integral with an unknown name", OK + '[integrals]\nI = "x + h"\n', ["integrals.I"]),
    ("an integral that is a table", OK + '[integrals]\nI.J = "x"\n', ["integrals.I"]),
    ("a density 0", OK + '[density]\nphi = "x - x"\n', ["density.phi"]),
    ("a density without phi", OK + "[density]\n", ["density.phi"]),
    ("an unknown source", OK + '[catalog]\nsources = ["nobody-1900"]\n', ["catalog.sources"]),
    ("facts that are no list", OK + '[catalog]\nfacts = "nice"\n', ["catalog.facts"]),
    ("a title that is no text", OK + "[catalog]\ntitle = [1]\n", ["catalog.title"]),
    ("degrees that are no list", OK + "[catalog]\ndegrees = 3\n", ["catalog.degrees"]),
    ("no degrees", OK + "[catalog]\ndegrees = []\n", ["catalog.degrees"]),
    ("a degree that is no integer", OK + '[catalog]\ndegrees = [1, "2"]\n', ["catalog.degrees"]),
    ("a degree 0", OK + "[catalog]\ndegrees = [1, 0]\n", ["catalog.degrees"]),
    ("a degree of 101 digits", OK + f"[catalog]\ndegrees = [1{100 * '0'}]\n", ["catalog.degrees"]),
    ("an unknown growth", OK + '[catalog]\ngrowth = "cubic"\n', ["catalog.growth"]),
    ("a verdict that is a table", OK + "[catalog]\nverdict = {a = 1}\n", ["catalog.verdict"]),
    ("a number for a polynomial", OK + "[catalog]\ndynamical_degree = 2\n", ["catalog.dynamical_degree"]),
    ("no polynomial", OK + '[catalog]\ndynamical_degree = "x^"\n', ["catalog.dynamical_degree"]),
    ("a polynomial in t", OK + '[catalog]\ndynamical_degree = "t - 2"\n', ["catalog.dynamical_degree"]),
    ("a constant polynomial", OK + '[catalog]\ndynamical_degree = "1"\n', ["catalog.dynamical_degree"]),
    ("a polynomial that is 0", OK + '[catalog]\ndynamical_degree = "0"\n', ["catalog.dynamical_degree"]),
    ("a reducible polynomial", OK + '[catalog]\ndynamical_degree = "x^2 - 1"\n', ["catalog.dynamical_degree"]),
    ("a square", OK + '[catalog]\ndynamical_degree = "(x - 1)^2"\n', ["catalog.dynamical_degree"]),
    ("a polynomial that is not monic", OK + '[catalog]\ndynamical_degree = "2*x - 1"\n', ["catalog.dynamical_degree"]),
    ("a codimension above the dimension", OK + "[catalog]\ncodimension = 3\n", ["catalog.codimension"]),
    ("a negative codimension", OK + "[catalog]\ncodimension = -1\n", ["catalog.codimension"]),
    ("a codimension true", OK + "[catalog]\ncodimension = true\n", ["catalog.codimension"]),
    ("relations that are no tables", OK + '[catalog]\nrelations = ["x"]\n', ["catalog.relations"]),
    (
        "an empty relation",
        OK + "[[catalog.relations]]\n",
        ["catalog.relations[1].monomials", "catalog.relations[1].dimension"],
    ),
    (
        "two mistakes in the second relation",
        OK
        + '[[catalog.relations]]\nmonomials = "degree <= 2"\ndimension = 1\n'
        + '[[catalog.relations]]\nmonomials = "degree 2"\ndimension = -1\nsize = 3\n',
        ["catalog.relations[2].size", "catalog.relations[2].monomials", "catalog.relations[2].dimension"],
    ),
    ("monomials that are numbers", OK + RELATION.format("[1, 2]", 0), ["catalog.relations[1].monomials"]),
    ("no monomials", OK + RELATION.format("[]", 0), ["catalog.relations[1].monomials"]),
    ("a function 0", OK + RELATION.format('["x - x"]', 0), ["catalog.relations[1].monomials"]),
    ("a function twice", OK + RELATION.format('["x^2", "x*x"]', 0), ["catalog.relations[1].monomials"]),
    ("a function of another variable", OK + RELATION.format('["q"]', 0), ["catalog.relations[1].monomials"]),
    ("too many monomials", OK + RELATION.format('"degree <= 999"', 0), ["catalog.relations[1].monomials"]),
    ("as many relations as functions", OK + RELATION.format('["x", "1"]', 2), ["catalog.relations[1].dimension"]),
    ("an unclosed bracket", "variables = [", ["TOML"]),
    ("the same key twice", "name = 'a'\nname = 'b'\n", ["TOML"]),
    ("an unclosed text", 'name = "a\n', ["TOML"]),
    ("a control character", "name = '\x01'\n", ["TOML"]),
    ("a date that is none", "name = 2024-13-45\n", ["TOML"]),
    ("a long integer without quotes", f"name = {'9' * 5000}\n", ["TOML"]),
    ("lists in lists in lists", "name = " + "[" * 100_000, ["TOML"]),
    ("invalid UTF-8", b'name = "\xff"\n', ["TOML"]),
    ("UTF-16", SYSTEM.encode("utf-16"), ["TOML"]),
    ("no text at all", bytes(range(256)), ["TOML"]),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG])
def test_a_wrong_file_is_told_its_mistakes_by_key(text, expected):
    assert keys(text) == expected


@pytest.mark.parametrize("parts", [400, 3000])  # Python stops at a depth of 1000; tomllib is slow beyond
@pytest.mark.parametrize("key", ["name", "variables", "parameters.p", "system.rhs", "density.phi", "family.A"])
def test_tables_nested_by_dotted_keys_are_a_mistake_and_no_crash(key, parts):
    assert key in keys(key + ".a" * parts + " = 1\n")


def test_all_mistakes_of_a_file_are_told_at_once():
    text = """
name = 1
variables = ["x", "y"]
colour = "red"
[parameters]
eps = 1
"2" = 1
[system]
rhs = ["x^3", "x*", "y"]
lhs = []
[integrals]
I1 = "x +"
I2 = "z"
[density]
phi = "0"
"""
    assert keys(text) == [
        "colour",
        "parameters.eps",
        "parameters.2",
        "name",
        "system.lhs",
        "system.rhs[1]",
        "system.rhs[2]",
        "system.rhs",
        "integrals.I1",
        "integrals.I2",
        "density.phi",
    ]


def test_mistakes_in_a_and_in_signs_are_told_together():
    text = '[family]\nA = [[1, 2], [3, 1]]\nH = "x1^3"\nsigns = [0]\n'
    assert keys(text) == ["family.signs", "family.A"]


def test_mistakes_in_j_are_told_even_where_the_variables_are_missing():
    assert keys('[hamiltonian]\nH = "x"\nJ = [[0, 1], [-1]]\n') == ["variables", "hamiltonian.J[2]"]


def test_the_message_names_the_file_counts_the_mistakes_and_lists_them():
    with pytest.raises(SystemFileError) as caught:
        parse_system('variables = ["x"]\n[system]\nrhs = ["x^3", "y"]\n', "pair.toml")
    first, *rest = str(caught.value).splitlines()
    assert first == "pair.toml: 3 mistakes"
    assert rest[0] == "  system.rhs[1]: found a polynomial of degree 3, expected at most 2"
    assert rest[1].startswith("  system.rhs[2]: found the unknown name 'y'")
    assert rest[-1] == "  system.rhs: found 2 right-hand sides, expected 1, one for each variable"


def test_the_message_points_at_the_entry_of_j_that_is_not_skew():
    _, sentence = only_mistake(H_OK.replace('"standard"', "[[0, 2], [1, 0]]"))
    assert "entry (1,2) is 2, entry (2,1) is 1" in sentence


def test_the_message_points_at_the_entry_of_a_that_is_wrong():
    _, sentence = only_mistake(F_OK.replace("[[1, 0], [0, 1]]", "[[1, 2], [0, 1]]"))
    assert "entry (1,2) is 2, expected 0: the upper right block must be skew" in sentence


def test_the_message_about_signs_says_which_factors_they_belong_to():
    _, sentence = only_mistake(FAMILY.replace("[1, -1]", "[1]"))
    assert "expected 2 numbers 1 or -1" in sentence
    assert "(t - 1), (t - 2)" in sentence


@pytest.mark.parametrize("value", [0.5, True, None, [1], "half", "1/0", date(2024, 1, 1)])
def test_an_override_that_is_no_exact_number_is_a_mistake_of_that_parameter(value):
    assert only_mistake(SYSTEM, a=value)[0] == "parameters.a"


def test_a_float_as_override_is_told_what_to_write_instead():
    assert '"0.5"' in only_mistake(SYSTEM, a=0.5)[1]


def test_an_unknown_override_is_told_the_parameters_there_are():
    key, sentence = only_mistake(SYSTEM, c=1)
    assert key == "parameters"
    assert sentence == "unknown parameter 'c', this system has: a, b"


def test_an_override_where_the_file_has_no_parameters_says_so():
    assert only_mistake(OK, c=1)[1] == "unknown parameter 'c', this system has: none"


def test_eps_cannot_be_given_as_a_parameter():
    assert only_mistake(OK, eps=1)[0] == "parameters"


def test_an_escape_sequence_in_a_key_does_not_reach_the_terminal():
    with pytest.raises(SystemFileError) as caught:
        parse_system('"\\u001b[31mred" = 1\n' + OK + '[integrals]\n"\\u0007" = "x +"\n')
    assert "\x1b" not in str(caught.value)
    assert "\x07" not in str(caught.value)


def test_a_key_of_any_length_is_cut_in_the_message():
    with pytest.raises(SystemFileError) as caught:
        parse_system(f"{'k' * 100_000} = 1\n" + OK)
    assert len(str(caught.value)) < 1000


# Files that cannot be read


def test_a_file_that_is_not_there_is_wrong_input(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the system file .*No such file"):
        read_system(tmp_path / "nothing.toml")


def test_a_folder_is_wrong_input(tmp_path):
    with pytest.raises(InputError, match="cannot read the system file"):
        read_system(tmp_path)


def test_a_path_with_a_nul_character_is_wrong_input():
    with pytest.raises(InputError, match="cannot read the system file"):
        read_system("a\0b")


@pytest.mark.parametrize(("spare", "fits"), [(0, True), (-1, False)])
def test_a_file_beyond_the_size_limit_is_wrong_input(spare, fits, tmp_path, monkeypatch):
    path = tmp_path / "large.toml"
    path.write_text(SYSTEM, encoding="utf-8")
    monkeypatch.setattr(files, "_TOML", files._TOML._replace(most=len(SYSTEM) + spare))
    for read in (lambda: read_system(path), lambda: parse_system(SYSTEM), lambda: parse_system(SYSTEM.encode())):
        if fits:
            assert read().name == "rotor"
        else:
            with pytest.raises(InputError, match="larger than"):
                read()


@pytest.mark.parametrize(
    ("text", "hint"),
    [("name = " + "[" * 100_000, "nested too deeply"), (f"a = {'9' * 5000}", "write long numbers in quotes")],
)
def test_a_file_that_python_gives_up_on_says_what_to_change(text, hint):
    assert hint in only_mistake(text)[1]


# Anything at all

PIECES = st.sampled_from(
    [
        "variables = ", "name = ", "signs = ", "[system]\n", "[family]\n", "[hamiltonian]\n", "[parameters]\n",
        "[integrals]\n", "[density]\n", "[[system]]\n", "rhs = ", "A = ", "H = ", "J = ", "phi = ", "a = ", "eps = ",
        '["x", "y"]', '["x"]', "[1, -1]", "[[0, 1], [-1, 0]]", "[]", "{}", "{a = 1}", '"x^2"', '"x1^3"', '"standard"',
        "1", "-0.5", "nan", "true", "1979-05-27", '""', "\n", "\n", "\n", "\n", ".", "'''", "\\", "\x00", "é",
    ]
)  # fmt: skip


@settings(max_examples=300)
@given(st.lists(PIECES, max_size=25).map("".join))
def test_whatever_the_text_is_only_input_errors_are_raised(text):
    try:
        file = parse_system(text)
    except InputError:
        return
    assert parse_system(file.to_toml()) == file


@settings(max_examples=100)
@given(st.binary(max_size=60))
def test_whatever_the_bytes_are_only_input_errors_are_raised(data):
    try:
        parse_system(data)
    except InputError:
        return


@settings(max_examples=200)
@given(st.sampled_from(list(HAND_WRITTEN.values())), st.integers(0, 10_000), st.integers(0, 40), st.text(max_size=3))
def test_a_damaged_file_is_an_input_error_or_still_a_file(text, at, length, inserted):
    at %= len(text)
    try:
        file = parse_system(text[:at] + inserted + text[at + length :])
    except InputError:
        return
    assert parse_system(file.to_toml()) == file


# Structured facts


def test_structured_facts_are_read_and_written():
    text = f"""
variables = ["x", "y"]
[system]
rhs = ["x*y", "y"]
[catalog]
degrees = [1, 4, {10**100 - 1}]
growth = "exponential"
dynamical_degree = "x^2 - x - 1"
verdict = "not integrable"
codimension = 2
[[catalog.relations]]
monomials = "degree <= 2"
dimension = 0
[[catalog.relations]]
monomials = ["x^2 + y^2", "1"]
dimension = 1
"""
    file = parse_system(text)
    again = parse_system(file.to_toml())
    assert again.catalog == file.catalog
    assert (file.catalog["degrees"][-1], file.catalog["codimension"]) == (10**100 - 1, 2)
    found = relations(again.catalog, again.variables)
    assert [(str(r.functions[0]), len(r.functions), r.dimension) for r in found] == [("1", 6, 0), ("x^2 + y^2", 2, 1)]


def test_bounds_of_numbers_are_told():
    with pytest.raises(SystemFileError) as caught:
        parse_system(OK + "[catalog]\ncodimension = 3\n" + RELATION.format('["x", "1"]', 2), "mine")
    assert [line.partition(", expected ")[2] for line in str(caught.value).splitlines()[1:]] == [
        "an integer from 0 to 2, the dimension",
        "an integer from 0 to 1",
    ]


def test_a_wrong_word_is_answered_with_those_that_are_known():
    with pytest.raises(SystemFileError) as caught:
        parse_system(OK + '[catalog]\ngrowth = "fast"\nverdict = "nice"\n', "mine")
    assert str(caught.value).splitlines()[1:] == [
        "  catalog.growth: found 'fast', expected one of bounded, linear, quadratic, exponential",
        "  catalog.verdict: found 'nice', expected one of integrable, linearisable, not integrable",
    ]


@pytest.mark.parametrize(
    ("document", "expected"),
    [
        ('variables = ["q", "p"]\n[hamiltonian]\nH = "q^3"\n', r'hamiltonian\.J: missing, expected "standard"'),
        ('variables = ["q", "p"]\n[hamiltonian]\nJ = "standard"\n', r"hamiltonian\.H: missing, expected a polynomial"),
        ('variables = ["x"]\n[system]\n', r"system\.rhs: missing, expected a list"),
        ("[family]\n", r"family\.A: missing, expected the rows"),
        (
            'variables = ["x"]\n[system]\nrhs = ["x"]\n[density]\n',
            r"density\.phi: missing, expected a rational function",
        ),
        ('[experiments.a]\ntask = "degrees"\n', "a batch spec is for kahanmaps batch run"),
    ],
)
def test_what_is_missing_is_said_with_what_is_expected(document, expected):
    with pytest.raises(SystemFileError, match=expected):
        parse_system(document)
