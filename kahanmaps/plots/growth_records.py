"""Degrees and heights read from what `degrees --json` and `heights --json` wrote; heights of a survey as curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from kahanmaps.algebra.parsing import parse_number
from kahanmaps.errors import InputError, printable
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.enclosure import Enclosure
from kahanmaps.laboratory.growth.height_survey import HeightSurvey
from kahanmaps.laboratory.singular.singularities import Patterns

_MAX_ORBITS, _MAX_TERMS = 2000, 10_000
_LARGEST = 10**15  # degrees, steps and bits: what no orbit has
_UNREADABLE = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)


def degrees_of_record(record: Any, where: str = "record") -> tuple[str, DegreeGrowth]:
    """The name of the system, and the degrees, in the JSON object that `kahanmaps degrees --json` writes.

    The recurrence is looked for anew; records of older versions have no patterns of singularities.
    Raises InputError for anything else.

    >>> record = {"command": "degrees", "system": "top", "degrees": [1, 3, 9, 19, 33, 51, 73, 99], "eps": "generic"}
    >>> name, growth = degrees_of_record({**record, "ended": "terms", "message": "8 terms", "seed": 0, "lines": []})
    >>> name, growth.recurrence.closed_form
    ('top', '2*n^2 + 1')
    """
    if not isinstance(record, Mapping) or record.get("command") != "degrees":
        raise InputError(f"{where}: found something else, expected an object written by 'kahanmaps degrees --json'")
    try:
        degrees = tuple(map(_integer, record["degrees"]))
        if not (1 <= len(degrees) <= _MAX_TERMS and any(degrees)):
            raise InputError("no degrees, or all of them 0")
        patterns = enclosure = None
        if (told := record.get("singularities")) is not None:
            known = told.get("generating_function") or {}
            series = tuple(tuple(int(c) for c in known[part]) for part in ("numerator", "denominator") if known)
            if series and not (max(map(len, series)) <= _MAX_TERMS and series[1][:1] == (1,)):
                raise InputError("no generating function with a short denominator that begins with 1")
            lengths = tuple(int(length) for length in told["lengths"])
            searched = None if told["searched"] is None else int(told["searched"])
            patterns = Patterns(lengths, searched, told["some_confined"], str(told["running"]), series)
        if (told := record.get("enclosure")) is not None:
            names = ("steps", "degree_below", "degree_above", "prime", "eps_residue")
            enclosure = Enclosure(str(told["lower"]), str(told["upper"]), *(int(told[name]) for name in names))
        growth = DegreeGrowth(
            degrees,
            None if record["eps"] == "generic" else parse_number(record["eps"]),
            str(record["ended"]),
            str(record["message"]),
            int(record["seed"]),
            tuple(int(line["prime"]) for line in record["lines"]),
            tuple(int(line["eps_residue"]) for line in record["lines"]),
            patterns=patterns,
            enclosure=enclosure,
        )
        return printable(str(record["system"])), growth
    except _UNREADABLE as error:
        raise InputError(f"{where}: found degrees that cannot be read ({error}), expected those of degrees") from error


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
        steps, bits = np.array(growth.steps, dtype=np.int64), np.array(growth.heights, dtype=np.float64)
        constant = None if growth.constant is None else float(growth.constant)
        ratio = None
        if growth.ratio is not None and growth.kind is Growth.EXPONENTIAL:
            ratio = float(growth.ratio) ** (1 / growth.every)
        found.append(
            HeightCurve(orbit.eps, steps, bits, growth.kind, constant, ratio, growth.end.status, survey.has_eps)
        )
    return tuple(found)


def curves_of_record(record: Any, where: str = "record") -> tuple[HeightCurve, ...]:
    """The orbits in the JSON object that `kahanmaps heights --json` writes: heights at steps 0, 1, 2, 4, 8, ...

    Raises InputError for anything else.
    """
    orbits = record.get("orbits") if isinstance(record, Mapping) and record.get("command") == "heights" else None
    if not isinstance(orbits, list) or not 1 <= len(orbits) <= _MAX_ORBITS:
        raise InputError(f"{where}: found something else, expected an object written by 'kahanmaps heights --json'")
    found = []
    try:
        for orbit in orbits:
            steps = [_integer(one["step"]) for one in orbit["heights"]]
            bits = [_integer(one["bits"]) for one in orbit["heights"]]
            if not steps or any(later <= earlier for earlier, later in pairwise(steps)):
                raise InputError("steps do not increase")
            kind, every = Growth(orbit["kind"]), max(1, _integer(orbit["every"]))
            constant = None if orbit["constant"] is None else float(orbit["constant"])
            ratio = None
            if orbit["ratio"] is not None and kind is Growth.EXPONENTIAL:
                ratio = float(orbit["ratio"]) ** (1 / every)
            numbers = np.array(steps, dtype=np.int64), np.array(bits, dtype=np.float64)
            found.append(HeightCurve(parse_number(orbit["eps"]), *numbers, kind, constant, ratio, str(orbit["status"])))
    except _UNREADABLE as error:
        raise InputError(f"{where}: found an orbit that cannot be read ({error}), expected one of heights") from error
    return tuple(found)


def _integer(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _LARGEST:
        raise InputError(f"found {str(value)[:40]!r}, expected a degree or a number of steps or bits")
    return value


def fit_of(curve: HeightCurve) -> Callable[[Any], Any] | None:
    """The law that was fitted, as a function of the step, NaN where it is not positive; None where there is none.

    For c n^2 and c n, c is that of the library, and the terms of lower degree fit the heights best in the sense of
    least squares. The exponential goes through the last height.
    """
    n, c = curve.steps.astype(np.float64), curve.constant
    if curve.kind is Growth.EXPONENTIAL and curve.ratio is not None:
        ratio = curve.ratio

        def exponential(at: Any) -> Any:
            with np.errstate(all="ignore"):
                return curve.bits[-1] * ratio ** (np.asarray(at, dtype=np.float64) - n[-1])

        return exponential
    if c is None or curve.kind not in (Growth.QUADRATIC, Growth.LINEAR) or len(n) < 3:
        return None
    power = 2 if curve.kind is Growth.QUADRATIC else 1
    lower = np.polynomial.Polynomial.fit(n, curve.bits - c * n**power, power - 1)

    def law(at: Any) -> Any:
        at = np.asarray(at, dtype=np.float64)
        value = c * at**power + lower(at)
        return np.where(value > 0, value, np.nan)

    return law
