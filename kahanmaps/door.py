"""Whatever stands for a map: what the functions of `import kahanmaps` take as their first argument.

A file, a system, a map, a name of the catalogue, a path, or equations as text. The functions themselves are given what
they work with, a `SystemFile`, a system or a map, and know nothing of this.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from itertools import starmap, zip_longest
from numbers import Real
from pathlib import Path
from types import FunctionType
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, Protocol, TypeVar, overload

from kahanmaps.errors import InputError

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile
    from kahanmaps.family.associated import AssociatedSystem, FamilyMember
    from kahanmaps.maps.implicit import BirationalMap, MapOver
    from kahanmaps.systems.hamiltonian import CubicHamiltonian
    from kahanmaps.systems.quadratic import QuadraticSystem

    Member = FamilyMember | AssociatedSystem | CubicHamiltonian
    Given = str | Path | SystemFile | QuadraticSystem | BirationalMap | MapOver | Member
    P = ParamSpec("P")
    R = TypeVar("R", covariant=True)

    class Opened(Protocol[P, R]):
        """What `opened` returns, for type checkers: the rest of the arguments is checked where there is no eps."""

        @overload
        def __call__(self, given: Given, /, *others: P.args, **options: P.kwargs) -> R: ...
        @overload
        def __call__(self, given: Given, /, *others: Any, eps: Any, **options: Any) -> R: ...
        @overload
        def __call__(self, given: Given, /, *others: Any, time_step: Any, **options: Any) -> R: ...


_INTEGERS = {
    *("steps", "every", "max_terms", "max_degree", "degree", "samples", "terms", "transient"),
    *("prime", "seed", "max_digits"),
}
_FIRST = ("file", "system", "given")  # names of first arguments that stand for a map


def opened(function: Callable[Concatenate[Any, P], R]) -> Opened[P, R]:
    """A function whose first argument is a file, a system or a map, for whatever stands for one.

    It takes `time_step` in the place of `eps` too, which is half of it, and `eps` where it has only settings. Where eps
    is named, the arguments without a name are the others in their order. Other functions, and classes, are returned as
    they are.
    """
    if not isinstance(function, FunctionType) or function.__code__.co_varnames[:1] not in [(one,) for one in _FIRST]:
        return function
    code = function.__code__
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    required = names[: code.co_argcount - len(function.__defaults__ or ())]
    wanted = str(function.__annotations__.get(names[0], ""))
    if not wanted:
        raise InputError(
            f"found {function.__module__}.{function.__qualname__} with {names[0]} without a type, expected one: "
            "SystemFile, QuadraticSystem, BirationalMap or MapOver says what is made of a name or a path"
        )
    convert: Callable[[Any], Any] = _file
    if "SystemFile" not in wanted:
        convert = _orbit_of if "MapOver" in wanted else _map if "BirationalMap" in wanted else _system

    @wraps(function)
    def door(*given: Any, time_step: Any = None, **options: Any) -> Any:
        others = given[1:]
        if "eps" in required and (time_step is not None or "eps" in options):
            free = [name for name in required[1:] if name != "eps"]
            options |= dict(zip(free, others, strict=False))
            others = others[len(free) :]
        if time_step is not None:
            from kahanmaps.algebra.fields import rational

            if options.get("eps") is not None or "eps" in names[1 : 1 + len(others)]:
                raise InputError("found eps and time_step, expected one of them: the time step is 2 eps")
            options["eps"] = rational(time_step) / 2
        if "eps" in options and "settings" in names and "eps" not in names:
            from kahanmaps.checks.settings import Settings

            if "extra" in names and others and not isinstance(others[0], Settings):
                options["extra"], others = others[0], others[1:]
            options["settings"] = Settings(eps=options.pop("eps"))
        if "other" in names and others:
            others = (_file(others[0]), *others[1:])
        others = tuple(starmap(_number, zip_longest(names[1 : 1 + len(others)], others, fillvalue="")))
        options = {name: _number(name, value) for name, value in options.items()}
        return function(*map(convert, given[:1]), *others, **options)

    return door


def _file(given: Any) -> SystemFile:
    from kahanmaps.documents.inline import file_of

    return file_of(given)


def _map(given: Any) -> Any:
    from kahanmaps.maps.implicit import BirationalMap
    from kahanmaps.systems.quadratic import QuadraticSystem

    return given if isinstance(given, QuadraticSystem | BirationalMap) else _file(given).map


def _orbit_of(given: Any) -> Any:
    from kahanmaps.maps.implicit import MapOver

    return given if isinstance(given, MapOver) else _map(given)


def _number(name: str, value: Any) -> Any:
    """An argument. Raises InputError for times that are no positive numbers and counts that are no integers."""
    if value is None:
        return value
    if name == "seconds" and (isinstance(value, bool) or not (isinstance(value, Real) and float(value) > 0)):
        raise InputError(f"found {value!r} seconds, expected a positive number")
    if name in _INTEGERS:
        from kahanmaps.algebra.fields import integer

        return integer(value, name)
    return value


def _system(given: Any) -> Any:
    from kahanmaps.systems.quadratic import QuadraticSystem

    return given if isinstance(given, QuadraticSystem) else _file(given).system
