"""Conversion of differential equations in common notations to right-hand sides, as a system file contains them.

A text is a list of equations separated by semicolons, commas or line breaks, perhaps in brackets. The left side of an
equation is a derivative in one of the following notations. The right side is a formula, in which x(t) means x.

    x'    dx/dt    x_dot    xdot    dxdt    x'[t]    dx(t)/dt    d^2x/dt^2    diff(x(t), t)    D[x[t], t]    x[0]'

The text is split into tokens and never executed; `kahanmaps.algebra.parsing` reads the formulas.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

from kahanmaps.errors import InputError, quoted

MAX_CHARACTERS = 2_000_000  # maximal number of characters of all equations together
_OPEN, _CLOSE = ("(", "[", "{"), (")", "]", "}")
_EQUALS = ("=", "==", ":=")
# Unicode can represent a dot or two dots above a letter as a separate character. A double quote means two primes.
_PRIMES = {"'": 1, "′": 1, "’": 1, "‘": 1, "´": 1, "`": 1, "\u0307": 1, "″": 2, '"': 2, "\u0308": 2, "‴": 3}
_TOKEN = re.compile(
    r"[A-Za-z_][A-Za-z_0-9]*|(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|==|:=|\*\*|[ \t\r\f\v\xa0]+|.", re.DOTALL
)
_MAX_TOKENS = 16  # maximal number of tokens of a derivative that is written without primes
_NAME, _ARGUMENT = "([A-Za-z_][A-Za-z_0-9]*)", r"(?:\(t\)|\[t\])?"
_CALL = rf"(?:diff|Diff|D|der|Derivative)[(\[{{]{_NAME}{_ARGUMENT}"  # in Maple, Mathematica, Modelica or SymPy
# Pairs of a pattern of a derivative (with a blank only between two words) and its order, compiled when needed.
_DERIVATIVE_PATTERNS = (
    (rf"{_CALL}(?:,t|,\{{t,1\}})?[)\]]", 1),
    (rf"{_CALL}(?:,t,t|,t\$2|,\{{t,2\}}|,\(t,2\))[)\]]", 2),
    (rf"d ?{_NAME}{_ARGUMENT}/d ?t", 1),
    (rf"d(?:\^2 ?|2){_NAME}{_ARGUMENT}/d ?t\^?2", 2),
    (rf"{_NAME}_ddot", 2),
    (rf"{_NAME}_dot", 1),
    (rf"{_NAME}ddot", 2),
    (rf"{_NAME}dot", 1),
    (rf"d{_NAME}dt", 1),
)
_LATEX_COMMANDS = ("dot", "ddot", "frac", "dfrac", "mathrm", "rm", "left", "begin", "d", "dt")
_EXAMPLES = "x' = x*y, dx/dt = x*y, x_dot = x*y or x'' = x^2"


class _Derivative(NamedTuple):
    name: str
    order: int
    end: int  # index of the first token after the derivative


def without_left_sides(document: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """Return (document, notes); right-hand sides and variables replace the equations in [system] of the document.

    Variables that are not given have the order of their equations, and velocities of second-order equations come last.
    A document without equations is returned unchanged. The notes are sentences on new names. Raises InputError for a
    text that is not an equation, and for an equation of a variable that is not among the given ones.

    >>> without_left_sides({"system": {"rhs": "x' = x*y, dy/dt = -x"}})
    ({'variables': ['x', 'y'], 'system': {'rhs': ['x*y', '-x']}}, [])
    """
    section = document.get("system")
    right_sides = section.get("rhs") if isinstance(section, dict) else None
    texts = [right_sides] if isinstance(right_sides, str) else right_sides
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        return dict(document), []
    separators = "=;,[{" if len(texts) == 1 else "=;"  # [x*y, -x] is a list of formulas in one text
    if isinstance(right_sides, list) and not any(separator in text for text in texts for separator in separators):
        return dict(document), []
    pieces = pieces_of("\n".join(texts))
    notes: list[str] = []
    if any(token in piece for piece in pieces for token in _EQUALS):
        names, parameters = document.get("variables"), document.get("parameters")
        given_names = [str(name) for name in names] if isinstance(names, list) else []
        formulas, velocities, notes = read_equations(
            pieces, given_names, parameters if isinstance(parameters, dict) else ()
        )
        new_velocities = [velocity for velocity in velocities if velocity not in given_names]
        variables = list(formulas) if names is None else [*given_names, *new_velocities]
        if set(variables) != set(formulas):
            raise InputError(f"found equations for {', '.join(formulas)}, expected one for each of the variables")
        document = {"variables": variables, **document}
        document["variables"] = variables
        rhs = [formulas[name] for name in variables]
    else:
        rhs = ["".join(piece).strip() for piece in pieces]
    return {**document, "system": {**document["system"], "rhs": rhs}}, notes


def tokens_of(text: str) -> list[str]:
    """Split a text into tokens; blanks are tokens too. Raises InputError if the text is too long."""
    if len(text) > MAX_CHARACTERS:
        raise InputError(f"found equations of {len(text)} characters, expected at most {MAX_CHARACTERS}")
    decomposed = text if text.isascii() else unicodedata.normalize("NFD", text)
    return _TOKEN.findall(decomposed)


def pieces_of(text: str) -> list[list[str]]:
    """Return the list of tokens of each equation or formula in a text. Raises InputError for unbalanced brackets."""
    tokens = tokens_of(text)
    positions = [k for k, token in enumerate(tokens) if not token.isspace()]
    # Skip the name and the terminator of a list, as in eqs := [x' = y, y' = -x];
    while positions and tokens[positions[-1]] in (";", ":", ","):
        positions.pop()
    first_three = [tokens[k] for k in positions[:3]]
    if len(first_three) == 3 and is_name(first_three[0]) and first_three[1] in ("=", ":=") and first_three[2] in "[{":
        positions = positions[2:]
    tokens = _without_outer_brackets(tokens[positions[0] : positions[-1] + 1]) if positions else []
    pieces: list[list[str]] = [[]]
    depth = 0
    for token in tokens:
        depth += (token in _OPEN) - (token in _CLOSE)
        if depth < 0:
            raise InputError(
                f"found {quoted(_text(pieces[-1]) + token)}, where a bracket is closed that was not opened"
            )
        if depth == 0 and token in (";", ",", "\n"):
            pieces.append([])
        else:
            pieces[-1].append(token)
    if depth:
        raise InputError(f"found {quoted(_text(pieces[-1]))}, where a bracket is opened that is not closed")
    return [piece for piece in pieces if _text(piece)]


def _without_outer_brackets(tokens: list[str]) -> list[str]:
    """Return the tokens without brackets around all of them, as in {x' = y, y' = -x}."""
    positions = [k for k, token in enumerate(tokens) if not token.isspace()]
    if len(positions) < 2 or tokens[positions[0]] not in _OPEN or tokens[positions[-1]] not in _CLOSE:
        return tokens
    depth = 0
    for k in positions:
        depth += (tokens[k] in _OPEN) - (tokens[k] in _CLOSE)
        if depth == 0:
            return tokens[positions[0] + 1 : positions[-1]] if k == positions[-1] else tokens
    return tokens


def read_equations(
    pieces: Sequence[list[str]], variables: Sequence[str] = (), parameters: Collection[str] = ()
) -> tuple[dict[str, str], list[str], list[str]]:
    """Read equations of first and second order, one for each variable.

    Args:
        pieces: the tokens of each equation.
        variables: the names of the variables, then of the velocities of second-order equations; by default new names.
        parameters: the names of the parameters, which velocities must not have.

    Returns:
        A triple: the right-hand sides by variable, in the order of the equations and with the velocities last; the
        names of the velocities; sentences that explain new names.

    Raises:
        InputError: for a text that is not an equation (with what to write), and for two equations of one variable.
    """
    pieces, notes = _replace_indexed_names(pieces, parameters)
    orders, formulas = dict[str, int](), dict[str, list[str]]()
    for piece in pieces:
        equals_at = [k for k, token in enumerate(piece) if token in _EQUALS]
        left_side = [token for token in piece[: equals_at[0]] if not token.isspace()] if equals_at else []
        derivative = derivative_at(left_side, 0)
        if len(equals_at) != 1 or derivative is None or derivative.end < len(left_side):
            raise InputError(
                f"found {quoted(_text(piece))}, expected an equation such as {_EXAMPLES}{_hint(left_side, piece)}"
            )
        if derivative.order > 2:
            text = quoted(_text(piece))
            raise InputError(
                f"found {text}, of order {derivative.order}, expected order 1 or 2: name the derivatives, "
                f"{derivative.name}' = u; u' = v; v' = ..."
            )
        if derivative.name in orders:
            raise InputError(f"found two equations for {derivative.name}, expected one")
        orders[derivative.name], formulas[derivative.name] = derivative.order, piece[equals_at[0] + 1 :]
    # The velocity of a variable x with a second-order equation has the given name, or by default vx.
    second_order = [name for name, order in orders.items() if order == 2]
    extra_names = [name for name in variables if name not in orders]
    if len(extra_names) == len(second_order):
        velocities = dict(zip(second_order, extra_names, strict=True))
    else:
        velocities = {}
        used_names = {*parameters, *(token for piece in pieces for token in piece)}
        for name in second_order:
            velocity = f"v{name}"
            while velocity in used_names or velocity in velocities.values():
                velocity += "_"
            velocities[name] = velocity
    notes += [f"{name}'' is read with a velocity, the variable {v}: {name}' = {v}" for name, v in velocities.items()]
    right_sides = dict[str, str]()
    for name, formula in formulas.items():
        right_sides[name] = velocities.get(name, "") or _formula_text(name, formula, orders, velocities)
    for name, velocity in velocities.items():
        right_sides[velocity] = _formula_text(name, formulas[name], orders, velocities)
    return right_sides, list(velocities.values()), notes


def derivative_at(tokens: Sequence[str], start: int) -> _Derivative | None:
    """Return the derivative (x', dx/dt, x_dot, diff(x(t), t)) that begins at token `start`, or None."""
    name = tokens[start] if start < len(tokens) else ""
    if not is_name(name):
        return None
    end = _skip_argument(tokens, start + 1)
    order = 0
    while end < len(tokens) and tokens[end] in _PRIMES:
        order, end = order + _PRIMES[tokens[end]], end + 1
    if order:
        return _Derivative(name, order, _skip_argument(tokens, end))
    text, last_token, ends = "", "", dict[int, int]()  # length of the text up to some token -> index after this token
    for position, token in enumerate(tokens[start : start + _MAX_TOKENS], start + 1):
        needs_blank = (last_token[-1:].isalnum() or last_token[-1:] == "_") and (token[0].isalnum() or token[0] == "_")
        text, last_token = f"{text}{' ' * needs_blank}{token}", token
        ends[len(text)] = position
    for pattern, order in _DERIVATIVE_PATTERNS:
        match = re.match(pattern + _ARGUMENT, text)
        if match is not None and match.end() in ends:
            return _Derivative(match[1], order, ends[match.end()])
    return None


def _skip_argument(tokens: Sequence[str], position: int) -> int:
    """Return the position after an argument (t) or [t] at `position`; if there is none, return `position`."""
    return position + 3 if "".join(tokens[position : position + 3]) in ("(t)", "[t]") else position


def _formula_text(name: str, tokens: list[str], orders: Mapping[str, int], velocities: Mapping[str, str]) -> str:
    """Return the right-hand side of the equation for `name` as text, in which x replaces x(t).

    `orders` maps each variable to the order of its equation. The derivative x' of a variable with a second-order
    equation is replaced by the name of the velocity in `velocities`.
    """
    words = [token for token in tokens if not token.isspace()]
    blanks, blank = list[str](), ""  # blank before each word: "x y" must not become "xy"
    for token in tokens:
        if token.isspace():
            blank = " "
        else:
            blanks.append(blank)
            blank = ""
    formula: list[str] = []
    k = 0
    while k < len(words):
        derivative = derivative_at(words, k)
        # x_dot is the derivative of x, unless x_dot is a variable.
        if derivative and derivative.name in orders and (words[k] not in orders or words[k] == derivative.name):
            if derivative.order != 1 or derivative.name not in velocities:
                raise InputError(
                    f"found a derivative of {derivative.name} on the right side of the equation for {name}, expected a "
                    "formula in the variables: replace it by the right-hand side of its equation"
                )
            formula.append(blanks[k] + velocities[derivative.name])
            k = derivative.end
        else:
            formula.append(blanks[k] + words[k])
            k = _skip_argument(words, k + 1) if words[k] in orders else k + 1
    return "".join(formula).strip()


def _replace_indexed_names(
    pieces: Sequence[list[str]], parameters: Collection[str]
) -> tuple[list[list[str]], list[str]]:
    """Replace x[0] by x0 (by x_0 if x0 is in use); return the new pieces, and a note on each new name."""
    used_names = {*parameters, *(token for piece in pieces for token in piece)}
    names = dict[tuple[str, str], str]()
    new_pieces: list[list[str]] = []
    for piece in pieces:
        new_pieces.append([])
        k = 0
        while k < len(piece):
            window = piece[k : k + 4]
            is_indexed = len(window) == 4 and is_name(window[0]) and window[1] == "[" and window[3] == "]"
            is_indexed = is_indexed and window[2].isdigit() and len(window[2]) < 5
            if is_indexed:
                name = f"{window[0]}{window[2]}"
                while name in used_names:
                    name = f"{window[0]}_{window[2]}" if "_" not in name else f"{name}_"
                new_pieces[-1].append(names.setdefault((window[0], window[2]), name))
            else:
                new_pieces[-1].append(piece[k])
            k += 4 if is_indexed else 1
    return new_pieces, [f"{name}[{index}] is called {new_name}" for (name, index), new_name in names.items()]


def _hint(left_side: Sequence[str], piece: Sequence[str]) -> str:
    """Return a hint on what to type instead of a statement that is not supported; "" if there is no hint."""
    if "\\" in left_side:  # LaTeX: \\dot{x}, \\dot x, \\frac{dx}{dt}
        name = next((token for token in left_side if is_name(token) and token not in _LATEX_COMMANDS), "x")
        name, primes = name.removeprefix("d" if "dt" in left_side else ""), "''" if "ddot" in left_side else "'"
        return f"; LaTeX is not read: write {name}{primes} = ..., and products with *"
    if left_side and left_side[0].isalpha() and not left_side[0].isascii():
        return f"; a name is made of ASCII letters, digits and _: rename {left_side[0]}"
    if len(left_side) == 1 and left_side[0][0] == "d" and is_name(left_side[0][1:]):
        return f"; did you mean {left_side[0]}/dt = ...?"
    if len(left_side) == 1 and is_name(left_side[0]):
        value = _text(piece).partition("=")[2].lstrip("= ")[:40]
        return f"; a parameter is given by -p {left_side[0]}={value}"
    if len(left_side) == 4 and left_side[1] in "([" and left_side[2] in ("0", "0.0"):
        return "; an initial value is given by --start"
    if "~" in left_side or "".join(left_side[1:]) in ("(t+1)", "[t+1]", "(n+1)", "[n+1]"):
        return "; a map is given by --vars X,Y,... and one --image EXPR for each variable"
    return ""


def is_name(token: str) -> bool:
    """Return whether a token is a name."""
    return (token[:1].isalpha() and token.isascii()) or token[:1] == "_"


def _text(tokens: Sequence[str]) -> str:
    return "".join(tokens).strip()
