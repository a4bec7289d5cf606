"""The choice of the method for an orbit, with the reason.

* generic: one linear system per step, and over Q relations between the points of the orbit; for every map.
* normal-form: steps plane by plane, for members of the family for which chi has distinct roots.
* doubling: each requested iterate directly, by doublings in the planes; for the same members.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from kahanmaps.errors import InputError
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm

METHODS = ("generic", "normal-form", "doubling")
# From this step on, doublings are faster than single steps. (Modulo p, single steps also report every pole passed.)
DOUBLING_FROM = {"exact": 24, "mod": 10_000, "ball": 1}


@dataclass(frozen=True)
class MethodChoice:
    """The name of a method and the reason for its choice."""

    name: str
    reason: str

    @property
    def text(self) -> str:
        """The method and the reason for its choice, as one line."""
        return f"method {self.name}: {self.reason}"


def choose_method(
    requested: str | None, arithmetic: str, normal_form: SystemNormalForm | NoNormalForm, at: Sequence[int] | None
) -> MethodChoice:
    """Choose the method for an orbit.

    Args:
        requested: "generic", "normal-form" or "doubling"; None to choose automatically.
        arithmetic: "exact", "mod", "ball" or "float".
        normal_form: the normal form of the system, or the reason why there is none.
        at: the requested iterates, or None for all steps.

    Raises:
        InputError: if the requested method is not available for this orbit.

    >>> choose_method(None, "exact", NoNormalForm("H is not a homogeneous cubic"), None).text
    'method generic: no normal form (H is not a homogeneous cubic)'
    """
    if requested is not None and requested not in METHODS:
        raise InputError(f"found the method {requested!r}, expected one of {', '.join(METHODS)}")
    if requested == "generic":
        return MethodChoice("generic", "as requested")
    if isinstance(normal_form, NoNormalForm):
        if requested is not None:
            raise InputError(f"the method {requested} needs a normal form, and there is none: {normal_form.reason}")
        return MethodChoice("generic", f"no normal form ({normal_form.reason})")
    if requested == "doubling" and (at is None or arithmetic == "float"):
        raise InputError("the method doubling is for --at N1,N2,... in exact, mod:P or ball arithmetic")
    if requested == "normal-form" and arithmetic == "mod":
        raise InputError("arithmetic mod:P has the methods generic and doubling only")
    if requested is not None:
        return MethodChoice(requested, normal_form.text)
    if arithmetic == "float":
        return MethodChoice("normal-form", normal_form.text)
    if at is not None and max(at, default=0) >= DOUBLING_FROM[arithmetic]:
        is_dense = arithmetic == "exact" and len(at) * 10 > max(at)
        if not is_dense:
            return MethodChoice("doubling", f"{normal_form.text}; each iterate by doublings")
    if arithmetic == "mod":
        return MethodChoice("generic", "few steps modulo P")
    return MethodChoice("normal-form", normal_form.text)
