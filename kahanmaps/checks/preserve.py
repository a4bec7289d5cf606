"""Invariant measures and Poisson structures of Kahan maps."""

from __future__ import annotations

from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks import theorems
from kahanmaps.checks.claims import Evidence, Report
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.judge import Contradiction, judge
from kahanmaps.checks.settings import Settings, run_orbit
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.invariants.measures import (
    ClaimedDensity,
    DeterminantDensity,
    jacobian_determinant_sides,
)
from kahanmaps.invariants.phase_functions import PhaseFunction
from kahanmaps.invariants.poisson import jacobi_defects, transformation_sides
from kahanmaps.maps.implicit import BirationalMap, MapOver
from kahanmaps.maps.kahan import Kahan, KahanMap, as_map
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem


def density_identity(system: QuadraticSystem | BirationalMap, density: PhaseFunction, eps: fmpq | None) -> Identity:
    """phi(x~) det M(x) = phi(x) det N(x, x~): the measure dx/phi is invariant; dPhi(x) is M^{-1} N.

    A system stands for its Kahan map, with M = I - eps f'(x) and N = I + eps f'(x~).
    """
    map_ = as_map(system)

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        kahan = map_.at(eps_value, field)
        image = _image(kahan, point)
        after, before = density.value(field, eps_value, image), density.value(field, eps_value, point)
        if after is None or before is None:
            return None
        above, below = jacobian_determinant_sides(kahan, point, image)
        if field.is_zero(above) or field.is_zero(below):
            return None  # where the map has no inverse both sides may vanish, and say nothing of a measure
        return [after * below], [before * above]

    labels = ("phi(x~) det(I - eps f'(x))", "phi(x) det(I + eps f'(x~))")
    if not isinstance(map_, Kahan):
        labels = ("phi(x~) det M(x)", "phi(x) det N(x, x~)")
    subject = (map_.subject, density.subject)
    no_value = "the map seems to have no inverse, or no value, or a denominator to vanish identically"
    return Identity(map_.dim, sides, eps, *labels, no_value=no_value, has_eps=map_.has_eps, subject=subject)


def _image(kahan: MapOver, point: tuple[Any, ...]) -> tuple[Any, ...]:
    """x~, put into the defining equation.

    The formula for dPhi that both laws use comes from this equation; the laws themselves would not notice a wrong
    x~: for phi = det(I - eps f') of a Hamiltonian f, and for Pi of the family, they hold at any two points x and x~.
    """
    image = kahan.step(point)
    field = kahan.field
    if not isinstance(kahan, KahanMap) or (field is not QQ and not field.characteristic):
        return image  # expanding it would cost much and add nothing to what points have shown
    factor = field.convert(2) * kahan.eps
    means = kahan.local.polarised(point, image)
    for x, after, mean in zip(point, image, means, strict=True):
        if not field.equal(after - x, factor * mean):
            raise Contradiction("the point computed for x~ does not satisfy the defining equation of the Kahan map")
    return image


def check_measure(file: SystemFile, settings: Settings | None = None, extra: RationalFunction | None = None) -> Report:
    """Is dx/phi invariant: for phi = det(I - eps f') of Hamiltonian systems, for the file's [density], for `extra`?

    Raises InputError where no density is known or claimed.
    """
    settings = settings or Settings()
    candidates: list[tuple[DeterminantDensity | ClaimedDensity, Evidence | None, str]] = []
    if file.hamiltonian is not None:
        proof = theorems.determinant_density_invariant(file.hamiltonian)
        candidates.append((DeterminantDensity(file.system), proof, "petrera-suris-2016, eq. (eq: CMOQ measure)"))
    if extra is not None:
        file.require_claim("a density", extra)
    for function in (file.density, extra):
        if function is not None:
            candidates.append((ClaimedDensity(function, settings.eps), None, ""))
    if not candidates:
        raise InputError(
            f"no density of {file.name} is known or claimed: add a section [density] with phi to the file, "
            "or give --density EXPRESSION (the measure is dx/phi)"
        )
    claimed = [density.subject for density, _, _ in candidates]
    orbit = run_orbit(file.map, settings, claimed, file.member is not None)
    findings = tuple(
        judge(
            f"the measure dx/phi is invariant{f', {density.condition}' if density.condition else ''}",
            density_identity(file.map, density, settings.eps),
            settings,
            proof,
            orbit,
            formula=density.formula,
            source=source,
        )
        for density, proof, source in candidates
    )
    context = settings.context([file], orbit=orbit.to_json())
    return Report("measure", findings, context, ended_early=settings.cut_short(orbit))


def transformation_identity(hamiltonian: CubicHamiltonian, eps: fmpq | None) -> Identity:
    """dPhi Pi(x) dPhi^T = Pi(x~), multiplied out."""
    n = hamiltonian.dim

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides:
        kahan = KahanMap(hamiltonian.system, eps_value, field)
        left, right = transformation_sides(kahan, hamiltonian, point, _image(kahan, point))
        return left.entries(), right.entries()

    entries = tuple(f"entry ({i + 1},{j + 1})" for i in range(n) for j in range(n))
    labels = ("(I + eps f'(x~)) Pi(x) (I + eps f'(x~))^T", "(I - eps f'(x)) Pi(x~) (I - eps f'(x))^T")
    subject = (hamiltonian.H, hamiltonian.J)
    return Identity(n, sides, eps, *labels, entries, subject=subject)


def jacobi_identity(hamiltonian: CubicHamiltonian, eps: fmpq | None) -> Identity:
    """The Jacobi identity of Pi for all triples of coordinates."""
    n = hamiltonian.dim

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides:
        defects = jacobi_defects(hamiltonian, field, eps_value, point)
        return defects, [field.zero] * len(defects)

    entries = tuple(
        f"triple ({i + 1},{j + 1},{k + 1})" for i in range(n) for j in range(i + 1, n) for k in range(j + 1, n)
    )
    subject = (hamiltonian.H, hamiltonian.J)
    return Identity(n, sides, eps, "the cyclic sum", "what it should be", entries, subject=subject)


def check_poisson(file: SystemFile, settings: Settings | None = None) -> Report:
    """Is Pi(x) = J - eps^2 f'(x)^2 J a Poisson tensor that the Kahan map preserves?

    Raises InputError for systems without a Hamiltonian.
    """
    settings = settings or Settings()
    if file.hamiltonian is None:
        raise InputError(
            f"{file.name} is of kind [{file.kind}]: Pi(x) = J - eps^2 f'(x)^2 J needs a Hamiltonian system, "
            "expected a file of kind [hamiltonian] or [family]"
        )
    hamiltonian = file.hamiltonian
    proof = theorems.poisson_tensor_invariant(hamiltonian, file.member)
    orbit = run_orbit(file.system, settings, (hamiltonian.H, hamiltonian.J), file.member is not None)
    source = "petrera-suris-2016, Theorem 12" if file.member is not None else ""
    law = judge(
        "the Kahan map is Poisson for Pi",
        transformation_identity(hamiltonian, settings.eps),
        settings,
        proof,
        orbit,
        formula="dPhi(x) Pi(x) dPhi(x)^T = Pi(x~), Pi(x) = J - eps^2 f'(x)^2 J",
        source=source,
    )
    jacobi = judge(
        "Pi is a Poisson tensor",
        jacobi_identity(hamiltonian, settings.eps),  # of x alone: an orbit would add nothing
        settings,
        proof,
        formula="sum_l Pi_il d_l Pi_jk + cyclic = 0",
        source=source,
    )
    context = settings.context([file], orbit=orbit.to_json())
    return Report("poisson", (law, jacobi), context, ended_early=settings.cut_short(orbit))
