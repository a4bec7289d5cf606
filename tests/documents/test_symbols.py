"""Systems with symbols are the systems with numbers, wherever the symbols get these numbers."""

import random

import pytest
from flint import fmpq
from search_helpers import PRIME, system

from kahanmaps.algebra.fields import GF
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.symbols import with_symbols
from kahanmaps.errors import InputError

FIELD = GF(PRIME)
WITH_PARAMETERS = [name for name in names() if load(name).parameters and load(name).kind != "family"]


def same_maps(first, second, seed=0):
    rng = random.Random(seed)
    for _ in range(3):
        x = [FIELD.random(rng) for _ in range(second.dim)]
        assert list(first.polarised(x, x)) == list(second.value(x))
        assert first.jacobian(x) == second.jacobian(x)


@pytest.mark.parametrize("name", WITH_PARAMETERS)
def test_symbols_at_the_numbers_of_the_file_give_its_system(name):
    changed = {parameter: fmpq(2 * k + 3, k + 2) for k, parameter in enumerate(load(name).parameters)}
    file = load(name, changed)
    symbols = tuple(file.parameters)
    over = with_symbols(load(name), symbols).over(FIELD, [FIELD.convert(file.parameters[s]) for s in symbols])
    same_maps(over, file.system.over(FIELD))


@pytest.mark.parametrize(
    ("file", "symbols", "words"),
    [
        (load("euler_top"), ["a4"], "found the symbol 'a4', expected eps or a parameter of the system: a1, a2, a3"),
        (load("lorenz"), ["x"], "found the symbol 'x'"),
        (system("x y", "x*y", "1"), ["a"], "a parameter of the system: none"),
        # a term that is not there only because the file says a = 0
        (
            system("x y", "a*x^3 + y", "x", a=0),
            ["a"],
            "with a as symbols: 1 mistake\n  system.rhs[1]: found a polynomial of degree 3",
        ),
        (system("x", "x^2/a", a=2), ["a"], "a division by something with variables in it"),
    ],
)
def test_what_cannot_be_a_symbol_is_refused(file, symbols, words):
    with pytest.raises(InputError) as caught:
        with_symbols(file, symbols)
    assert words in str(caught.value)
