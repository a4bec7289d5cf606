"""The check whether two maps commute: Phi_f o Phi_g = Phi_g o Phi_f."""

from __future__ import annotations

from itertools import combinations
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import Field, rational
from kahanmaps.algebra.printing import format_number
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import certify
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report
from kahanmaps.checks.decide import Identity, Sides, decide
from kahanmaps.checks.settings import Settings, run_orbit
from kahanmaps.documents.files import SystemFile, match_variables
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.family.associated import FamilyMember
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily, SystemLike, as_map
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem

SOURCE = "petrera-suris-2016, Theorem 9"
EQUAL_STEPS = fmpq(1)
# Maximal number of pairs of maps that are also tested at random points and along an orbit; all pairs are proved.
_MAX_TRIED_PAIRS = 30
_MAX_TRIED_PAIRS_IN_HIGH_DIMENSION = 2  # above dimension 16, where the test of a pair takes many seconds


def commutativity(
    f: QuadraticSystem | MapFamily,
    g: QuadraticSystem | MapFamily,
    eps: fmpq | None,
    names: tuple[str, str],
    ratio: fmpq = EQUAL_STEPS,
) -> Identity:
    """Return Phi_f o Phi_g = Phi_g o Phi_f as an identity.

    A system stands for its Kahan map. Phi_f is taken at eps, Phi_g at `ratio` times eps. `names` are those of f and g.
    """
    f_map, g_map = as_map(f), as_map(g)

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides:
        with field.working():
            g_eps = eps_value if ratio == 1 else eps_value * field.convert(ratio)
        phi_f, phi_g = f_map.at(eps_value, field), g_map.at(g_eps, field)
        return phi_g.step(phi_f.step(point)), phi_f.step(phi_g.step(point))

    f_name, g_name = names
    labels = (f"Phi_{g_name}(Phi_{f_name}(x))", f"Phi_{f_name}(Phi_{g_name}(x))")
    data = (f_map.seed_data, g_map.seed_data, *([] if ratio == 1 else [ratio]))
    has_eps = f_map.has_eps or g_map.has_eps
    is_scaled = f_map.scales_with_eps and g_map.scales_with_eps
    root = f_map.root or g_map.root
    return Identity(f.dim, sides, eps, *labels, has_eps=has_eps, scales_with_eps=is_scaled, root=root, seed_data=data)


def _require_not_identity(file: SystemFile, letter: str, map_: MapFamily, eps: Any, seed: int) -> None:
    """Raise InputError if the map is the identity (e.g. for f = 0), since the identity commutes with every map.

    The equation x~ = x is tested at random points, with an error probability below 2^-100.
    """

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides:
        return map_.at(eps_value, field).step(point), point

    properties: dict[str, Any] = {"has_eps": map_.has_eps, "root": map_.root, "seed_data": (map_.seed_data, "identity")}
    if decide(Identity(map_.dim, sides, eps, "Phi(x)", "x", **properties), seed).verdict is Certainty.SUPPORTED:
        eps_text = "" if eps is None or file.is_quadratic or not map_.has_eps else f" at eps = {format_number(eps)}"
        raise InputError(
            f"found {file.labelled(letter)}, whose map is the identity{eps_text}, expected another: "
            "the identity commutes with every map"
        )


def check_commute(
    system: SystemLike,
    other: SystemLike | None = None,
    settings: Settings | None = None,
    eps2: Any = None,
    *,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
) -> Report:
    """Check whether the maps of two systems commute, or whether all associated maps of a member of the family commute.

    Args:
        system, other: the two systems or maps; a system stands for its Kahan map. Without `other`, `system` must be a
            member of the family, and its rational associated maps are checked pairwise. A control follows, a claim that
            is false in general: the maps of J grad H_0 and J grad H_1 = J A grad H_0 commute.
        settings: eps, seed, error bound and orbit. eps2: the eps of the second map, if it differs; then eps is
            required. eps, time_step, h: eps (half the time step) or the time step, instead of `settings.eps`.

    Returns:
        The report.

    Raises:
        InputError: if there is nothing to compare, or one of the maps is the identity.
    """
    file, settings = as_file(system), Settings.of(settings, eps, time_step, h)
    if other is None:
        if eps2 is not None:
            raise InputError("a second step needs a second system: kahanmaps check-commute SYSTEM OTHER --eps2 E")
        if file.member is None:
            raise InputError(
                f"found the single map of {file.name}, and every map commutes with itself: give a second system; "
                "only a file of kind [family] is compared with its own associated maps"
            )
        return _check_member(file, file.member, settings)
    other_file = as_file(other)
    f = file.map
    g, note = match_variables(file, other_file)
    notes = [note] if note else []
    is_same_order = set(f.variables) != set(other_file.variables) or f.variables == other_file.variables
    ratio, is_same_step = EQUAL_STEPS, True
    if eps2 is not None:
        if settings.eps is None:
            raise InputError("a second step needs the first one as well: give both --eps and --eps2")
        eps2 = rational(eps2)
        if eps2 == 0:
            raise InputError("found eps2 = 0, expected another number: at eps = 0 the Kahan map is the identity")
        ratio = eps2 / settings.eps
        note = f"the map of g at eps2 = {format_number(eps2)} is that of (eps2/eps) g at eps"
        if other_file.is_quadratic and isinstance(g, KahanFamily):
            # The Kahan map of g depends only on the product eps g.
            g, ratio, is_same_step = KahanFamily(g.system.scaled(ratio)), EQUAL_STEPS, ratio == 1
        else:
            note = f"the map of g is taken at eps2 = {format_number(eps2)}"
        notes.append(f"{note}; the evidence below is stated for eps")
    _require_not_identity(file, "f", f, settings.eps, settings.seed)
    g_eps = None if settings.eps is None else settings.eps * ratio
    _require_not_identity(other_file, "g", g, g_eps, settings.seed)
    proof = None
    if is_same_step and is_same_order and file.member is not None and other_file.member is not None:
        proof = theorems.commuting_by_involution_of_members(file.member, other_file.member)
    if proof is None and file.is_quadratic and other_file.is_quadratic and isinstance(g, KahanFamily):
        proof = theorems.commuting_by_splitting(file.system, g.system)
    identity = commutativity(f, g, settings.eps, ("f", "g"), ratio)
    orbit = run_orbit(f, settings, g.seed_data, proof is not None and file.member is not None)
    certified = settings.certified(file, commute=other_file)
    maps_text = "Kahan maps" if file.is_quadratic and other_file.is_quadratic else "maps"
    finding = certify(
        f"the {maps_text} of {file.labelled('f')} and {other_file.labelled('g')} commute",
        identity,
        settings,
        proof,
        orbit,
        formula="Phi_f o Phi_g = Phi_g o Phi_f",
        source=SOURCE if proof is not None and "Theorem 9" in proof.summary else "",
        certified=certified,
    )
    eps2_context = {"eps2": format_number(eps2)} if eps2 is not None else {}
    context = settings.context([file, other_file], orbit=orbit.to_json(), **eps2_context)
    return Report("commute", (finding,), context, notes, settings.cut_short(orbit), certified)


def _check_member(file: SystemFile, member: FamilyMember, settings: Settings) -> Report:
    _require_not_identity(file, "f_0", file.map, settings.eps, settings.seed)
    count = len(member.factors)
    notes = []
    associates = theorems.listed_associates(member)
    if count > theorems.MAX_FACTORS:
        notes.append(f"chi has {count} factors: of the 2^{count - 1} associated maps those with at most one minus sign")
    member_hypotheses = theorems.member_hypotheses(member)
    hypotheses_of = {}
    for k, associate in enumerate(associates):
        settings.progress(f"associated system {k + 1} of {len(associates)}")
        hypotheses_of[associate.label] = theorems.associated_hypotheses(member, associate)
    orbit = run_orbit(associates[0].system, settings, (member.A, member.H), is_integrable=True)

    def certify_pair(
        claim: str,
        systems: tuple[QuadraticSystem, QuadraticSystem],
        names: tuple[str, str],
        proof: Evidence | None,
        is_tried: bool = True,
        formula: str = "Phi_{0} o Phi_{1} = Phi_{1} o Phi_{0}",
        **details: Any,
    ) -> Finding:
        formula = formula.format(*names)
        details["certified"] = settings.certified(systems[0], commute=systems[1])
        if not is_tried and proof is not None:
            return Finding(claim, Certainty.PROVED, proof, formula=formula, **details)
        identity = commutativity(*systems, settings.eps, names)
        return certify(claim, identity, settings, proof, orbit if is_tried else None, formula=formula, **details)

    findings = []
    pairs = list(combinations(associates, 2))
    max_tried = _MAX_TRIED_PAIRS if member.dim <= 16 else _MAX_TRIED_PAIRS_IN_HIGH_DIMENSION
    for k, (left, right) in enumerate(pairs):
        if k < max_tried:
            settings.progress(f"pair {k + 1} of {len(pairs)}, the first {max_tried} along an orbit as well")
        proof = theorems.evidence(
            "Theorem 9 of Petrera and Suris",
            [*member_hypotheses, *hypotheses_of[left.label], *hypotheses_of[right.label]],
        )
        names = (f"f_{left.label}", f"f_{right.label}")
        claim = f"the Kahan maps of {names[0]} and {names[1]} commute"
        findings.append(certify_pair(claim, (left.system, right.system), names, proof, k < max_tried, source=SOURCE))
    if len(pairs) > max_tried:
        notes.append(
            f"the first {max_tried} pairs were also tried along an orbit; the hypotheses were verified for all"
        )
    if len(associates) == 1:
        # If chi is irreducible, f_0 and -f_0 are the only rational associated systems; their maps are inverses.
        f_0, minus_f_0 = associates[0].system, associates[0].system.scaled(-1)
        findings.append(
            certify_pair(
                "the Kahan maps of f_0 and -f_0, its only rational associated system, commute "
                "(they are inverse to each other)",
                (f_0, minus_f_0),
                ("f_0", "-f_0"),
                theorems.commuting_by_splitting(f_0, minus_f_0),
                formula="Phi_f(., eps) o Phi_f(., -eps) = id",
                source="petrera-suris-2016, eq. (eq: reversible)",
            )
        )
    irrational_factors = [f"({factor})" for factor in member.factors if factor.degree > 1]
    if irrational_factors:
        proof = theorems.commuting_over_splitting_field(member)
        reason = Evidence(theorems.METHOD, "the hypotheses of the theorem do not all hold, which decides nothing")
        claim = (
            f"over the splitting field of chi, where {', '.join(irrational_factors)} splits, the Kahan maps of all "
            f"associated systems commute pairwise"
        )
        verdict = Certainty.UNDECIDED if proof is None else Certainty.PROVED
        findings.append(Finding(claim, verdict, proof or reason, source=SOURCE))
    # The control: Phi_{H_0} and Phi_{H_1}. For m = 1 there is no H_1; the maps of f at eps and at 2 eps are compared.
    f, *other_systems = (CubicHamiltonian(H, standard_structure(member.dim)).system for H in member.chain[:2])
    g, claim, names = f.scaled(2), "control: the Kahan maps of f at eps and at 2 eps commute", ("f(eps)", "f(2 eps)")
    if member.m > 1:
        claim = "control: the Kahan maps of J grad H_0 and J grad H_1, grad H_1 = A grad H_0, commute"
        g, names = other_systems[0], ("H_0", "H_1")
    source = "petrera-suris-2016, Introduction: in general these maps do not commute"
    control = certify_pair(claim, (f, g), names, theorems.commuting_by_splitting(f, g), control=True, source=source)
    if not control.is_as_expected:
        notes.append(
            "the control was not refuted: these maps commute as well, so this member cannot show that the check "
            "is able to fail"
        )
    context = settings.context([file], orbit=orbit.to_json(), m=member.m, factors=[str(f) for f in member.factors])
    certified_all = settings.certified(file, commute="associates")
    return Report("commute", (*findings, control), context, notes, settings.cut_short(orbit), certified_all)
