"""Reading of files of XPPAUT (.ode): equations, parameters and definitions.

The reader accepts x' = ..., dx/dt = ..., par, number, init, x(0) = ..., and definitions name = formula and !name =
formula, which are substituted. Options (@), aux, set and boundary conditions, which concern only the integration, are
skipped with a note. A statement that would change the equations (functions, arrays, Markov variables, tables, maps
x(t+1)) raises an error that quotes its line. XPP is not case-sensitive. Source: Ermentrout's documentation of XPPAUT 8,
"Structure of ODE files".
"""

from __future__ import annotations

from typing import Any

from kahanmaps.algebra.parsing import LIMITS
from kahanmaps.documents.equations import derivative_at, is_name, tokens_of
from kahanmaps.errors import InputError, SystemFileError, quoted

ENDING = ".ode"
_PARAMETER_KEYWORDS = ("p", "par", "param", "params", "parameter", "parameters", "n", "num", "number", "numbers")
_INITIAL_KEYWORDS = ("i", "init", "ic", "initial")
_SKIPPED_KEYWORDS = ("a", "aux", "b", "bdry", "bndry", "set", "options", "only", "export", "command")
_EXPECTED = "x' = ..., dx/dt = ..., par a=1, init x=0 and name = formula"


def is_ode(text: str) -> bool:
    """Whether a text that is not TOML contains a line whose left side is a derivative.

    >>> is_ode("x' = -x\\ny' = x"), is_ode('[system]\\nrhs = "x')
    (True, False)
    """
    for line in text[: LIMITS.characters].split("\n"):
        if line.lstrip().startswith("["):
            return False
        left_side = [token for token in tokens_of(line.partition("=")[0]) if not token.isspace()]
        derivative = derivative_at(left_side, 0) if "=" in line else None
        if derivative is not None and derivative.end == len(left_side):
            return True
    return False


def read_ode(text: str, where: str) -> tuple[dict[str, Any], list[str]]:
    """Return the document for the system of an XPP file, and notes on skipped lines; messages call the file `where`.

    Raises SystemFileError that lists every line that cannot be read.

    >>> read_ode("# decay\\npar a=.5 b=2\\ninit x=1\\nx'=-a*X+b\\n@ total=9\\ndone", "decay.ode")[0]
    {'parameters': {'a': '.5', 'b': '2'}, 'system': {'rhs': ["x'=-a*x+b"]}}
    """
    reader = _OdeReader()
    mistakes: list[tuple[str, str]] = []
    lines = text.replace("\\\r\n", "").replace("\\\n", "").split("\n")
    for number, line in enumerate(lines, 1):
        if line.strip().lower() in ("d", "done"):
            break
        try:
            reader.read(line.strip())
        except InputError as error:
            mistakes.append((f"line {number}", str(error)))
    if not reader.equations and not mistakes:
        mistakes.append(("file", f"found no equations, expected a system file in TOML, or one of XPP: {_EXPECTED}"))
    if mistakes:
        raise SystemFileError(where, mistakes)
    try:
        equations = [left_side + reader.expand(right_side) for left_side, right_side in reader.equations]
    except InputError as error:
        raise SystemFileError(where, [("file", str(error))]) from error
    document = {"parameters": reader.parameters, "system": {"rhs": equations}}
    notes = list(reader.notes)
    if reader.has_capitals:
        notes.append("names are in lower case: XPP does not distinguish upper and lower case")
    if reader.initial:
        start = ", ".join(f"{name} = {value}" for name, value in reader.initial.items())
        notes.append(f"the initial values {start} are left out: --start gives them, in the order of the variables")
    if reader.skipped:
        notes.append(f"left out, being about the integration: {', '.join(reader.skipped)}")
    return document, notes


class _OdeReader:
    """A reader for the lines of an XPP file; its attributes hold the content of the lines read so far."""

    def __init__(self) -> None:
        self.equations: list[tuple[str, list[str]]] = []  # pairs: the left side as text, the right side as tokens
        self.parameters: dict[str, str] = {}
        self.initial: dict[str, str] = {}
        self.skipped: dict[str, None] = {}
        self.notes: list[str] = []
        self.definitions: dict[str, str] = {}
        self.has_capitals = False  # whether some name in the file contains a capital letter

    def read(self, line: str) -> None:
        """Read one line. Raises InputError if the line cannot be read."""
        if not line or line[0] in '#"':
            return
        if line[0] == "@":
            self.skipped["@"] = None
            return
        self.has_capitals |= line != line.lower()
        keyword, arguments = [*line.lower().split(None, 1), ""][:2]
        tokens = tokens_of(line.lower().lstrip("!"))
        words = [token for token in tokens if not token.isspace()]
        is_keyword = is_name(keyword) and is_name(arguments[:1])
        if is_keyword and keyword in _SKIPPED_KEYWORDS:
            self.skipped[keyword] = None
        elif is_keyword and keyword in (*_PARAMETER_KEYWORDS, *_INITIAL_KEYWORDS):
            # Assignments a=1,b=-2.5 c=8/3, with commas or blanks between; in init a name alone means 0, as in XPP.
            is_parameter, k = keyword in _PARAMETER_KEYWORDS, 1
            while k < len(words):
                name = words[k]
                if not is_name(name):
                    raise InputError(f"found {quoted(name)}, expected NAME=NUMBER, as in par a=1, b=2.5")
                value, k = "0", k + 1
                if words[k : k + 1] == ["="]:
                    end = k + 1 + (words[k + 1 : k + 2] in (["-"], ["+"]))
                    if words[end + 1 : end + 2] == ["/"]:  # XPP silently ignores the rest of the line
                        end += 2
                        fraction = "".join(words[k + 1 : end + 1])
                        self.notes.append(f"{name} = {fraction} is read literally, unlike in XPP")
                    value, k = "".join(words[k + 1 : end + 1]), end + 1
                elif is_parameter:  # XPP would use 0, which is rarely intended
                    raise InputError(f"found the parameter {quoted(name)} without a value, expected one: par {name}=0")
                (self.parameters if is_parameter else self.initial)[name] = value
                k += words[k : k + 1] == [","]
        elif (equals_at := next((k for k, token in enumerate(words) if token == "="), None)) is None:
            raise InputError(f"found {quoted(line)}, expected {_EXPECTED}")
        elif len(words) > 5 and words[1:5] == ["(", "0", ")", "="]:
            self.initial[words[0]] = "".join(words[5:])
        else:
            derivative = derivative_at(words[:equals_at], 0)
            is_equation = derivative is not None and derivative.end == equals_at
            if not is_equation and (equals_at != 1 or not is_name(words[0])):
                raise InputError(f"found {quoted(line)}, expected {_EXPECTED}: write functions, arrays and maps out")
            formula_start = tokens.index("=") + 1
            if is_equation:
                self.equations.append(("".join(tokens[:formula_start]), tokens[formula_start:]))
            else:  # a definition NAME = formula; the formula may contain earlier definitions
                self.definitions[words[0]] = f"({self.expand(tokens[formula_start:])})"

    def expand(self, tokens: list[str]) -> str:
        """Return a formula in which the definitions are substituted. Raises InputError if it becomes too long."""
        pieces = [self.definitions.get(token, token) for token in tokens]
        if sum(map(len, pieces)) > LIMITS.characters:
            raise InputError(
                f"found a formula of more than {LIMITS.characters} characters after its definitions are inserted"
            )
        return "".join(pieces).strip()
