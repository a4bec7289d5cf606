"""Base classes of values that are printed and displayed: `__str__`, `_repr_html_` and `_repr_latex_`.

The files of kahanmaps.display register the text, HTML and LaTeX of each class, so that the classes need not import
these files. They are imported by name on first use: no other file imports from a higher layer.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import singledispatch
from importlib import import_module
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.hints import AttributeHints


class HtmlDisplay(AttributeHints):
    """Base class of values that notebooks display as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        _load_displays(self)
        return html_form(self)


class WithoutTruthValue:
    """Base class of results for which `if result:` raises TypeError, since its meaning would be ambiguous.

    Without this class a refuted claim and an empty search would count as true.
    """

    __slots__ = ()

    def __bool__(self) -> bool:
        if hasattr(self, "holds"):
            hint = "use .holds, which is True, False or None (undecided)"
        elif getattr(self, "_parts", ""):
            hint = "use len(result), or `is not None`"
        else:
            hint = "use one of its attributes, or `is not None`"
        name = type(self).__name__
        article = "an" if name[0] in "AEIOU" else "a"
        raise TypeError(f"the truth value of {article} {name} is ambiguous: {hint}")


class Certified:
    """Base class of results that can have certificates: proofs that other programs can check."""

    __slots__ = ()

    def certificate(self, checker: str) -> str:
        """Return a script with which another program checks what this result proves about a map for every eps.

        Args:
            checker: "rocq" (Coq 8.16 or newer), "gp" (PARI/GP) or "sympy".

        Returns:
            The exact text of the script: a str that has the attributes of the result of `km.certificate`.

        Raises:
            InputError: if there is no certificate. The message says why, for example since eps is fixed.

        >>> from kahanmaps.checks.conserve import check_integrals
        >>> check_integrals("euler_top").findings[0].certificate("gp").splitlines()[-1]
        'quit(!ok)'
        """
        text: str = import_module("kahanmaps.certificates.certificate").certificate_of(self, checker)
        return text


class PrintableResult(HtmlDisplay, WithoutTruthValue, Certified):
    """Base class of results; `print` shows the lines that the command for this kind of result prints.

    A result with parts is a sequence of these parts: `_parts` is the name of the attribute that contains them. `_noun`
    is a pair: the noun for a part in singular and in plural.
    """

    __slots__ = ()
    _parts, _noun = "", ("", "")

    def __str__(self) -> str:
        _load_displays(self)
        return text_form(self)

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "__repr__" not in vars(cls):
            cls.__repr__ = PrintableResult.__repr__  # type: ignore[method-assign]  # a dataclass prints all its fields

    def __repr__(self) -> str:
        """Return the class name with number and verdicts of the parts or, without parts, the first line of the text."""
        if self._noun[0]:
            verdicts = sorted({str(part.verdict) for part in self if hasattr(part, "verdict")})
            if hasattr(self, "verdict"):  # a single verdict of all parts together
                verdicts = [str(self.verdict)]
            number = f"{len(self) or 'no'} {self._noun[len(self) > 1]}"
            return f"<{type(self).__name__}: {', '.join([number, *verdicts])}>"
        first_line = str(self).partition("\n")[0].replace("\t", " ")
        return f"<{type(self).__name__}: {shorten(first_line, 100)}>"

    def _sequence(self) -> Sequence[Any]:
        if not self._parts:
            alternative = "rows(), or its attributes" if hasattr(self, "rows") else "its attributes"
            raise TypeError(f"a {type(self).__name__} is not a sequence: use {alternative}")
        parts: Sequence[Any] = getattr(self, self._parts)
        return parts

    def __iter__(self) -> Iterator[Any]:
        return iter(self._sequence())

    def __len__(self) -> int:
        return len(self._sequence())

    def __getitem__(self, index: Any) -> Any:
        return self._sequence()[index]

    def to_dict(self) -> Any:
        """Return the result as plain data, as `to_json` does: `json.dump(result.to_dict(), file)` writes it."""
        return self.to_json()  # type: ignore[attr-defined]

    def to_pandas(self) -> Any:
        """Return `rows()` as a DataFrame. Raises InputError if pandas is not installed or the result has no rows."""
        if not hasattr(self, "rows"):
            raise InputError(f"a {type(self).__name__} is not a table: use print")
        return data_frame(self.rows())


def data_frame(rows: Sequence[Mapping[str, Any]]) -> Any:
    """Return the rows as a pandas DataFrame. Raises InputError if pandas is not installed."""
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise InputError(f"a table needs pandas ({error}): pip install pandas, or use rows()") from error
    return pandas.DataFrame(rows)


_TEXT_ATTRIBUTES = ("text", "sentence", "summary", "claim", "reason", "rhs")


class ResultPart(AttributeHints, Certified):
    """Base class of parts of results; the first attribute in `_TEXT_ATTRIBUTES` that a part has is its text."""

    __slots__ = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "__repr__" not in vars(cls):
            cls.__repr__ = ResultPart.__repr__  # type: ignore[method-assign]  # a dataclass prints all its fields

    def __repr__(self) -> str:
        value = next(getattr(self, name) for name in _TEXT_ATTRIBUTES if hasattr(self, name))
        text = value if isinstance(value, str) else ", ".join(map(str, value))
        return f"<{type(self).__name__}: {shorten(text.partition(chr(10))[0], 100)}>"

    def to_dict(self) -> Any:
        """Return the part as plain data, as `to_json` does."""
        return self.to_json()  # type: ignore[attr-defined]


class LatexDisplay(AttributeHints):
    """Base class of values that notebooks display as a formula."""

    __slots__ = ()

    def _repr_latex_(self) -> str:
        formula = latex(self)
        return formula if formula.startswith("$") else rf"$\displaystyle {formula}$"

    def latex(self) -> str:
        """Return the value as a formula in LaTeX, without dollar signs."""
        return latex(self).removeprefix(r"$\displaystyle ").removesuffix("$")

    def to_sympy(self) -> Any:
        """Return the exact formula in SymPy; for a system or a map, a dict from variables to formulas."""
        return import_module("kahanmaps.languages.to_sympy").sympy_form(self)

    _sympy_ = to_sympy  # `sympy.sympify(value)` calls this method


def latex(value: object) -> str:
    """Return a system, a map, a polynomial or a rational function as LaTeX."""
    _load_displays(value)
    return latex_form(value)


def shorten(text: str, width: int) -> str:
    """Shorten a long text to its first and last characters, followed by its length: 12345...67890 (1234 chars)."""
    if len(text) <= width:
        return text
    kept_length = max(4, (width - 18) // 2)
    return f"{text[:kept_length]}...{text[-kept_length:]} ({len(text)} chars)"


@singledispatch
def html_form(value: object) -> str:
    """Return the value as HTML, by the function that a file of kahanmaps.display registered for its class."""
    raise TypeError(f"no HTML is registered in kahanmaps.display for the class {type(value).__name__}")


@singledispatch
def text_form(value: object) -> str:
    """Return the text that `print` shows for the value, by the function that is registered for its class."""
    return object.__repr__(value)


@singledispatch
def latex_form(value: object) -> str:
    """Return the value as LaTeX, by the function that kahanmaps.display registered for its class."""
    raise TypeError(f"no LaTeX is registered in kahanmaps.display for the class {type(value).__name__}")


_FILES = {"documents": "systems", "family": "systems", "maps": "systems"}  # folder -> file of kahanmaps.display


def _load_displays(value: object) -> None:
    """Import the file of kahanmaps.display for the class of `value`; `_FILES` or the folder of the class names it."""
    for base in type(value).__mro__:  # base classes too: a user's subclass is displayed like its base class
        package, *folders = base.__module__.split(".")
        if package in ("kahanmaps", "flint"):
            is_formula = package == "flint" or folders[0] == "algebra"
            import_module(f"kahanmaps.display.{'latex' if is_formula else _FILES.get(folders[0], folders[0])}")
            return
