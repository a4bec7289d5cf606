"""The tasks for checks, the claims of the paper, members of the family, and orbits; each task is one function.

The results of tasks are small: counts, verdicts, numbers, and witnesses of refutations. `report = true` also stores the
full report, which `--json` prints.
"""

from __future__ import annotations

from collections import Counter, deque
from hashlib import sha256
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.printing import attributes, format_point
from kahanmaps.checks.claims import Certainty, Report
from kahanmaps.checks.decide import DEFAULT_ERROR_BITS
from kahanmaps.checks.settings import Settings, random_starts
from kahanmaps.checks.table import CHECKS, Check
from kahanmaps.documents.files import SystemFile, float_normal_form
from kahanmaps.errors import InputError
from kahanmaps.experiments.registry import MEMBER, MEMBER_OR_OTHER, SYSTEM, FullResult, Result, task
from kahanmaps.family.cubics import cubic_space
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm
from kahanmaps.invariants.heights import height_growth
from kahanmaps.maps.normal_form.periods import period_of
from kahanmaps.maps.orbits.arithmetic import Arithmetic
from kahanmaps.maps.orbits.integer_point import IntegerPoint
from kahanmaps.maps.orbits.iteration import DEFAULT_MAX_DIGITS, OrbitPoint
from kahanmaps.maps.orbits.methods import choose_method
from kahanmaps.maps.orbits.orbit import orbit as find_orbit

_MIN_COMPILED_WORK = 5_000_000  # minimal product of orbits and steps for compiled code
_MAX_POINT = 400  # maximal number of characters of a stored point; of a longer last point only the hash is stored


_SETTINGS = {"eps": None, "start": None, "steps": 10, "seed": 0, "error_bits": DEFAULT_ERROR_BITS, "max_digits": None}


def _register_check(check: Check) -> None:
    """Register the task of a check, for one system or for two systems, which may have different time steps."""

    def perform(system: SystemFile, other: SystemFile | None = None, eps2: Any = None, **options: Any) -> FullResult:
        is_requested = options["start"] is not None or options["steps"] != Settings.steps
        settings = Settings(**options, orbit_is_requested=is_requested)
        return _full_result(check(system, other, settings, eps2) if check.is_of_pair else check(system, settings))

    perform.__doc__ = check.for_batch or check.question
    options = {"other": None, "eps": None, "eps2": None, **_SETTINGS} if check.is_of_pair else _SETTINGS
    task(check.command, needs=MEMBER_OR_OTHER if check.is_of_pair else SYSTEM, options=options, reports=True)(perform)


for _check in CHECKS.values():
    _register_check(_check)


@task("verify", needs=MEMBER, reports=True)
def verify_member(
    system: SystemFile,
    eps: Any = None,
    sections: tuple[int, ...] | None = None,
    order: int = 3,
    ball_bits: int | None = None,
    controls: bool = False,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
) -> FullResult:
    """Check every statement of the paper for a member of the family."""
    from kahanmaps.paper.verify import VerifyOptions, verify

    settings = Settings(eps=eps, seed=seed, error_bits=error_bits)
    return _full_result(verify(system, settings, VerifyOptions(sections, order, ball_bits, controls)))


@task("verify-universal", reports=True)
def verify_in_general(
    m: int,
    sections: tuple[int, ...] | None = None,
    order: int = 3,
    controls: bool = False,
    seed: int = 0,
    error_bits: int = DEFAULT_ERROR_BITS,
) -> FullResult:
    """Check every statement of the paper for the generic member."""
    from kahanmaps.paper.verify import VerifyOptions, verify

    settings = Settings(seed=seed, error_bits=error_bits)
    return _full_result(verify(None, settings, VerifyOptions(sections, order, None, controls), m=m))


@task("family-space", needs=MEMBER)
def family_space(system: SystemFile) -> Result:
    """Compute the space of cubics that belong to A and the number of associated systems."""
    member = system.member
    if member is None:
        raise InputError(f"{system.name} is of kind [{system.kind}], expected one of kind [family]")
    space = cubic_space(member.A, member.variables)
    return {
        "m": member.m,
        **attributes(space, "dimension", expected="expected_dimension", rank="rank", unknowns="unknown_count"),
        "factors": [str(factor) for factor in member.factors],
        "generic": member.is_generic,
        "associated": 2 ** (len(member.factors) - 1),
    }


@task("orbit")
def orbit(
    system: SystemFile,
    eps: Any,
    steps: int = 100,
    start: Any = None,
    at: tuple[int, ...] | None = None,
    arithmetic: str = "exact",
    method: str | None = None,
    max_digits: int = DEFAULT_MAX_DIGITS,
    seed: int = 0,
) -> Result:
    """Compute an orbit: how it ended, its period, digits and last point."""
    point = _random_start(system, seed) if start is None else start
    parsed_arithmetic = Arithmetic.parse(arithmetic)
    if parsed_arithmetic.kind == "float" and at is not None:
        raise InputError("iterates reached directly (at) need exact, mod:P or ball:BITS arithmetic")
    normal_form: SystemNormalForm | NoNormalForm = NoNormalForm("as requested")
    if method != "generic" and system.is_quadratic:
        normal_form = float_normal_form(system, method) if parsed_arithmetic.kind == "float" else system.normal_form
    trajectory = find_orbit(
        system.map,
        point,
        eps,
        steps=steps if at is None else None,
        at=at,
        arithmetic=parsed_arithmetic,
        method=method,
        max_digits=max_digits,
        normal_form=normal_form,
    )
    points = deque(trajectory, 1)
    if not points:  # the orbit ended before the first requested iterate
        first = trajectory.orbit.start
        exact = parsed_arithmetic.kind == "exact"
        points.append(OrbitPoint(0, parsed_arithmetic.field, IntegerPoint.from_rationals(first) if exact else first))
    last = points[0]
    end = trajectory.end
    result: Result = {
        "start": format_point(point),
        "method": trajectory.method,
        "status": end.status,
        "reached": end.steps,
        "ending": end.message,
    }
    if parsed_arithmetic.kind != "float":
        result["period"] = end.period
    text = ",".join(last.text)
    if len(text) <= _MAX_POINT:
        result["last"] = text
    result["last_sha256"] = sha256(text.encode()).hexdigest()  # for comparing two computations
    if parsed_arithmetic.kind == "exact":
        result["digits"] = last.digits
    return result


@task("ensemble")
def ensemble(
    system: SystemFile,
    eps: Any,
    orbits: int = 1000,
    box: Any = "1",
    steps: int = 1000,
    method: str | None = None,
    seed: int = 0,
) -> Result:
    """Compute floating-point orbits from random initial points; count the completed ones, and measure drift."""
    from kahanmaps.maps.floats.ensemble import FloatEnsemble
    from kahanmaps.maps.floats.float_orbit import to_floats
    from kahanmaps.maps.floats.starts import starts_in_box

    starts = starts_in_box(orbits, system.dim, float(to_floats([box])[0]), seed)
    normal_form = float_normal_form(system, method)
    choice = choose_method(method, "float", normal_form, None)
    form = normal_form.form if choice.name == "normal-form" and isinstance(normal_form, SystemNormalForm) else None
    # The kernels give equal numbers; compiling code takes longer than a short task.
    kernel = "numpy" if orbits * steps < _MIN_COMPILED_WORK else None
    run = FloatEnsemble(system.map, eps, starts, form=form, kernel=kernel, threads=1)
    run.advance(steps)
    statuses, counts = run.status.tolist(), Counter(run.status.tolist())
    completed = [k for k, status in enumerate(statuses) if status == "completed"]
    return {
        "method": choice.name,
        **{status: counts[status] for status in ("completed", "overflow", "singular")},
        "near_singular": int((run.near_singular > 0).sum()),
        "largest_drift": max((float(drift.largest[completed].max()) for drift in run.drift if completed), default=None),
    }


@task("heights")
def heights(
    system: SystemFile,
    eps: Any,
    steps: int = 60,
    every: int = 1,
    start: Any = None,
    max_digits: int = DEFAULT_MAX_DIGITS,
    seed: int = 0,
) -> Result:
    """Measure the growth of the heights along an orbit: its kind and constant."""
    point = _random_start(system, seed) if start is None else start
    growth = height_growth(
        system.map.at(eps), point, steps, normal_form=system.normal_form, every=every, max_digits=max_digits
    )
    record = growth.to_json()
    return {
        "start": format_point(point),
        "growth": record.pop("kind"),
        "reached": record.pop("steps"),
        "ending": record.pop("message"),
        **{name: value for name, value in record.items() if name != "every"},
    }


@task("period")
def period(system: SystemFile, eps: Any, start: Any = None, prime: int | None = None, seed: int = 0) -> Result:
    """Compute the exact period of an orbit of a member of the family, modulo a prime or over Q."""
    normal_form = system.normal_form
    if isinstance(normal_form, NoNormalForm):
        raise InputError(f"no period of {system.name} can be computed: {normal_form.reason}")
    point = _random_start(system, seed) if start is None else start
    result = period_of(normal_form, eps, point, prime)
    return {
        "start": format_point(point),
        "status": result.status,
        "period": None if result.period is None else str(result.period),
        "meets_pole": result.meets_pole,
        "planes": [plane.text for plane in result.planes],
    }


def _random_start(system: SystemFile, seed: int) -> tuple[fmpq, ...]:
    """Return a random initial point that depends on `seed` and on the system: one point for all might be special."""
    return next(random_starts(system.dim, derive_seed(seed, system.map.seed_data)))


def _full_result(report: Report) -> FullResult:
    """Return the result (verdict, counts of verdicts, refuted or undecided claims, witnesses) and the full report."""
    findings = [finding for finding in report.findings if finding.applies and not finding.control]
    counts = Counter(finding.verdict for finding in findings)
    controls = [finding for finding in report.findings if finding.control]
    problems = (Certainty.REFUTED, Certainty.UNDECIDED)
    doubtful = [finding.to_json() for finding in findings if finding.verdict in problems]
    return {
        "verdict": str(report.verdict),
        "claims": len(findings),
        **{str(verdict): counts[verdict] for verdict in Certainty},
        "controls": len(controls),
        "controls_refuted": sum(finding.verdict is Certainty.REFUTED for finding in controls),
        "ended_early": report.ended_early,
        **({"m": report.context["m"]} if "m" in report.context else {}),
        **({"doubtful": doubtful} if doubtful else {}),
    }, report
