"""Certify that the Kahan maps of f and of g, or of a linear family of g, commute: by a lemma, or at random points.

The lemmas are the splitting lemma of checks/theorems.py and the following two; all hypotheses are verified exactly.

affine       One of the fields is affine, with linear part B. Its Kahan map x -> P x + q commutes with the map of the
             other field g if P g(x) = g(P x + q). This equation is linear in g. Multiplied by det(I - eps B)^2 it has
             degree at most 2n in eps, so it holds for every eps if it holds at 2n + 1 values of eps.
dimension 1  The Kahan map of a x^2 + b x + c is the Moebius map of I + eps M with M = [[b, 2c], [-2a, -b]]. Since M is
             linear in the field, the matrices of proportional fields commute.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flint import fmpq, fmpq_mat

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.matrices import rank
from kahanmaps.algebra.polynomials import ring
from kahanmaps.algebra.small_systems import SolutionComponent
from kahanmaps.algebra.work import count_work
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import certify
from kahanmaps.checks.claims import Evidence, Finding
from kahanmaps.checks.commute import commutativity
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.settings import Settings
from kahanmaps.laboratory.symmetry.commuting_space import CommutingSpace, coefficients_of, combination, field_at
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.quadratic import QuadraticSystem

_FORMULA = "Phi_f o Phi_g = Phi_g o Phi_f"


def certify_field(f: QuadraticSystem, g: QuadraticSystem, settings: Settings) -> Finding:
    """Certify that the Kahan maps of f and g commute at equal eps, for every eps.

    `settings` has the random seed and `error_bits`. The finding is proved, refuted with a witness, or supported with
    the probability of error below 2^-error_bits. Source: schwartz-1980.

    >>> f = QuadraticSystem.from_text(["x", "y"], ["x^2", "y^2 + x"])
    >>> str(certify_field(f, f.scaled(-1), Settings()).verdict), str(certify_field(f, f.scaled(2), Settings()).verdict)
    ('proved', 'refuted')
    """
    claim, certified_objects = "the Kahan maps of f and g commute", {"system": f, "commute": g}
    for factor, text in ((1, "g = f"), (-1, "g = -f, and its map is the inverse"), (0, "g = 0, and its map is x -> x")):
        if g == f.scaled(factor):
            evidence = Evidence(theorems.METHOD, text)
            return Finding(claim, theorems.PROVED, evidence, formula=_FORMULA, certified=certified_objects)
    count_work(2_000 + 350 * f.dim**2)
    identity = commutativity(f, g, None, ("f", "g"))
    proof = theorems.commuting_by_splitting(f, g) or proof_by_affine_lemma(f, [g]) or _proof_in_dimension_one(f, g)
    return certify(claim, identity, settings, proof, formula=_FORMULA, certified=certified_objects)


def certify_family(f: QuadraticSystem, space: CommutingSpace, family: SolutionComponent, settings: Settings) -> Finding:
    """Certify that the Kahan maps of f and of every g of a linear family in the space commute, for every eps."""
    count_work(2_000 + 350 * f.dim**2 * len(family.free))
    members = [field_at(space, family.point), *(field_at(space, family.direction(i)) for i in family.free)]
    proof = proof_by_affine_lemma(f, members) or _proof_in_dimension_one(f, f)
    claim = "the Kahan maps of f and of every member g of the family commute"
    return certify(claim, _family_identity(f, space, family), settings, proof, formula=_FORMULA)


def proof_by_affine_lemma(f: QuadraticSystem, fields: Sequence[QuadraticSystem]) -> Evidence | None:
    """Return evidence by the lemma of affine maps for f and all g in `fields`; None if the lemma does not apply."""
    if f.degree <= 1:
        name, pairs = "f", [(f, g) for g in fields]
    elif len(fields) == 1 and fields[0].degree <= 1:
        name, pairs = "g", [(fields[0], f)]
    else:
        return None
    n, eps_count = f.dim, 2 * f.dim + 1
    identity, is_symmetric = QQ.identity(n), True
    for a, h in pairs:  # test at enough values of eps whether the affine Kahan map of a is a symmetry of h
        checked_count, k = 0, 0
        while is_symmetric and checked_count < eps_count:
            k += 1
            matrix = identity - a.B * fmpq(1, k)
            if matrix.det() != 0:
                P = matrix.solve(identity + a.B * fmpq(1, k))
                q = matrix.solve(fmpq_mat(n, 1, list(a.c))) * fmpq(2, k)
                is_symmetric = h.composed(P, q.entries()) == h.transformed(P)
                checked_count += 1
    equation = f"P h(x) = h(P x + q) for its map x -> P x + q and the other field h, at {eps_count} values of eps"
    return theorems.evidence("the lemma of affine maps", [(f"{name} is affine", True), (equation, is_symmetric)])


def _proof_in_dimension_one(f: QuadraticSystem, g: QuadraticSystem) -> Evidence | None:
    if f.dim > 1:
        return None
    are_proportional = rank(QQ, fmpq_mat([*coefficients_of(f), *coefficients_of(g)])) <= 1
    return theorems.evidence(
        "the lemma of Moebius maps", [("f and g are proportional, in dimension 1", are_proportional)]
    )


def _family_identity(f: QuadraticSystem, space: CommutingSpace, family: SolutionComponent) -> Identity:
    """Return the identity Phi_f o Phi_g = Phi_g o Phi_f in x, eps and the free parameters of the family of g."""
    n, free_indices = f.dim, family.free
    zero = family.values[0].context().constant(0)
    coefficients = combination(space.fields, family.values, zero)
    # The free parameters are the symbols of g.
    symbols = [f"{''.join(f.variables)}{k}" for k in range(len(free_indices))]
    joint = ring((*f.variables, *symbols))
    parameters = dict(zip(free_indices, joint.gens()[n:], strict=True))
    arguments = [parameters.get(k, joint.constant(0)) for k in range(len(family.values))]
    weights = [value.compose(*arguments, ctx=joint) for value in family.values]
    rhs = [0 * joint.gen(0)] * n
    for weight, g in zip(weights, space.fields, strict=True):
        rhs = [entry + weight * p.compose(*joint.gens()[:n], ctx=joint) for entry, p in zip(rhs, g.rhs, strict=True)]
    family_f, family_g = KahanFamily(f), KahanFamily(QuadraticSystem(tuple(rhs), tuple(symbols)))

    def sides(field: Field, point: tuple[Any, ...], eps: Any) -> Sides:
        phi_f, phi_g, x = family_f.at(eps, field), family_g.at(eps, field, point[n:]), point[:n]
        return phi_g.step(phi_f.step(x)), phi_f.step(phi_g.step(x))

    labels = ("Phi_g(Phi_f(x))", "Phi_f(Phi_g(x))")
    identity_key = (f.rhs, coefficients, free_indices)
    return Identity(n + len(free_indices), sides, None, *labels, seed_data=identity_key)
