"""What the tests of `convert` share: systems, the values that a converted file has to give, and scripts of Python."""

import json
import random
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from typing import Any

from flint import fmpq

import kahanmaps as km
from kahanmaps.algebra.fields import QQ
from kahanmaps.invariants.integrals_and_densities import CommutantIntegral, ModifiedHamiltonian
from kahanmaps.languages.convert import convert

# Reserved or special somewhere: I, E, S, N, C, D, O, Q, gamma, beta, Pi, lambda, end, _x, a_1 next to a1, point.
NASTY = {
    "nasty-capitals": """
        variables = ["I", "E", "S", "N"]
        [system]
        rhs = ["E*S/3 - I", "N^2 - 2/7*E", "I*E", "S + 5/2"]
        [integrals]
        "H~" = "(I - eps^2*E)/(S^2 + 1)"
        H = "I*N"
        D = "E/3"
    """,
    "nasty-words": """
        variables = ["lambda", "a_1", "a1", "_x", "gamma", "point"]
        [parameters]
        end = "2/3"
        [system]
        rhs = ["a_1*a1", "end*_x^2 - lambda", "gamma*point", "a1 - 1", "1/2*point^2", "-_x*a_1"]
        [density]
        phi = "(gamma + _x*point)*eps^2 + 1"
    """,
    "nasty-letters": """
        variables = ["C", "D", "O", "Q"]
        [hamiltonian]
        H = "C^3/3 + C*D*Q - O^2*Q + Q^3"
        J = "standard"
    """,
    "constant": 'variables = ["x", "y"]\n[system]\nrhs = ["1", "1/2"]\n[integrals]\nI = "y/2"\nK = "1/2"\n',
}
# Of every kind: with parameters or without, integrals, densities, Hamiltonians, from one variable to four.
CATALOGUE = ("riccati", "weierstrass", "euler_top", "lorenz", "henon_heiles")


@cache
def systems() -> dict[str, km.SystemFile]:
    """Systems of the catalogue, a member of the family, and names that are hard to write."""
    member = km.SystemFile.from_member(km.random_member_with_eigenvalues([1, -2], seed=7))
    nasty = {name: km.parse_system(text, name) for name, text in NASTY.items()}
    return {name: km.load(name) for name in CATALOGUE} | {"member": member} | nasty


@dataclass(frozen=True)
class Question:
    """A function of the converted file, an exact point and eps, and the values it has to give."""

    function: str
    point: tuple[fmpq, ...]
    eps: fmpq
    expected: list[fmpq]


def converted(language: str, file: km.SystemFile, **more: Any) -> tuple[str, list[Question]]:
    """A file with everything in it, and what to ask it."""
    parts, requested = questions(file)
    return convert(file, language, parts, **more), requested


def questions(file: km.SystemFile) -> tuple[list[str], list[Question]]:
    """The parts of a converted form that holds everything, and what to ask it."""
    draw = random.Random(5)
    requested: list[Question] = []
    x, eps = None, fmpq(1, draw.randint(5, 9))
    kahan = km.KahanMap(file.system, eps)
    while x is None or kahan.determinant(x) == 0 or kahan.inverse.determinant(x) == 0:
        x = tuple(fmpq(draw.randint(-9, 9), draw.randint(1, 4)) for _ in file.variables)

    def ask(function: str, values: Any) -> None:
        requested.append(Question(function, x, eps, [fmpq(value) for value in values]))

    ask("kahan_map", kahan.step(x))
    ask("kahan_inverse", kahan.inverse_step(x))
    ask("kahan_jacobian", [entry for row in kahan.jacobian(x).tolist() for entry in row])
    parts = ["system", "map", "inverse", "jacobian"]
    for name, function in file.integrals.items():
        # "H~" is written as H: the next one of that name gets a number.
        shown = {"H~": "H", "H": "H_2"}.get(name, name) if "H~" in file.integrals else name
        ask(f"integral_{shown}", [function.value(QQ, (*x, eps))])
    if file.member is not None:
        for k in range(file.member.m):
            ask(f"integral_H{k}", [CommutantIntegral(file.hamiltonian, file.member.A, k).value(QQ, eps, x)])
    elif file.hamiltonian is not None:
        ask("modified_hamiltonian", [ModifiedHamiltonian(file.hamiltonian).value(QQ, eps, x)])
    if file.integrals or file.hamiltonian:
        parts.append("integrals")
    if file.density is not None:
        ask("density", [file.density.value(QQ, (*x, eps))])
    elif file.hamiltonian is not None:
        ask("density", [kahan.determinant(x)])
    if file.density or file.hamiltonian:
        parts.append("density")
    if file.system.dim <= 3:
        ask("kahan_map_formula", kahan.step(x))
        parts.append("map-formulas")
    return parts, requested


_DRIVER = """
import contextlib, io, json, sys
printed = {}
for name, script in json.load(sys.stdin).items():
    with contextlib.redirect_stdout(io.StringIO()) as held:
        exec(compile(script, name, "exec"), {})
    printed[name] = held.getvalue().splitlines()
print(json.dumps(printed))
"""


def run_python(scripts: dict[str, str]) -> dict[str, list[str]]:
    """The lines that scripts print, each in a namespace of its own, all in one process."""
    command = [sys.executable, "-c", _DRIVER]
    done = subprocess.run(command, input=json.dumps(scripts), capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))
