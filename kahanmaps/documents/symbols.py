"""The system or map of a file with some of its parameters left as symbols."""

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


def map_with_symbols(file: SystemFile, symbols: Sequence[str] = ()) -> MapFamily:
    """The map of a file, the parameters named in `symbols` without values, the others with theirs.

    Raises InputError as `with_symbols` does, for another map only where a name is no parameter.

    >>> from kahanmaps.documents.files import parse_system
    >>> lyness = 'variables = ["x", "y"]\\nparameters.a = 2\\n[map]\\nimage = ["y", "(a + y)/x"]'
    >>> print(map_with_symbols(parse_system(lyness), ["a"]))
    x~ = y
    y~ = (y + a)/x
    """
    if file.map.unsupported_reason:
        raise InputError(file.map.unsupported_reason)
    symbols = _parameters(file, symbols)
    if not symbols:
        return file.map
    return DocumentReader(dict(file.document), file.name, {}).read_map(file.kind, symbols)


def member_of(file: SystemFile, values: Mapping[str, fmpq]) -> SystemFile:
    """The system of a file with other values of some of its parameters, and without its claims.

    >>> from kahanmaps.documents.files import parse_system
    >>> lyness = 'variables = ["x", "y"]\\nparameters.a = 2\\n[map]\\nimage = ["y", "(a + y)/x"]'
    >>> print(member_of(parse_system(lyness), {"a": fmpq(1, 3)}).map)
    x~ = y
    y~ = (y + 1/3)/x
    """
    _parameters(file, list(values))
    document = {key: value for key, value in file.document.items() if key not in ("catalog", "integrals", "density")}
    numbers = {name: format_number(value) for name, value in {**file.parameters, **values}.items()}
    title = f"{file.name} at {', '.join(f'{name} = {numbers[name]}' for name in values)}"
    return SystemFile(**DocumentReader({**document, "name": title, "parameters": numbers}, file.name, {}).read())


def with_symbols(file: SystemFile, symbols: Sequence[str] = ()) -> QuadraticSystem:
    """The system of a file, the parameters named in `symbols` without values, the others with theirs.

    Args:
        file: the system.
        symbols: names of its parameters; eps is a symbol anyway and is not to be named.

    Returns:
        The system, its right-hand sides exact.

    Raises:
        InputError: for a name that is no parameter, for right-hand sides that with the symbols free have a degree
            above 2 or are no polynomials, and for a member of the family, whose A and H must fit together at
            every value.

    >>> from kahanmaps.documents.catalog import load
    >>> with_symbols(load("euler_top"), ["a1"]).rhs
    (x2*x3*a1, -2*x1*x3, x1*x2)
    """
    _ = file.system  # of another map there is none
    map_ = map_with_symbols(file, symbols)
    assert isinstance(map_, KahanFamily)
    return map_.system


def _parameters(file: SystemFile, symbols: Sequence[str]) -> tuple[str, ...]:
    """The names, each once. Raises InputError for one that is no parameter."""
    for name in symbols:
        if name not in file.parameters:
            known_names = ", ".join(file.parameters) or "none"
            raise InputError(
                f"found the symbol {quoted(name)}, expected eps or a parameter of the system: {known_names}"
            )
    return tuple(dict.fromkeys(symbols))
