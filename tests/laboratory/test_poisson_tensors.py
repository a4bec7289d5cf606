"""Poisson tensors that a map preserves, found: those of the literature, with their Casimirs, and no others."""

from dataclasses import replace
from functools import cache

import pytest
from helpers import random_point
from search_helpers import TODD, map_file, random_system, system

from kahanmaps import QQ, Certainty, find_integrals, find_poisson, load, parse_rational_function
from kahanmaps.laboratory.preserve.poisson import poisson_tensors

PROVED = Certainty.PROVED


LYNESS = map_file("x y", "y", "(a + y)/x", inverse=["(a + x)/y", "x"], a="2/3")
# x_{n+4} x_n = x_{n+3} x_{n+1} + x_{n+2}^2
SOMOS_4 = map_file("x y z w", "y", "z", "w", "(y*w + z^2)/x", inverse=["(x*z + y^2)/w", "x", "y", "z"])
HENON = map_file("x y", "y + 1 - 2*x^2", "x/3", inverse=["3*y", "x - 1 + 18*y^2"])  # det dPhi = -1/3


def holds_exactly(file, first, eps):
    """dPhi P dPhi^T = P(x~) at rational points, computed here."""
    map_ = file.map.at(eps)
    for x in (random_point(file.dim, seed) for seed in (1, 2)):
        slope = map_.jacobian(x)
        here, there = (first.tensor.value(QQ, map_.eps, point) for point in (x, map_.step(x)))
        if slope * here * slope.transpose() != there:
            return False
    return True


@pytest.mark.parametrize(
    ("file", "rank", "log_canonical"),
    [
        (LYNESS, 2, [[0, 1], [-1, 0]]),
        # Gekhtman, Shapiro and Vainshtein; Hone and Fordy: the bracket of the cluster algebra, of rank 2
        (SOMOS_4, 2, [[0, 1, 2, 3], [-1, 0, 1, 2], [-2, -1, 0, 1], [-3, -2, -1, 0]]),
        (load("lv(4,0)"), 4, [[(j > i) - (j < i) for j in range(4)] for i in range(4)]),
    ],
)
def test_log_canonical_brackets_of_the_literature(file, rank, log_canonical):
    search = find_poisson(file, integrals=())
    names = file.variables
    terms = [
        f"{{{names[i]},{names[j]}}} = {'' if entry == 1 else f'{entry}*'}{names[i]}*{names[j]}"
        for i, row in enumerate(log_canonical)
        for j, entry in enumerate(row)
        if i < j
    ]
    (entry,) = (tensor for tensor in search.tensors if tensor.text == ", ".join(terms))
    assert (entry.verdict, entry.jacobi, entry.rank) == (PROVED, PROVED, rank)
    assert holds_exactly(file, entry, "1/10")


def test_integrals_and_casimirs_of_the_euler_top():
    # rank 2 in dimension 3: each tensor has one Casimir, a function of the two integrals
    search = find_poisson(load("euler_top"), 3)
    assert [tensor.rank for tensor in search.tensors] == [2] * 3
    assert {verdict for one in search.tensors for verdict in (one.verdict, one.jacobi, one.involution)} == {PROVED}
    assert [tensor.casimirs for tensor in search.tensors] == [("I1",), ("I2",), ("(I1 - 2*I2)/(2*I2*eps^2 - 1)",)]
    assert all(tensor.is_liouville_integrable for tensor in search.tensors)
    assert search.pencil is PROVED  # tri-Hamiltonian
    assert search.note == "they are compatible: every combination of them is a Poisson tensor (proved)"
    assert all(holds_exactly(load("euler_top"), tensor, "-2/3") for tensor in search.tensors)


ROTATION = system("x y z", "2*z - 3*y", "3*x - z", "y - 2*x")  # about w = (1, 2, 3)
ALONG, SQUARE = "(x + 2*y + 3*z)", "(x^2 + y^2 + z^2)"


@cache
def integrals_of_rotation():
    return find_integrals(ROTATION).integrals


def casimirs_of_lie_poisson(*texts):
    """Those of {x,y} = z, ... among functions of these integrals I1, I2 of the rotation."""
    [model, *_] = integrals_of_rotation()
    names = ["x", "y", "z", "eps"]
    known = [replace(model, name=f"I{k}", function=parse_rational_function(t, names)) for k, t in enumerate(texts, 1)]
    tensors = find_poisson(ROTATION, 1, integrals=known).tensors
    return next(tensor for tensor in tensors if "{x,y} = z" in tensor.text).casimirs


@pytest.mark.parametrize(
    ("integrals", "casimirs"),
    [
        ((ALONG, f"{SQUARE} + eps^2*{ALONG}^2 + {ALONG}"), ("I1^2*eps^2 + I1 - I2",)),
        ((f"{SQUARE}^2*{ALONG}^3", f"{SQUARE}*{ALONG}"), ("I1/I2^3",)),
        ((f"{ALONG}^2/{SQUARE}", f"1/{ALONG}"), ("I1*I2^2",)),
        ((f"{SQUARE}*{ALONG} + 1", ALONG), ("I2/(I1 - 1)",)),  # neither a product of powers nor a polynomial
        ((ALONG,), ()),  # w.x is none
        ((ALONG, f"{SQUARE} + {ALONG}^3"), ()),  # of a higher degree than is tried
        ((SQUARE, ALONG), ("I1",)),  # enough, and no functions of it
    ],
)
def test_functions_of_integrals_are_tried_as_casimirs(integrals, casimirs):
    assert casimirs_of_lie_poisson(*integrals) == casimirs


def test_a_function_that_is_said_to_be_a_casimir_is_put_to_the_proof(monkeypatch):
    wrong = [("I1*I2", parse_rational_function(f"{ALONG}*{SQUARE}", ["x", "y", "z", "eps"]))]
    monkeypatch.setattr(poisson_tensors, "casimir_candidates", lambda *given: iter(wrong))
    assert casimirs_of_lie_poisson(ALONG, f"{SQUARE} + {ALONG}") == ()


def test_the_factors_of_a_density_are_tried_as_a_denominator():
    # both integrals are N/(x y z), the measure |dx dy dz/(x y z)|
    search = find_poisson(TODD, 3)
    assert (len(search.tensors), search.pencil, search.reason) == (2, PROVED, "")
    assert str(search.denominator.numerator) == "x*y*z"
    assert all(tensor.is_liouville_integrable and holds_exactly(TODD, tensor, 1) for tensor in search.tensors)
    none = find_poisson(TODD, 2, integrals=search.integrals)
    assert (none.tensors, none.denominator) == ((), None)
    assert none.reason.endswith(", and none of degree at most 5 over x*y*z")


@pytest.mark.parametrize(
    ("file", "degree"),
    [
        (HENON, 6),  # volume shrinks by 1/3 everywhere
        (random_system(3, 1), 3),
        (load("henon_heiles"), 2),  # the map is not symplectic for any such structure
    ],
)
def test_maps_without_structure_have_none(file, degree):
    search = find_poisson(file, degree)
    assert (search.tensors, search.degree, search.toml_section()) == ((), degree, "")
    assert search.reason.startswith(f"no tensor of degree at most {degree} is preserved (measured modulo a prime)")
