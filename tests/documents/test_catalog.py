"""The catalogue: every file is complete, and everything it claims is true.

Claims are decided by the checks, at the default and at random values of the parameters, for every eps and for one; and
they are proved here, by expanding them with eps and the parameters as indeterminates. Each of them is also
altered a little, and has to be refuted then. Facts that can be computed are computed.
"""

import dataclasses
import random
import re
from pathlib import Path

import pytest
from flint import fmpq
from helpers import quick

import kahanmaps
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks.claims import Verdict
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load, names
from kahanmaps.documents.files import parse_system
from kahanmaps.family.draw import draw_generic, draw_with_eigenvalues
from kahanmaps.sources import SOURCES

PACKAGE = Path(kahanmaps.__file__).parent
HOLDS = {Verdict.PROVED, Verdict.SUPPORTED}
ONE_EPS = fmpq(2, 7)

over_the_catalogue = pytest.mark.parametrize("name", names())
# The largest take seconds, and nothing here depends on their size.
_LARGE = ("paper_m3", "three_wave", "volterra_periodic_5")
_SMALLER = [name for name in names() if name not in _LARGE]
over_the_smaller_systems = pytest.mark.parametrize("name", quick(names(), _SMALLER))


def with_random_parameters(name, seed):
    """The system at random nonzero values of its parameters."""
    rng = random.Random(f"{name} {seed}")
    declared = load(name).parameters
    return load(name, {key: fmpq(rng.choice((-1, 1)) * rng.randint(1, 9), rng.randint(1, 5)) for key in declared})


def findings(file, eps=None):
    """What check-integrals and check-measure say of a file; nothing where it claims nothing."""
    settings = Settings(eps=eps, steps=3)
    found = []
    if file.integrals or file.hamiltonian is not None:
        found += check_integrals(file, settings).findings
    if file.density is not None or file.hamiltonian is not None:
        found += check_measure(file, settings).findings
    return found


# What each file says of itself.


@over_the_catalogue
def test_a_file_has_the_name_of_its_system_and_reads_back_equal(name):
    file = load(name)
    assert file.name == name
    assert parse_system(file.to_toml(), name) == file


@over_the_catalogue
def test_a_file_has_a_title_a_source_that_exists_a_convention_and_facts(name):
    catalog = load(name).catalog
    assert catalog["title"]
    assert catalog["sources"]
    assert set(catalog["sources"]) <= set(SOURCES)
    assert "2 eps" in catalog["convention"] or "is eps" in catalog["convention"]
    assert catalog["facts"]


# What the files claim, decided by the checks.


@pytest.mark.parametrize("name", quick([name for name in names() if load(name).parameters], _SMALLER))
def test_every_claim_holds_at_random_parameters_and_one_eps(name):
    assert all(finding.verdict in HOLDS for finding in findings(with_random_parameters(name, 0), ONE_EPS))


@over_the_smaller_systems
def test_every_claim_of_a_file_holds_for_every_eps(name):
    file = load(name)
    found = findings(file)
    assert all(finding.verdict in HOLDS for finding in found)
    claimed = {f"{integral} is conserved" for integral in file.integrals}
    assert claimed <= {finding.claim for finding in found}
    measures = [finding for finding in found if "measure" in finding.claim]
    assert len(measures) == (file.density is not None) + (file.hamiltonian is not None)


def altered(function, eps_at):
    """The function with 2 eps for eps; where it does not contain eps, with the first variable added."""
    gens = function.numerator.context().gens()
    doubled = [2 * gen if k == eps_at else gen for k, gen in enumerate(gens)]
    other = RationalFunction(function.numerator.compose(*doubled), function.denominator.compose(*doubled))
    return (
        other
        if other != function
        else RationalFunction(function.numerator + gens[0] * function.denominator, function.denominator)
    )


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
    found = findings(file)
    assert len(found) == len(file.integrals) + (file.density is not None)
    for finding in found:
        assert finding.verdict is Verdict.REFUTED, finding.claim
        assert finding.witness.field == "QQ"
        assert finding.witness.left != finding.witness.right


# The members of the family.

DRAWN = {
    "paper_m2": lambda: draw_with_eigenvalues([1, 2], seed=196, size=1),
    "paper_m3": lambda: draw_with_eigenvalues([1, 2, 3], seed=327, size=1),
    "paper_m3_irreducible": lambda: draw_generic(3, seed=76, size=1),
}


@pytest.mark.parametrize("name", DRAWN)
def test_the_maps_of_a_member_commute_and_the_control_does_not(name):
    report = check_commute(load(name), settings=Settings(steps=2))
    assert report.verdict is Verdict.PROVED
    (control,) = [finding for finding in report.findings if finding.control]
    assert control.verdict is Verdict.REFUTED


# The sources.

KEY = re.compile(r"(?<![\w-])(?:petrera-suris-[a-z0-9]+|[a-z]+(?:-[a-z]+)*-(?:18|19|20)[0-9]{2})(?![\w-])")


def keys_in_the_package():
    """What looks like the key of a source, in the code, its docstrings and the catalogue."""
    paths = [path for ending in ("py", "toml") for path in PACKAGE.rglob(f"*.{ending}")]
    texts = [path.read_text(encoding="utf-8") for path in paths if path.name != "sources.py"]
    return {key for text in texts for key in KEY.findall(text)}


def test_every_source_that_is_cited_exists():
    assert keys_in_the_package() - set(SOURCES) == set()
