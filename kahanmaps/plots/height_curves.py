"""Heights of exact orbits as curves: from a survey, or from the record of one that `heights --json` wrote."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.written.text import parse_number
from kahanmaps.errors import InputError
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.height_survey import HeightSurvey

_MOST_ORBITS = 2000
_LARGEST = 10**15  # steps and bits: what no orbit has


@dataclass(frozen=True, eq=False)
class HeightCurve:
    """Heights in bits of one orbit at some steps, the kind of growth that was decided, and its numbers.

    `eps` is exact, half the time step; `constant` is c in c n^2 or c n, `ratio` the factor of one step where growth is
    exponential; `status` is how the orbit ended, in the words of OrbitEnd.
    """

    eps: fmpq
    steps: NDArray[np.int64]
    bits: NDArray[np.float64]
    kind: Growth
    constant: float | None
    ratio: float | None
    status: str
    has_eps: bool = True


def height_curves(survey: HeightSurvey) -> tuple[HeightCurve, ...]:
    """The orbits of a survey as curves, every height of them.

    >>> from kahanmaps.laboratory.growth.height_survey import height_survey
    >>> from kahanmaps.documents.catalog import load
    >>> [curve] = height_curves(height_survey(load("weierstrass").system, "1/10", starts=[[1, "1/2"]], steps=40))
    >>> curve.bits[:6].tolist(), str(curve.kind), round(curve.constant, 4)
    ([2.0, 7.0, 17.0, 32.0, 52.0, 82.0], 'quadratic', 3.0413)
    """
    found = []
    for orbit in survey.orbits:
        growth = orbit.growth
        ratio = float(growth.ratio) ** (1 / growth.every) if growth.ratio is not None else None
        found.append(
            HeightCurve(
                orbit.eps,
                np.array(growth.steps, dtype=np.int64),
                np.array(growth.heights, dtype=np.float64),
                growth.kind,
                None if growth.constant is None else float(growth.constant),
                ratio if growth.kind is Growth.EXPONENTIAL else None,
                growth.end.status,
                survey.has_eps,
            )
        )
    return tuple(found)


def curves_of_record(record: Any, where: str = "record") -> tuple[HeightCurve, ...]:
    """The orbits in the JSON object that `kahanmaps heights --json` writes: heights at steps 0, 1, 2, 4, 8, ...

    Raises InputError for anything else.
    """
    orbits = record.get("orbits") if isinstance(record, Mapping) and record.get("command") == "heights" else None
    if not isinstance(orbits, list) or not 1 <= len(orbits) <= _MOST_ORBITS:
        raise InputError(f"{where}: found something else, expected an object written by 'kahanmaps heights --json'")
    try:
        return tuple(_curve_of(orbit) for orbit in orbits)
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        raise InputError(f"{where}: found an orbit that cannot be read ({error}), expected one of heights") from error


def _curve_of(orbit: Mapping[str, Any]) -> HeightCurve:
    pairs = [(_whole(one["step"]), _whole(one["bits"])) for one in orbit["heights"]]
    if not pairs or any(later[0] <= earlier[0] for earlier, later in pairwise(pairs)):
        raise InputError("steps do not increase")
    kind = Growth(orbit["kind"])
    every = max(1, _whole(orbit["every"]))
    ratio = None if orbit["ratio"] is None else float(orbit["ratio"]) ** (1 / every)
    return HeightCurve(
        parse_number(orbit["eps"]),
        np.array([step for step, _ in pairs], dtype=np.int64),
        np.array([bits for _, bits in pairs], dtype=np.float64),
        kind,
        None if orbit["constant"] is None else float(orbit["constant"]),
        ratio if kind is Growth.EXPONENTIAL else None,
        str(orbit["status"]),
    )


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _LARGEST:
        raise InputError(f"found {str(value)[:40]!r}, expected a number of steps or bits")
    return value


def fit_of(curve: HeightCurve) -> Callable[[Any], Any] | None:
    """The law that was fitted, as a function of the step, NaN where it is not positive; None where there is none.

    For c n^2 and c n, c is that of the library, and the terms of lower degree fit the heights best in the sense of
    least squares. The exponential goes through the last height.
    """
    n = curve.steps.astype(np.float64)
    if curve.kind is Growth.EXPONENTIAL and curve.ratio is not None:
        ratio, last, height = curve.ratio, n[-1], curve.bits[-1]

        def exponential(at: Any) -> Any:
            with np.errstate(all="ignore"):
                return height * ratio ** (np.asarray(at, dtype=np.float64) - last)

        return exponential
    if curve.constant is None or curve.kind not in (Growth.QUADRATIC, Growth.LINEAR) or len(n) < 3:
        return None
    power = 2 if curve.kind is Growth.QUADRATIC else 1
    c = curve.constant
    lower = np.polynomial.Polynomial.fit(n, curve.bits - c * n**power, power - 1)

    def law(at: Any) -> Any:
        at = np.asarray(at, dtype=np.float64)
        value = c * at**power + lower(at)
        return np.where(value > 0, value, np.nan)

    return law
