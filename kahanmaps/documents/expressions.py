"""Conversion of formulas and numbers of SymPy and similar libraries to text, without importing these libraries."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from kahanmaps.algebra.fields import rational
from kahanmaps.errors import InputError

_NUMBERS = (int, float, complex)


def formula_text(value: Any) -> str:
    """Convert a right-hand side or a claim to text, exactly.

    Raises InexactNumber for floats, also for those in SymPy expressions (Python evaluates the 1/3 in 1/3*x to a float),
    and InputError for irrational numbers in SymPy expressions.

    >>> formula_text("x*y"), formula_text(2)
    ('x*y', '2')
    """
    if isinstance(value, _NUMBERS) or (type(value).__module__ == "numpy" and not isinstance(value, str)):
        return str(rational(value))
    if not _is_sympy(value):
        return str(value)
    for irrational in _irrational_numbers(value):
        if irrational.is_Float:
            rational(float(irrational))  # raises InexactNumber
        raise InputError(
            f"found {irrational} in {value}, expected rational numbers and names: "
            f"an algebraic number is the value of a parameter, System(..., a={irrational})"
        )
    return str(value)


def roots_named(sides: Sequence[Any], taken: Collection[str]) -> tuple[list[Any], dict[str, Any]]:
    """Give a name to the only irrational number in SymPy expressions; return the new sides and {name: number} or {}."""
    from_sympy = [side for side in sides if _is_sympy(side)]
    irrational_numbers = {irrational for side in from_sympy for irrational in _irrational_numbers(side)}
    if len(irrational_numbers) != 1 or any(irrational.is_Float for irrational in irrational_numbers):
        return list(sides), {}
    from sympy import Symbol

    [value] = irrational_numbers
    taken_names = {str(symbol) for side in from_sympy for symbol in side.free_symbols}.union(taken)
    name = next(name for k in count() if (name := f"r{k or ''}") not in taken_names)
    replacement = {value: Symbol(name)}
    return [side.xreplace(replacement) if _is_sympy(side) else side for side in sides], {name: value}


def number(value: Any) -> Any:
    """Convert an algebraic number of SymPy to a text "root of ..."; return other values unchanged.

    Raises InputError for SymPy's floats and transcendental numbers.
    """
    if not _is_sympy(value) or value.is_Rational:
        return value
    if not value.is_algebraic or value.is_Float:
        raise InputError(f"found {value}, expected a rational or an algebraic number")
    from sympy import Symbol, minimal_polynomial

    position = f" near {value.evalf(20)}" if value.is_real else ""
    return f"root of {minimal_polynomial(value, Symbol('t'))}{position}".replace("**", "^")


def sides_of_equations(equations: Sequence[Any]) -> Mapping[str, Any] | None:
    """Return the right-hand sides of SymPy equations Eq(x(t).diff(t), y(t)) by variable; None if not all are equations.

    Raises InputError for SymPy equations of another form.
    """
    if not equations or not all(getattr(equation, "is_Equality", False) for equation in equations):
        return None
    from sympy import Derivative, Symbol

    for equation in equations:
        if not isinstance(equation.lhs, Derivative) or equation.lhs.derivative_count != 1:
            raise InputError(f"found {equation}, expected a first derivative on the left: Eq(x(t).diff(t), y(t))")
    names = {equation.lhs.expr: Symbol(equation.lhs.expr.func.__name__) for equation in equations}
    return {str(names[equation.lhs.expr]): equation.rhs.subs(names) for equation in equations}


def _irrational_numbers(value: Any) -> Iterator[Any]:
    """Yield the maximal subexpressions of a SymPy expression that are irrational numbers or floats."""
    from sympy import preorder_traversal

    parts = preorder_traversal(value)
    for part in parts:
        if getattr(part, "is_number", False) and not (part.is_Rational or part.is_Add or part.is_Mul):
            parts.skip()
            yield part


def _is_sympy(value: Any) -> bool:
    return type(value).__module__.partition(".")[0] == "sympy"
