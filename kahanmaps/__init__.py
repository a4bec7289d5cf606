"""Kahan (Hirota-Kimura) maps of quadratic systems, in exact arithmetic: orbits, integrals, commutativity, proofs.

>>> import kahanmaps as km
>>> member = km.random_member_with_eigenvalues([1, -2, 3], seed=7)
>>> f, g = member.associate([1, 1, 1]), member.associate([1, 1, -1])
>>> phi_f, phi_g = km.KahanMap(f.system, "1/10"), km.KahanMap(g.system, "1/10")
>>> x = phi_f.point(["1/2", "-1/3", 0, 1, "2/5", -1])
>>> phi_f.step(phi_g.step(x)) == phi_g.step(phi_f.step(x))
True
>>> km.check_commute(km.SystemFile.from_member(member)).verdict
<Certainty.PROVED: 'proved'>

Names are imported when they are first used, so that `import kahanmaps` is fast.
"""

from __future__ import annotations

from types import FunctionType
from typing import Any

from lazy_loader import attach_stub

from kahanmaps.hints import missing_name
from kahanmaps.version import __version__ as __version__

# Type checkers read the public names from __init__.pyi.
_load, _, _NAMES = attach_stub(__name__, __file__)
_COMMANDS = {  # public name -> name of the function, for functions that have the name of a command
    "cycles": "cycle_census",
    "degrees": "degree_growth",
    "find_density": "find_densities",
    "find_symmetry": "linear_symmetries",
    "heights": "height_survey",
    "invariant_measure": "find_densities",
    "lyapunov": "lyapunov_exponents",
    "map": "map_at",
    "portrait": "plot_orbits",
}
# `from kahanmaps import *` does not import `km.map`, which would hide Python's `map`.
__all__ = sorted({*_NAMES, *_COMMANDS} - {"map", "map_at", "plot_orbits"})


def __getattr__(name: str) -> Any:
    if name not in _NAMES and name not in _COMMANDS:
        raise missing_name("module 'kahanmaps'", name, __all__)
    value = _load(_COMMANDS.get(name, name))
    if isinstance(value, FunctionType):
        from kahanmaps.function_calls import public_function

        value = globals()[name] = public_function(value, name)
    return value


def __dir__() -> list[str]:
    return __all__
