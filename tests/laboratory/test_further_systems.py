"""Systems of the catalogue and beyond, analysed blind and compared with answers that were found without this library.

Integrals and densities of further_systems.txt and degenerate_systems.txt are tried here on exact orbits first, by the
arithmetic of the tests; then `analyze` has to give what stands there.
"""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import islice
from types import SimpleNamespace

import pytest
from check_helpers import determinant, function_value, kahan_jacobian, kahan_step, modified_value, slope, unit
from helpers import fraction, together
from search_helpers import DEGENERATE, FURTHER, Answer, differences, file_of, ranks, residues_of, verdict_of

from kahanmaps import Laboratory, SystemFile, analyze, load, names, parse_rational_function
from kahanmaps.checks.settings import random_starts
from kahanmaps.documents.structured_facts import relations


def known_of(growth_and_degrees, *more):
    """What is known of a Kahan map, from the lines below its equations."""
    growth, degrees = growth_and_degrees.split(": ")
    more = {key: rest.split("; ") for key, _, rest in (line.partition(" ") for line in more)}
    assert set(more) <= {"integrals", "density", "at"}
    is_slow = growth in ("bounded", "linear", "quadratic")
    return SimpleNamespace(
        growth=growth if is_slow else "exponential",
        dynamical_degree="x - 1" if is_slow else growth,
        degrees=tuple(map(int, degrees.split(", "))),
        integrals=more.get("integrals", []),
        density=more.get("density", [None])[0],
        at=dict(entry.split(": ") for entry in more.get("at", [])),
    )


KNOWN = {name: known_of(*lines) for name, (_, *lines) in (FURTHER | DEGENERATE).items()}
MODIFIED, DETERMINANT = "modified Hamiltonian", "determinant"  # of theorems, for which no formula is written out

# Analysed in less than half a second.
FAST = ("suslov_pencil", "riccati_pair", "gauss_skew", "volterra_open_3")
FAST = (*FAST, "rabinovich_conservative", "zander_11m1_lines", "zander_112_affine")
BOUNDED = ("hamiltonian_6_generic",)  # has a test of its own
EPS = ("1/10", "-2/7")


@cache
def analysed(name):
    return analyze(file_of(name))


@cache
def function(name, text):
    file = file_of(name)
    return parse_rational_function(text, (*file.variables, "eps"), file.parameters)


def formulas(name):
    """The integrals of the answer that are written out, as functions of the variables and eps."""
    return tuple(function(name, text) for text in KNOWN[name].integrals if text != MODIFIED)


def answer_for(name):
    known = KNOWN[name]
    if known.density == DETERMINANT:
        value = lambda map_, x: int(map_.map.determinant(x))  # noqa: E731
    else:
        value = None if known.density is None else residues_of(function(name, known.density))
    return Answer(
        len(known.integrals),
        known.growth,
        known.degrees,
        known.dynamical_degree,
        formulas(name),
        value,
        known.density is None,
        verdict_of(known.growth),
    )


def value_at(text, name, x, eps):
    """The value of an integral or a density of the answers at a rational point, None at a pole."""
    if text == MODIFIED:
        return modified_value(file_of(name).hamiltonian, eps, x)
    if text == DETERMINANT:
        return determinant(unit(len(x)) - eps * slope(file_of(name).system, x))
    return function_value(function(name, text), x, eps)


def orbits(file, starts=4, steps=2):
    """(eps, points of an orbit), exact, with orbits that end at a pole left out."""
    for text in EPS:
        eps, result = Fraction(text), 0
        for start in islice(random_starts(file.system.dim, 8), 10 * starts):
            points = [tuple(fraction(entry) for entry in start)]
            while len(points) <= steps and points[-1] is not None:
                points.append(kahan_step(file.system, eps, points[-1]))
            if points[-1] is not None and result < starts:
                result += 1
                yield eps, points


def some_slow(names, slow):
    return [pytest.param(name, marks=pytest.mark.slow) if name in slow else name for name in names]


@pytest.mark.parametrize("name", some_slow(KNOWN, [name for name in KNOWN if file_of(name).dim > 2]))
def test_the_integrals_and_densities_of_the_answers_hold_on_exact_orbits(name):
    file, known = file_of(name), KNOWN[name]
    compared, seen = 0, [set() for _ in known.integrals]
    for eps, points in orbits(file):
        rows = [[value_at(text, name, x, eps) for x in points] for text in known.integrals]
        x, image = points[:2]
        before, after = (1 if known.density is None else value_at(known.density, name, y, eps) for y in (x, image))
        if before == 0 or any(None in row for row in rows):
            continue  # a point on an invariant line, or a pole of an integral
        for values, row in zip(seen, rows, strict=True):
            assert len(set(row)) == 1
            values |= set(row)
        assert known.density is None or after == determinant(kahan_jacobian(file.system, eps, x)) * before
        compared += 1
    assert compared >= 4
    assert all(len(values) > 1 for values in seen)  # no constants


@together("name", KNOWN)
def test_the_answers_count_their_independent_integrals(name):
    known = KNOWN[name]
    _, rank, _ = ranks([], formulas(name), Laboratory(file_of(name)).maps[0])
    assert rank + (MODIFIED in known.integrals) == len(known.integrals) <= file_of(name).dim


@pytest.mark.parametrize("name", some_slow([name for name in FURTHER if name not in BOUNDED], {*FURTHER} - {*FAST}))
def test_the_analysis_gives_the_answer(name):
    assert differences(analysed(name), answer_for(name)) == set()


@pytest.mark.parametrize("name", DEGENERATE)
def test_the_analysis_of_degenerate_systems_gives_the_answer(name):
    analysis = analyze(file_of(name))
    assert differences(analysis, replace(answer_for(name), verdict=None), 4) == set()
    affine = all(int(p.total_degree()) <= 1 for p in analysis.file.system.rhs)
    assert analysis.conclusion.kind == ("linear" if affine else verdict_of(KNOWN[name].growth))
    assert analysis.skipped == []


SPECIAL = [(name, eps) for name, known in KNOWN.items() for eps in known.at]


@pytest.mark.parametrize(("name", "eps"), SPECIAL)
def test_special_eps(name, eps):
    file, special = file_of(name), KNOWN[name].at[eps]
    analysis = analyze(file, eps=eps)
    assert f"All this holds at eps = {eps}; other eps may differ." in analysis.conclusion.sentence
    if special.startswith("period "):
        period = int(special.removeprefix("period "))
        assert analysis.integrals.profile.period == period
        is_proved = f"Phi^{period} is the identity (proved)" in analysis.conclusion.sentence
        assert is_proved or analysis.conclusion.kind == "linear"
        assert analysis.conclusion.integrals == file.system.dim
        return
    assert analysis.integrals.integrals == analysis.densities.densities == ()
    defect = {"no value": "is defined nowhere", "not invertible": "is not invertible"}[special]
    assert defect in analysis.integrals.reason
    if special == "no value":
        assert analysis.conclusion.kind == "singular"


@pytest.mark.parametrize("name", ["ishii", "zander_11m1_lines"])
def test_a_wrong_answer_is_seen_to_be_different(name):
    result, answer = analysed(name), answer_for(name)
    wrong = function(name, "1" if name != "ishii" else result.file.variables[-1])  # of ishii 1 is a density
    assert differences(result, answer) == set()
    for count in (answer.integrals + 1, answer.integrals - 1):
        assert "count" in differences(result, replace(answer, integrals=count))
    assert differences(result, replace(answer, degrees=(*answer.degrees[:4], answer.degrees[4] + 1))) == {"degrees"}
    assert differences(result, replace(answer, growth="cubic")) == {"growth"}
    assert differences(result, replace(answer, verdict="undecided")) == {"verdict"}
    assert differences(result, replace(answer, dynamical_degree="x^2 - x - 1")) == {"dynamical degree"}
    assert differences(result, replace(answer, density=residues_of(wrong))) == {"density"}
    assert differences(result, replace(answer, without_density=True)) == {"density"}
    foreign = function(name, "+".join(f"{k + 2}*{v}^3" for k, v in enumerate(result.file.variables)))
    assert differences(result, replace(answer, formulas=(*answer.formulas, foreign))) == {"formulas"}


FACTS = [name for name in names() if set(load(name).catalog) & {"degrees", "growth", "verdict", "codimension"}]
# All others take less than a second.
SLOW = ("henon_heiles", "zhukovski_volterra_2", "volterra_periodic_5", "kirchhoff_generic", "clebsch_first_flow")
SLOW = (*SLOW, "kirchhoff_case", "lagrange_top", "so4_euler_manakov", "paper_m3", "paper_m3_irreducible", "three_wave")
SLOW = (*SLOW, "lorenz", "zander_120", "paper_m2", "volterra_periodic_4")


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


@pytest.mark.parametrize("name", some_slow(FACTS, SLOW))
def test_the_facts_of_the_file_are_found_blind(name):
    # The analysis of the right-hand sides, without anything else that the file says.
    result = analyze(SystemFile.from_system(load(name).system, "somebody"))
    assert differences(result, facts_of(name)) == set()
    nullities = {f"degree <= {k}": nullity for k, nullity in enumerate(result.integrals.profile.nullities, 1)}
    for known in relations(load(name).catalog, result.file.variables):
        assert nullities.get(known.text, known.dimension) == known.dimension
