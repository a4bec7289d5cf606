"""examples/dysts and mass_action: systems and networks are read as text; their table can be checked."""

import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

import kahanmaps as km

EXAMPLES = Path(__file__).parents[2] / "examples"
FOLDER = EXAMPLES / "dysts"
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


NETWORKS = {
    "cubic": "2A + B ->(k) 3A",
    "dimer": "# a title\nr1: 2A (off)<->(on*cell) B  # 2A\n-> A\n\nr3: B ->(c*B + off) EmptySet",
    "enzyme": "S ->(Vm/(Km + S)) P",
    "negative": "A + B ->(k*(T - A)) B",
    "other_names": "2Y ->(w) Y\nEmptySet ->(s) X\nX + X ->(p) Y\nY ->(q) 2X\nY ->(v)",
    "other_places": "2Y ->(w) X\nEmptySet ->(s) X\nX + X ->(p) Y\nY ->(q) 2X\nY ->(v)",
    "power": "S ->(k*P**n) P",
}
KINDS = """cubic degree 3
dimer quadratic
enzyme other rates
negative other rates
other_names repeated as dimer
other_places quadratic
power other rates
1 degree 3, 3 other rates, 2 quadratic, 1 repeated of 7
"""


def read(tmp_path, networks):
    """What the script says of the networks; its files are in `systems`."""
    (tmp_path / "reactions" / "papers").mkdir(parents=True)
    for name, text in networks.items():
        (tmp_path / "reactions" / "papers" / name).write_text(text)
    script, folders = EXAMPLES / "mass_action" / "read_networks.py", (tmp_path / "reactions", tmp_path / "systems")
    return subprocess.run([sys.executable, script, *folders], capture_output=True, text=True, check=False)


def test_mass_action_is_read_and_other_rates_are_refused(tmp_path):
    done = read(tmp_path, NETWORKS)
    lines = [line.split("\t") for line in done.stdout.splitlines()]
    kinds = [" ".join(line[:2] + line[2:] * line[1:2].count("repeated")) for line in lines]
    assert "\n".join(kinds) + "\n" == KINDS
    assert sorted(path.name for path in (tmp_path / "systems").iterdir()) == ["dimer.toml", "other_places.toml"]
    dimer = km.load(tmp_path / "systems" / "dimer.toml")
    assert list(map(str, dimer.rhs)) == ["-12*A^2 + 10*B + 7", "6*A^2 - 11*B^2 - 10*B"]


def test_a_line_that_is_no_reaction_is_an_error(tmp_path):
    done = read(tmp_path, {"wrong": "A + B = C"})
    assert done.returncode == 1
    assert "expected a reaction, found A + B = C" in done.stderr
