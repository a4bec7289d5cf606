"""Kahan (Hirota-Kimura) maps of quadratic systems, exactly: orbits, integrals, commutativity, with proofs.

>>> import kahanmaps as km
>>> member = km.draw_with_eigenvalues([1, -2, 3], seed=7)
>>> f, g = member.associate([1, 1, 1]), member.associate([1, 1, -1])
>>> phi_f, phi_g = km.KahanMap(f.system, "1/10"), km.KahanMap(g.system, "1/10")
>>> x = phi_f.point(["1/2", "-1/3", 0, 1, "2/5", -1])
>>> phi_f.step(phi_g.step(x)) == phi_g.step(phi_f.step(x))
True
>>> km.check_commute(km.SystemFile.from_member(member)).verdict
<Verdict.PROVED: 'proved'>

Names are imported when they are first used, so that `import kahanmaps` costs next to nothing.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from kahanmaps.door import opened
from kahanmaps.errors import suggestion
from kahanmaps.version import __version__ as __version__

# The one list of public names is what type checkers read: __init__.pyi.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="ascii")
_MODULE_OF = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _STUB, re.MULTILINE)}
# What takes whatever stands for a map, and the same under the names of the commands.
_OTHER_NAMES = dict(re.findall(r"^(\w+) = (?:opened\(_)?(\w+)\)?$", _STUB, re.MULTILINE))
_HIDDEN = {"map_at", "draw_orbits", "map"}  # the last is the name of a builtin, which `import *` leaves alone
__all__ = list(dict.fromkeys(name for name in (*_MODULE_OF, *_OTHER_NAMES) if name not in _HIDDEN))


_VALUES: dict[str, Any] = {}  # by name. Not in globals(), where doctest takes the functions for ones of this file


def __getattr__(name: str) -> Any:
    if name in _VALUES:
        return _VALUES[name]
    known = _OTHER_NAMES.get(name, name)
    if known != name and known in __all__:  # one function under two names
        value = __getattr__(known)
    elif known in _MODULE_OF:
        function = getattr(import_module(_MODULE_OF[known]), known)
        value = opened(function)
        if value is not function:  # pickle looks for it here, not where `function` is
            value.__module__, value.__name__, value.__qualname__ = __name__, name, name
    else:
        raise AttributeError(f"module 'kahanmaps' has no attribute {name!r}{suggestion(name, __all__)}")
    return _VALUES.setdefault(name, value)  # two threads get the same


def __dir__() -> list[str]:
    return sorted(__all__)
