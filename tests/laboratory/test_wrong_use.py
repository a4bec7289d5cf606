"""What no search of the laboratory can be asked: each names what it found, and runs nothing."""

import pytest
from helpers import together

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.preserve.poisson.poisson_tensors import find_poisson
from kahanmaps.laboratory.singular.singularities import singularities
from kahanmaps.laboratory.symmetry.commuting import commuting_systems
from kahanmaps.laboratory.symmetry.symmetries import linear_symmetries

FILE = load("euler_top")
TWICE = {"eps": 1, "symbols": ["eps"]}
WRONG = [
    (analyze, FILE, {"eps": 0}, "found eps = 0"),
    (analyze, FILE, {"symbols": ["zz"]}, "found the symbol 'zz'"),
    (analyze, FILE, TWICE, "both as a number and as a symbol"),
    (analyze, FILE, {"effort": 1.5}, "found the effort 1.5, expected an integer"),
    (analyze, FILE, {"effort": 41}, "found the effort 41"),
    (find_integrals, FILE, {"eps": 0}, "found eps = 0"),
    (find_integrals, FILE, {"eps": 0.5}, "0.5"),
    (find_integrals, FILE, TWICE, "found eps both as a number and as a symbol"),
    (find_integrals, FILE, {"symbols": ["a9"]}, "found the symbol 'a9'"),
    (find_integrals, FILE, {"effort": 0.5}, "found the effort 0.5, expected an integer from -20 to 40"),
    (find_integrals, FILE, {"max_degree": 0}, "found the largest degree 0"),
    (find_densities, FILE, {"eps": 0}, "found eps = 0"),
    (find_densities, FILE, TWICE, "found eps both"),
    (find_densities, FILE, {"effort": 41}, "found the effort 41"),
    (find_densities, FILE, {"max_degree": -1}, "found the largest degree -1"),
    (find_poisson, FILE, {"degree": -1}, "found the degree -1"),
    (find_poisson, FILE, {"effort": -21}, "found the effort -21"),
    (find_poisson, FILE, {"eps": 0}, "found eps = 0"),
    (degree_growth, FILE.system, {"eps": 0}, "found eps = 0"),
    (degree_growth, FILE.system, {"effort": float("nan")}, "found the effort nan"),
    (degree_growth, FILE.system, {"max_terms": -1}, "found -1 terms"),
    (degree_growth, FILE.system, {"max_degree": 0}, "the largest degree 0"),
    (degree_growth, FILE.system, {"steps": 0}, "found 0 steps"),
    (singularities, FILE.system, {"eps": 1, "steps": 0}, "found 0 steps, expected 1 to 10000"),
    (singularities, FILE.system, {"eps": 1, "steps": 10_001}, "found 10001 steps, expected 1 to 10000"),
    (commuting_systems, FILE.system, {"shape": "cubic"}, "expected"),
    (commuting_systems, FILE.system, {"effort": True}, "found the effort True"),
    (commuting_systems, FILE.system, {"error_bits": 0}, "expected"),
    (linear_symmetries, FILE.system, {"effort": float("nan")}, "found the effort nan"),
]


@together("search, given, options, words", WRONG)
def test_what_cannot_be_searched_is_refused(search, given, options, words):
    with pytest.raises(InputError, match=words):
        search(given, **options)
