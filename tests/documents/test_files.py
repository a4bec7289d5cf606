"""System files: what is written reads back equal, and a wrong file is told all its mistakes at once, each with its key.

Systems with symbols are those with numbers, wherever the symbols get these numbers.
"""

import random
from pathlib import Path

import pytest
from flint import fmpq, fmpq_mat
from helpers import CHARACTERS, table, together
from hypothesis import given, settings
from hypothesis import strategies as st
from search_helpers import PRIME

from kahanmaps.algebra.fields import GF
from kahanmaps.algebra.parsing import parse_polynomial, parse_rational_function
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.errors import InputError, SystemFileError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.family.random_members import random_member_with_eigenvalues

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


def mistakes(text):
    """The mistakes of a file, key and sentence."""
    with pytest.raises(SystemFileError) as caught:
        parse_system(text, "example")
    return caught.value.mistakes


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


def test_a_family_file_means_the_associated_system_that_its_signs_pick():
    file = parse_system(FAMILY)
    assert file.member is not None
    assert file.member.signs == (1, -1)
    assert file.system == file.member.associate((1, -1)).system
    assert file.hamiltonian == file.member.chosen.hamiltonian


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


@pytest.mark.parametrize("text", HAND_WRITTEN.values(), ids=HAND_WRITTEN)
def test_a_file_reads_back_equal(text):
    file = parse_system(text)
    assert parse_system(file.to_toml()) == file


@pytest.mark.parametrize("m", [1, 2, 3])
def test_every_member_of_the_family_reads_back_equal(m):
    rng = random.Random(m)
    member = random_member_with_eigenvalues([fmpq(rng.randint(-9, 9), rng.randint(1, 5)) + 20 * k for k in range(m)], m)
    signs = tuple(rng.choice((1, -1)) for _ in member.factors)
    file = SystemFile.from_member(FamilyMember(member.A, member.H, signs), "a name")
    again = parse_system(file.to_toml())
    assert again == file
    assert again.member == file.member


# Mistakes

OK = 'variables = ["x", "y"]\n[system]\nrhs = ["x*y", "y"]\n'
F_OK = '[family]\nA = [[1, 0], [0, 1]]\nH = "x1^3"\n'


# Each piece stands in its heading in the place of @; behind it are keys of mistakes, and words of what is said.
WRONG = [
    (heading.replace("@", piece).replace("\\n", "\n"), expected, words)
    for heading, lines in table(Path(__file__).with_name("wrong_files.txt")).items()
    for piece, expected, *words in (line.split(" => ") for line in lines)
]
# What is too long for it, or no text.
LARGE = {
    "an empty file": ("", ["file", "variables"]),
    "a comment only": ("# nothing\n", ["file", "variables"]),
    "101 variables": (f"variables = {[f'x{k}' for k in range(101)]}\n[system]\nrhs = []\n", ["variables"]),
    "nested brackets": (OK.replace("x*y", "(" * 5000 + "x" + ")" * 5000), ["system.rhs[1]"]),
    "an A of 101 rows": ("[family]\nA = [" + "[1]," * 101 + ']\nH = "x1^3"\n', ["family.A"]),
    "a sign of 20000 digits": (F_OK + f"signs = [0x{'f' * 20000}]\n", ["family.signs"]),
    "a control character": ("name = '\x01'\n", ["TOML"]),
    "invalid UTF-8": (b'name = "\xff"\n', ["TOML"]),
    "UTF-16": (SYSTEM.encode("utf-16"), ["TOML"]),
}


@together("text, expected, words", WRONG)
def test_the_mistakes_of_a_wrong_file_are_reported_by_key(text, expected, words):
    result = mistakes(text)
    assert ", ".join(key for key, _ in result) == expected
    assert [word for word in words if not any(word in sentence for _, sentence in result)] == []


@pytest.mark.parametrize(("text", "expected"), LARGE.values(), ids=LARGE)
def test_files_that_are_too_large_or_no_text_are_refused_by_key(text, expected):
    assert [key for key, _ in mistakes(text)] == expected


@settings(max_examples=60)
@given(
    st.sampled_from(list(HAND_WRITTEN.values())),
    st.integers(0, 10_000),
    st.integers(0, 40),
    st.text(CHARACTERS, max_size=3),
)
def test_a_damaged_file_is_an_input_error_or_still_a_file(text, at, length, inserted):
    at %= len(text)
    try:
        file = parse_system(text[:at] + inserted + text[at + length :])
    except InputError:
        return
    assert parse_system(file.to_toml()) == file


FIELD = GF(PRIME)
WITH_PARAMETERS = [name for name in names() if load(name).parameters and load(name).kind != "family"]


@pytest.mark.parametrize("name", WITH_PARAMETERS)
def test_symbols_at_the_numbers_of_the_file_give_its_system(name):
    changed = {parameter: fmpq(2 * k + 3, k + 2) for k, parameter in enumerate(load(name).parameters)}
    file = load(name, changed)
    symbols, rng = tuple(file.parameters), random.Random(0)
    first = with_symbols(load(name), symbols).over(FIELD, [FIELD.convert(file.parameters[s]) for s in symbols])
    second = file.system.over(FIELD)
    for _ in range(3):
        x = [FIELD.random(rng) for _ in range(second.dim)]
        assert list(first.polarised(x, x)) == list(second.value(x))
        assert first.jacobian(x) == second.jacobian(x)
