"""What a command loads: `--help` next to nothing, an exact orbit no numpy.

Loading is what a user waits for: numpy costs about as long as all of `--help` may take. Each command runs in
an interpreter of its own, since the one that runs the tests has loaded everything already.
"""

import json
import subprocess
import sys
from functools import cache

from kahanmaps.experiments.results.store import Store

HEAVY = {"numpy", "flint", "rich", "numba", "llvmlite", "matplotlib", "distributed"}

COMMAND = """
from kahanmaps_cli.main import main
status = main({arguments!r})
assert status == 0, f"exit status {{status}}"
"""


@cache
def modules_loaded_by(code: str) -> set[str]:
    """The modules in memory after `code` has run in a fresh interpreter."""
    report = "\nimport json, sys\nprint('\\n' + json.dumps(sorted(sys.modules)), file=sys.stderr)\n"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(json.loads(done.stderr.splitlines()[-1]))


def test_a_module_that_is_loaded_is_seen():
    assert "numpy" in modules_loaded_by("import numpy.linalg")


def test_help_loads_nothing_heavy():
    assert modules_loaded_by(COMMAND.format(arguments=["--help"])) & HEAVY == set()


SHORT = ["orbit", "lotka_volterra", "--start", "1,2", "--eps", "1/10", "--steps", "1"]


def test_an_exact_orbit_does_not_load_numpy():
    loaded = modules_loaded_by(COMMAND.format(arguments=SHORT))
    assert loaded & {"numpy", "numba", "matplotlib", "distributed"} == set()
    assert "flint" in loaded


def test_a_short_orbit_loads_no_normal_forms():
    heavy = {"kahanmaps.family.recognition", "kahanmaps.maps.normal_form.rational_iterate"}
    assert modules_loaded_by(COMMAND.format(arguments=SHORT)) & heavy == set()
    member = ["orbit", "paper_m2", "--start", "1,2,3,4", "--eps", "1/10", "--at", "100"]
    assert heavy <= modules_loaded_by(COMMAND.format(arguments=member))


def test_looking_at_a_database_of_results_loads_no_mathematics(tmp_path):
    Store.open(tmp_path / "results.db", create=True).close()
    arguments = ["batch", "status", "--db", str(tmp_path / "results.db")]
    assert modules_loaded_by(COMMAND.format(arguments=arguments)) & HEAVY == set()
