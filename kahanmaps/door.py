"""Whatever stands for a map: what the functions of `import kahanmaps` take as their first argument.

A file, a system, a map, a name of the catalogue, a path, or equations as text. The functions themselves are given what
they work with, a `SystemFile`, a system or a map, and know nothing of this.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any

from kahanmaps.errors import InputError

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile

_FIRST = ("file", "system", "given")  # names of first arguments that stand for a map


def opened(function: Any) -> Any:
    """A function whose first argument is a file, a system or a map, for whatever stands for one.

    It takes `time_step` in the place of `eps` too, which is half of it, and `eps` where it has only settings. Other
    functions, and classes, are returned as they are.
    """
    if not isinstance(function, FunctionType) or function.__code__.co_varnames[:1] not in [(one,) for one in _FIRST]:
        return function
    names = function.__code__.co_varnames[: function.__code__.co_argcount + function.__code__.co_kwonlyargcount]
    wanted = str(function.__annotations__[names[0]])
    convert: Callable[[Any], Any] = _file
    if "SystemFile" not in wanted:
        convert = _map if "BirationalMap" in wanted else _system

    @wraps(function)
    def door(given: Any, /, *others: Any, time_step: Any = None, **options: Any) -> Any:
        if time_step is not None:
            from kahanmaps.algebra.fields import rational

            if options.get("eps") is not None or "eps" in names[1 : 1 + len(others)]:
                raise InputError("found eps and time_step, expected one of them: the time step is 2 eps")
            options["eps"] = rational(time_step) / 2
        if "eps" in options and "settings" in names and "eps" not in names:
            from kahanmaps.checks.settings import Settings

            options["settings"] = Settings(eps=options.pop("eps"))
        if "other" in names and others:
            others = (_file(others[0]), *others[1:])
        return function(convert(given), *others, **options)

    return door


def _file(given: Any) -> SystemFile:
    from kahanmaps.documents.catalog import load
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.documents.inline import System
    from kahanmaps.systems.quadratic import QuadraticSystem

    if isinstance(given, SystemFile):
        return given
    if isinstance(given, QuadraticSystem):
        return SystemFile.from_system(given)
    if isinstance(given, str) and "=" in given:
        return System(given)
    if isinstance(given, str | Path):
        return load(given)
    kind = type(given).__name__
    raise InputError(f"found a {kind}, expected a name of the catalogue, a file, a system, or equations as text")


def _map(given: Any) -> Any:
    from kahanmaps.maps.implicit import BirationalMap
    from kahanmaps.systems.quadratic import QuadraticSystem

    return given if isinstance(given, QuadraticSystem | BirationalMap) else _file(given).map


def _system(given: Any) -> Any:
    from kahanmaps.systems.quadratic import QuadraticSystem

    return given if isinstance(given, QuadraticSystem) else _file(given).system
