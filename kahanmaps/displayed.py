"""What a notebook asks a value for, and JSON a formula: how it looks. The answers are in kahanmaps.display.

That folder knows all values and stands above them, so that no value knows HTML or LaTeX. It is imported when somebody
looks, by its name: this is the one file where imports point up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import singledispatch
from importlib import import_module
from typing import Any

from kahanmaps.errors import InputError


class Displayed:
    """A value that notebooks show as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        _load(self)
        return html_form(self)


class WithoutTruthValue:
    """A result of which `if result:` is an error: it would be true for a refuted claim and an empty search as well."""

    __slots__ = ()

    def __bool__(self) -> bool:
        if hasattr(self, "holds"):
            hint = "use .holds, which is True, False or None (undecided)"
        else:
            hint = "use one of its attributes, or `is not None`"
        name = type(self).__name__
        article = "an" if name[0] in "AEIOU" else "a"
        raise TypeError(f"the truth value of {article} {name} is ambiguous: {hint}")


class Printed(Displayed, WithoutTruthValue):
    """A result that `print` shows as the lines of its command too."""

    __slots__ = ()

    def __str__(self) -> str:
        _load(self)
        return text_form(self)

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.__repr__ = Printed.__repr__  # type: ignore[method-assign]  # a dataclass would write all of its data

    def __repr__(self) -> str:
        """The first line of what `print` shows."""
        first = str(self).partition("\n")[0].replace("\t", " ")
        return f"<{type(self).__name__}: {shorten(first, 100)}>"

    def to_pandas(self) -> Any:
        """`rows()` as a table of pandas. Raises InputError where that, an extra, is not installed, or has no rows."""
        if not hasattr(self, "rows"):
            raise InputError(f"a {type(self).__name__} is no table: print shows it")
        return data_frame(self.rows())


def data_frame(rows: Sequence[Mapping[str, Any]]) -> Any:
    """A table of pandas. Raises InputError where it is not installed."""
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise InputError(f"a table needs pandas ({error}): pip install pandas, or take rows()") from error
    return pandas.DataFrame(rows)


class DisplayedAsFormula:
    """A value that notebooks show as a formula."""

    __slots__ = ()

    def _repr_latex_(self) -> str:
        return latex(self)


def latex(value: object) -> str:
    """A system, a map, a polynomial or a rational function in LaTeX."""
    _load(value)
    return latex_form(value)


def shorten(text: str, width: int) -> str:
    """A long number with its middle left out and its length told: 12345...67890 (1234 characters)."""
    if len(text) <= width:
        return text
    keep = max(4, (width - 18) // 2)
    return f"{text[:keep]}...{text[-keep:]} ({len(text)} chars)"


@singledispatch
def html_form(value: object) -> str:
    """The value as HTML: the files of kahanmaps.display register what they know."""
    raise TypeError(f"no file of kahanmaps.display says how a {type(value).__name__} looks as HTML")


@singledispatch
def text_form(value: object) -> str:
    """The value as `print` shows it: the files of kahanmaps.display register what a command prints."""
    return object.__repr__(value)


@singledispatch
def latex_form(value: object) -> str:
    """The value as LaTeX: the files of kahanmaps.display register what they know."""
    raise TypeError(f"no file of kahanmaps.display says how a {type(value).__name__} looks as a formula")


_FILES = {"documents": "systems", "family": "systems", "maps": "systems"}


def _load(value: object) -> None:
    """Import the file that knows this kind of value: it is called like the folder of the kind, or as `_FILES` says."""
    for kind in type(value).__mro__:  # what a user made from one of ours looks like ours
        top, *folders = kind.__module__.split(".")
        if top in ("kahanmaps", "flint"):
            is_formula = top == "flint" or folders[0] == "algebra"
            import_module(f"kahanmaps.display.{'latex' if is_formula else _FILES.get(folders[0], folders[0])}")
            return
