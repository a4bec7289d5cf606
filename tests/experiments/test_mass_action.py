"""examples/mass_action: networks are read as text."""

import subprocess
import sys
from pathlib import Path

import kahanmaps as km

FOLDER = Path(__file__).parents[2] / "examples" / "mass_action"
NETWORKS = {
    "cubic": "2A + B ->(k) 3A",
    "dimer": "# a title\nr1: 2A (off)<->(on*cell) B  # 2A\n-> A\n\nr3: B ->(c*B + off) EmptySet",
    "enzyme": "S ->(Vm/(Km + S)) P",
    "negative": "A + B ->(k*(T - A)) B",
    "other_names": "2Y ->(w) Y\nEmptySet ->(s) X\nX + X ->(p) Y\nY ->(q) 2X\nY ->(v)",
    "other_places": "2Y ->(w) X\nEmptySet ->(s) X\nX + X ->(p) Y\nY ->(q) 2X\nY ->(v)",
    "power": "S ->(k*P**n) P",
}
READ = """cubic degree 3
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
    command = [sys.executable, FOLDER / "read_networks.py", tmp_path / "reactions", tmp_path / "systems"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_mass_action_is_read_and_other_rates_are_refused(tmp_path):
    done = read(tmp_path, NETWORKS)
    lines = [line.split("\t") for line in done.stdout.splitlines()]
    kinds = [" ".join(line[:2] + line[2:] * line[1:2].count("repeated")) for line in lines]
    assert "\n".join(kinds) + "\n" == READ
    assert sorted(path.name for path in (tmp_path / "systems").iterdir()) == ["dimer.toml", "other_places.toml"]
    dimer = km.load(tmp_path / "systems" / "dimer.toml")
    assert list(map(str, dimer.rhs)) == ["-12*A^2 + 10*B + 7", "6*A^2 - 11*B^2 - 10*B"]


def test_a_line_that_is_no_reaction_is_an_error(tmp_path):
    done = read(tmp_path, {"wrong": "A + B = C"})
    assert done.returncode == 1
    assert "expected a reaction, found A + B = C" in done.stderr
