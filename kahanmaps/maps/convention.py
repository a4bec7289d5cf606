"""What eps is, in a sentence that every record carries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq

from kahanmaps.algebra.written.text import format_number
from kahanmaps.maps.implicit import BirationalMap

CONVENTION = "eps is the paper's epsilon, the time step is 2 eps"
NO_TIME_STEP = "eps stands in the map as its file says; there is no time step"
NO_EPS = "the map does not depend on eps"


def convention(*maps: BirationalMap) -> str:
    """The sentence for the maps of which a record speaks together."""
    with_eps = [map_ for map_ in maps if map_.has_eps]
    if not with_eps:
        return NO_EPS
    return CONVENTION if any(map_.has_time_step for map_ in with_eps) else NO_TIME_STEP


def eps_record(eps: fmpq | None, *maps: BirationalMap) -> dict[str, str | None]:
    """What every record says of eps, None standing for every one: its value, the time step, and what eps is.

    The value is None where the maps do not depend on eps.
    """
    meaning = convention(*maps)
    time_step = "every" if eps is None else format_number(2 * eps)
    return {
        "eps": None if meaning == NO_EPS else "every" if eps is None else format_number(eps),
        "time_step": time_step if meaning == CONVENTION else None,
        "convention": meaning,
    }


def eps_words(context: Mapping[str, Any]) -> str:
    """For which eps a record speaks, with the time step where there is one, to follow the name of the map.

    >>> eps_words({"eps": "1/10", "time_step": "1/5", "convention": CONVENTION})
    ', eps = 1/10 (time step 2 eps = 1/5)'
    """
    if context.get("convention") == NO_EPS:
        return ""
    has_step = context["time_step"] is not None
    if context["eps"] == "every":
        return f", every eps{' (the time step is 2 eps)' if has_step else ''}"
    return f", eps = {context['eps']}" + (f" (time step 2 eps = {context['time_step']})" if has_step else "")
