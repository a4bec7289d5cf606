"""The catalogue: every file is complete, everything it claims is true, and altered a little it is refuted."""

import dataclasses
import random

import pytest
from flint import fmpq, fmpq_poly
from helpers import quick

from kahanmaps.algebra.parsing import parse_polynomial
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.claims import Certainty
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import parse_system
from kahanmaps.sources import SOURCES

over_the_catalogue = pytest.mark.parametrize("name", names())
# The largest take seconds, and nothing here depends on their size.
LARGE = {"paper_m3", "three_wave", "volterra_periodic_5"}


def findings(file):
    """What check-integrals and check-measure say of a file; nothing where it claims nothing."""
    settings = Settings(steps=3)
    results = []
    if file.integrals or file.hamiltonian is not None:
        results += check_integrals(file, settings).findings
    if file.density is not None or file.hamiltonian is not None:
        results += check_measure(file, settings).findings
    return results


@over_the_catalogue
def test_a_file_has_its_facts_and_reads_back_equal(name):
    file = load(name)
    assert (file.name, parse_system(file.to_toml(), name)) == (name, file)
    assert set(file.catalog["sources"]) <= set(SOURCES)
    assert all(file.catalog[key] for key in ("title", "sources", "convention", "facts"))


@pytest.mark.parametrize("name", quick(names(), set(names()) - LARGE))
def test_every_claim_of_a_file_holds_at_random_parameters_for_every_eps(name):
    rng = random.Random(name)
    signed = ((key, rng.choice((-1, 1)) * rng.randint(1, 9)) for key in load(name).parameters)
    file = load(name, {key: fmpq(number, rng.randint(1, 5)) for key, number in signed})
    result = findings(file)
    assert all(finding.verdict.holds for finding in result)
    claimed = {f"{integral} is conserved" for integral in file.integrals}
    assert claimed <= {finding.claim for finding in result}
    measures = [finding for finding in result if "measure" in finding.claim]
    assert len(measures) == (file.density is not None) + (file.hamiltonian is not None)


def altered(function, eps_at):
    """The function with 2 eps for eps; where it does not contain eps, with the first variable added."""
    gens = function.numerator.context().gens()
    doubled = [2 * gen if k == eps_at else gen for k, gen in enumerate(gens)]
    other = RationalFunction(function.numerator.compose(*doubled), function.denominator.compose(*doubled))
    if other != function:
        return other
    return RationalFunction(function.numerator + gens[0] * function.denominator, function.denominator)


def with_altered_claims(file):
    """The claims of a file, each altered, without the structure from which others would follow."""
    at = len(file.variables)
    return dataclasses.replace(
        file,
        hamiltonian=None,
        member=None,
        integrals={name: altered(function, at) for name, function in file.integrals.items()},
        density=None if file.density is None else altered(file.density, at),
    )


@over_the_catalogue
def test_every_altered_claim_is_refuted_with_a_rational_witness(name):
    file = with_altered_claims(load(name))
    result = findings(file)
    assert len(result) == len(file.integrals) + (file.density is not None)
    for finding in result:
        assert finding.verdict is Certainty.REFUTED, finding.claim
        assert finding.witness.field == "QQ"
        assert finding.witness.left != finding.witness.right


CLOSED_FORMS = {
    "planar_cubic_hamiltonian": lambda n: -(-3 * n * n // 4) + 1,
    "euler_top": lambda n: 2 * n * n + 1,
    "lagrange_top": lambda n: 4 * n * n + 2,
    "so4_euler_manakov": lambda n: 5 * n * n + 1,
}


@pytest.mark.parametrize("name", CLOSED_FORMS)
def test_the_degrees_are_the_values_of_the_closed_form(name):
    catalog = load(name).catalog
    assert catalog["degrees"] == [CLOSED_FORMS[name](n) for n in range(1, len(catalog["degrees"]) + 1)]


LATEST_BEGINNING = 2


def follow(degrees, minimal):
    """Whether d_0 = 1, d_1, ... obey the recurrence of `minimal` (t - 1) from some n <= LATEST_BEGINNING on.

    At least two equations have to be left then: with fewer, almost any numbers would do.
    """
    d, recurrence = [1, *degrees], minimal * fmpq_poly([-1, 1])  # and a constant
    order = recurrence.degree()
    misses = [sum(recurrence[j] * d[k + j] for j in range(order + 1)) for k in range(len(d) - order)]
    return len(next((misses[n:] for n in range(LATEST_BEGINNING + 1) if not any(misses[n:])), [])) >= 2


@pytest.mark.parametrize("name", [name for name in names() if "dynamical_degree" in load(name).catalog])
def test_the_degrees_follow_the_recurrence_of_the_dynamical_degree(name):
    catalog = load(name).catalog
    terms = parse_polynomial(catalog["dynamical_degree"], ["x"]).terms()
    coefficients = {int(monomial[0]): coefficient for monomial, coefficient in terms}
    minimal = fmpq_poly([coefficients.get(k, 0) for k in range(max(coefficients) + 1)])
    assert follow(catalog["degrees"], minimal)
    assert catalog["growth"] == "exponential"
    assert max(root.real for root, _ in minimal.complex_roots()) > 1
