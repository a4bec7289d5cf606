"""Options: what is written becomes canonical plain data, one text for one value, and gives back what it stands for.

Whatever is no value of an option is told in a sentence (InputError), with what was found and what was expected.
"""

import json
import re
from datetime import time
from itertools import product

import pytest
from flint import fmpq, fmpq_poly
from helpers import refuses, together

from kahanmaps.errors import InputError
from kahanmaps.experiments.options import FAMILY, VOCABULARY

ALL = {**VOCABULARY, **FAMILY}

# Option, ways to write one value, the canonical text, and what the library gets.
SAME = [
    ("eps", [0.1, "0.1", "1/10", "2/20", " 1/10 ", ".1", "1e-1", fmpq(1, 10)], "1/10", fmpq(1, 10)),
    ("eps", [5, "5", "5.0", "10/2", "+5"], "5", fmpq(5)),
    ("steps", [5, "5", "5.0", "10/2"], 5, 5),
    ("seed", [0, "0", "-0", "0.0"], 0, 0),
    ("start", ["1/2,-1/3", "1/2, -1/3", " 0.5 ,-2/6"], "1/2,-1/3", (fmpq(1, 2), fmpq(-1, 3))),
    ("at", [5, "5", "5.0", "5,5"], "5", (5,)),
    ("sections", ["1,2", "2,1", "2,1,2"], "1,2", (1, 2)),
    ("prime", [7, "7", "7.0", " 7"], "7", 7),
    ("arithmetic", ["mod:7"], "mod:7", "mod:7"),
    ("chi", ["t^2 - 2", "t^2-2", "2*t^2 - 4", "(t^2 - 2)", "t*t - 2"], "t^2 - 2", fmpq_poly([-2, 0, 1])),
    ("chi", ["(t - 1)*(t + 1/2)", "t^2 - t/2 - 1/2"], "t^2 - 1/2*t - 1/2", fmpq_poly([-1, -1, 2]) / 2),
    ("eigenvalues", ["1,0.5", "1, 1/2"], "1,1/2", (fmpq(1), fmpq(1, 2))),
    ("signs", ["1,-1", "+1, -1"], "1,-1", (1, -1)),
    ("symbolic", ["a1,a2", "a2, a1", " a1 ,a2,a1"], "a1,a2", ["a1", "a2"]),
    ("effort", [3, "3", "3.0", "6/2"], 3, 3),
]


def read(name, value):
    # A decimal of a spec arrives as the text that was written.
    return ALL[name].read(str(value) if isinstance(value, float) else value)


@pytest.mark.parametrize(("name", "written", "canonical", "made"), SAME)
def test_one_value_has_one_canonical_form_and_makes_what_the_library_wants(name, written, canonical, made):
    assert [read(name, value) for value in written] == [canonical] * len(written)
    assert ALL[name].make(canonical) == made


@together(
    "name, value, words",
    [
        ("eps", True, "found true, expected a number"),
        ("eps", "nan", "found 'nan', expected an integer, p/q or a decimal such as 0.1"),
        ("eps", "", "found nothing, expected an integer, p/q or a decimal such as 0.1"),
        ("eps", "1/0", "found the denominator 0, expected a nonzero integer"),
        ("eps", "1e10001", "found the power of ten '10001', expected at most 10000 in size"),
        ("steps", "1/2", "found 1/2, expected an integer from 0 to 1000000000"),
        ("steps", 10**9 + 1, "found 1000000001, expected an integer from 0 to 1000000000"),
        ("method", "dubling", "found 'dubling', expected one of generic, normal-form, doubling; did you mean doubling"),
        ("start", 1, 'found 1, expected numbers separated by commas in one text, e.g. "1/2,-1/3"'),
        ("start", "1,,2", "entry 2: found nothing, expected an integer, p/q or a decimal such as 0.1"),
        ("start", "", "found nothing, expected a point"),
        ("at", "1.5", "found 3/2, expected integers from 0 to 10^18, separated by commas in one text"),
        ("at", 10**18 + 1, "found 1000000000000000001, expected integers from 0 to 10^18"),
        ("sections", "1,12", "found 12, expected integers from 1 to 11"),
        ("prime", 4, "4"),
        ("prime", 1, "found 1, expected a prime of at most 192 bits"),
        ("prime", 2**200, "expected a prime of at most 192 bits"),
        ("arithmetic", "mod:4", "4"),
        ("arithmetic", "mod:" + "7" * 3000, "expected exact, float, mod:P or ball:BITS"),
        ("arithmetic", "ball:1000000000", "1000000000"),
        ("arithmetic", 7, "found 7, expected exact, float, mod:P or ball:BITS"),
        ("chi", "5", "found chi = 5, expected a polynomial in t of degree m >= 1"),
        ("chi", "x^2", "x"),
        ("chi", "t^17", "found a polynomial of degree 17, expected at most 16"),
        ("chi", 2, "found 2, expected a polynomial in t, as text"),
        ("eigenvalues", ",".join(["1"] * 17), "found 17 numbers, expected at most 16"),
        ("symbolic", "a,eps", "found eps, expected names of parameters: eps is symbolic whenever it has no value"),
        ("symbolic", "a,,b", "found the name '', expected names of parameters in one text"),
        ("symbolic", 1, "found 1, expected names of parameters in one text"),
    ],
)
def test_an_invalid_value_is_refused_in_a_sentence(name, value, words):  # others are in spec_mistakes.txt
    refuses(re.escape(words), read, name, value)


ANYTHING = (None, True, -7, 10**4000, "", "\x1b[31m", "1..2", "a" * 10_000, [1], {}, time(7, 32))


@together("name, value", product([name for name in ALL if name != "other"], ANYTHING))
def test_whatever_is_written_is_read_or_refused_in_a_short_sentence(name, value):
    try:
        json.dumps(ALL[name].read(value))
    except InputError as error:
        assert len(str(error)) < 400  # noqa: PT017
        assert "\x1b" not in str(error)  # noqa: PT017
