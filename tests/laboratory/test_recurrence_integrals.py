"""Integrals of recurrences that are published as integrable, and of their images under scalings and permutations."""

import pytest
from search_helpers import ranks

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.checks.claims import Certainty
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.integrals import find_integrals

NAMES = "abcdefg"


def of_sums(order):
    """x_{n+N} = 3/(x_{n+1} ... x_{n+N-1}) - x_n - ... - x_{n+N-1}; (P - 3) S is kept, P the product and S the sum.

    With x' = 3/Q - S, Q the product without x_n, P' = Q x' and S' = S - x_n + x': (P' - 3) S' = (P - 3) S.
    """
    x = NAMES[:order]
    return x, f"3/({'*'.join(x[1:])}) - {' - '.join(x)}", [f"({'*'.join(x)} - 3)*({' + '.join(x)})"]


def lyness(order):
    """x_{n+N} = (3 + x_{n+1} + ... + x_{n+N-1})/x_n, and an integral: (3 + S) times all (1 + x_i)/x_i."""
    x = NAMES[:order]
    ones = "*".join(f"({c} + 1)" for c in x)
    return x, f"(3 + {' + '.join(x[1:])})/{x[0]}", [f"(3 + {' + '.join(x)})*{ones}/({'*'.join(x)})"]


def image_of(names, last, scales, order):
    """The map (x_1, ..., x_N) -> (x_2, ..., x_N, last) for y_i = x_i/D_i, the variables in another order."""
    x = {name: f"({scale}*{name})" for name, scale in zip(names, scales, strict=True)}
    text = "".join(x.get(c, c) for c in last)
    images = [f"{x[after]}/({scale})" for after, scale in zip(names[1:], scales, strict=False)]
    images.append(f"({text})/({scales[-1]})")
    variables, image = [names[k] for k in order], [images[k] for k in order]
    return parse_system(f"variables = {variables}\n[map]\nimage = {image}")


@pytest.mark.parametrize(
    ("case", "count", "scales", "order"),
    [
        (of_sums(4), 2, [1, 1, 1, 1], [0, 1, 2, 3]),
        (of_sums(4), 2, [10**6, "1/3", 7, "2/999983"], [2, 0, 3, 1]),
        (of_sums(5), 3, [1, 1, 1, 1, 1], [0, 1, 2, 3, 4]),
        (lyness(3), 2, [2, "1/5", 10**5], [1, 2, 0]),
        (lyness(4), 2, [1, 1, 1, 1], [0, 1, 2, 3]),
        (("abcd", "(1 + a + b + c + d)/a", []), 0, [1, 1, 1, 1], [0, 1, 2, 3]),
    ],
)
def test_all_integrals_of_recurrences_are_found(case, count, scales, order):
    names, last, known = case
    file = image_of(names, last, scales, order)
    search = find_integrals(file)
    assert (len(search.integrals), search.codimension, search.reason) == (count, count, "")
    assert all(integral.verdict is Certainty.PROVED for integral in search.integrals)
    texts = ["".join(f"({scales[names.index(c)]}*{c})" if c in names else c for c in text) for text in known]
    functions = [parse_rational_function(text, [*file.variables, "eps"]) for text in texts]
    number, _, of_all = ranks([integral.function for integral in search.integrals], functions, Laboratory(file).maps[0])
    assert number == of_all == count  # the known ones are functions of those found
