"""The check whether known or claimed integrals are conserved: I(x~) = I(x)."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed, random_prime_field
from kahanmaps.algebra.fields import Field
from kahanmaps.algebra.functions import BudgetExceeded, FunctionField
from kahanmaps.algebra.polynomials import RationalFunction, linear_combinations
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import MAX_DIMENSION, certify
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.settings import Settings, claimed_function, claimed_functions, run_orbit, settings_and_claim
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.inline import as_file
from kahanmaps.documents.iterates import iterates_in
from kahanmaps.errors import BadPrime, InputError, SingularMatrix, SingularStep
from kahanmaps.invariants.integrals_and_densities import (
    ClaimedFunction,
    ClaimedIntegral,
    CommutantIntegral,
    ImageFunction,
    ModifiedHamiltonian,
    PaperIntegral,
    PhaseFunction,
    is_constant,
    measured_integrals,
    orbit_about,
)
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike, as_map
from kahanmaps.systems.quadratic import QuadraticSystem

Candidate = tuple[PhaseFunction, Evidence | None, str]  # (integral, evidence of a theorem, reference)
# Maximal number of proved integrals that are also tested along an orbit.
_MAX_TRIED_INTEGRALS = 32
_MAX_TRIED_INTEGRALS_IN_HIGH_DIMENSION = 2  # above dimension 16, where the test of an integral takes many seconds


def conservation(system: QuadraticSystem | MapFamily, integral: PhaseFunction, eps: fmpq | None) -> Identity:
    """Return the identity I(x~) = I(x) for an integral I and a map; a system stands for its Kahan map."""
    map_, labels = as_map(system), ("I(x~)", "I(x)")
    last_value: list[Any] = []  # cache: along an orbit, I(x~) at one point is I(x) at the next
    iterate_function = integral if isinstance(integral, ClaimedFunction) and integral.iterates else None
    if iterate_function is not None:  # I depends on several points, with x in the middle
        labels = ("I on the orbit of x, a step later", "I on the orbit of x")

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        if iterate_function is not None:
            points = orbit_about(map_.at(eps_value, field), point, iterate_function.iterates + 1)
            value, image_value = (iterate_function.on(field, eps_value, points[k:]) for k in (0, 1))
            return None if image_value is None or value is None else ([image_value], [value])
        image = map_.at(eps_value, field).step(point)
        is_cached = last_value and last_value[0] is field and last_value[1] == eps_value and last_value[2] == point
        value = last_value[3] if is_cached else integral.value(field, eps_value, point)
        image_value = integral.value(field, eps_value, image)
        last_value[:] = [field, eps_value, image, image_value]
        return None if image_value is None or value is None else ([image_value], [value])

    data = (map_.seed_data, integral.seed_data)
    is_scaled = map_.scales_with_eps and integral.scales_with_eps
    return Identity(
        map_.dim, sides, eps, *labels, has_eps=map_.has_eps, scales_with_eps=is_scaled, root=map_.root, seed_data=data
    )


def known_integrals(file: SystemFile) -> list[Candidate]:
    """Return the integrals that theorems give for the system, each with the evidence of its theorem and a reference."""
    integrals: list[Candidate] = []
    member = file.member
    if member is None:
        if file.hamiltonian is not None:
            proof = theorems.cubic_hamiltonian(file.hamiltonian)
            integrals.append((ModifiedHamiltonian(file.hamiltonian), proof, "cmoq-2013"))
            if file.hamiltonian.is_homogeneous and file.hamiltonian.is_standard:
                integrals.append((PaperIntegral(file.hamiltonian), proof, "petrera-suris-2016, eq. (tH)"))
        return integrals
    # The modified H, its multiple H~, K~_s for every listed associated system (signs s), and commutant integrals. If
    # chi has many factors, K~_s with several minus signs are omitted: they are linear combinations of the others.
    associates = theorems.listed_associates(member)
    f_0 = associates[0]
    proof = theorems.shared_integral(member, f_0)
    integrals += [
        (ModifiedHamiltonian(f_0.hamiltonian), proof, "petrera-suris-2016, eq. (eq: CMOQ integral)"),
        (PaperIntegral(f_0.hamiltonian), proof, "petrera-suris-2016, eq. (tH)"),
    ]
    for associate in associates[1:]:
        integral = PaperIntegral(associate.hamiltonian, "K", f"_{associate.label}")
        integrals.append((integral, theorems.shared_integral(member, associate), "petrera-suris-2016, eq. (tK)"))
    # m - 1 integrals from the powers of A. They are rational also if chi has irrational roots, unlike the K~_s.
    hamiltonian = member.chosen.hamiltonian
    letter = "H" if all(sign > 0 for sign in member.signs) else "K"
    for k in range(1, member.m):
        commutant = CommutantIntegral(hamiltonian, member.A, k, letter)
        name = "A^T" if k == 1 else f"(A^T)^{k}"
        integrals.append((commutant, theorems.commutant_integral(hamiltonian, commutant, name), ""))
    return integrals


def functions_along(
    file: SystemFile, requested: Sequence[tuple[str, str]], in_floats: bool, taken: Sequence[str] = ()
) -> dict[str, PhaseFunction]:
    """Return the functions to evaluate along an orbit, by name.

    Args:
        file: the system.
        requested: pairs (name, text). The name may be empty. The text is an expression, the name of an integral of the
            file, or "known" for all integrals that follow from theorems or are claimed by the file.
        in_floats: whether the orbit is in floating point.
        taken: the names of the other columns of the table of the orbit.

    Raises:
        InputError: if a name occurs twice or is in `taken`, or if a function cannot be evaluated in floats.
    """
    file = file.real_approximation if in_floats else file
    functions: list[PhaseFunction] = []
    for k, (name, text) in enumerate(requested, start=1):
        if text == "known" and not name:
            claims = {**measured_integrals(file), **file.integrals_in_iterates}
            known_functions = [integral for integral, _, _ in known_integrals(file)]
            if not known_functions and not claims:
                raise InputError(f"--integral known: no integral of {file.name} is known or claimed")
            if known_functions and in_floats:
                raise InputError(
                    "--integral known needs exact, mod:P or ball:BITS arithmetic; give an expression for float"
                )
            functions += known_functions
        elif text in (file_integrals := {**file.integrals, **file.integrals_in_iterates}):
            claims = {name or text: file_integrals[text]}
        else:
            short_text = " ".join(text.split()) if len(text) <= 30 else f"I{k}"
            claims = {name or short_text: claimed_function(file, text)}
        if in_floats and (iterate_names := [name for name, function in claims.items() if iterates_in(*function.names)]):
            names_text = ", ".join(iterate_names)
            raise InputError(
                f"found {names_text} with x~ in it, which needs exact, mod:P or ball:BITS arithmetic, not float"
            )
        functions += [ClaimedFunction(name, function, file.map.root, file.map) for name, function in claims.items()]
    names = [*taken, *(function.name for function in functions)]
    for name in names:
        if names.count(name) > 1:
            kind = "columns" if taken else "integrals"
            raise InputError(f"found two {kind} of the name {name}: write --integral NAME=EXPR")
    return {function.name: function for function in functions}


def check_integrals(
    system: SystemLike,
    settings: Settings | Any = None,
    extra: Mapping[str, Any] | Any = None,
    *,
    known: bool = False,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
) -> Report:
    """Check whether integrals are conserved by a map, as an identity in x and along an exact orbit.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        settings: eps, seed, error bound and orbit. If it is omitted, `extra` may be the second argument.
        extra: the claimed integrals, rational functions of the variables and eps: one, a list, or a mapping by name.
            Each is a function, text, a SymPy expression or the name of an integral of the file. Default: the integrals
            that theorems give and those of the file.
        known: whether these default integrals are checked in addition to `extra`.
        eps, time_step, h: eps (half the time step) or the time step, instead of `settings.eps`.

    Returns:
        The report; the claimed integrals come first.

    Raises:
        InputError: if there is nothing to check, or two integrals have the same name.

    >>> from kahanmaps.documents.inline import System
    >>> str(check_integrals(System("x' = y; y' = -x"), "x^2 + y^2").verdict)
    'proved'
    """
    file = as_file(system)
    settings, extra = settings_and_claim(settings, extra, eps, time_step, h)
    claims, file_integrals = claimed_functions(file, extra), {**file.integrals, **file.integrals_in_iterates}
    for name, function in claims.items():
        file.require_claim(f"the integral {name}", function)
        if known and file_integrals.get(name, function) != function:
            raise InputError(f"found two integrals of the name {name}, expected different names")

    def without_proof(functions: Mapping[str, RationalFunction]) -> list[Candidate]:
        integrals = (ClaimedIntegral(k, f, settings.eps, file.map.root, file.map) for k, f in functions.items())
        return [(integral, None, "") for integral in integrals]

    candidates = without_proof(claims)
    if known or extra is None:
        candidates += known_integrals(file)
        candidates += without_proof({name: f for name, f in file_integrals.items() if name not in claims})
    if not candidates:
        raise InputError(
            f"no integral of {file.name} is known or claimed: add a section [integrals] to the file, "
            "or give --integral 'NAME=EXPRESSION', in Python extra=\"EXPRESSION\""
        )
    claim_data = [integral.seed_data for integral, _, _ in candidates]
    orbit = run_orbit(file.map, settings, claim_data, file.member is not None)
    findings = []
    max_tried = _MAX_TRIED_INTEGRALS if file.dim <= 16 else _MAX_TRIED_INTEGRALS_IN_HIGH_DIMENSION
    for k, (integral, proof, source) in enumerate(candidates):
        settings.progress(f"integral {k + 1} of {len(candidates)}")
        claim = f"{integral.name} is conserved{f', {integral.condition}' if integral.condition else ''}"
        details: dict[str, Any] = {"formula": integral.formula, "source": source}
        details["certified"] = _certified(file, integral, settings, claims)
        if _is_constant(integral, settings):
            eps_text = "" if settings.eps is None else f" at eps = {settings.eps}"
            reason = Evidence(
                "constant", f"it is a constant{eps_text}: every map conserves constants, so this is no integral"
            )
            is_claimed = isinstance(integral, ClaimedIntegral)  # the verdict of an integral from a theorem is ignored
            finding = Finding(claim, Certainty.UNDECIDED, reason, **details, applies=is_claimed)
        elif proof is not None and k >= max_tried and file.dim > 16:
            finding = Finding(f"{integral.name} is conserved", Certainty.PROVED, proof, **details)
        else:
            identity, is_tried = conservation(file.map, integral, settings.eps), k < max_tried or proof is None
            finding = certify(claim, identity, settings, proof, orbit if is_tried else None, **details)
        findings.append(finding)
    notes = []
    proved_findings = [finding for finding in findings if finding.verdict is Certainty.PROVED]
    if any(not any(e.method == "exact orbit" for e in finding.also) for finding in proved_findings):
        notes.append(f"of the proved integrals the first {max_tried} were also tried along an orbit")
    context = settings.context([file], orbit=orbit.to_json())
    known_argument = {"known": "integrals"} if known or extra is None else {}
    certified = settings.certified(file, **known_argument, **({"integrals": claims} if claims else {}))
    return Report("integrals", tuple(findings), context, notes, settings.cut_short(orbit), certified)


def _certified(
    file: SystemFile, integral: PhaseFunction, settings: Settings, claims: Mapping[str, RationalFunction]
) -> dict[str, Any]:
    """Return the arguments with which `certificate` proves an integral, or the reason why it cannot."""
    if isinstance(integral, ClaimedFunction):
        if integral.name in claims:
            return settings.certified(file, integrals={integral.name: claims[integral.name]})
        return settings.certified(file, claims=[integral.name])
    assert isinstance(integral, ImageFunction)
    if file.hamiltonian is None or integral.hamiltonian.H != file.hamiltonian.H:  # of an associated system
        reason = f"{integral.name} is a linear combination of H0, H1, ..., which have certificates"
        return {"why_not": f"{reason}: type km.certificate(system, checker)"}
    power = integral.power if isinstance(integral, CommutantIntegral) else 0
    is_form = file.member is not None and not isinstance(integral, ModifiedHamiltonian)
    return settings.certified(file, claims=[f"H{power}" if is_form else "modified_hamiltonian"])


def _is_constant(integral: PhaseFunction, settings: Settings) -> bool:
    """Return whether an integral is constant at `settings.eps`, like the modified H of 3 q^2 + p^2 at eps = 1/2.

    The answer True is exact; False is also returned if the function is too long to expand.
    """
    if isinstance(integral, ClaimedIntegral):
        return integral.is_constant
    if not isinstance(integral, ImageFunction):
        return False
    H = integral.hamiltonian
    if isinstance(integral, CommutantIntegral):  # leading term -2 x^T J C f; if C f = 0, then C (x~ - x) = 0
        return all(f.is_zero() for f in linear_combinations(integral.matrix, H.system.rhs))
    if H.is_homogeneous or H.dim > MAX_DIMENSION:
        return H.H.is_zero()  # the term of lowest degree of the integral is a multiple of H
    # Different values at two points refute constancy; equal values are weak evidence, so the integral is then expanded.
    rng = random.Random(f"constant {derive_seed(settings.seed, integral.seed_data, settings.eps)}")
    field = random_prime_field(rng)
    try:
        eps = field.random(rng) if settings.eps is None else field.convert(settings.eps)
        a, b = (integral.value(field, eps, tuple(field.random(rng) for _ in range(H.dim))) for _ in range(2))
    except (BadPrime, SingularMatrix, SingularStep):
        return False
    if not field.equal(a, b):
        return False
    functions = FunctionField([*H.system.variables, "eps"])
    *point, symbol = functions.variables
    try:
        value = integral.value(functions, symbol if settings.eps is None else settings.eps, tuple(point))
    except BudgetExceeded:
        return False
    return is_constant(value.numerator, value.denominator, H.dim)
