"""Conversion of equations, given on the command line or in Python, to system files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kahanmaps.documents.catalog import load
from kahanmaps.documents.expressions import formula_text, number, roots_named, sides_of_equations
from kahanmaps.documents.files import SystemFile, parse_system
from kahanmaps.documents.map_files import map_file
from kahanmaps.errors import InputError
from kahanmaps.family.associated import AssociatedSystem, FamilyMember
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import Map, MapFamily
from kahanmaps.systems.hamiltonian import CubicHamiltonian
from kahanmaps.systems.quadratic import QuadraticSystem

if TYPE_CHECKING:
    from kahanmaps.maps.kahan import SystemLike


def inline_file(
    variables: str | None, parameters: Mapping[str, str], kind: str, section: Mapping[str, str | Sequence[str]]
) -> str:
    """Return the text of a system file with the section [`kind`]; `variables` are names separated by commas.

    >>> print(inline_file("x,y", {"a": "1/2"}, "system", {"rhs": ["a*y", "-x"]}))
    variables = ["x", "y"]
    [system]
    rhs = ["a*y", "-x"]
    [parameters]
    "a" = "1/2"
    """

    def value(data: Any) -> str:  # strings and lists of strings are written in TOML as in JSON
        return json.dumps(data, ensure_ascii=False)

    lines = [] if variables is None else [f"variables = {value([name.strip() for name in variables.split(',')])}"]
    lines += [f"[{kind}]", *(f"{key} = {value(data)}" for key, data in section.items()), "[parameters]"]
    lines += [f"{value(name)} = {value(text.strip())}" for name, text in parameters.items()]
    return "\n".join(lines)


def System(
    equations: str | Mapping[Any, Any] | Sequence[Any] | None = None,
    variables: Any = None,
    *,
    hamiltonian: Any = None,
    **parameters: Any,
) -> SystemFile:
    """Create a system x' = f(x) of degree at most 2 from its equations, or from a Hamiltonian of degree at most 3.

    Args:
        equations: "x' = 2*x*y - 1; y' = -x^2", a dict from variables to right-hand sides, or a list of right-hand
            sides, each a text or a SymPy expression; or a list of SymPy equations Eq(x(t).diff(t), ...).
        variables: the names of the variables in the order of a list of right-hand sides. In other cases also a dict of
            parameters. For a Hamiltonian: the positions, then the momenta in the same order.
        hamiltonian: H, in place of equations; the system is q' = dH/dp, p' = -dH/dq.
        parameters: values of the other names, as a=2 or parameters={"a": 2}: exact, or algebraic numbers of SymPy.

    Returns:
        A `SystemFile`, as if it had been read from a file.

    Raises:
        InputError: if the equations cannot be read.

    >>> System("x' = 2*x*y - a; y' = -x^2 - y^2 - x", a="1/2").system.rhs
    (2*x*y - 1/2, -x^2 - y^2 - x)
    >>> System(hamiltonian="p^2/2 + q^2/2 - q^3/3", variables="q,p").system.rhs
    (p, q^2 - q)
    """
    if isinstance(variables, Mapping):
        variables, parameters = None, {**{str(key): value for key, value in variables.items()}, **parameters}
    for name in ("parameters", "params"):
        if isinstance(parameters.get(name), Mapping):
            parameters |= {str(key): value for key, value in parameters.pop(name).items()}
    if (equations is None) == (hamiltonian is None):
        example = "km.System(\"q' = p; p' = q^2 - q\")"
        raise InputError(f'expected either equations, {example}, or hamiltonian="p^2/2 + q^3/3", variables="q,p"')
    if hamiltonian is not None and variables is None:
        raise InputError('found a Hamiltonian without variables, expected positions and momenta, variables="q,p"')
    equations = [hamiltonian] if equations is None else equations
    if not isinstance(equations, str | Mapping):
        try:
            equations = list(equations)
        except TypeError as error:
            kind = type(equations).__name__
            raise InputError(
                f"found a {kind}, expected equations, as text, a dictionary or a list: km.System(\"x' = y; y' = x^2\")"
            ) from error
        equations = sides_of_equations(equations) or equations
    if isinstance(equations, Mapping):
        variables, equations = list(equations), list(equations.values())
    elif (
        not isinstance(equations, str) and variables is None and not any("=" in str(equation) for equation in equations)
    ):
        raise InputError(f"found {len(equations)} right-hand sides without variables, expected these too: x, y, ...")
    if not isinstance(equations, str):
        equations, roots = roots_named(equations, [*map(str, variables or ()), *parameters])
        parameters |= roots
    rhs = equations if isinstance(equations, str) else [formula_text(equation) for equation in equations]
    if isinstance(variables, str):
        variables = variables.replace(",", " ").split()
    names = None if variables is None else ",".join(map(str, variables))
    values = {name: formula_text(number(value)) for name, value in parameters.items()}
    if hamiltonian is not None:
        return parse_system(inline_file(names, values, "hamiltonian", {"H": rhs[0], "J": "standard"}), "inline")
    return parse_system(inline_file(names, values, "system", {"rhs": rhs}), "inline")


# Names of System in the style of other libraries, such as System.from_sympy([y, x**2], (x, y)).
vars(System).update({f"from_{form}": System for form in ("text", "string", "dict", "sympy", "equations")})
vars(System)["from_hamiltonian"] = lambda H, variables=None, **parameters: System(
    None, variables, hamiltonian=H, **parameters
)


def map_at(system: SystemLike, eps: Any = None, *, time_step: Any = None, h: Any = None) -> Map:
    """Return the map of a system at an exact eps: callable, composed by @ and **. Raises InputError without eps.

    >>> map_at("euler_top", "1/10")([1, 2, 3])
    (65/37, 10/37, 125/37)
    """
    return as_file(system).at(resolve_eps(eps, time_step, h))


def as_file(value: Any) -> SystemFile:
    """Return a file for a file, system, map, catalogue name, path, or equations in a notation that `System` reads.

    A map at one eps becomes a map that does not depend on eps. Raises InputError for any other value.
    """
    if isinstance(value, SystemFile):
        return value
    if isinstance(value, QuadraticSystem):
        return SystemFile.from_system(value)
    if isinstance(value, FamilyMember):
        return SystemFile.from_member(value)
    if isinstance(value, AssociatedSystem):
        value = value.hamiltonian
    if isinstance(value, CubicHamiltonian):
        return SystemFile.from_hamiltonian(value)
    if (isinstance(value, str) and "=" in value) or isinstance(value, Mapping):
        return System(value)
    if isinstance(value, list | tuple):
        if not any("=" in str(equation) or hasattr(equation, "lhs") for equation in value):
            raise InputError("found a list, expected one system: for several type [f(system) for system in systems]")
        return System(value)
    if isinstance(value, str | Path):
        return load(value)
    if isinstance(value, Map | MapFamily):
        return map_file(value)
    kind = type(value).__name__
    raise InputError(f"found a {kind}, expected a name of the catalogue, a file, a system, or equations as text")
