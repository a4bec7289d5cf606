"""examples/dysts: systems are read from a wheel as text, analyzed, and written as a table that can be checked."""

import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

import kahanmaps as km

FOLDER = Path(__file__).parents[2] / "examples" / "dysts"
FLOWS = """
raise RuntimeError("this file is read, and not run")

class Prey(DynSys):
    @staticjit
    def _rhs(x, y, t, a, b):
        xdot = a * x * (1 - y)
        ydot = b * 0.30000000000000001 * y * (x - 1)
        return xdot, ydot

class SlowPrey(Prey):
    pass

class Named(DynSys):
    @staticmethod
    def _rhs(q, p, t, w):
        force = -w**2 * q + q**2
        return p, 2 * force

class Cubic(DynSys):
    def _rhs(x, y, t):
        return y, -x**3

class Forced(DynSys):
    def _rhs(x, y, t):
        return y, x * t

class Wave(DynSys):
    def _rhs(x, y, t):
        return y, np.sin(x)

class Array(DynSys):
    def rhs(self, X, t):
        return X
"""
PARAMETERS = {"Prey": '{"a": 1.1, "b": 2}', "SlowPrey": '{"a": 0.1, "b": 1e-2}', "Named": '{"w": 0.5}'}
READ = """Array not read
Cubic polynomial of higher degree
Forced not polynomial
Named quadratic
Prey quadratic
SlowPrey quadratic
Wave not polynomial"""


@pytest.fixture(scope="module")
def systems(tmp_path_factory):
    """The folder with the systems of a small wheel, and what the script said of them."""
    folder = tmp_path_factory.mktemp("dysts")
    names = [line.split()[0] for line in READ.splitlines()]
    facts = ", ".join(f'"{name}": {{"parameters": {PARAMETERS.get(name, "{}")}}}' for name in names)
    with ZipFile(folder / "small.whl", "w") as wheel:
        wheel.writestr("dysts/flows.py", FLOWS)
        wheel.writestr("dysts/data/chaotic_attractors.json", f"{{{facts}}}")
    command = [sys.executable, FOLDER / "read_dysts.py", folder / "small.whl", folder / "systems"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return folder, done.stdout


def test_right_hand_sides_are_read_as_text_with_exact_numbers(systems):
    folder, said = systems
    assert [" ".join(line.split("\t")[:2]) for line in said.splitlines()[:-1]] == READ.splitlines()
    assert said.splitlines()[-1] == "2 not polynomial, 1 not read, 1 polynomial of higher degree, 3 quadratic of 7"
    files = {path.stem: km.load(path) for path in (folder / "systems").glob("*.toml")}
    assert {name: list(map(str, file.rhs)) for name, file in files.items()} == {
        "Prey": [
            "-11/10*x*y + 11/10*x",
            "30000000000000001/50000000000000000*x*y - 30000000000000001/50000000000000000*y",
        ],
        "SlowPrey": [
            "-1/10*x*y + 1/10*x",
            "30000000000000001/10000000000000000000*x*y - 30000000000000001/10000000000000000000*y",
        ],
        "Named": ["p", "2*q^2 - 1/2*q"],
    }


def test_the_table_has_the_results_and_its_check_notices_other_degrees(systems):
    folder, _ = systems
    spec = (FOLDER / "study.toml").read_text().replace("systems/*", f"{folder}/systems/Named")
    assert [record.outcome for record in km.run(spec, folder / "study.db")] == ["ok"]
    script = [sys.executable, FOLDER / "table.py", folder / "study.db"]
    table = subprocess.run(script, capture_output=True, text=True, check=True).stdout.splitlines()
    assert table[2] == "| `Named` | 2 | integrable | 1 | 2, 3, 5, 7, 11, ... | 1 | `8*q*eps^2 - eps^2 - 2` | 2 |"
    assert table[4] == "1 systems: 1 integrable."
    check = [*script, "--check", folder / "systems"]
    done = subprocess.run(check, capture_output=True, text=True, check=True)
    assert done.stdout == "1 of 1 systems have the degrees of the definition, to the term 5\n"
    other = folder / "systems" / "Named.toml"
    other.write_text(other.read_text().replace("2*q^2", "2*q^2 + q*p"))
    done = subprocess.run(check, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "Named: [2, 3, 5, 7, 11] in the study, [2, 4, 8, 16, 32] by the definition" in done.stdout
