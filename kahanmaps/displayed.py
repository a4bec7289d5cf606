"""What a notebook asks a value for, and JSON a formula: how it looks. The answers are in kahanmaps.display.

That folder knows all values and stands above them, so that no value knows HTML or LaTeX. It is imported when somebody
looks: hence by its name, the one place where an import points up.
"""

from __future__ import annotations

from functools import singledispatch
from importlib import import_module


class Displayed:
    """A value that notebooks show as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        _load(self)
        return html_form(self)


class DisplayedAsFormula:
    """A value that notebooks show as a formula."""

    __slots__ = ()

    def _repr_latex_(self) -> str:
        return latex(self)


def latex(value: object) -> str:
    """A system, a map, a polynomial or a rational function in LaTeX."""
    _load(value)
    return latex_form(value)


@singledispatch
def html_form(value: object) -> str:
    """The value as HTML: the files of kahanmaps.display register what they know."""
    raise TypeError(f"no file of kahanmaps.display says how a {type(value).__name__} looks as HTML")


@singledispatch
def latex_form(value: object) -> str:
    """The value as LaTeX: the files of kahanmaps.display register what they know."""
    raise TypeError(f"no file of kahanmaps.display says how a {type(value).__name__} looks as a formula")


def _load(value: object) -> None:
    """Import the file that knows this kind of value: it is called like the folder of the kind."""
    for kind in type(value).__mro__:  # what a user made from one of ours looks like ours
        top, *folders = kind.__module__.split(".")
        if top in ("kahanmaps", "flint"):
            is_formula = top == "flint" or folders[0] == "algebra"
            import_module(f"kahanmaps.display.{'latex' if is_formula else folders[0]}")
            return
