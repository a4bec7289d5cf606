"""SageMath, Macaulay2 and PARI on the Kahan maps of the catalogue: their answers and times beside those of kahanmaps.

    python benchmarks/peers.py [--limit SECONDS] [--only NAME ...] [--programs NAME ...] [--venv FOLDER]

Installs pinned wheels in a temporary folder (0.7 GB; none is used by kahanmaps; --venv keeps the folder for the next
run) and prints the tables of docs/comparison.md. A cell has the time of the program relative to that of kahanmaps,
where both answers are equal; else what it answered. Every question may take --limit seconds of processor time. All run
one after the other, and the mean processor time of several runs counts, without start-up.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction
from itertools import permutations
from math import gcd, lcm
from pathlib import Path
from resource import RLIMIT_CPU, setrlimit
from typing import Any

from flint import fmpq, fmpq_mpoly, fmpq_mpoly_ctx

import kahanmaps as km

PINS = ["passagemath-schemes==10.8.13", "passagemath-macaulay2==10.8.13", "cypari==2.5.7"]
INPUTS = ["nahm_tetrahedral", "weierstrass", "zander_111", "zander_120", "lotka_volterra", "euler_top", "lorenz"]
INPUTS += ["zhukovski_volterra_2", "volterra_periodic_4", "henon_heiles"]
EPS = Fraction(1, 10)
STEPS = 8
TERMS = {2: 6, 3: 3, 4: 3}
START_UP = 5  # seconds of loading, which do not count
MOST_RUNS = 200
HERE = Path(__file__).parent
LAST = "w0"  # the homogeneous coordinate


def determinant(matrix: list[list[fmpq_mpoly]]) -> fmpq_mpoly:
    """By its definition; the matrices have at most four rows."""
    total = matrix[0][0] * 0
    for order in permutations(range(len(matrix))):
        sign = (-1) ** sum(order[i] > order[j] for j in range(len(order)) for i in range(j))
        term = matrix[0][0] * 0 + sign
        for i, j in enumerate(order):
            term *= matrix[i][j]
        total += term
    return total


def forms(system: km.QuadraticSystem) -> list[fmpq_mpoly]:
    """The map in homogeneous coordinates, with integer coefficients and without a common factor: Cramer's rule."""
    dim = system.dim
    ring = fmpq_mpoly_ctx.get([*system.variables, LAST], "degrevlex")
    *x, w = ring.gens()
    eps = fmpq(EPS.numerator, EPS.denominator)
    f, slope = [], []
    for part, line, constant in zip(system.Q, system.B.table(), system.c, strict=True):
        f.append(
            sum((part[i, j] * x[i] * x[j] for i in range(dim) for j in range(dim)), constant * w * w)
            + sum((line[i] * x[i] * w for i in range(dim)), w * 0)
        )
        slope.append([f[-1].derivative(i) for i in range(dim)])
    matrix = [[(w if i == j else w * 0) - eps * slope[i][j] for j in range(dim)] for i in range(dim)]
    det = determinant(matrix)
    results = []
    for k in range(dim):
        replaced = [[2 * eps * f[i] if j == k else matrix[i][j] for j in range(dim)] for i in range(dim)]
        results.append(x[k] * det + determinant(replaced))
    results.append(w * det)
    common = results[0]
    for form in results[1:]:
        common = common.gcd(form)
    results = [form / common for form in results]
    coefficients = [Fraction(int(c.p), int(c.q)) for form in results for c in form.coeffs()]
    scale = Fraction(lcm(*(c.denominator for c in coefficients)), 1)
    scale /= gcd(*(int(c * scale) for c in coefficients))
    return [form * fmpq(scale.numerator, scale.denominator) for form in results]


def described(name: str, limit: int) -> dict[str, Any]:
    """An input as the other programs get it."""
    file = km.load(name)
    integrals = [str(integral) for integral in file.integrals.values()]
    return {
        "name": name,
        "affine": list(file.variables),
        "variables": [*file.variables, LAST],
        "forms": [str(form) for form in forms(file.system)],
        "start": [f"1/{k + 2}" for k in range(file.dim)],
        "steps": STEPS,
        "terms": TERMS[file.dim],
        "limit": limit,
        "pari": joined(km.convert(file, "pari", ["map", "map-formulas"])),
        "integrals": integrals,
    }


def joined(code: str) -> str:
    """GP code without comments, one definition in braces a line."""
    lines = [line for line in code.splitlines() if not line.startswith("\\\\")]
    blocks = re.findall(r"\{(.*?)\n\}", "\n".join(lines), re.DOTALL)
    return "\n".join(" ".join(block.split()) for block in blocks)


def timed(question: Callable[[], Any]) -> tuple[Any, float]:
    """The answer and the mean processor time of runs that take a third of a second together."""
    started, count = time.process_time(), 0
    while True:
        answer, count = question(), count + 1
        seconds = time.process_time() - started
        if seconds > 0.3 or count == MOST_RUNS:
            return answer, seconds / count


def ours(name: str) -> dict[str, tuple[Any, float]]:
    """The same questions to kahanmaps."""
    file, entry = km.load(name), described(name, 0)
    eps, terms = str(EPS), TERMS[file.dim]

    def fixed() -> list[list[str]]:
        found = km.fixed_points(file).fixed_points
        return [list(map(str, part.coordinates)) for part in found if part.dimension == 0 and not part.equations]

    def orbit() -> list[list[str]]:
        return [[str(number) for number in point.x] for point in km.orbit(file, entry["start"], eps, STEPS)]

    def degrees() -> list[int]:
        return list(km.degree_growth(file, eps, max_terms=terms).degrees[1:])

    def growth() -> str:
        rate = km.degree_growth(file, eps).dynamical_degree
        return "unknown" if rate is None else f"{float(rate):.4g}"

    questions: dict[str, Callable[[], Any]] = {"degrees": degrees, "dynamical degree": growth, "orbit": orbit}
    questions["fixed points"] = fixed
    if entry["integrals"]:
        questions["integrals"] = lambda: "1" if km.check_integrals(file).verdict.value == "proved" else "0"
    return {key: timed(question) for key, question in questions.items()}


def install(folder: Path) -> dict[str, Path]:
    """An environment with the pinned packages; returns its programs."""
    python = folder / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        quiet = ["--quiet", "--disable-pip-version-check"]
        subprocess.run([python, "-m", "pip", "install", *quiet, *PINS], check=True, stderr=subprocess.DEVNULL)
    return {"python": python, "M2": next(folder.glob("lib/python*/site-packages/sage_wheels/bin/M2"))}


MACAULAY2 = """needsPackage "Cremona";
R = QQ[{variables}];
F = matrix {{{{{forms}}}}};
G = matrix {{{{{inverse}}}}};
degreeOf = h -> first first degrees ideal matrix h
composed = n -> (
    f := rationalMap F; h := f; d := {{degreeOf h}};
    for k from 2 to n do (h = h*f; d = append(d, degreeOf h));
    d)
t = cpuTime(); n = 0;
while (v = {question}; n = n + 1; cpuTime() - t < 0.3 and n < 200) do ();
<< toString v << "|" << (cpuTime() - t)/n << endl;
exit 0
"""
MACAULAY2_QUESTIONS = {
    "degrees": "composed {terms}",
    "inverse": "inverse rationalMap F == rationalMap G",
    "birational": "isBirational rationalMap F",
}


def script_for(question: str, entry: dict[str, Any]) -> str:
    """The script of Macaulay2 with its package Cremona."""
    return MACAULAY2.format(
        variables=", ".join(entry["variables"]),
        forms=", ".join(entry["forms"]),
        inverse=", ".join(map(str, forms(km.load(entry["name"]).system.scaled(-1)))),
        question=MACAULAY2_QUESTIONS[question].format(terms=entry["terms"]),
    )


def asked(programs: dict[str, Path], program: str, question: str, entry: dict[str, Any]) -> dict[str, Any]:
    """The answer of a program, in a process of its own. Its start takes seconds, which are not counted."""
    with tempfile.NamedTemporaryFile("w", suffix=".m2") as file:
        if program == "Macaulay2":
            file.write(script_for(question, entry))
            file.flush()
            command = [str(programs["M2"]), "--script", file.name]
        else:
            command = [
                str(programs["python"]),
                str(HERE / ("peer_sage.py" if program == "SageMath" else "peer_pari.py")),
                question,
            ]
        done = subprocess.run(
            command,
            input=json.dumps(entry),
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=lambda: setrlimit(RLIMIT_CPU, (entry["limit"] + START_UP, entry["limit"] + START_UP)),
        )
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return {"error": "time"}
    if done.returncode:
        return {"error": done.stderr.strip().splitlines()[-1]}
    if program == "Macaulay2":
        text, _, seconds = done.stdout.strip().rpartition("|")
        return {"text": text, "seconds": float(seconds)}
    return json.loads(done.stdout.splitlines()[-1])


def affine(points: list[list[str]]) -> list[list[Fraction]]:
    """Points (x : w) as x/w, without those at infinity."""
    numbers = [[Fraction(entry) for entry in point] for point in points]
    return [[entry / point[-1] for entry in point[:-1]] for point in numbers if point[-1] != 0]


def compared(program: str, question: str, text: Any, mine: Any) -> str:
    """What is wrong with an answer, or nothing."""
    if question in ("birational", "inverse", "integrals"):
        return "" if text in ("true", "1") else f"**{text}**"
    if question == "degrees":
        found = [int(number) for number in re.findall(r"\d+", str(text))]
        return "" if found == mine else f"**{', '.join(map(str, found))}**"
    if question == "dynamical degree":
        return f"{float(text):.3f}, exactly {mine}"
    if program == "PARI":
        points = [[Fraction(entry) for entry in point.split(",")] for point in re.findall(r"\[([^\[\]]*)\]~", text)]
    else:
        points = affine(text)
    expected = [[Fraction(entry) for entry in point] for point in mine]
    same = points == expected if question == "orbit" else sorted(points) == sorted(expected)
    return "" if same else f"**another list of {len(points)} point{'s' * (len(points) != 1)}**"


def cell(program: str, question: str, record: dict[str, Any], own: tuple[Any, float] | None) -> str:
    """An entry of the table."""
    if "error" in record:
        return "no answer" if record["error"] == "time" else f"refused: {record['error'].split(':')[0]}"
    wrong = compared(program, question, record["text"], own[0] if own else None)
    ratio = f"{record['seconds'] / own[1]:.2g}" if own else "equal"
    return f"{wrong} ({ratio})" if question == "dynamical degree" else wrong or ratio


QUESTIONS = {
    "SageMath": ["degrees", "dynamical degree", "orbit", "fixed points", "canonical height", "preperiodic"],
    "Macaulay2": ["degrees", "inverse", "birational"],
    "PARI": ["orbit", "integrals"],
}


def main() -> None:
    """Ask all programs, and print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--limit", type=int, default=10)
    parser.add_argument("--only", nargs="*", default=INPUTS)
    parser.add_argument("--programs", nargs="*", choices=list(QUESTIONS), default=list(QUESTIONS))
    parser.add_argument("--venv", type=Path)
    options = parser.parse_args()
    sys.set_int_max_str_digits(0)  # coordinates have thousands of digits
    with tempfile.TemporaryDirectory() as folder:
        programs = install(options.venv or Path(folder))
        for program in options.programs:
            questions = QUESTIONS[program]
            print(f"| {program} | {' | '.join(questions)} |")
            print("|---" * (len(questions) + 1) + "|")
            for name in options.only:
                entry, mine = described(name, options.limit), ours(name)
                print(f"| `{name}`", end="", flush=True)
                for question in questions:
                    text = ""
                    if question != "integrals" or entry["integrals"]:
                        text = cell(program, question, asked(programs, program, question, entry), mine.get(question))
                    print(f" | {text}", end="", flush=True)
                print(" |", flush=True)
            print()


if __name__ == "__main__":
    main()
