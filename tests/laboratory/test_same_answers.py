"""The same question has the same answer, and takes the same counted work: other hash seeds, one or two processes, and
what was asked before change no byte. An analysis alone finds no less than `analyze`, both with their defaults."""

import os
import subprocess
import sys

import pytest
from helpers import quick
from search_helpers import analysis_of, integrals_of

from kahanmaps import degree_growth, find_commuting, find_densities, find_poisson, height_survey, load, singularities
from kahanmaps.algebra.work import Budget, count_work, counted
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

SYSTEMS = ("riccati",)
LARGE = ("lotka_volterra", "euler_top", "paper_m2", "volterra_periodic_5", "three_wave", "paper_m3_irreducible")
LARGE += ("kirchhoff_generic", "nahm_icosahedral", "harmonic", "nahm_tetrahedral")
LARGE += ("scan", "integrals", "densities", "limits", "weierstrass", "singularities", "heights")
LARGE += ("integrals of a flow", "integrals with symbols")
# Analyses, and searches of their own that are cut by their budgets, or begin at other points than an analysis does.
PROGRAM = """
import json, sys
import kahanmaps as km
from kahanmaps.algebra.printing import plain
from kahanmaps.algebra.work import Budget, counted
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory import analysis
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.growth.height_survey import height_survey
from kahanmaps.laboratory.preserve.limit.limits import flow_and_map
from kahanmaps.laboratory.scan.scan import scan
from kahanmaps.laboratory.singular.singularities import singularities

analysis.processors = lambda: 2
processes, *names = sys.argv[1:]
lines = km.parse_system('''variables = ["x", "y"]
parameters.g = 1
[system]
rhs = ["x*(x + 2*y)", "-y*((g + 1)*x + g*y)"]''')
SEARCHES = {
    "degrees": lambda: degree_growth(load("henon_heiles").map, effort=Budget(50_000)),
    "singularities": lambda: singularities(load("zander_120").map, "1/7", effort=Budget(20_000)),
    "heights": lambda: height_survey(load("zander_120").map, steps=12, effort=Budget(10_000)),
    "integrals": lambda: km.find_integrals("volterra_periodic_4"),
    "integrals of a flow": lambda: km.find_integrals("weierstrass", flow=True),
    "integrals of a map": lambda: km.find_integrals("lyness", effort=-8),
    "integrals with symbols": lambda: km.find_integrals("euler_top", symbols=["a1"], effort=-9),
    "densities": lambda: km.find_densities("somos_4"),
    "limits": lambda: flow_and_map(km.find_integrals("lotka_volterra")),
    "scan": lambda: scan(lines, ["g"], terms=3, primes=[11, 13, 17], jobs=int(processes)),
    "scan in a hurry": lambda: scan(lines, ["g"], terms=4, primes=[31, 37, 41], jobs=int(processes), effort=-13),
}
for name in names:
    before = counted()
    if name in SEARCHES:
        found = SEARCHES[name]()
        print(json.dumps(plain(found.to_json())), counted() - before)
    else:
        found = analysis.analyze(load(name), processes=int(processes))
        print(json.dumps(found.to_json()), found.work)
"""
SEARCHES = ("degrees", "integrals of a map", "scan in a hurry")


def answers(names, hash_seed, processes):
    """What a fresh interpreter prints: for each name a line of JSON and the work that was counted."""
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    line = [sys.executable, "-c", PROGRAM, str(processes), *names]
    return subprocess.run(line, env=environment, capture_output=True, check=True).stdout.splitlines()


def require_same(names):
    # In the other order as well: what is left in the caches of modules is not seen by the next one.
    first, second = answers(names, 0, 1), answers(tuple(reversed(names)), 1, 2)
    assert len(first) == len(names)
    assert [name for name, a, b in zip(names, first, reversed(second), strict=True) if a != b] == []
    return first


def test_the_bytes_are_the_same_with_another_hash_seed_and_two_processes():
    first = require_same((*SYSTEMS, *SEARCHES))
    assert all(b"effort 1, " in line for line in first[: len(SYSTEMS)])
    assert b"budget" in b"".join(first[len(SYSTEMS) :])  # some were cut


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_so_are_those_of_larger_systems():
    require_same(LARGE)


def asked(map_):
    return degree_growth(map_), singularities(map_, "1/7"), height_survey(map_, steps=10)


@pytest.mark.parametrize("name", quick(["weierstrass", "lorenz", "paper_m2", "kirchhoff_case"], ["weierstrass"]))
def test_what_was_asked_before_does_not_change_the_work_that_is_counted(name):
    map_, marks, result = load(name).map, [counted()], []
    for _ in range(2):
        result.append([entry.to_json() for entry in asked(map_)])
        marks.append(counted())
    assert result[0] == result[1]
    assert marks[1] - marks[0] == marks[2] - marks[1] > 0


def test_work_that_is_not_the_search_is_not_charged_to_it():
    """Negative control: what is counted elsewhere before is not spent, but what is counted meanwhile is."""
    map_ = load("henon_heiles").map
    complete = degree_growth(map_, effort=Budget(100_000))
    count_work(1_000_000)
    assert degree_growth(map_, effort=Budget(100_000)).degrees == complete.degrees
    less = degree_growth(map_, effort=Budget(100_000), progress=lambda _: count_work(20_000))
    assert len(less.degrees) < len(complete.degrees)


ALONE = [
    ("integrals", integrals_of, lambda found: [one.text for one in found.integrals]),
    ("densities", lambda name: find_densities(load(name)), lambda found: [one.text for one in found.densities]),
    ("poisson", lambda name: find_poisson(load(name)), lambda found: [one.text for one in found.tensors]),
    ("symmetries", lambda name: linear_symmetries(load(name).system), lambda found: [t.text for t in found.generators]),
    ("commuting", lambda name: find_commuting(load(name).system), lambda found: [str(g.rhs) for g in found.solutions]),
    ("degrees", lambda name: degree_growth(load(name).map), lambda found: [found.growth_text]),
]


@pytest.mark.parametrize(
    "name", quick(["euler_top", "lotka_volterra", "volterra_periodic_3", "weierstrass"], ["euler_top"])
)
@pytest.mark.parametrize(("result", "search", "texts"), ALONE, ids=[row[0] for row in ALONE])
def test_what_analyze_finds_the_command_finds(name, result, search, texts):
    together = analysis_of(name)[result]
    alone = search(name)
    if together is None:  # tensors of the plane are densities
        assert (result, load(name).dim) == ("poisson", 2)
        return
    # No integral is known of the map of Lotka and Volterra.
    assert texts(together) or (result, name) == ("integrals", "lotka_volterra")
    assert set(texts(together)) <= set(texts(alone))


def test_the_three_tensors_of_the_euler_top_are_found_without_a_degree() -> None:
    search = find_poisson(load("euler_top"), integrals=())
    assert (search.degree, len(search.tensors)) == (3, 3)
    assert find_poisson(load("euler_top"), 2, integrals=()).tensors == ()
