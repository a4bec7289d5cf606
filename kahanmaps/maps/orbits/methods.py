"""Which way an orbit is computed: generic, in normal form, or by doublings; chosen from the wish, with the reason.

* generic: linear solves, and over Q relations where they hold along the orbit; for every map.
* normal-form: plane by plane, for members of the family with distinct roots.
* doubling: each point wanted directly, by doublings; the same members, any chi.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from kahanmaps.errors import InputError
from kahanmaps.family.system_normal_form import NoNormalForm, SystemNormalForm

METHODS = ("generic", "normal-form", "doubling")
# From here on doublings are faster than steps: over Q, and modulo p, where steps do not pass poles silently.
DOUBLING_FROM = {"exact": 24, "mod": 10_000, "ball": 1}


@dataclass(frozen=True)
class Method:
    """The name of a method and, in a sentence, why it was taken."""

    name: str
    reason: str

    @property
    def text(self) -> str:
        """One line for people."""
        return f"method {self.name}: {self.reason}"


def choose_method(
    wish: str | None, arithmetic: str, normal_form: SystemNormalForm | NoNormalForm, at: Sequence[int] | None
) -> Method:
    """The method for an orbit in "exact", "mod", "ball" or "float" arithmetic; `at` has the steps, if only some count.

    Raises InputError where the wish cannot be met.

    >>> choose_method(None, "exact", NoNormalForm("H is not a homogeneous cubic"), None).text
    'method generic: no normal form (H is not a homogeneous cubic)'
    """
    if wish is not None and wish not in METHODS:
        raise InputError(f"found the method {wish!r}, expected one of {', '.join(METHODS)}")
    if wish == "generic":
        return Method("generic", "as asked for")
    if isinstance(normal_form, NoNormalForm):
        if wish is not None:
            raise InputError(f"the method {wish} needs a normal form, and there is none: {normal_form.reason}")
        return Method("generic", f"no normal form ({normal_form.reason})")
    if wish == "doubling" and (at is None or arithmetic == "float"):
        raise InputError("the method doubling is for --at N1,N2,... in exact, mod:P or ball arithmetic")
    if wish == "normal-form" and arithmetic == "mod":
        raise InputError("modulo P there are the methods generic and doubling")
    if wish is not None:
        return Method(wish, normal_form.text)
    if arithmetic == "float":
        return Method("normal-form", normal_form.text)
    if at is not None and max(at, default=0) >= DOUBLING_FROM[arithmetic]:
        dense = arithmetic == "exact" and len(at) * 10 > max(at)
        if not dense:
            return Method("doubling", f"{normal_form.text}; each iterate by doublings")
    if arithmetic == "mod":
        return Method("generic", "few steps modulo P")
    return Method("normal-form", normal_form.text)
