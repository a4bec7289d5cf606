"""The systems of the catalogue analysed blind: what comes out is what their files say, and the literature before them.

Degrees, growth, dynamical degree, the number of integrals, the verdict, the density and the dimensions of
Hirota-Kimura bases are facts of the files, which `analyze` does not read (test_analysis.py).
"""

from functools import cache

import pytest
from analysis_helpers import Answer, differences, residues_of
from search_helpers import ranks

from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.structured_facts import relations
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.laboratory import Laboratory

FACTS = [name for name in names() if set(load(name).catalog) & {"degrees", "growth", "verdict", "codimension"}]
# All others take less than a second.
SLOW = ("henon_heiles", "zhukovski_volterra_2", "volterra_periodic_5", "kirchhoff_generic", "clebsch_first_flow")
SLOW = (*SLOW, "kirchhoff_case", "lagrange_top", "so4_euler_manakov", "paper_m3", "paper_m3_irreducible", "three_wave")
SLOW = (*SLOW, "lorenz", "zander_120", "paper_m2", "volterra_periodic_4")


@cache
def blind(name):
    """The analysis of the right-hand sides, without anything else that the file says."""
    return analyze(SystemFile.from_system(load(name).system, "somebody"))


def marked(result):
    return [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in result]


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


@pytest.mark.parametrize("name", marked(FACTS))
def test_the_facts_of_the_file_are_found_blind(name):
    result, answer = blind(name), facts_of(name)
    assert differences(result, answer) == set()
    nullities = result.integrals.profile.nullities
    for known in relations(load(name).catalog, result.file.variables):
        degree = _degree(known)
        if degree is not None and degree <= len(nullities):
            assert nullities[degree - 1] == known.dimension


def _degree(known):
    prefix = "degree <= "
    return int(known.text.removeprefix(prefix)) if known.text.startswith(prefix) else None
