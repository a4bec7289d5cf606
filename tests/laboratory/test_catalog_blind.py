"""The systems of the catalogue analysed blind: what comes out is what their files say, and the literature before them.

Degrees, growth, dynamical degree, the number of integrals, the verdict, the density and the dimensions of
Hirota-Kimura bases are facts of the files, which `analyze` does not read (test_analysis.py).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from analysis_helpers import Answer, differences, residues_of
from search_helpers import ranks

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.structured_facts import relations
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.laboratory import Laboratory
from kahanmaps.laboratory.preserve.hirota_kimura import hirota_kimura_basis, relations_on_orbit

FACTS = [name for name in names() if set(load(name).catalog) & {"degrees", "growth", "verdict", "codimension"}]
# Seconds that are enough, where the default would be long. All below takes less than a second.
SECONDS = {"henon_heiles": 8, "zhukovski_volterra_2": 5, "volterra_periodic_5": 12, "kirchhoff_generic": 16}
SECONDS |= dict.fromkeys(("clebsch_first_flow", "kirchhoff_case", "lagrange_top", "so4_euler_manakov"), 16)
SECONDS |= {"paper_m3": 30, "paper_m3_irreducible": 45, "three_wave": 16}
SLOW = (*SECONDS, "lorenz", "zander_120", "paper_m2", "volterra_periodic_4")


def blind(name):
    """The analysis of the right-hand sides, without anything else that the file says."""
    return analyze(SystemFile.from_system(load(name).system, "somebody"), seconds=SECONDS.get(name))


def marked(found):
    return [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in found]


def facts_of(name):
    file = load(name)
    facts = file.catalog
    claimed = tuple(function for function in file.integrals.values() if set(function.names) == {*file.variables, "eps"})
    count = facts.get("codimension")
    if count is None:
        count = ranks([], claimed, Laboratory(file).maps[0])[1]
    return Answer(
        count,
        facts.get("growth"),
        tuple(facts.get("degrees", ())),
        facts.get("dynamical_degree"),
        claimed,
        None if file.density is None else residues_of(file.density),
        False,
        facts.get("verdict"),
    )


def test_there_is_something_to_compare():
    assert len(FACTS) >= 25
    answers = [facts_of(name) for name in FACTS]
    assert all(answer.growth and answer.degrees and answer.verdict for answer in answers)
    assert sum(answer.density is not None for answer in answers) >= 15
    assert sum(bool(answer.formulas) for answer in answers) >= 15
    assert sum(answer.dynamical_degree is not None for answer in answers) >= 5


@pytest.mark.parametrize("name", marked(FACTS))
def test_the_facts_of_the_file_are_found_blind(name):
    found, answer = blind(name), facts_of(name)
    assert differences(found, answer) == set()
    nullities = found.integrals.profile.nullities
    for known in relations(load(name).catalog, found.file.variables):
        degree = _degree(known)
        if degree is not None and degree <= len(nullities):
            assert nullities[degree - 1] == known.dimension


@cache
def _maps(name):
    return Laboratory(load(name), (), None, 7).maps


SETS = [(name, k) for name in FACTS for k in range(len(load(name).catalog.get("relations", [])))]


@pytest.mark.parametrize(
    ("name", "k"),
    [pytest.param(*each, marks=pytest.mark.slow) if load(each[0]).system.dim > 4 else each for each in SETS],
)
def test_hirota_kimura_bases_have_their_dimensions(name, k):
    file = load(name)
    known = relations(file.catalog, file.variables)[k]
    degree = _degree(known)
    if degree is not None:
        for map_ in _maps(name):
            assert len(relations_on_orbit(map_, degree).vectors) == known.dimension
        return
    found = hirota_kimura_basis(_maps(name), known.functions, [str(one) for one in known.functions])
    assert (found.dimension, found.agree) == (known.dimension, True)


@pytest.mark.parametrize("name", ["euler_top", "lotka_volterra"])
def test_wrong_facts_are_seen_to_be_wrong(name):
    found, answer = blind(name), facts_of(name)
    degrees = list(answer.degrees)
    degrees[3] -= 1
    assert differences(found, replace(answer, degrees=tuple(degrees))) == {"degrees"}
    assert differences(found, replace(answer, integrals=answer.integrals + 1)) == {"count"}
    other = {"integrable": "not integrable", "not integrable": "integrable"}[answer.verdict]
    assert differences(found, replace(answer, verdict=other)) == {"verdict"}
    assert differences(found, replace(answer, growth="linear")) == {"growth"}
    assert differences(found, replace(answer, dynamical_degree="x - 7")) == {"dynamical degree"}
    foreign = residues_of(facts_of("nahm_tetrahedral" if found.dim == 2 else "dressing_chain_3").formulas[0])
    assert differences(found, replace(answer, density=foreign)) == {"density"}


def _degree(known):
    prefix = "degree <= "
    return int(known.text.removeprefix(prefix)) if known.text.startswith(prefix) else None
