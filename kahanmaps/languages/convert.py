"""One function for all languages: a system, its Kahan map, integrals and density as a file for another program."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from kahanmaps.algebra.written.numerals import is_name
from kahanmaps.documents.files import SystemFile
from kahanmaps.errors import InputError
from kahanmaps.languages.formulas import Formulas
from kahanmaps.languages.language import LANGUAGES as TABLES
from kahanmaps.languages.language import Language
from kahanmaps.languages.latex import write_latex
from kahanmaps.languages.writer import PARTS, write

LANGUAGES = ("latex", *TABLES)


def convert(
    file: SystemFile,
    language: str,
    what: Iterable[str] | None = None,
    *,
    name: str = "",
    symbols: Sequence[str] = (),
    command: str = "",
) -> str:
    """A map and what is known of it as a file that another program runs as it stands, exactly.

    A system stands for its Kahan map.

    Args:
        file: the system; its parameters are written as the numbers that the file gives.
        language: one of `LANGUAGES`.
        what: of `PARTS`; None for the system, the map, and integrals and density where they are known.
        name: put before the names of all functions, so that two systems fit into one session; in LaTeX nothing.
        symbols: parameters that stay symbols (not in a [family] file); the functions take them as arguments after eps.
        command: the command line that makes this file, for the comment on top.

    Returns:
        The text of the file. eps is an argument of all functions of the map (the time step is 2 eps, as the comment on
        top says), if it has one. Nothing in it depends on the day or the machine.

    Raises:
        InputError: for an unknown language or part, a name that is none, integrals or a density where none is known,
            and a closed form ("map-formulas") that is too large.

    >>> from kahanmaps.documents.catalog import load
    >>> print(convert(load("harmonic"), "pari", ["system"]).split("\\n\\n")[1].strip())
    \\\\ x' = f(x)
    {vector_field(point) =
      my(x = point[1], y = point[2]);
      [y, -x]~
    }
    """
    if language not in LANGUAGES:
        raise InputError(f"found the language {str(language)[:40]!r}, expected one of {', '.join(LANGUAGES)}")
    if name and not (is_name(name) and name[0] != "_"):
        raise InputError(f"found the name {name[:40]!r}, expected a letter, then letters, digits and _")
    formulas = Formulas.of(file, symbols)
    parts = _parts(what, formulas)
    if language == "latex":
        return write_latex(formulas, parts, command)
    return write(Language.load(language), formulas, parts, name, command)


def _parts(what: Iterable[str] | None, formulas: Formulas) -> list[str]:
    """The parts in the order of `PARTS`. Raises InputError for one that is unknown or cannot be written."""
    if what is None:
        first = ["system", "map"] if formulas.rhs else ["map"]
        return [*first, *(part for part in ("integrals", "density") if part not in formulas.missing)]
    if isinstance(what, str):
        raise InputError(f"found the text {what[:40]!r}, expected a list of parts such as ['system', 'map']")
    asked = list(what)
    for part in asked:
        if part not in PARTS:
            raise InputError(f"found the part {str(part)[:40]!r}, expected one of {', '.join(PARTS)}")
    if not asked:
        raise InputError(f"found no part, expected some of {', '.join(PARTS)}")
    if not formulas.rhs and (fields := [part for part in ("system", "jacobian") if part in asked]):
        expected = "map, map-formulas, inverse, integrals or density"
        raise InputError(f"found the part {fields[0]} of {formulas.map.kind}, expected {expected}")
    for part in formulas.missing:
        if part in asked:
            raise InputError(formulas.missing[part])
    return [part for part in PARTS if part in asked]
