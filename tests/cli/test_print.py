"""`print` of a result shows what its command prints, and `rows()` is what tables are made of."""

import pytest

import kahanmaps as km


def test_print_shows_what_the_command_prints(kahanmaps):
    assert f"{km.check_integrals('euler_top')}\n" == kahanmaps("check-integrals", "euler_top").out
    assert f"{km.analyze('nahm_tetrahedral')}\n" == kahanmaps("analyze", "nahm_tetrahedral").out


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (lambda: km.degrees("euler_top", max_terms=4), "degrees euler_top --terms 4"),
        (lambda: km.find_symmetry("lorenz"), "find-symmetry lorenz"),
        (lambda: km.find_commuting("paper_m2"), "find-commuting paper_m2"),
        (lambda: km.darboux_polynomials("lotka_volterra", 2), "find-integrals lotka_volterra --darboux 2"),
        (lambda: km.find_poisson("lorenz", 1), "find-poisson lorenz --degree 1"),
        (
            lambda: km.scan("lotka_volterra", ["a"], primes=[5, 7, 11], terms=2),
            "scan lotka_volterra --over a --primes 5,7,11 --terms 2",
        ),
    ],
)
def test_print_shows_what_the_command_prints_below_its_heading(kahanmaps, result, words):
    assert f"{result()}\n" == kahanmaps(words).out.split("\n", 1)[1]


def test_rows_are_tables():
    darboux, run = km.darboux_polynomials("lotka_volterra", 1), km.singularities("weierstrass", "1/3")
    assert darboux.rows()[0] == {"cofactor": "C[x]", "polynomial": "x", "verdict": "proved"}
    assert (run.rows()[0]["polynomial"], run.rows()[0]["confined_at"]) == ("4*x - 3", 4)
    assert km.constant_structures("weierstrass").rows()[0]["function"] == "2*x^3 - y^2/2 - 2*x"
    assert km.heights("weierstrass", "1/10").rows()[0] == {"eps": "1/10", "start": "29/16,19/7", "growth": "quadratic"}
    assert km.cycles("weierstrass", "1/7", 101).rows()[0] == {"length": 3, "count": 1}
    assert km.find_symmetry("lorenz").rows()[1] == {"kind": "symmetry", "action": "(x, y, z) -> (-x, -y, z)"}
    assert km.find_commuting("lorenz").rows() == []
    assert {row["verdict"] for row in km.find_commuting("paper_m2").rows()} == {"proved"}
    first = km.analyze("riccati").rows()[0]
    assert first == {"section": "vector field", "status": "proved", "text": "div f = 2*x + 1"}
