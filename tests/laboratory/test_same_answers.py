"""The same question has the same answer: other hash seeds, one or two processes, and a busy machine change no byte."""

import os
import subprocess
import sys

import pytest

SYSTEMS = ("harmonic", "weierstrass", "lotka_volterra", "euler_top", "nahm_tetrahedral", "riccati")
LARGE = (
    "paper_m2",
    "volterra_periodic_5",
    "three_wave",
    "paper_m3_irreducible",
    "kirchhoff_generic",
    "nahm_icosahedral",
)
PROGRAM = """
import json, sys
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory import analysis

analysis.processors = lambda: 2
processes, *names = sys.argv[1:]
for name in names:
    found = analysis.analyze(load(name), processes=int(processes))
    print(json.dumps(found.to_json()))
    print(found.work)
"""


def answers(names, hash_seed, processes):
    """What a fresh interpreter prints: JSON, with the units, and the line on the work."""
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    line = [sys.executable, "-c", PROGRAM, str(processes), *names]
    return subprocess.run(line, env=environment, capture_output=True, check=True).stdout.splitlines()


def require_same(names):
    first, second = answers(names, 0, 1), answers(tuple(reversed(names)), 1, 2)
    assert len(first) == 2 * len(names)
    # In the other order as well: what an analysis leaves in the caches of modules is not seen by the next one.
    pairs = [(first[k], second[len(first) - 2 - k]) for k in range(0, len(first), 2)]
    assert [name for name, (a, b) in zip(names, pairs, strict=True) if a != b] == []
    lines = [(first[k], second[len(first) - k]) for k in range(1, len(first), 2)]
    assert all(a == b and a.startswith(b"effort 1, ") for a, b in lines)


def test_the_bytes_are_the_same_with_another_hash_seed_and_two_processes():
    require_same(SYSTEMS)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_so_are_those_of_larger_systems():
    require_same(LARGE)
