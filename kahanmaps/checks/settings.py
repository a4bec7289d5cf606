"""The settings of a check, the exact orbit along which claims are tested, and the data needed to reproduce a report."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.etale import EtaleElement
from kahanmaps.algebra.fields import QQ, rational
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_number
from kahanmaps.checks.claims import Evidence, Witness
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS, Identity, witness_of
from kahanmaps.display_protocols import PrintableResult, ResultPart
from kahanmaps.documents.expressions import formula_text
from kahanmaps.documents.files import SystemFile
from kahanmaps.documents.iterates import parse_with_iterates
from kahanmaps.errors import InputError
from kahanmaps.invariants.poisson import MatrixPoissonTensor
from kahanmaps.maps.convention import eps_record, resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import as_map
from kahanmaps.maps.orbits.iteration import Orbit, OrbitEnd, require_short
from kahanmaps.systems.quadratic import QuadraticSystem
from kahanmaps.version import __version__

MAX_STEPS = 10_000  # maximal length of the exact orbit, all of whose points are stored


@dataclass(frozen=True)
class Settings:
    """The settings of a check.

    `eps` is half the time step; None means every eps. Claims are also tested along `steps` steps of an exact orbit from
    the initial point `start` (None: a random point). The orbit ends at a coordinate with more than `max_digits` digits
    (None: a default that depends on the dimension). `eps` and the coordinates may be any exact numbers: 1,
    Fraction(1, 10), "1/10"; coordinates may also be elements of one number field. `orbit_is_requested` means that the
    user gave `start` or `steps`; the report then says whether the orbit was completed.
    """

    eps: fmpq | None = None
    start: tuple[Any, ...] | None = None
    steps: int = 10
    seed: int = 0
    error_bits: int = DEFAULT_ERROR_BITS
    max_digits: int | None = None
    orbit_is_requested: bool = False
    progress: Callable[[str], None] = lambda _: None

    def __post_init__(self) -> None:
        if self.eps is not None:
            object.__setattr__(self, "eps", rational(self.eps))
        if self.start is not None:
            start = tuple(entry if isinstance(entry, EtaleElement) else rational(entry) for entry in self.start)
            object.__setattr__(self, "start", start)
        if self.eps == 0:
            raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
        if not 0 <= self.steps <= MAX_STEPS:
            raise InputError(f"found {self.steps} steps, expected 0 to {MAX_STEPS}")
        require_short(self.eps, [x for x in self.start or () if isinstance(x, fmpq)], self.max_digits)
        if not 1 <= self.error_bits <= 10_000:
            raise InputError(f"found an error bound of {self.error_bits} bits, expected 1 to 10000")

    @classmethod
    def of(cls, settings: Settings | None, eps: Any, time_step: Any, h: Any = None) -> Settings:
        """Return the settings (None: the default settings). If eps or the time step is given, it replaces their eps."""
        settings, eps = settings or cls(), resolve_eps(eps, time_step, h)
        return settings if eps is None else replace(settings, eps=eps)

    def cut_short(self, run: OrbitRun) -> bool:
        """Return whether an orbit that the user requested ended early."""
        return self.orbit_is_requested and not run.end.is_complete

    def certified(self, system: Any, **arguments: Any) -> dict[str, Any]:
        """Return the arguments with which `certificate` proves a claim; if eps is fixed, the reason why it cannot."""
        if self.eps is not None:
            return {"why_not": f"a certificate is about a map, for every eps: found a claim for eps = {self.eps}"}
        return {"system": system, **arguments}

    def context(self, files: Sequence[SystemFile], **details: Any) -> dict[str, Any]:
        """Return the data needed to reproduce the check, including the documents of its systems."""
        return {
            "version": __version__,
            "system": files[0].name,
            **({"other": files[1].name} if len(files) > 1 else {}),
            **eps_record(self.eps, *(file.map for file in files)),
            "arithmetic": "exact",
            "seed": self.seed,
            "error_bits": self.error_bits,
            **details,
            "document": files[0].document,
            **({"other_document": files[1].document} if len(files) > 1 else {}),
        }


@dataclass(frozen=True)
class OrbitRun:
    """An exact orbit, along which identities are tested."""

    start: tuple[Any, ...]
    points: tuple[tuple[Any, ...], ...]
    eps: fmpq
    end: OrbitEnd

    def to_json(self) -> dict[str, Any]:
        return {
            "start": [str(entry) for entry in self.start],
            "eps": format_number(self.eps),
            "steps": self.end.steps,
            "status": self.end.status,
            "message": self.end.message,
        }


def random_starts(dim: int, seed: int) -> Iterator[tuple[fmpq, ...]]:
    """Yield random rational points of small height; they depend on the seed only.

    No coordinate is 0: many systems leave the subspace x_i = 0 invariant, and a false claim may hold on it.

    >>> next(random_starts(2, seed=0))
    (1, -2/3)
    """
    rng = random.Random(f"start {seed}")
    while True:
        yield tuple(fmpq(rng.choice((-1, 1)) * rng.randint(1, 5), rng.randint(1, 5)) for _ in range(dim))


def run_orbit(
    system: QuadraticSystem | MapFamily,
    settings: Settings,
    claim_data: Sequence[Any] = (),
    is_integrable: bool = False,
) -> OrbitRun:
    """Compute the exact orbit of the given initial point; otherwise draw random points until an orbit is not singular.

    A claim for every eps is tested at a random eps. Random choices depend on the system and on `claim_data`, so that no
    claim can be constructed for an orbit known in advance. At most 20 random points are drawn.
    """
    seed = derive_seed(settings.seed, as_map(system).seed_data, settings.eps, claim_data)
    rng = random.Random(f"eps {seed}")
    eps = settings.eps if settings.eps is not None else fmpq(rng.randint(1, 3), rng.randint(7, 20))
    number_fields = [entry.field for entry in settings.start or () if isinstance(entry, EtaleElement)]
    map_at_eps = as_map(system).at(eps, number_fields[0] if number_fields else QQ)
    # A claim about the second iterate of a point multiplies the number of digits by dim^2, and the solution of its
    # linear system multiplies it by dim. For members of the family the number of digits hardly grows with the steps.
    default_max_digits = 5_000 if is_integrable else max(100, 60_000 // map_at_eps.dim**2)
    max_digits = default_max_digits if settings.max_digits is None else settings.max_digits
    random_points = random_starts(map_at_eps.dim, seed)
    attempt = 0
    while True:
        start = settings.start if settings.start is not None else next(random_points)
        orbit = Orbit(map_at_eps, start, settings.steps, max_digits=max_digits)
        points = []
        for point in orbit:
            settings.progress(f"orbit: step {point.step} of {settings.steps}")
            points.append(point.x)
        end = orbit.end
        if end is None:  # impossible: the loop has exhausted the orbit
            raise AssertionError("an orbit ended without a status")
        attempt += 1
        if end.status != "singular" or settings.start is not None or attempt >= 20:
            return OrbitRun(orbit.start, tuple(points), eps, end)


def try_along_orbit(identity: Identity, run: OrbitRun) -> tuple[Evidence, Witness | None]:
    """Test an identity at the points of an exact orbit; return the evidence, and a witness if the identity fails."""
    tried_count = undefined_count = 0
    number_fields = [entry.field for entry in run.start if isinstance(entry, EtaleElement)]
    ground_field = number_fields[0] if number_fields else identity.ground
    for orbit_point in run.points:
        point, eps = tuple(map(ground_field.convert, orbit_point)), ground_field.convert(run.eps)
        sides = identity.at(ground_field, point, eps)
        if sides is None:
            undefined_count += 1
            continue
        tried_count += 1
        witness = witness_of(identity, ground_field, point, eps, sides)
        if witness is not None:
            text = f"fails at step {tried_count + undefined_count - 1} of an exact orbit"
            return Evidence("exact orbit", text, _orbit_data(run, tried_count, undefined_count)), witness
    eps_text = f", eps = {format_number(run.eps)}" if identity.has_eps else ""
    text = f"held exactly at {tried_count} point{'s' * (tried_count != 1)} of an orbit{eps_text}"
    if not tried_count:
        text = f"could not be tried at any point of an orbit{eps_text}"
    if undefined_count:
        text += f", undefined at {undefined_count}"
    if not run.end.is_complete:
        text += f" ({run.end.message})"
    return Evidence("exact orbit", text, _orbit_data(run, tried_count, undefined_count)), None


def _orbit_data(run: OrbitRun, tried_count: int, undefined_count: int) -> Mapping[str, Any]:
    return {"points": tried_count, "undefined_at": undefined_count, "eps": format_number(run.eps)}


# ---- claims of the user: formulas as text or SymPy expressions ----------------------------------------------------


def settings_and_claim(
    settings: Settings | Any, extra: Any, eps: Any = None, time_step: Any = None, h: Any = None
) -> tuple[Settings, Any]:
    """Return (settings, claim), also if the claim was passed as `settings`; a given eps or step replaces its eps."""
    if settings is None or isinstance(settings, Settings):
        return Settings.of(settings, eps, time_step, h), extra
    if extra is not None:
        raise InputError(f"expected Settings as second argument, since the third is a claim; got {settings!r}")
    return Settings.of(None, eps, time_step, h), settings


def claimed_function(file: SystemFile, claim: Any) -> RationalFunction:
    """Convert a claim to a function of the variables of a file, eps, and iterates of the variables if the claim has x~.

    A claim is a function, a result of a search, a formula in variables, parameters and eps, or the name of an integral.
    """
    claim = getattr(claim, "function", claim) if isinstance(claim, ResultPart) else claim
    if isinstance(claim, RationalFunction):
        return claim
    file_integrals, names = {**file.integrals, **file.integrals_in_iterates}, file.claim_names
    if isinstance(claim, str) and claim in file_integrals and claim not in names:
        return file_integrals[claim]
    return parse_with_iterates(formula_text(claim), names[: file.dim], names[file.dim :], file.parameters)


def claimed_functions(file: SystemFile, claims: Any) -> dict[str, RationalFunction]:
    """Map names of claims to functions; claims without a name are called I1, I2, ... (names in use are skipped)."""
    if claims is None:
        return {}
    if not isinstance(claims, Mapping):
        unnamed_claims = list(claims) if isinstance(claims, list | tuple | PrintableResult) else [claims]
        file_integrals = {**file.integrals, **file.integrals_in_iterates}
        unused_names = (f"I{k}" for k in count(1) if f"I{k}" not in file_integrals)
        claims = {
            function if isinstance(function, str) and function in file_integrals else next(unused_names): function
            for function in unnamed_claims
        }
    if not claims:
        raise InputError(
            "found no integral, expected at least one, or None for the known integrals and those of the file"
        )
    return {name: claimed_function(file, value) for name, value in claims.items()}


def claimed_tensor(file: SystemFile, claim: Any) -> MatrixPoissonTensor | None:
    """Convert a matrix of formulas to a tensor. Raises InputError if the matrix is not skew-symmetric."""
    claim = getattr(claim, "tensor", claim) if isinstance(claim, ResultPart) else claim
    if claim is None or isinstance(claim, MatrixPoissonTensor):
        return claim
    rows = claim.tolist() if hasattr(claim, "tolist") else claim
    if not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) for row in rows):
        raise InputError(f"found {claim!r}, expected a matrix of formulas: [['0', 'x*y'], ['-x*y', '0']]")
    return MatrixPoissonTensor([[claimed_function(file, entry) for entry in row] for row in rows])
