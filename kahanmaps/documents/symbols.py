"""Conversion of a system file to its system or map, in which some of the parameters are symbols."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flint import fmpq

from kahanmaps.algebra.printing import format_number
from kahanmaps.documents.document import DocumentReader
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError, quoted
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import KahanFamily
from kahanmaps.systems.quadratic import QuadraticSystem


def split_names(names: Sequence[str]) -> Sequence[str]:
    """Return names that are given as a sequence, or as one text such as "a, b", as a sequence."""
    return names.replace(",", " ").split() if isinstance(names, str) else names


def map_with_symbols(file: SystemFile, symbols: Sequence[str] = ()) -> MapFamily:
    """Return the map of a file; the parameters `symbols` are symbols in it, all other parameters have values.

    Raises InputError as `with_symbols` does; for a map that is no Kahan map, only for names that are not parameters.

    >>> from kahanmaps.documents.files import parse_system
    >>> lyness = 'variables = ["x", "y"]\\nparameters.a = 2\\n[map]\\nimage = ["y", "(a + y)/x"]'
    >>> print(map_with_symbols(parse_system(lyness), ["a"]))
    x~ = y
    y~ = (y + a)/x
    """
    if file.map.unsupported_reason:
        raise InputError(file.map.unsupported_reason)
    symbols = _require_parameters(file, symbols)
    if not symbols:
        return file.map
    return DocumentReader(dict(file.document), file.name, {}).read_map(file.kind, symbols)


def member_of(file: SystemFile, values: Mapping[str, fmpq]) -> SystemFile:
    """Return the system of a file with other values of some of its parameters, and without its claims.

    >>> from kahanmaps.documents.files import parse_system
    >>> lyness = 'variables = ["x", "y"]\\nparameters.a = 2\\n[map]\\nimage = ["y", "(a + y)/x"]'
    >>> print(member_of(parse_system(lyness), {"a": fmpq(1, 3)}).map)
    x~ = y
    y~ = (y + 1/3)/x
    """
    _require_parameters(file, list(values))
    document = {key: value for key, value in file.document.items() if key not in ("catalog", "integrals", "density")}
    numbers = {name: format_number(value) for name, value in {**file.parameters, **values}.items()}
    title = f"{file.name} at {', '.join(f'{name} = {numbers[name]}' for name in values)}"
    return SystemFile(**DocumentReader({**document, "name": title, "parameters": numbers}, file.name, {}).read())


def with_symbols(file: SystemFile, symbols: Sequence[str] = ()) -> QuadraticSystem:
    """Return the system of a file; the parameters `symbols` are symbols in it, all other parameters have values.

    Args:
        file: the system.
        symbols: names of parameters. The name eps is always a symbol and must not be given.

    Returns:
        The quadratic system, with exact right-hand sides.

    Raises:
        InputError: for a name that is not a parameter; if with free symbols the right-hand sides are no polynomials of
            degree at most 2; for a member of the family, since other values of the symbols may give no member.

    >>> from kahanmaps.documents.catalog import load
    >>> with_symbols(load("euler_top"), ["a1"]).rhs
    (x2*x3*a1, -2*x1*x3, x1*x2)
    """
    _ = file.system  # raises InputError for a map that is no Kahan map
    map_ = map_with_symbols(file, symbols)
    assert isinstance(map_, KahanFamily)
    return map_.system


def _require_parameters(file: SystemFile, symbols: Sequence[str]) -> tuple[str, ...]:
    """Return the names `symbols` without repetitions. Raises InputError for a name that is not a parameter."""
    for name in symbols:
        if name not in file.parameters:
            known_names = ", ".join(file.parameters)
            expected = f"eps or a parameter of the system: {known_names}" if known_names else "eps"
            reason = "" if known_names else ": this system has no parameters"
            raise InputError(f"found the symbol {quoted(name)}, expected {expected}{reason}")
    return tuple(dict.fromkeys(symbols))
