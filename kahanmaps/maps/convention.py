"""The convention for eps and the time step of a map, and the sentences that state it.

A step of a map approximates the flow over the time `time_steps` * 2 eps, which is 2 eps for a Kahan map and k * 2 eps
for its k-th power. A composition of maps of different vector fields has no flow and no time step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import rational
from kahanmaps.algebra.printing import format_number
from kahanmaps.errors import InputError
from kahanmaps.maps.implicit import MapFamily

CONVENTION = "eps is the paper's epsilon, the time step is 2 eps"
NO_TIME_STEP = "eps enters the map as its file defines it; there is no time step"
NO_EPS = "the map does not depend on eps"


def either(hint: str = "", **arguments: Any) -> Any:
    """Return the only value in `arguments` that is not None, or None. Raises InputError if several are not None."""
    given_values = {name: value for name, value in arguments.items() if value is not None}
    if len(given_values) > 1:
        raise InputError(f"found {' and '.join(given_values)}, expected one of them{hint}")
    return next(iter(given_values.values()), None)


def resolve_eps(eps: Any, time_step: Any, h: Any = None, *, floats: bool = False) -> Any:
    """Return eps, given as `eps`, or by the time step 2 eps as `time_step` or `h`; None if none of these is given.

    If `floats` is True (floating-point orbits), a float stands for the decimal number that Python prints: 0.1 is 1/10.
    """
    number = either(": the time step is h = 2 eps", eps=eps, time_step=time_step, h=h)
    if floats and isinstance(number, float):
        number = rational(repr(float(number)))
    return number if eps is not None or number is None else rational(number) / 2


def _time_steps(maps: tuple[MapFamily, ...]) -> list[int]:
    """Return the distinct nonzero `time_steps` of those maps that depend on eps, sorted; [1] if no maps are given."""
    return sorted({map_.time_steps for map_ in maps if map_.has_eps} - {0}) if maps else [1]


def time_step(eps: Any, *maps: MapFamily) -> Any:
    """Return the time step at `eps` (a number or an element of a field); None unless it is the same for all maps."""
    steps = _time_steps(maps)
    return 2 * steps[0] * eps if len(steps) == 1 else None


def convention(*maps: MapFamily) -> str:
    """Return the sentence about eps and the time step, for a record about these maps."""
    if maps and not any(map_.has_eps for map_ in maps):
        return NO_EPS
    steps = [f"{2 * steps} eps" for steps in _time_steps(maps)]
    if len(steps) > 1:
        return f"eps is the paper's epsilon, the time steps of the maps are {' and '.join(steps)}"
    return f"eps is the paper's epsilon, the time step is {steps[0]}" if steps else NO_TIME_STEP


def describe_eps(map_: MapFamily) -> str:
    """Return a sentence such as "eps is half the time step" for a map; empty if the map has no time step."""
    if not map_.time_steps:
        return ""
    return f"eps is {'half' if map_.time_steps == 1 else f'{fmpq(1, 2 * map_.time_steps)} of'} the time step"


def eps_record(eps: fmpq | None, *maps: MapFamily) -> dict[str, str | None]:
    """Return the entries of a record about eps (None: every eps): the value of eps, the time step and the convention.

    The value of eps is None if the maps do not depend on eps.
    """
    convention_text, step = convention(*maps), time_step(1 if eps is None else eps, *maps)
    return {
        "eps": None if convention_text == NO_EPS else "every" if eps is None else format_number(eps),
        "time_step": None if step is None else "every" if eps is None else format_number(step),
        "convention": convention_text,
    }


def eps_record_suffix(context: Mapping[str, Any]) -> str:
    """Return the text about eps and the time step for the record `context`, to be appended to the name of its map."""
    convention_text = context.get("convention", CONVENTION)
    if convention_text == NO_EPS:
        return ""
    multiple, step = convention_text.rpartition(" is ")[2], context["time_step"]
    if context["eps"] == "every":
        return f", every eps{'' if step is None else f' (the time step is {multiple})'}"
    return f", eps = {context['eps']}{'' if step is None else f' (time step {multiple} = {step})'}"


def eps_suffix(eps: fmpq | None, *maps: MapFamily) -> str:
    """Return the text about eps and the time step of these maps, to be appended to a name.

    >>> eps_suffix(fmpq(1, 10)), eps_suffix(None)
    (', eps = 1/10 (time step 2 eps = 1/5)', ', every eps (the time step is 2 eps)')
    """
    return eps_record_suffix(eps_record(eps, *maps))
