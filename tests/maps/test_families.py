"""Degrees of many members of a family modulo a small prime.

Specified here: degrees compiled, by FLINT and by the lines of `degrees` are the same.
"""

import random

import numpy as np
import pytest

from kahanmaps.documents.files import parse_system
from kahanmaps.documents.symbols import map_with_symbols
from kahanmaps.maps.residues.families import NOWHERE, Family

THREE_LINES = """variables = ["x", "y"]
parameters = { g1 = 1, g2 = 1 }
[system]
rhs = ["x*(g2*(x + y) + y)", "-y*(g1*(x + y) + x)"]"""
LOTKA_VOLTERRA = """variables = ["x", "y", "z"]
parameters = { A = 1, B = 1, C = 1 }
[system]
rhs = ["x*(C*y + z)", "y*(x + A*z)", "z*(B*x + y)"]"""
LYNESS = """variables = ["x", "y"]
parameters = { a = 1, b = 1 }
[map]
image = ["y", "(a + b*y^2 + y)/x"]"""
CASES = [
    (THREE_LINES, ["g1", "g2"], 6, 67),
    (LOTKA_VOLTERRA, ["A", "B", "C"], 3, 23),
    (LYNESS, ["a", "b"], 5, 31),  # an equation of degree 2 in the point
]


def family(text: str, names: list[str], prime: int) -> Family:
    return Family(map_with_symbols(parse_system(text), names), prime)


def members(count: int, prime: int, size: int = 40) -> np.ndarray:
    return np.array([[random.Random(k).randrange(prime) for k in range(i, i + count)] for i in range(size)])


@pytest.mark.parametrize(("text", "names", "terms", "prime"), CASES)
def test_the_compiled_loop_and_flint_give_the_same_degrees_on_the_same_lines(text, names, terms, prime):
    pytest.importorskip("numba")
    entry = family(text, names, prime)
    points = members(len(names), prime)
    results = [
        entry.degrees(points, None, terms, 400, random.Random(3), kernel=kernel) for kernel in ("numba", "numpy")
    ]
    assert (results[0] == results[1]).all()
    assert len({tuple(row) for row in results[0].tolist()}) > 1  # members are told from each other


def test_special_members_have_smaller_degrees():
    points = np.array([[1, 1], [1, 2], [2, 3], [5, 6], [3, 12]])
    result = np.max(
        [family(THREE_LINES, ["g1", "g2"], 8179).degrees(points, None, 7, 300, random.Random(k)) for k in (1, 2)],
        axis=0,
    )
    assert result.tolist() == [
        [2, 4, 8, 13, 20, 28, 38],  # zander-2021
        [2, 4, 7, 12, 18, 25, 34],
        [2, 4, 7, 11, 16, 23, 31],
        [2, 4, 7, 12, 20, 33, 54],
        [2, 4, 8, 16, 32, 64, 128],
    ]


@pytest.mark.parametrize("kernel", ["numba", "numpy"])
def test_an_iterate_defined_nowhere_is_reported(kernel):
    if kernel == "numba":
        pytest.importorskip("numba")
    vanishing = 'variables = ["x"]\nparameters.a = 1\n[bilinear]\nequations = ["a*(X - x) = eps*a*x*X"]'
    result = family(vanishing, ["a"], 13).degrees(np.array([[2], [0]]), None, 2, 99, random.Random(1), kernel=kernel)
    assert result.tolist() == [[1, 1], [NOWHERE, NOWHERE]]
