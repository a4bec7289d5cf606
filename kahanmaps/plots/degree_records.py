"""Degrees of iterates from the record that `kahanmaps degrees --json` wrote."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kahanmaps.algebra.written.text import parse_number
from kahanmaps.errors import InputError, printable
from kahanmaps.laboratory.growth.degrees import DegreeGrowth
from kahanmaps.laboratory.growth.enclosure import Enclosure
from kahanmaps.laboratory.singular.singularities import Patterns

_MOST_TERMS = 10_000
_LARGEST = 10**15


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
        degrees = record["degrees"]
        if not isinstance(degrees, list) or not 1 <= len(degrees) <= _MOST_TERMS:
            raise InputError("no list of degrees")
        for d in degrees:
            if isinstance(d, bool) or not isinstance(d, int) or not 0 <= d <= _LARGEST:
                raise InputError(f"found {str(d)[:40]!r}, expected a degree")
        if not any(degrees):
            raise InputError("all degrees are 0")
        growth = DegreeGrowth(
            tuple(degrees),
            None if record["eps"] == "generic" else parse_number(record["eps"]),
            str(record["ended"]),
            str(record["message"]),
            int(record["seed"]),
            tuple(int(line["prime"]) for line in record["lines"]),
            tuple(int(line["eps_residue"]) for line in record["lines"]),
            patterns=_patterns(record.get("singularities")),
            enclosure=_enclosure(record.get("enclosure")),
        )
        return printable(str(record["system"])), growth
    except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError) as error:
        raise InputError(f"{where}: found degrees that cannot be read ({error}), expected those of degrees") from error


def _patterns(record: Any) -> Patterns | None:
    if record is None:
        return None
    searched, known = record["searched"], record.get("generating_function") or {}
    series = tuple(tuple(int(c) for c in known[part]) for part in ("numerator", "denominator") if known)
    if series and not (len(series[0]) <= _MOST_TERMS and len(series[1]) <= _MOST_TERMS and series[1][:1] == (1,)):
        raise InputError("no generating function with a short denominator that begins with 1")
    return Patterns(
        tuple(int(length) for length in record["lengths"]),
        None if searched is None else int(searched),
        record["some_confined"],
        str(record["running"]),
        series,
    )


def _enclosure(record: Any) -> Enclosure | None:
    if record is None:
        return None
    numbers = (int(record[name]) for name in ("steps", "degree_below", "degree_above", "prime", "eps_residue"))
    return Enclosure(str(record["lower"]), str(record["upper"]), *numbers)
