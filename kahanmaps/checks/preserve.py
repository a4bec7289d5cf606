"""The checks of invariant measures and Poisson structures."""

from __future__ import annotations

from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.checks import theorems
from kahanmaps.checks.certify import Contradiction, certify
from kahanmaps.checks.claims import Evidence, Report
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.settings import Settings, claimed_function, claimed_tensor, run_orbit, settings_and_claim
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError
from kahanmaps.invariants.integrals_and_densities import (
    ClaimedDensity,
    DeterminantDensity,
    PhaseFunction,
    jacobian_determinant_fraction,
)
from kahanmaps.invariants.poisson import (
    HamiltonianTensor,
    MatrixPoissonTensor,
    PoissonTensor,
    jacobi_defects,
    tensor_condition,
    transformation_sides,
)
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.maps.kahan import KahanFamily, KahanMap, SystemLike, as_map
from kahanmaps.systems.quadratic import QuadraticSystem

_UNDEFINED_TENSOR = "the map seems to be defined nowhere, or the tensor or a denominator to vanish identically"


def density_identity(system: QuadraticSystem | MapFamily, density: PhaseFunction, eps: fmpq | None) -> Identity:
    """Return the identity phi(x~) det M(x) = phi(x) det N(x, x~), which says that the measure dx/phi is invariant.

    Here dPhi(x) = M^{-1} N and x~ = Phi(x). A system stands for its Kahan map: M = I - eps f'(x), N = I + eps f'(x~).
    """
    map_ = as_map(system)

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        map_at_eps = map_.at(eps_value, field)
        image = _image(map_at_eps, point)
        image_density, point_density = density.value(field, eps_value, image), density.value(field, eps_value, point)
        if image_density is None or point_density is None:
            return None
        numerator, denominator = jacobian_determinant_fraction(map_at_eps, point, image)
        if field.is_zero(numerator) or field.is_zero(denominator):
            return None  # if the map has no inverse, both sides may be 0, and the identity is trivial
        return [image_density * denominator], [point_density * numerator]

    labels = ("phi(x~) det(I - eps f'(x))", "phi(x) det(I + eps f'(x~))")
    if not isinstance(map_, KahanFamily):
        labels = ("phi(x~) det M(x)", "phi(x) det N(x, x~)")
    data = (map_.seed_data, density.seed_data)
    undefined_reason = "the map seems to have no inverse, to be defined nowhere, or a denominator to vanish identically"
    properties: dict[str, Any] = {"has_eps": map_.has_eps, "root": map_.root, "seed_data": data}
    properties["scales_with_eps"] = map_.scales_with_eps and density.scales_with_eps
    return Identity(map_.dim, sides, eps, *labels, undefined_reason=undefined_reason, **properties)


def _image(map_at_eps: Map, point: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the image x~ of the point x, after a test that x and x~ satisfy the equation of the Kahan map.

    The formula for dPhi follows from the equation. Without the test a wrong x~ would not be noticed: the identities for
    phi = det(I - eps f') with Hamiltonian f, and for Pi of the family, hold at arbitrary points x and x~.
    """
    image = map_at_eps.step(point)
    field = map_at_eps.field
    if not isinstance(map_at_eps, KahanMap) or (field is not QQ and not field.characteristic):
        return image  # over other fields it takes long; tests over Q and GF(p) suffice
    factor = field.convert(2) * map_at_eps.eps
    polarized_values = map_at_eps.local.polarised(point, image)
    for x, x_tilde, polarized_value in zip(point, image, polarized_values, strict=True):
        if not field.equal(x_tilde - x, factor * polarized_value):
            raise Contradiction("the point computed for x~ does not satisfy the defining equation of the Kahan map")
    return image


def check_measure(
    system: SystemLike,
    settings: Settings | Any = None,
    extra: RationalFunction | Any = None,
    *,
    known: bool = False,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
) -> Report:
    """Check whether the measure dx/phi is invariant.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        settings: eps, seed, error bound and orbit. If it is omitted, `extra` may be the second argument.
        extra: phi, as a function, text or SymPy expression. By default, det(I - eps f') (for Hamiltonian systems) and
            the [density] of the file (if there is one) are checked.
        known: whether these default densities are checked in addition to `extra`.
        eps, time_step, h: eps (half the time step) or the time step, instead of `settings.eps`.

    Returns:
        The report.

    Raises:
        InputError: if no density is known or claimed.

    >>> from kahanmaps.documents.inline import System
    >>> str(check_measure(System("x' = x*(1 - y); y' = y*(x - 2)"), "x*y").verdict)
    'proved'
    """
    file = as_file(system)
    settings, extra = settings_and_claim(settings, extra, eps, time_step, h)
    candidates: list[tuple[DeterminantDensity | ClaimedDensity, Evidence | None, str, dict[str, Any]]] = []

    def add(function: RationalFunction) -> None:
        proof = theorems.product_density_invariant(file.system, function) if file.is_quadratic else None
        density = ClaimedDensity(function, settings.eps, file.map.root)
        candidates.append((density, proof, "", settings.certified(file, density=function)))

    if extra is not None:
        phi = claimed_function(file, extra)
        file.require_claim("a density", phi)
        add(phi)
    if known or extra is None:
        if file.hamiltonian is not None:
            proof = theorems.cubic_hamiltonian(file.hamiltonian)
            certified = settings.certified(file, claims=["volume" if file.density is None else "determinant"])
            source = "petrera-suris-2016, eq. (eq: CMOQ measure)"
            candidates.append((DeterminantDensity(file.system), proof, source, certified))
        if file.density is not None:
            add(file.density)
    if not candidates:
        raise InputError(
            f"no density of {file.name} is known or claimed: add a section [density] with phi to the file, "
            'or give --density EXPRESSION, in Python extra="EXPRESSION" (the measure is dx/phi)'
        )
    claim_data = [density.seed_data for density, *_ in candidates]
    orbit = run_orbit(file.map, settings, claim_data, file.member is not None)
    findings = tuple(
        certify(
            f"the measure dx/phi is invariant{f', {density.condition}' if density.condition else ''}",
            density_identity(file.map, density, settings.eps),
            settings,
            proof,
            orbit,
            formula=density.formula,
            source=source,
            certified=certified,
        )
        for density, proof, source, certified in candidates
    )
    context = settings.context([file], orbit=orbit.to_json())
    known_argument = {"known": "measure"} if known or extra is None else {}
    certified = settings.certified(file, **known_argument, **({} if extra is None else {"density": phi}))
    return Report("measure", findings, context, (), settings.cut_short(orbit), certified)


def transformation_identity(map_: MapFamily, tensor: PoissonTensor, eps: fmpq | None) -> Identity:
    """Return the identity dPhi P(x) dPhi^T = P(x~) for the matrix P of `tensor`, without the denominator of dPhi."""
    n = map_.dim

    def sides(field: Field, point_and_values: tuple[Any, ...], eps_value: Any) -> Sides | None:
        point, values = point_and_values[:n], point_and_values[n:]
        map_at_eps = map_.at(eps_value, field, values)
        sides_at_point = transformation_sides(map_at_eps, tensor, point, _image(map_at_eps, point), values)
        return None if sides_at_point is None else (sides_at_point[0].entries(), sides_at_point[1].entries())

    entries = tuple(f"entry ({i + 1},{j + 1})" for i in range(n) for j in range(n))
    labels = ("N(x, x~) P(x) N(x, x~)^T", "M(x) P(x~) M(x)^T")
    if isinstance(map_, KahanFamily):
        labels = ("(I + eps f'(x~)) P(x) (I + eps f'(x~))^T", "(I - eps f'(x)) P(x~) (I - eps f'(x))^T")
    labels = (labels[0].replace("P", tensor.name), labels[1].replace("P", tensor.name))
    data, dim = (map_.seed_data, tensor.seed_data), n + len(map_.symbols)
    has_eps = map_.has_eps or tensor.has_eps
    return Identity(
        dim, sides, eps, *labels, entries, has_eps=has_eps, undefined_reason=_UNDEFINED_TENSOR, seed_data=data
    )


def jacobi_identity(tensor: PoissonTensor, eps: fmpq | None) -> Identity:
    """Return the Jacobi identity of a tensor: the cyclic sums over all triples of coordinates vanish."""
    n = tensor.dim

    def sides(field: Field, point: tuple[Any, ...], eps_value: Any) -> Sides | None:
        defects = jacobi_defects(tensor, field, eps_value, point)
        return None if defects is None else (defects, [field.zero] * len(defects))

    entries = tuple(
        f"triple ({i + 1},{j + 1},{k + 1})" for i in range(n) for j in range(i + 1, n) for k in range(j + 1, n)
    )
    labels, dim = ("the cyclic sum", "what it should be"), n + len(tensor.symbols)
    data = tensor.seed_data
    return Identity(
        dim, sides, eps, *labels, entries, has_eps=tensor.has_eps, undefined_reason=_UNDEFINED_TENSOR, seed_data=data
    )


def check_poisson(
    system: SystemLike,
    settings: Settings | Any = None,
    extra: MatrixPoissonTensor | Any = None,
    *,
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
) -> Report:
    """Check whether a tensor is a Poisson tensor that the map preserves.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        settings: eps, seed, error bound and orbit. If it is omitted, `extra` may be the second argument.
        extra: the tensor, or a matrix of formulas. By default Pi(x) = J - eps^2 f'(x)^2 J, for Hamiltonian systems.
        eps, time_step, h: eps (half the time step) or the time step, instead of `settings.eps`.

    Returns:
        The report: the transformation law and the Jacobi identity.

    Raises:
        InputError: if the system has no Hamiltonian and no tensor is given, or if the tensor has another dimension or
            is identically zero.
    """
    file = as_file(system)
    settings, extra = settings_and_claim(settings, extra, eps, time_step, h)
    extra = claimed_tensor(file, extra)
    proof, source, condition = None, "", ""
    tensor: PoissonTensor
    if extra is not None:
        if extra.dim != file.dim:
            raise InputError(f"found a tensor in dimension {extra.dim}, expected {file.dim} as the map has")
        for row in extra.rows:
            for entry in row:
                file.require_claim("an entry of a tensor", entry)
        tensor, condition = extra, tensor_condition(extra, settings.eps)
    elif file.hamiltonian is not None:
        tensor = HamiltonianTensor(file.hamiltonian)
        proof = theorems.poisson_tensor_invariant(file.hamiltonian, file.member)
        source = "petrera-suris-2016, Theorem 12" if file.member is not None else ""
    elif file.map.unsupported_reason:
        raise InputError(file.map.unsupported_reason)
    else:
        raise InputError(
            f"{file.name} is of kind [{file.kind}]: Pi(x) = J - eps^2 f'(x)^2 J needs a Hamiltonian system, "
            "expected a file of kind [hamiltonian] or [family], or a tensor: --tensor FILE, in Python its rows"
        )
    orbit = run_orbit(file.map, settings, tensor.seed_data, file.member is not None)
    name, scope = tensor.name, f", {condition}" if condition else ""
    certified = settings.certified(file, **({"known": "poisson"} if extra is None else {"tensor": extra}))
    law = certify(
        f"the {'Kahan ' * isinstance(file.map, KahanFamily)}map is Poisson for {name}{scope}",
        transformation_identity(file.map, tensor, settings.eps),
        settings,
        proof,
        orbit,
        formula=f"dPhi(x) {name}(x) dPhi(x)^T = {name}(x~), {tensor.formula}",
        source=source,
        certified=certified,
    )
    jacobi = certify(
        f"{name} is a Poisson tensor{scope}",
        jacobi_identity(tensor, settings.eps),  # an identity in x alone, so an orbit adds no evidence
        settings,
        proof,
        formula=f"sum_l {name}_il d_l {name}_jk + cyclic = 0",
        source=source,
        certified=certified,
    )
    context = settings.context([file], orbit=orbit.to_json())
    return Report("poisson", (law, jacobi), context, (), settings.cut_short(orbit), certified)
