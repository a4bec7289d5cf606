"""The same question has the same answer, and takes the same counted work, in any process and on any processors."""

import os
import subprocess
import sys

import pytest
from helpers import quick

from kahanmaps.algebra.work import Budget, count, counted
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.singular.singularities import singularities

SCRIPT = """
import json, sys
from kahanmaps.algebra.work import Budget, counted
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import parse_system
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.scan.scan import scan
from kahanmaps.laboratory.singular.singularities import singularities

lines = parse_system('''variables = ["x", "y"]
parameters.g = 1
[system]
rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
for name in ("zander_120", "henon_heiles", "volterra_periodic_5"):
    map_ = load(name).map
    some = (
        degree_growth(map_),
        degree_growth(map_, effort=Budget(50_000)),
        singularities(map_, "1/7"),
        singularities(map_, "1/7", effort=Budget(20_000)),
        height_survey(map_, steps=12, effort=Budget(10_000)),
    )
    print(json.dumps([one.to_json() for one in some]), counted())
for effort in (1, -9):
    found = scan(lines, ["g"], terms=4, primes=[31, 37, 41], jobs=int(sys.argv[1]), effort=effort)
    print(json.dumps(found.to_json()), found.text, counted())
"""


def test_neither_the_seed_of_hashes_nor_the_number_of_threads_matters():
    def lines(hash_seed, jobs):
        command = [sys.executable, "-c", SCRIPT, str(jobs)]
        environment = os.environ | {"PYTHONHASHSEED": str(hash_seed)}
        return subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout.splitlines()

    first, second = lines(1, 1), lines(2, 2)
    assert first == second
    assert "budget" in "".join(first)  # some were cut


def asked(map_):
    return degree_growth(map_), singularities(map_, "1/7"), height_survey(map_, steps=10)


@pytest.mark.parametrize("name", quick(["weierstrass", "lorenz", "paper_m2", "kirchhoff_case"], ["lorenz"]))
def test_what_was_asked_before_does_not_change_the_work_that_is_counted(name):
    map_, marks, found = load(name).map, [counted()], []
    for _ in range(2):
        found.append([one.to_json() for one in asked(map_)])
        marks.append(counted())
    assert found[0] == found[1]
    assert marks[1] - marks[0] == marks[2] - marks[1] > 0


def test_work_that_is_not_the_search_is_not_charged_to_it():
    """Negative control: what is counted elsewhere before is not spent, but what is counted meanwhile is."""
    map_ = load("henon_heiles").map
    budget = Budget(100_000)
    whole = degree_growth(map_, effort=budget)
    count(1_000_000)
    assert degree_growth(map_, effort=Budget(100_000)).degrees == whole.degrees
    less = degree_growth(map_, effort=Budget(100_000), progress=lambda _: count(20_000))
    assert len(less.degrees) < len(whole.degrees)
