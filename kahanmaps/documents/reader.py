"""Reading the parts of a system file (tables, texts, polynomials, matrices) and collecting the mistakes in them.

A formula may contain the variables, the parameters, which have values, and the symbols, which have none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.parsing import parse_constant, parse_polynomial, parse_rational_function
from kahanmaps.algebra.polynomials import RationalFunction
from kahanmaps.algebra.printing import format_number
from kahanmaps.algebra.roots import Root
from kahanmaps.documents.iterates import parse_with_iterates
from kahanmaps.documents.structured_facts import FACT_KEYS
from kahanmaps.errors import InputError, UnknownName, counted, quoted, show
from kahanmaps.maps.polarised import MAX_DEGREE
from kahanmaps.systems.quadratic import MAX_DIMENSION

T = TypeVar("T")

KINDS = ("system", "hamiltonian", "family", "bilinear", "map", "composition")
KEYS = {
    "": {"name", "variables", "parameters", *KINDS, "integrals", "density", "catalog"},
    "system": {"rhs", "discretization", "degree"},
    "hamiltonian": {"H", "J"},
    "family": {"A", "H", "signs"},
    "bilinear": {"new", "equations"},
    "map": {"image", "inverse"},
    "composition": {"of"},
    "composition.of": {"file", "system", "map", "power", "inverse", "parameters", "involution"},
    "density": {"phi"},
    "catalog": {"title", "sources", "convention", "facts", *FACT_KEYS},
}
EXPECTED = {
    ("system", "rhs"): "a list of polynomials of degree at most 2 in quotes, one for each variable",
    ("bilinear", "equations"): "a list of equations in quotes, linear in the old point and in the new one",
    ("composition", "of"): 'a list of maps, each with one of file = "...", system = "..." and map = { ... }',
    ("map", "image"): "a list of rational functions in quotes, one for each variable",
    ("hamiltonian", "H"): "a polynomial of degree at most 3 in quotes",
    ("hamiltonian", "J"): '"standard", which is [[0, I], [-I, 0]], or the rows of a skew matrix',
    ("family", "A"): "the rows of a skew-Hamiltonian matrix",
    ("family", "H"): "a homogeneous cubic in quotes",
    ("density", "phi"): "a rational function of the variables and eps in quotes",
}


# A function that looks up a part of a composition from a key ("file" or "system") and its value. It returns the
# document of the part, a unique name of this document, and the look-up function for the parts of this document.
LookUp = Callable[[str, str], tuple[dict[str, Any], str, Any]]


class PartReader:
    """Read the parts of a document; collect its names (parameters, variables, symbols) and its mistakes."""

    def __init__(
        self, document: dict[str, Any], where: str, overrides: Mapping[str, Any], look_up: LookUp | None = None
    ) -> None:
        """`overrides` replace parameter values; `look_up` finds the parts of a composition that are given by name."""
        self.document = document
        self.where = where
        self.overrides = overrides
        self.look_up = look_up
        self.enclosing: tuple[str, ...] = ()  # files with compositions that contain this document
        self.part_count = [0]  # number of parts read so far, in a list that the readers of all parts share
        self.mistakes: list[tuple[str, str]] = []
        self.parameters: dict[str, fmpq] = {}
        self.has_bad_parameter = False  # whether a parameter is invalid, so that checks with its value are omitted
        self.variables: tuple[str, ...] | None = None
        self.symbols: tuple[str, ...] = ()  # parameters that remain symbols in the map
        self.root: tuple[str, Root] | None = None  # name and value of the algebraic parameter, one of the symbols

    def _report(self, key: str, sentence: str) -> None:
        # Keys come from the file and may contain escape sequences, which must not reach a terminal.
        self.mistakes.append((key if key.isprintable() and len(key) <= 100 else quoted(key, 100), sentence))

    def _refuse(self, key: str, sentence: str) -> T | None:
        """Add a mistake to the list and return None."""
        self._report(key, sentence)
        return None

    def _try_make(self, path: str, make: Callable[..., T], *arguments: Any) -> T | None:
        """Return make(*arguments); if this call raises InputError, note a mistake at `path` and return None."""
        try:
            return make(*arguments)
        except InputError as error:
            return self._refuse(path, str(error))

    def _report_unknown_keys(self, section: str, table: Mapping[str, Any]) -> None:
        known_keys = KEYS[section]
        for key in table:
            if key not in known_keys:
                path = f"{section}.{key}" if section else key
                hint = " (a batch spec is for kahanmaps batch run)" if path == "experiments" else ""
                self._report(path, f"unknown key, expected one of {', '.join(sorted(known_keys))}{hint}")

    def _read_table(self, key: str) -> dict[str, Any] | None:
        value = self.document.get(key, {})
        if isinstance(value, dict):
            return value
        return self._refuse(key, f"found {show(value)}, expected a table [{key}]")

    def _read_text(self, path: str, value: Any) -> str | None:
        if isinstance(value, int | str) and not isinstance(value, bool):
            return value if isinstance(value, str) else self._try_make(path, format_number, fmpq(value))
        return self._refuse(path, f"found {show(value)}, expected an expression in quotes")

    def _read_polynomial(
        self, path: str, value: Any, max_degree: int, extra_names: Sequence[str] = (), *, of_map: bool = True
    ) -> fmpq_mpoly | None:
        """Return `value` as a polynomial in the variables and `extra_names`; if `of_map`, also in the symbols and eps.

        If the text is invalid, or its degree in the variables exceeds `max_degree`, note a mistake and return None.
        """
        text = self._read_text(path, value)
        if text is None or self.variables is None:
            return None
        try:
            map_names = (*self.symbols, "eps") if of_map else ()
            polynomial = parse_polynomial(text, (*self.variables, *extra_names, *map_names), self.parameters)
        except UnknownName as error:
            places = "in [parameters], by -p NAME=VALUE, or System(..., NAME=VALUE)"
            return self._refuse(path, f"{error}\nif it is a parameter, give its value: {places}")
        except InputError as error:
            return self._refuse(path, str(error))
        actual_degree = max((sum(m[: len(self.variables)]) for m in polynomial.monoms()), default=-1)
        if actual_degree > max_degree and not self.has_bad_parameter:
            degree = "" if actual_degree == 3 else f" and degree = {actual_degree}"
            keys = f'discretization = "polarised"{degree}'
            advice = f"\nfor a field of degree {actual_degree} write {keys} into [system] of a file"
            hint = advice if path.startswith("system.rhs") and actual_degree <= MAX_DEGREE else ""
            return self._refuse(
                path, f"found a polynomial of degree {actual_degree}, expected at most {max_degree}{hint}"
            )
        return polynomial

    def _read_matrix(self, path: str, value: Any, size: int | None) -> fmpq_mat | None:
        if not isinstance(value, list) or not value or not all(isinstance(row, list) for row in value):
            return self._refuse(path, f'found {show(value)}, expected rows of numbers, e.g. [["0", "1"], ["-1", "0"]]')
        expected = size or len(value)
        if expected > MAX_DIMENSION:
            return self._refuse(path, f"found {expected} rows, expected at most {MAX_DIMENSION}")
        is_invalid = False
        if len(value) != expected:
            self._report(path, f"found {counted(len(value), 'row')}, expected {expected}")
            is_invalid = True
        entries: list[fmpq] = []
        for i, row in enumerate(value):
            if len(row) != expected:
                self._report(f"{path}[{i + 1}]", f"found {len(row)} entries, expected {expected}")
                is_invalid = True
            for j, entry in enumerate(row):
                entry_path = f"{path}[{i + 1}][{j + 1}]"
                text = self._read_text(entry_path, entry)
                number = None if text is None else self._try_make(entry_path, parse_constant, text, self.parameters)
                entries.append(fmpq(0) if number is None else number)
                is_invalid = is_invalid or number is None
        return None if is_invalid else fmpq_mat(expected, expected, entries)

    def _require(self, section: str, table: Mapping[str, Any], key: str) -> Any:
        if key not in table:
            self._report(f"{section}.{key}", f"missing, expected {EXPECTED[section, key]}")
        return table.get(key)

    def _read_list(self, section: str, key: str, value: Any, noun: str) -> list[Any] | None:
        """Return `value` if it is a list with one entry for each variable; otherwise note a mistake and return None."""
        path = f"{section}.{key}"
        if value is None:
            return None
        if not isinstance(value, list):
            return self._refuse(path, f"found {show(value)}, expected {EXPECTED.get((section, key), 'a list')}")
        if self.variables is None:
            return None
        if len(value) != len(self.variables):
            count = len(self.variables)
            return self._refuse(path, f"found {counted(len(value), noun)}, expected {count}, one for each variable")
        return value

    def _read_each(self, path: str, value: Any, read: Callable[[str, Any], T | None]) -> list[T] | None:
        """Return the list of all entries, each read by `read`; note all mistakes, and return None if there is one."""
        entries = value if isinstance(value, list) else []
        results = [read(f"{path}[{k + 1}]", entry) for k, entry in enumerate(entries)]
        valid = [result for result in results if result is not None]
        return valid if len(valid) == len(results) else None

    def _read_claim(self, path: str, value: Any) -> RationalFunction | None:
        text = self._read_text(path, value)
        if text is None or self.variables is None:
            return None
        constant_names = (*self.symbols, "eps")
        if path.startswith("integrals."):
            return self._try_make(path, parse_with_iterates, text, self.variables, constant_names, self.parameters)
        return self._try_make(path, parse_rational_function, text, (*self.variables, *constant_names), self.parameters)


def json_like(value: Any) -> Any:
    """Return plain data in which long integers are replaced by text."""
    if isinstance(value, dict):
        return {key: json_like(item) for key, item in value.items()}
    if isinstance(value, list):
        return [json_like(item) for item in value]
    if isinstance(value, int) and value.bit_length() > 1000:
        return format_number(fmpq(value))
    return value
