"""Certificates: Coq, PARI/GP and SymPy accept what is true, and refuse it with one coefficient changed."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction

import pytest
from flint import fmpq, fmpq_mat
from helpers import quick, refuses

from kahanmaps.algebra.parsing import parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction, ring
from kahanmaps.certificates.certificate import (
    _SEARCHES,
    CHECKERS,
    _claims_of,
    _commuting_claims,
    _known_claims,
    _Planes,
    _prepare,
    certificate,
)
from kahanmaps.certificates.chains import Chain, periodic
from kahanmaps.certificates.combinations import (
    AffineSymmetry,
    ChangedFunction,
    OrbitIntegral,
    affine_symmetry,
    bilinear_integral,
    modified_hamiltonian,
)
from kahanmaps.certificates.darboux import (
    DarbouxPolynomial,
    conserved_function,
    darboux_polynomial,
)
from kahanmaps.certificates.entropy import positive_entropy
from kahanmaps.certificates.identities import (
    FalseClaim,
    InvariantTensor,
    invariant_tensor,
    map_data,
)
from kahanmaps.checks.commute import check_commute
from kahanmaps.checks.conserve import check_integrals
from kahanmaps.checks.preserve import check_measure, check_poisson
from kahanmaps.documents.catalog import load
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.inline import System
from kahanmaps.family.random_members import random_member
from kahanmaps.laboratory.analysis import analyze
from kahanmaps.laboratory.growth.degree_bounds import bound_dynamical_degree
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.laboratory.preserve.darboux.darboux_polynomials import darboux_polynomials
from kahanmaps.laboratory.preserve.densities import find_densities
from kahanmaps.laboratory.preserve.integrals import find_integrals
from kahanmaps.laboratory.symmetry.commuting import commuting_systems
from kahanmaps.laboratory.vector_field.equivalence import equivalent_system
from kahanmaps.paper.verify import VerifyOptions, verify

PROGRAMS = {
    "rocq": (["coqc"], ".v", r"(Definition c1 : R := )", r"\1 1 + "),
    "gp": (["gp", "-q"], ".gp", r"^(c1 = \()", r"\g<1>1 + "),
    "sympy": ([sys.executable], ".py", r"^(c1 = \()", r"\g<1>1 + "),
}
# Every day most of it is asked of one of them: of PARI/GP, which takes the least time, or of SymPy without it.
DAILY = "gp" if shutil.which("gp") else "sympy"
SYSTEMS = ["lyness", "riccati", "weierstrass"]  # dimension 2 and 1; a map by formulas, and one with a modified H
FURTHER = ["harmonic", "euler_top", "henon_heiles", "nahm_tetrahedral", "planar_cubic_hamiltonian", "qrt_symmetric"]
FURTHER += ["volterra_periodic_3"]


def over(*programs: str) -> pytest.MarkDecorator:
    """The test with each of these programs, with one of them every day."""
    return pytest.mark.parametrize("checker", quick(programs, [DAILY]))


def run(checker: str, text: str, folder) -> subprocess.CompletedProcess[str]:
    program, ending, _, _ = PROGRAMS[checker]
    if shutil.which(program[0]) is None:
        pytest.skip(f"{program[0]} is not installed")
    path = folder / f"proof{ending}"
    path.write_text(text)
    return subprocess.run([*program, path], capture_output=True, text=True, stdin=subprocess.DEVNULL, cwd=folder)


@pytest.mark.parametrize("checker", PROGRAMS)
@pytest.mark.parametrize("name", [*SYSTEMS, *(pytest.param(name, marks=pytest.mark.slow) for name in FURTHER)])
def test_a_program_that_is_not_ours_accepts_every_claim_of_a_system(name, checker, tmp_path):
    text = certificate(load(name), checker)
    done = run(checker, text, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "FALSE" not in done.stdout
    assert done.stdout.count(": true\n") == (0 if checker == "rocq" else text.count('check("'))


@pytest.mark.parametrize("checker", PROGRAMS)
def test_a_certificate_with_one_coefficient_changed_is_refused(checker, tmp_path):
    _, _, where, changed = PROGRAMS[checker]
    text, count = re.subn(where, changed, certificate(load("weierstrass"), checker), flags=re.MULTILINE)
    assert count
    assert run(checker, text, tmp_path).returncode != 0


def claims_of(name: str, kind: str):
    """The claims with this name about the map of a system, or the first one that a search finds."""
    file = load(name)
    formulas, data = _prepare(file, "gp")
    known = dict(_known_claims(formulas, _Planes(file, data)))
    return known[kind]() if kind in known else _claims_of(_SEARCHES[kind](file), data)[:1]


def changed(claim):
    """The claim with one coefficient changed."""
    if isinstance(claim, OrbitIntegral):
        return replace(claim, numerator=claim.numerator + claim.numerator.context().gen(0))
    if isinstance(claim, AffineSymmetry):
        more = 3 * claim.image[0].context().gen(0)  # T stays invertible, also where it changes the sign of x
        return replace(claim, image=(claim.image[0] + more, *claim.image[1:]))
    if isinstance(claim, InvariantTensor):
        return replace(claim, upper={pair: P + (pair == (0, 1)) for pair, P in claim.upper.items()})
    if isinstance(claim, ChangedFunction):
        P, Q = claim.new_function
        return replace(claim, new_function=(P + P.context().gen(0), Q))
    name = "product" if isinstance(claim, DarbouxPolynomial) else "fraction"
    fraction = getattr(claim, name)
    if fraction is None:
        return replace(claim, numerator=claim.numerator + claim.numerator.context().gen(0))
    first, *others = fraction.products
    P, *rest = first.factors
    other = 1 if P.degree == 1 else P.polynomial.context().gen(0)  # x^2 + y^2 + 1 would be an integral
    factors = (replace(P, polynomial=P.polynomial + other), *rest)
    return replace(claim, **{name: replace(fraction, products=(replace(first, factors=factors), *others))})


CASES = [("weierstrass", "modified_hamiltonian"), ("lotka_volterra", "poisson"), ("lotka_volterra", "darboux")]
CASES += [("lotka_volterra", "volume"), ("lotka_volterra", "symmetry"), ("harmonic", "E"), ("zander_111", "F")]
CASES += [("harmonic", "volume"), ("volterra_periodic_3", "poisson"), ("paper_m2", "I1")]
SLOW_CASES = [("paper_m3", "H1"), ("euler_top", "poisson"), ("paper_m2", "poisson"), ("three_wave", "symmetry")]
SLOW_CASES += [("repaired_icosahedral", "F"), ("qrt_asymmetric", "volume"), ("volterra_periodic_4", "I2")]


OFTEN = [*((case, DAILY) for case in CASES), (CASES[0], "sympy")]


@pytest.mark.parametrize(
    ("name", "kind", "checker"),
    [
        pytest.param(*case, checker, marks=[pytest.mark.slow] * ((case, checker) not in OFTEN))
        for case in [*CASES, *SLOW_CASES]
        for checker in PROGRAMS
    ],
)
def test_each_kind_of_claim_is_accepted_and_refused_with_one_coefficient_changed(name, kind, checker, tmp_path):
    claims = claims_of(name, kind)
    assert run(checker, CHECKERS[checker](claims), tmp_path).returncode == 0
    for claim in claims:
        assert run(checker, CHECKERS[checker]([changed(claim)]), tmp_path).returncode != 0


@over(*PROGRAMS)
@pytest.mark.parametrize(
    ("system", "other"),
    [
        ("x' = y; y' = -x", "x' = 2*y; y' = -2*x"),
        pytest.param("paper_m2", "associates", marks=pytest.mark.slow),
        pytest.param("paper_m3", "associates", marks=pytest.mark.slow),
    ],
)
def test_commuting_maps_are_accepted_and_refused_with_one_coefficient_changed(system, other, checker, tmp_path):
    file = load(system) if other == "associates" else System(system)
    claims = _commuting_claims(file, _prepare(file, checker)[1], other if other == "associates" else System(other))
    claims = [*[claim for claim in claims if not isinstance(claim, Chain)][:2], claims[-1]]
    assert run(checker, CHECKERS[checker](claims), tmp_path).returncode == 0
    chain = claims[-1]
    point = chain.values[-1]
    wrong = replace(point, numerators=(point.numerators[0] + 1, *point.numerators[1:]))
    false = replace(chain, values=(*chain.values[:-1], wrong))
    assert run(checker, CHECKERS[checker]([false]), tmp_path).returncode != 0


EQUIVALENT = System("x' = y + 1; y' = 24*(x - 2)^2 - 8")  # to weierstrass at g2 = 64, by 4 x - 8, 4 y + 4
FASTER = System("x' = 3*x - 3*x*y; y' = 3*x*y - 3*y")  # lotka_volterra at eps/c with c = 1/3


@over(*PROGRAMS)
def test_an_equivalence_is_accepted_and_refused_with_one_coefficient_changed(checker, tmp_path):
    result = equivalent_system(EQUIVALENT)
    text = result.certificate(checker)
    assert "equivalence: f is equivalent to weierstrass at g2 = 64 after (x, y) -> (4*x - 8, 4*y + 4)" in text
    assert run(checker, text, tmp_path).returncode == 0
    (claim,) = _claims_of(result, _prepare(EQUIVALENT, checker)[1])
    one = claim.image[0] ** 0
    shifted = replace(claim, image=(claim.image[0] + one, claim.image[1]))
    rows = claim.target.rows
    other = replace(claim, target=replace(claim.target, rows=((*rows[0][:-1], rows[0][-1] + 1), rows[1])))
    wrong = [CHECKERS[checker]([false]) for false in (changed(claim), shifted, other)]
    if checker == "rocq":
        singular = text.replace("(4 * x_new - 8)", "(0 * x_new - 8)", 1)  # in the theorem that T is onto
        assert singular.index("_is_onto") < singular.index("(0 * x_new - 8)") < singular.index("Proof. intros x y.")
    else:
        false = replace(claim, image=(one * 0, one * 0), matrix=((0, 0), (0, 0)))
        singular = CHECKERS[checker]([false])
    for false in (*wrong, singular):
        assert run(checker, false, tmp_path).returncode != 0


@over("gp", "sympy")
def test_an_equivalence_by_a_given_map_and_one_that_changes_eps(checker, tmp_path):
    found = equivalent_system(FASTER)
    texts = [certificate(EQUIVALENT, checker, equivalent=load("weierstrass", {"g2": 64}), by=["4*x - 8", "4*y + 4"])]
    texts += [found.certificate(checker), certificate(FASTER, checker, ["equivalence"])]
    assert "T takes the map of inline to that of weierstrass" in texts[0]
    for text in texts:
        assert run(checker, text, tmp_path).returncode == 0


@over(*PROGRAMS)
def test_a_period_is_accepted_and_refused_with_one_coefficient_changed(checker, tmp_path):
    file = load("lyness", {"a": 1})
    assert run(checker, certificate(file, checker, period=5), tmp_path).returncode == 0
    chain = periodic(_prepare(file, checker)[1], 5)
    wrong = replace(chain.values[2], numerators=(chain.values[2].numerators[0] + 1, *chain.values[2].numerators[1:]))
    values = (*chain.values[:2], wrong, *chain.values[3:])
    assert run(checker, CHECKERS[checker]([replace(chain, values=values)]), tmp_path).returncode != 0


def wrong_entropies(claim):
    """The claim with one number changed."""
    first, *others = claim.forms[-1]
    return [
        replace(claim, lower=claim.lower + Fraction(1, 100)),
        replace(claim, forms=(*claim.forms[:-1], (first * 2, *others))),
        replace(claim, factors=(*claim.factors[:-1], claim.factors[-1] * 2)),
        replace(claim, inverse=(claim.inverse[0] + claim.inverse[2], *claim.inverse[1:])),
    ]


POSITIVE = ["lotka_volterra", "fibonacci", "zander_120", "lotka_volterra_symplectic_euler"]


@over("gp", "sympy")
@pytest.mark.parametrize(
    "name", ["fibonacci", *(pytest.param(n, marks=pytest.mark.slow) for n in ("lotka_volterra", "hietarinta_viallet"))]
)
def test_positive_entropy_is_accepted_and_refused_with_one_number_changed(name, checker, tmp_path):
    (claim,) = claims_of(name, "entropy")
    done = run(checker, CHECKERS[checker]([claim]), tmp_path)
    assert (done.returncode, "FALSE" in done.stdout) == (0, False), done.stdout + done.stderr
    for wrong in (replace(claim, line_degree=claim.line_degree + 1), *wrong_entropies(claim)):
        assert run(checker, CHECKERS[checker]([wrong]), tmp_path).returncode != 0
    bounds = bound_dynamical_degree(load(name).map, None)
    assert bounds is not None
    assert 1 < claim.lower < Fraction(bounds.upper)


def test_positive_entropy_is_not_certified_for_integrable_maps():
    for name in ("nahm_octahedral", "mcmillan", "zander_111"):
        for checker in ("gp", "rocq"):
            refuses("which proves nothing", certificate, load(name), checker, ["entropy"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["hietarinta_viallet", *POSITIVE])
def test_coq_accepts_positive_entropy_from_one_axiom(name, tmp_path):
    done = run("rocq", certificate(load(name), "rocq", ["entropy"]), tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.findall(r"^\w+(?=$|\n? : )", done.stdout.replace("Axioms:", ""), flags=re.MULTILINE)[-1] == (
        "degrees_grow_exponentially"
    )


@pytest.mark.slow
def test_coq_refuses_positive_entropy_with_one_number_changed(tmp_path):
    file = load("hietarinta_viallet")
    data = _prepare(file, "rocq")[1]
    claim = positive_entropy(data, data.with_rows(file.map.inverse_rows), is_short=True)
    text = CHECKERS["rocq"]([claim])
    texts = [CHECKERS["rocq"]([other]) for other in wrong_entropies(claim)]
    for old, new in (("= Some 73%nat", "= Some 74%nat"), ("prime 1009", "prime 1011"), ("1009", "1011")):
        assert old in text
        texts.append(text.replace(old, new))
    for other in texts:
        assert run("rocq", other, tmp_path).returncode != 0


ROTATION, ZERO, FAMILY = System("x' = y; y' = -x"), System("x' = 0; y' = 0"), load("weierstrass", {"g2": 64})


@pytest.mark.parametrize(
    ("system", "options", "message"),
    [
        ("euler_top", {"integrals": {"F": "x1^2 + x2^2"}}, "F is not conserved"),
        ("euler_top", {"integrals": {"F": "(x1^2 + x3^2)/(1 + eps*x2)"}}, "F is not conserved"),
        ("lotka_volterra", {"integrals": {"F": "x/y"}}, "F is not conserved"),  # Darboux polynomials, other cofactors
        ("lotka_volterra", {"density": "x"}, "dx/phi is not invariant"),
        (ROTATION, {"commute": System("x' = 2*x; y' = x")}, "maps_1_and_2_commute: the maps do not commute"),
        ("lyness", {"period": 4}, "iterate 4 is not the identity, as it moves a point modulo 2^61 - 1: x = "),
        (EQUIVALENT, {"equivalent": FAMILY, "by": ["4*x - 8", "4*y"]}, "equivalence takes the map to another one"),
        (EQUIVALENT, {"equivalent": FAMILY, "by": ["0", "0"]}, "equivalence is not invertible"),
    ],
)
def test_what_is_false_has_no_certificate(system, options, message):
    refuses(re.escape(message), certificate, system, "gp", error=FalseClaim, **options)


@pytest.mark.parametrize(
    ("system", "options", "message"),
    [
        (EQUIVALENT, {"equivalent": FAMILY, "by": ["4*x - 8"]}, "weierstrass and 1 polynomial, expected two quadratic"),
        (
            EQUIVALENT,
            {"equivalent": FAMILY, "by": ["x^2", "y"]},
            "found x^2, y, expected polynomials of degree at most 1",
        ),
        (
            ROTATION,
            {"commute": ZERO},
            "one of the maps is the identity, as for the zero field, and commutes with every",
        ),
        (ZERO, {"commute": ROTATION}, "one of the maps is the identity"),
        (ZERO, {"commute": ZERO}, "one of the maps is the identity"),
        ("euler_top", {"commute": "associates"}, "expected a member of the commuting family"),
        ("euler_top", {"commute": load("harmonic")}, "same dimension"),
        ("euler_top", {"commute": "associates", "period": 2}, "cannot be combined with other claims"),
        ("euler_top", {"checker": "coq"}, "expected the checker rocq, gp, sympy, got 'coq'"),
        ("euler_top", {"claims": []}, "found an empty list of claims, expected names"),
        ("euler_top", {"claims": ["F9"]}, "expected one of F1, F2, volume"),
        ("euler_top", {"claims": ["entropy"]}, "no claim 'entropy' of euler_top"),
        ("lyness", {"claims": ["darboux"]}, "the search for 'darboux' proves nothing about lyness"),
        ("euler_top", {"integrals": {"I": "eps^2 + 3"}}, "I is a constant, which every map conserves"),
        ("euler_top", {"integrals": {"I": "x1*x1~"}}, "found x1~ in a function, expected x1, x2, x3, eps"),
        ("euler_top", {"density": "0"}, "found the density 0"),
        ("euler_top", {"tensor": [["0", "0", "0"]] * 3}, "the tensor P is 0"),
        ("euler_top", {"period": 0}, "found period = 0, expected a positive integer"),
        ("euler_top", {"period": 1001}, "found period = 1001, expected at most 1000"),
        ("euler_top", {"effort": 99}, "found the effort 99, expected an integer from -20 to 40"),
    ],
)
def test_what_holds_for_every_map_or_means_nothing_has_no_certificate(system, options, message):
    refuses(re.escape(message), certificate, system, **{"checker": "gp", **options})


def test_a_period_is_refuted_at_one_point_before_anything_is_multiplied_out(monkeypatch):
    monkeypatch.setattr("kahanmaps.certificates.chains.apply", lambda *_: pytest.fail("multiplied out"))
    refuses("iterate 30 is not the identity", certificate, load("kirchhoff_generic"), "gp", period=30, error=FalseClaim)


@over(*PROGRAMS)
def test_jacobi_identities_are_checked_for_a_tensor_that_is_invariant_but_not_poisson(checker, tmp_path):
    # For x~ = x every tensor is invariant; dz - y dx is a contact form, so the tensor with this kernel is not Poisson.
    names = ("x", "y", "z", "eps")
    rows = [[parse_rational_function(f"{int(i == j)}", names).numerator for j in range(3)] for i in range(3)]
    x = [parse_rational_function(name, names).numerator for name in "xyz"]
    data = map_data([[*row, x[i]] for i, row in enumerate(rows)], names[:3], ("x_new", "y_new", "z_new"), names)
    upper = {(0, 1): x[0] ** 0, (0, 2): x[0] * 0, (1, 2): -x[1]}
    claim = InvariantTensor("P", data, upper, x[0] ** 0, 1, False)
    assert run(checker, CHECKERS[checker]([claim]), tmp_path).returncode != 0
    right = replace(claim, upper={**upper, (1, 2): x[0] * 0})
    assert run(checker, CHECKERS[checker]([right]), tmp_path).returncode == 0
    tensor = [[RationalFunction(claim.entry(i, j), x[0] ** 0) for j in range(3)] for i in range(3)]
    refuses("P is no Poisson tensor", invariant_tensor, data, "P", tensor, error=FalseClaim)


def test_false_claims_of_each_kind_have_no_certificate():
    _, data = _prepare(load("euler_top"), "gp")
    x = ring(data.names).gens()
    zero, one, linear = (RationalFunction(P, x[0] ** 0) for P in (x[0] * 0, x[0] ** 0, x[0] + x[1]))
    for call, message, *arguments in (
        (affine_symmetry, "C is no symmetry", fmpq_mat([[1, 0, 0], [0, 1, 0], [0, 0, -1]]), [fmpq(0)] * 3, False),
        (modified_hamiltonian, "C is not conserved", ring(data.names[:3]).gens()[0] ** 3),
        (bilinear_integral, "C is not conserved", fmpq_mat([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])),
        (darboux_polynomial, "C is no Darboux polynomial", linear),
        (invariant_tensor, "not Poisson for C", [[zero, one, zero], [one, zero, zero], [zero, zero, zero]]),
    ):
        refuses(message, call, data, "C", *arguments, error=FalseClaim)


@pytest.mark.parametrize("name", ["harmonic", "lotka_volterra"])
@over("gp", "sympy")
def test_a_density_of_0_is_refused(name, checker, tmp_path):
    text = certificate(load(name), checker, ["volume"])
    wrong = re.sub(r"^P = ", "P = 0*", text, flags=re.MULTILINE)
    assert wrong != text
    assert run(checker, wrong, tmp_path).returncode != 0


WRONG_DERIVATIVES = {  # with the same determinant, so that the identity of the volume form holds
    "rocq": [("l12 : R := eps", "l12 : R := - eps"), ("l21 : R := - eps", "l21 : R := eps")],
    "gp": [("L = [1, eps; - eps, 1]", "L = [1, - eps; eps, 1]")],
    "sympy": [("in [[1, eps], [- eps, 1]]]", "in [[1, - eps], [eps, 1]]]")],
}


@over(*PROGRAMS)
@pytest.mark.parametrize("claim", ["volume", "poisson"])
def test_a_matrix_that_is_not_the_derivative_of_the_equation_is_refused(claim, checker, tmp_path):
    wrong = certificate(load("harmonic"), checker, [claim])
    for old, new in WRONG_DERIVATIVES[checker]:
        assert old in wrong
        wrong = wrong.replace(old, new)
    assert run(checker, wrong, tmp_path).returncode != 0


def test_a_check_that_raises_an_error_ends_gp_with_a_status_that_is_not_0(tmp_path):
    # gp goes on with the next line after an error, unless recover is 0 (PARI/GP 2.17).
    text = certificate(load("lotka_volterra"), "gp", ["volume"])
    wrong = text.replace("image(G, k, letters) = {", "image(G, k, letters) = {\n  matdet([G]);")
    assert wrong != text
    assert run("gp", wrong, tmp_path).returncode != 0
    assert run("gp", wrong.replace("default(recover, 0);", ""), tmp_path).returncode == 0


def test_names_of_factors_and_of_later_claims_differ():
    text = certificate(load("nahm_octahedral"), "rocq", everything=True)
    names = re.findall(r"^(?:Definition|Lemma|Theorem) (\w+)", text[: text.index("End Map1.")], flags=re.MULTILINE)
    assert {"num_2", "num_claim_2"} <= set(names)
    assert len(names) == len(set(names))


@over(*PROGRAMS)
@pytest.mark.parametrize(
    ("system", "options"),
    [
        ("I' = fun; fun' = -I", {"integrals": {"O": "(I^2 + fun^2)/3"}}),  # words of the programs
        ("h' = k; k' = -h", {"integrals": {"I": "h^2 + k^2"}}),  # the letter that makes forms homogeneous
        ("h' = k^2 + 1; k' = h^2 - k", {"claims": ["entropy"]}),
        ("t' = x; x' = -t", {"density": "1"}),  # the step of a derivative
    ],
)
def test_variables_with_the_names_of_words_of_the_programs_are_renamed(system, options, checker, tmp_path):
    if checker == "gp" or "claims" not in options:  # the others take long for the entropy
        assert run(checker, certificate(System(system), checker, **options), tmp_path).returncode == 0


@over(*PROGRAMS)
@pytest.mark.parametrize(
    ("x_dot", "options"),
    [
        ("y^2", {"integrals": "y"}),
        ("y^2/6", {"integrals": "(y^3 + y/2)/(y^2 + 1)"}),
        ("y^2/3", {"integrals": "y^2", "density": "y^3"}),
    ],
)
def test_maps_with_a_constant_determinant_have_certificates(x_dot, options, checker, tmp_path):
    done = run(checker, certificate(System(f"x' = {x_dot}; y' = 0"), checker, **options), tmp_path)
    assert done.returncode == 0
    assert "false" not in done.stdout
    refuses("not conserved", certificate, System(f"x' = {x_dot}; y' = 0"), checker, integrals="x + y", error=FalseClaim)


@over(*PROGRAMS)
def test_findings_and_results_write_certificates_of_what_they_prove(checker, tmp_path):
    member = verify("paper_m2", options=VerifyOptions(sections=(6,)))
    theorem = next(finding for finding in member if finding.claim.startswith("Theorem 9: The Kahan maps"))
    results = {
        "F2: ": check_integrals("euler_top")[1],
        "maps_1_and_2_commute: ": theorem,
        "D1: ": darboux_polynomials("lotka_volterra", 1),
        "volume: ": check_measure("paper_m2"),
        "P: ": check_poisson("lotka_volterra", [["0", "x*y"], ["-x*y", "0"]])[0],
    }
    for name, result in results.items():
        text = result.certificate(checker)
        assert checker == "rocq" or f" {name}" in text
        assert run(checker, text, tmp_path).returncode == 0


def test_a_claim_that_takes_too_many_products_is_refused_or_left_out_with_a_note(monkeypatch):
    monkeypatch.setattr("kahanmaps.certificates.identities.MAX_PRODUCTS", 10)
    refuses("more than 10 products of terms to multiply out", certificate, load("euler_top"), "gp", ["F1"])
    text = certificate(load("weierstrass"), "gp")
    assert "Not in this certificate: modified_H: the identities of the certificate take more than 10 products" in text
    assert "dx/phi is invariant" in text


# Seconds of processor time that Coq took, of which it takes 2 to start.
MEASURED = [("lyness", 2.6), ("zander_111", 4.3), ("planar_cubic_hamiltonian", 6.3), ("euler_top", 12.8)]
MEASURED += [("qrt_asymmetric", 14.8), ("repaired_icosahedral", 31.4), ("volterra_periodic_4", 37.2)]


@pytest.mark.parametrize(
    ("name", "seconds"), [*MEASURED[:4], *(pytest.param(*case, marks=pytest.mark.slow) for case in MEASURED[4:])]
)
def test_the_time_that_is_said_beforehand_is_that_of_coq_within_a_factor_of_3(name, seconds):
    text = certificate(load(name), "rocq", everything=True)
    assert seconds / 3 < text.seconds < 3 * seconds
    assert str(len(text)) in text.summary


def test_an_integral_is_split_into_the_lines_that_the_map_multiplies():
    formulas, data = _prepare(load("repaired_icosahedral"), "gp")
    lines, curve = conserved_function(data, "F", formulas.integrals["F"]).fraction.products
    assert [(factor.degree, factor.exponent) for factor in lines.factors] == [(1, 1), (1, 2), (1, 3)]
    assert [(factor.degree, factor.exponent) for factor in curve.factors] == [(6, 1)]


def test_the_certificate_of_a_finding_is_about_its_claim():
    report = check_integrals("paper_m2")
    by_claim = {finding.claim.partition(" is conserved")[0]: finding for finding in report}
    for claim, says in {"modified H": "modified_hamiltonian", "H~": "H0", "H~_1": "H1", "I2": "I2"}.items():
        text = by_claim[claim].certificate("gp")
        assert re.findall(r"^\\\\ (\w+): P", text, flags=re.MULTILINE)[0] == says
    refuses(re.escape("K~_+- is a linear combination of H0, H1"), by_claim["K~_+-"].certificate, "gp")
    assert "maps_1_and_2_commute" in check_commute("paper_m2")[0].certificate("gp")
    field, *_ = commuting_systems("paper_m2")
    assert field.certificate("gp") == field.finding.certificate("gp")


def test_an_analysis_writes_one_certificate_of_all_that_it_proves():
    text = analyze("lotka_volterra").certificate("gp")
    assert [f" {name}" in text for name in ("volume_1: ", "T1: ", "entropy: ")] == [True] * 3
    text = analyze("euler_top", symbols=["a1"], effort=-2).certificate("gp")
    assert "Parameters left as symbols: a1" in text
    assert "Not in this certificate: symmetries, commuting and equivalent systems" in text


def test_a_member_with_one_associated_system_has_the_certificate_that_its_map_and_the_inverse_commute():
    member = SystemFile.from_member(random_member(1, seed=3))
    assert certificate(member, "gp", commute="associates").claims == ("maps_1_and_2_commute",)
    assert check_commute(member).certificate("gp").claims == ("maps_1_and_2_commute",)


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (lambda: check_integrals("euler_top", eps="1/10"), "for every eps: found a claim for eps = 1/10"),
        (lambda: check_integrals("euler_top", "x1")[0], "I1 is not conserved"),
        (lambda: check_commute("paper_m2")[1], "the maps do not commute"),
        (lambda: verify(m=1), "no certificate is known for this claim: no other program is told how"),
        (lambda: degree_growth("euler_top"), "a DegreeGrowth has no certificate"),
        (lambda: find_integrals("euler_top")[0], "a FoundIntegral has no certificate: .* a part of a result; type"),
        (lambda: analyze("lotka_volterra", eps="1/3"), "for every eps: found a result for eps = 1/3"),
        (lambda: find_densities("lotka_volterra", flow=True), "for every eps: found a result for the flow"),
    ],
)
def test_what_has_no_certificate_says_why_in_one_sentence(result, message):
    refuses(message, result().certificate, "gp")
