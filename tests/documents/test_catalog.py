"""The catalogue: every file is complete, and everything it claims is true.

Claims are decided by the checks, at the default and at random values of the parameters, for every eps and for one; and
they are proved here, by expanding them with eps and the parameters as indeterminates. Each of them is also
altered a little, and has to be refuted then. Facts that can be computed are computed.
"""

from __future__ import annotations

import dataclasses
import os
import random
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from flint import fmpq, fmpq_mat
from helpers import quick, random_point

import kahanmaps
from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import RationalFunction, gradient, linear_combinations, ring
from kahanmaps.algebra.text import parse_number, parse_polynomial, parse_rational_function
from kahanmaps.checks.claims import Verdict
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure
from kahanmaps.checks.settings import Settings
from kahanmaps.documents.catalog import load, map_names, names, titles
from kahanmaps.documents.files import parse_system
from kahanmaps.errors import InputError, SystemFileError
from kahanmaps.family.draw import draw_generic, draw_with_eigenvalues
from kahanmaps.invariants.integrals import ModifiedHamiltonian
from kahanmaps.maps.kahan import KahanMap
from kahanmaps.sources import SOURCES
from kahanmaps.systems.hamiltonian import standard_structure

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


@cache
def known_findings(name, eps):
    """The same of a system of the catalogue, as it is."""
    return findings(load(name), eps)


# What each file says of itself.


def test_titles_and_dimensions_are_those_of_the_systems():
    everything = (*names(), *map_names())
    assert titles() == {name: (load(name).dim, load(name).catalog["title"]) for name in everything}


def test_the_catalogue_has_the_systems_that_the_documentation_speaks_of():
    assert {
        "euler_top",
        "henon_heiles",
        "lorenz",
        "lotka_volterra",
        "paper_m2",
        "paper_m3",
        "planar_cubic_hamiltonian",
    } <= set(names())


def test_the_names_are_those_of_the_files_in_alphabetical_order():
    assert names() == tuple(sorted(path.stem for path in (PACKAGE / "documents" / "catalog").glob("*.toml")))


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


@over_the_catalogue
def test_every_fact_opens_with_its_status(name):
    for fact in load(name).catalog["facts"]:
        assert re.match(r"(Proved|Refuted|Measured|Classical|Origin)( \([a-z0-9-]+\))?: .*\.$", fact), fact


@over_the_catalogue
def test_no_file_is_longer_than_a_newcomer_reads(name):
    lines = (PACKAGE / "documents" / "catalog" / f"{name}.toml").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 60


@over_the_catalogue
def test_a_file_without_integrals_says_so_and_no_other_does(name):
    file = load(name)
    says_so = any(re.search("no integral is known|none is written out", fact) for fact in file.catalog["facts"])
    assert says_so == (not file.integrals and file.hamiltonian is None)


# What the files claim, decided by the checks.


@pytest.mark.parametrize("eps", [None, ONE_EPS], ids=["every eps", "one eps"])
@over_the_smaller_systems
def test_every_claim_holds_at_the_default_parameters(name, eps):
    assert all(finding.verdict in HOLDS for finding in known_findings(name, eps))


@pytest.mark.parametrize("eps", [None, ONE_EPS], ids=["every eps", "one eps"])
@pytest.mark.parametrize("name", quick([name for name in names() if load(name).parameters], _SMALLER))
def test_every_claim_holds_at_random_parameters(name, eps):
    assert all(finding.verdict in HOLDS for finding in findings(with_random_parameters(name, 0), eps))


@over_the_smaller_systems
def test_every_claim_of_a_file_is_among_the_findings(name):
    file, found = load(name), known_findings(name, None)
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


@pytest.mark.parametrize("eps", [None, ONE_EPS], ids=["every eps", "one eps"])
@over_the_catalogue
def test_every_altered_claim_is_refuted_with_a_rational_witness(name, eps):
    file = with_altered_claims(load(name))
    found = findings(file, eps)
    assert len(found) == len(file.integrals) + (file.density is not None)
    for finding in found:
        assert finding.verdict is Verdict.REFUTED, finding.claim
        assert finding.witness.field == "QQ"
        assert finding.witness.left != finding.witness.right


@pytest.mark.parametrize("name", [name for name in names() if load(name).integrals])
def test_at_the_witness_an_altered_integral_has_the_two_values_that_it_says(name):
    file = with_altered_claims(load(name))
    for finding, function in zip(
        check_integrals(file, Settings(steps=3)).findings, file.integrals.values(), strict=True
    ):
        point = tuple(parse_number(entry) for entry in finding.witness.point)
        eps = parse_number(finding.witness.eps)
        after = function.value(QQ, (*KahanMap(file.system, eps).step(point), eps))
        assert (str(after), str(function.value(QQ, (*point, eps)))) == (*finding.witness.left, *finding.witness.right)


# What the files claim, proved by expansion.


class Expansion:
    """The Kahan map of a file as polynomials in the variables, eps and the parameters: x~ = `image` / `det`.

    `det` is det(I - eps f') and `adjugate` belongs to it.
    """

    def __init__(self, file):
        self.dim = n = len(file.variables)
        self.ring = ring([*file.variables, "eps", *file.parameters])
        self.x, self.eps = self.ring.gens()[:n], self.ring.gens()[n]
        self.zero, self.one = self.ring.constant(0), self.ring.constant(1)
        self.rhs = self._right_hand_side(file.document)
        matrix = [[self.one * (i == j) - self.eps * f.derivative(j) for j in range(n)] for i, f in enumerate(self.rhs)]
        # Faddeev and LeVerrier: the adjugate and the determinant without a division of polynomials.
        self.adjugate, coefficient = [[self.one * (i == j) for j in range(n)] for i in range(n)], self.one
        for k in range(1, n + 1):
            product = self._product(matrix, self.adjugate)
            coefficient = -sum((product[i][i] for i in range(n)), self.zero) / k
            if k < n:
                self.adjugate = [[product[i][j] + coefficient * (i == j) for j in range(n)] for i in range(n)]
        self.adjugate = [[(-1) ** (n - 1) * entry for entry in row] for row in self.adjugate]
        self.det = (-1) ** n * coefficient
        self.increment = [2 * self.eps * entry for [entry] in self._product(self.adjugate, [[f] for f in self.rhs])]
        self.image = [self.det * x + step for x, step in zip(self.x, self.increment, strict=True)]

    def parse(self, text):
        """A rational function of the variables, eps and the parameters."""
        return parse_rational_function(text, self.ring.names())

    def after_a_step(self, function):
        """A rational function at x~: numerator and denominator."""
        (above, high), (below, low) = self._at_image(function.numerator), self._at_image(function.denominator)
        return above * self.det ** max(low - high, 0), below * self.det ** max(high - low, 0)

    def _right_hand_side(self, document):
        def parse(text):
            return parse_polynomial(str(text), self.ring.names())

        if "system" in document:
            return [parse(text) for text in document["system"]["rhs"]]
        section = document.get("hamiltonian", document.get("family"))
        slopes = gradient(parse(section["H"]))[: self.dim]
        if section.get("J", "standard") == "standard":
            return list(linear_combinations(standard_structure(self.dim), slopes))
        return [entry for [entry] in self._product([[*map(parse, row)] for row in section["J"]], [[h] for h in slopes])]

    def _product(self, left, right):
        columns = range(len(right[0]))
        return [[sum((a * right[k][j] for k, a in enumerate(row)), self.zero) for j in columns] for row in left]

    def _at_image(self, polynomial):
        """det^d P(image/det) and d, the degree of P in the variables."""
        n, d = self.dim, max((int(sum(monomial[: self.dim])) for monomial in polynomial.monoms()), default=0)
        total = self.zero
        for monomial, coefficient in polynomial.terms():
            exponents = [int(exponent) for exponent in monomial]
            term = self.ring.from_dict({(*[0] * n, *exponents[n:]): coefficient})
            for base, exponent in zip([*self.image, self.det], [*exponents[:n], d - sum(exponents[:n])], strict=True):
                term = term * base**exponent
            total = total + term
        return total, d


def test_the_expansion_of_the_map_agrees_with_its_step():
    file = load("zhukovski_volterra_1")
    expanded, x = Expansion(file), random_point(3, seed=1)
    values = (*x, ONE_EPS, *file.parameters.values())
    phi = KahanMap(file.system, ONE_EPS)
    assert expanded.det(*values) == phi.determinant(x)
    assert tuple(entry(*values) / expanded.det(*values) for entry in expanded.image) == phi.step(x)


@pytest.mark.parametrize("name", [name for name in names() if load(name).integrals and load(name).member is None])
def test_every_integral_is_conserved_identically_in_eps_and_the_parameters(name):
    file = load(name)
    expanded = Expansion(file)
    for text in file.document["integrals"].values():
        integral = expanded.parse(text)
        above, below = expanded.after_a_step(integral)
        assert above * integral.denominator == below * integral.numerator


def test_an_altered_integral_is_not_conserved_by_the_expanded_map():
    file = load("euler_top")
    expanded = Expansion(file)
    integral = altered(expanded.parse(file.document["integrals"]["F1"]), file.system.dim)
    above, below = expanded.after_a_step(integral)
    assert above * integral.denominator != below * integral.numerator


WITH_DENSITY = [name for name in names() if load(name).density and not load(name).hamiltonian]
LARGE = {"volterra_periodic_5"}  # its expansion has a hundred thousand terms


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE)) for name in WITH_DENSITY]
)
def test_every_density_is_one_identically_in_eps_and_the_parameters(name):
    file = load(name)
    expanded = Expansion(file)
    density = expanded.parse(file.document["density"]["phi"])
    above, below = expanded.after_a_step(density)
    reversed_eps = [-gen if gen == expanded.eps else gen for gen in expanded.ring.gens()]
    # phi(x~)/phi(x) = det(I + eps f'(x~))/det(I - eps f'(x))
    there, scale = expanded.after_a_step(RationalFunction(expanded.det.compose(*reversed_eps), expanded.one))
    assert above * density.denominator * expanded.det * scale == below * density.numerator * there


@pytest.mark.parametrize("name", [name for name in names() if load(name).density and load(name).hamiltonian])
def test_the_density_of_a_hamiltonian_system_is_the_determinant_but_for_a_constant(name):
    # The determinant is one by the theorem of Celledoni, McLachlan, Owren and Quispel (cmoq-2013).
    expanded = Expansion(load(name))
    density = expanded.parse(load(name).document["density"]["phi"])
    if name == "harmonic":  # linear: the determinant 1 + eps^2 w is a constant
        assert density == expanded.parse("1")
    else:
        assert density == RationalFunction(expanded.det, expanded.one)


# What the facts say.


@pytest.mark.parametrize(
    ("name", "parameters", "eps"),
    [("henon_heiles", {}, 1), ("henon_heiles", {"c": "2/3"}, -1), ("harmonic", {"w": 9}, "1/3")],
)
def test_the_fourth_iterate_is_the_identity_where_eps_squared_times_the_frequency_squared_is_one(name, parameters, eps):
    phi = KahanMap(load(name, parameters).system, eps)
    orbit = [random_point(phi.dim, seed=3)]
    for _ in range(4):
        orbit.append(phi.step(orbit[-1]))
    assert orbit[4] == orbit[0]
    assert len(set(orbit)) == 4


def test_the_riccati_map_is_the_moebius_map_of_its_facts():
    expanded = Expansion(load("riccati"))
    (above, below) = (expanded.parse(text).numerator for text in ("(1 + eps*b)*x + 2*eps*c", "1 - eps*b - 2*eps*a*x"))
    assert (expanded.image, expanded.det) == ([above], below)


@pytest.mark.parametrize(
    ("name", "claim", "multiple"),
    [
        ("planar_cubic_hamiltonian", "modified_H", 1),
        ("weierstrass", "modified_H", 1),
        ("henon_heiles", "modified_H", 1),
        ("nahm_tetrahedral", "F", 3),
    ],
)
def test_the_integral_written_out_is_a_multiple_of_modified_h(name, claim, multiple):
    file = load(name)
    x = random_point(file.system.dim, seed=5)
    modified = ModifiedHamiltonian(file.hamiltonian).value(QQ, ONE_EPS, x)
    assert file.integrals[claim].value(QQ, (*x, ONE_EPS)) == multiple * modified


def test_the_three_integrals_of_the_euler_top_go_into_each_other_cyclically():
    file = load("euler_top")
    expanded = Expansion(file)
    x1, x2, x3, eps, a1, a2, a3 = expanded.ring.gens()
    F1, F2 = (expanded.parse(text) for text in file.document["integrals"].values())
    F3 = RationalFunction(F1.denominator * F2.denominator, F1.numerator * F2.numerator)

    def turned(F):
        images = (x2, x3, x1, eps, a2, a3, a1)
        return RationalFunction(F.numerator.compose(*images), F.denominator.compose(*images))

    assert (turned(F1), turned(F2), turned(F3)) == (F2, F3, F1)


# The members of the family.

DRAWN = {
    "paper_m2": lambda: draw_with_eigenvalues([1, 2], seed=196, size=1),
    "paper_m3": lambda: draw_with_eigenvalues([1, 2, 3], seed=327, size=1),
    "paper_m3_irreducible": lambda: draw_generic(3, seed=76, size=1),
}


@pytest.mark.parametrize("name", DRAWN)
def test_a_member_of_the_family_is_drawn_as_its_file_says(name):
    assert load(name).member == DRAWN[name]()


@pytest.mark.parametrize("name", ["paper_m2", "paper_m3"])
def test_the_integrals_of_a_member_add_up_to_modified_k_with_the_signs_of_every_associated_system(name):
    # The theorem on shared integrals gives the left side, for all signs, and so each of the integrals on the right.
    file = load(name)
    integrals = [Expansion(file).parse(text) for text in file.document["integrals"].values()]
    for associate in file.member.associated():
        plain = dataclasses.replace(file, document={"family": {"H": str(associate.K)}})
        expanded = Expansion(plain)
        K = expanded.parse(str(associate.K)).numerator
        slopes = zip(gradient(K), expanded.increment, strict=False)  # the last derivative is that by eps
        above, below = 3 * K * expanded.det + sum((g * step for g, step in slopes), expanded.zero), 3 * expanded.det
        total = RationalFunction(expanded.zero, expanded.one)
        for sign, integral in zip(associate.signs, integrals, strict=True):
            total = RationalFunction(
                total.numerator * integral.denominator + sign * integral.numerator * total.denominator,
                total.denominator * integral.denominator,
            )
        assert above * total.denominator == below * total.numerator, associate.label


@pytest.mark.parametrize("name", DRAWN)
def test_the_maps_of_a_member_commute_and_the_control_does_not(name):
    report = check_commute(load(name), settings=Settings(steps=2))
    assert report.verdict is Verdict.PROVED
    (control,) = [finding for finding in report.findings if finding.control]
    assert control.verdict is Verdict.REFUTED


def test_the_member_with_irreducible_chi_has_three_rational_integrals():
    file = load("paper_m3_irreducible")
    phi = KahanMap(file.system, ONE_EPS)
    x = random_point(6, seed=2)
    values = []
    for _ in range(3):
        image = phi.step(x)
        J, row, column = standard_structure(6), fmpq_mat(1, 6, list(x)), fmpq_mat(6, 1, list(image))
        values.append([(row * J * file.member.A.transpose() ** k * column)[0, 0] for k in (1, 2)])
        x = image
    assert values[0] == values[1] == values[2]


# The sources.

KEY = re.compile(r"(?<![\w-])(?:petrera-suris-[a-z0-9]+|[a-z]+(?:-[a-z]+)*-(?:19|20)[0-9]{2})(?![\w-])")


def keys_in_the_package():
    """What looks like the key of a source, in the code, its docstrings and the catalogue."""
    paths = [path for ending in ("py", "toml") for path in PACKAGE.rglob(f"*.{ending}")]
    texts = [path.read_text(encoding="utf-8") for path in paths if path.name != "sources.py"]
    return {key for text in texts for key in KEY.findall(text)}


def test_every_source_is_used():
    assert set(SOURCES) - keys_in_the_package() == set()


def test_every_source_that_is_cited_exists():
    assert keys_in_the_package() - set(SOURCES) == set()


def test_a_key_is_recognised_in_the_middle_of_a_sentence():
    assert KEY.findall("see kahan-1993, Sect. 2; (petrera-suris-4d); UTF-8-2010") == ["kahan-1993", "petrera-suris-4d"]
    assert all(KEY.fullmatch(key) for key in SOURCES)


# load


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("eulertop", "euler_top"),
        ("Euler-Top", "euler_top"),
        ("lorentz", "lorenz"),
        ("planar", "planar_cubic_hamiltonian"),
    ],
)
def test_an_unknown_name_is_answered_with_a_close_one_and_the_way_to_list_all(wrong, meant):
    with pytest.raises(InputError, match=f"did you mean .*{meant}.* 'kahanmaps systems' lists the catalogue"):
        load(wrong)


@pytest.mark.parametrize("wrong", ["qqqqqq", "", "x" * 1000, "\x1b[31m"])
def test_a_name_that_is_like_no_other_is_refused_in_one_short_printable_line(wrong):
    with pytest.raises(InputError, match="'kahanmaps systems' lists the catalogue") as caught:
        load(wrong)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 250


def test_a_parameter_that_the_system_does_not_have_is_refused_with_those_it_has():
    with pytest.raises(SystemFileError, match="unknown parameter 'a4', this system has: a1, a2, a3"):
        load("euler_top", {"a4": 1})


def test_a_float_is_no_value_for_a_parameter():
    with pytest.raises(SystemFileError, match=r"found the machine number 0\.5"):
        load("euler_top", {"a1": 0.5})


MINE = 'variables = ["x"]\n[parameters]\na = "2"\n[system]\nrhs = ["a*x"]\n'


@pytest.mark.parametrize("reference", ["mine.toml", "./mine.toml", "mine", "./euler_top", Path("euler_top")], ids=repr)
def test_a_path_is_what_ends_in_toml_has_a_separator_or_is_an_existing_file(reference, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mine.toml", "mine", "euler_top"):
        (tmp_path / name).write_text(MINE, encoding="utf-8")
    assert load(reference, {"a": 3}).system.dim == 1
    assert load(reference, {"a": 3}).parameters == {"a": 3}


def test_the_catalogue_wins_over_a_file_of_the_same_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "euler_top").write_text(MINE, encoding="utf-8")
    assert load("euler_top").system.dim == 3


@pytest.mark.parametrize("reference", ["missing.toml", f"missing{os.sep}system", "euler_top.toml"])
def test_a_path_to_no_file_is_refused_as_a_file(reference, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"cannot read the system file {re.escape(reference)}"):
        load(reference)


def test_listing_the_names_loads_no_arithmetic():
    code = "import sys, kahanmaps.documents.catalog as c; c.names(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    loaded = set(done.stdout.split())
    assert loaded & {"flint", "numpy", "kahanmaps.documents.files"} == set()
    assert "kahanmaps.documents.catalog" in loaded
