"""The catalogue of named systems: for each a TOML file in this folder with its equations, known facts and sources.

The subfolder maps contains maps that are not Kahan maps. `load` finds systems and maps by name. It also generates the
members of families such as lv(7,3), see documents/families.py.

>>> names()[:3]
('clebsch_first_flow', 'dressing_chain_3', 'euler_top')
>>> top = load("euler_top", {"a1": 1, "a2": 2, "a3": "-3/2"})
>>> print(top.system)
x1' = x2*x3
x2' = 2*x1*x3
x3' = -3/2*x1*x2
>>> top.catalog["title"]
'Euler top'

A file has the format of all system files, and its name is the name of the system. Each fact begins with its status:
Proved (in the source named; if none is named, by the argument stated or by tests/documents/test_catalog.py), Refuted
(at a point), Measured (by a finite computation modulo a prime, which is no proof), Classical, or Origin (how the file
was made). Degrees, growth, verdict and relations are also structured data (`kahanmaps.documents.structured_facts`);
tests/laboratory/test_further_systems.py and tests/documents/test_catalog_maps.py recompute them.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kahanmaps.documents.families import family_member
from kahanmaps.errors import InputError, quoted

if TYPE_CHECKING:
    from kahanmaps.documents.files import SystemFile


class UnknownSystem(InputError, KeyError):
    """Raised if the catalogue has no system of a given name."""


_ENDING = ".toml"
_FOLDER = Path(__file__).parent
_LIST_HINT = "'kahanmaps systems' lists the catalogue"


def names() -> tuple[str, ...]:
    """Return the names of all systems of the catalogue, in alphabetical order.

    >>> "lorenz" in names()
    True
    """
    return _names_in(_FOLDER)


def map_names() -> tuple[str, ...]:
    """Return the names of the maps in the catalogue that are not Kahan maps, in alphabetical order.

    >>> "lyness" in map_names()
    True
    """
    return _names_in(_FOLDER / "maps")


def _names_in(folder: Path) -> tuple[str, ...]:
    entries = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(_ENDING) for name in entries if name.endswith(_ENDING)))


def text_of(name: str) -> bytes:
    """Return the content of the file of a system or map in the catalogue. Raises KeyError for any other name."""
    generated = family_member(name)
    if generated is not None:
        from kahanmaps.documents.toml_text import to_toml

        return to_toml(generated[1], ("variables",), ("catalog", "system", "integrals", "density")).encode()
    if name in map_names():
        return (_FOLDER / "maps" / (name + _ENDING)).read_bytes()
    if name not in names():
        raise KeyError(name)
    return (_FOLDER / (name + _ENDING)).read_bytes()


def titles() -> dict[str, tuple[int, str]]:
    """Return a dict {name: (dimension, title)} of all systems and then all maps; no file is parsed completely.

    >>> titles()["lorenz"]
    (3, 'Lorenz system')
    """
    titles_by_name = {}
    for name in (*names(), *map_names()):
        document = tomllib.loads(text_of(name).decode())
        if "composition" in document:
            variables = document["composition"]["of"][0]["map"]["variables"]
        else:
            variables = document.get("variables") or document["family"]["A"]
        copies = 2 if document.get("system", {}).get("discretization") == "polarised" else 1
        titles_by_name[name] = copies * len(variables), document["catalog"]["title"]
    return titles_by_name


class Catalogue(Mapping[str, "SystemFile"]):
    """The named systems and maps: a mapping from names to system files, which are read when they are accessed.

    >>> catalogue = Catalogue()
    >>> "lorenz" in catalogue, catalogue["lorenz"].dim
    (True, 3)
    """

    def __getitem__(self, name: str) -> SystemFile:
        if not isinstance(name, str):
            raise UnknownSystem(f"found {name!r}, expected a name: list(km.catalogue())[:3] are the first three")
        if name not in self:
            raise UnknownSystem(str(_unknown_system(name)))
        return load(name)

    def __iter__(self) -> Iterator[str]:
        return iter((*names(), *map_names()))

    def __len__(self) -> int:
        return len(names()) + len(map_names())

    def __contains__(self, name: object) -> bool:
        return name in (*names(), *map_names())

    def __repr__(self) -> str:
        return f"<Catalogue: {len(names())} systems and {len(map_names())} maps>"

    def __str__(self) -> str:
        return "\n".join(f"{name}\t{dim}\t{title}" for name, (dim, title) in titles().items())

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each system: name, dimension and title."""
        return [{"name": name, "dim": dim, "title": title} for name, (dim, title) in titles().items()]


def catalogue() -> Catalogue:
    """Return the mapping from names to systems and maps; `print` lists them with dimensions and titles."""
    return Catalogue()


def load(reference: str | Path, parameters: Mapping[str, Any] | None = None, **values: Any) -> SystemFile:
    """Load a system from the catalogue or from a TOML file.

    Args:
        reference: a name of the catalogue (euler-top stands for euler_top) or a path. A path is a `Path`, or a text
            that ends in .toml, contains a path separator or names an existing file. A name of the catalogue takes
            precedence over a file of the same name, which is given as ./name.
        parameters, values: exact numbers (int, Fraction, text such as "2/3") that replace default values of parameters.

    Returns:
        The system file.

    Raises:
        InputError: for a name that is not in the catalogue, and for a file that cannot be read. SystemFileError, a
            subclass: for a file with mistakes, for unknown parameters and for inexact values.

    >>> load("henon_heiles", {"c": "-6"}).parameters, load("henon_heiles", c=1).parameters
    ({'c': -6}, {'c': 1})
    >>> load("henon_hailes")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InputError: found the unknown system 'henon_hailes', did you mean henon_heiles? ...
    >>> load("lv(5,2)").dim
    5
    >>> load("henon_heiles", {"d": 1})
    Traceback (most recent call last):
        ...
    kahanmaps.errors.SystemFileError: henon_heiles: 1 mistake
      parameters: unknown parameter 'd', this system has: c
    """
    # Imported here, so that listing names does not load FLINT.
    from kahanmaps.documents.files import parse_system, read_system

    parameters = {**(parameters or {}), **values}
    if not isinstance(reference, str | Path):
        kind = type(reference).__name__
        raise InputError(f"found a {kind}, expected the name of a system or the path of a file: km.load('lorenz')")
    if not isinstance(reference, Path):
        generated = family_member(reference)
        name = reference if generated is None else generated[0]
        underscored = name.replace("-", "_")
        if generated is None and not os.path.exists(name) and underscored in (*names(), *map_names()):
            name = underscored
        if generated is not None or name in (*names(), *map_names()):
            return parse_system(text_of(name), name, parameters)
        has_ending = "." in reference and "(" not in reference  # the ending of a file name, perhaps mistyped
        has_separator = any(mark in reference for mark in (os.sep, os.altsep) if mark)
        if not (has_ending or has_separator or os.path.exists(reference)):
            raise _unknown_system(reference)
    return read_system(reference, parameters)


def _unknown_system(name: str) -> InputError:
    if not name or len(name) > 60 or not name.isprintable():  # no system can have such a name
        return InputError(f"found {quoted(name)}, expected the name of a system or a path: {_LIST_HINT}")
    normalized = name.lower().replace("-", "_").replace(" ", "_")
    known_names = (*names(), *map_names())
    from difflib import get_close_matches

    similar_names = get_close_matches(normalized, known_names, 3)
    # Suggest also the names that contain the given text: henon_heiles for "heiles".
    longer_names = [known for known in known_names if len(normalized) > 2 and normalized in known]
    similar_names = list(dict.fromkeys([*similar_names, *longer_names]))[:3]
    question = f", did you mean {' or '.join(similar_names)}?" if similar_names else ":"
    return InputError(
        f"found the unknown system {name!r}{question} {_LIST_HINT}; a file is given by its path, e.g. ./{name}{_ENDING}"
    )
