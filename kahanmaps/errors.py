"""The errors of kahanmaps: wrong use, told in a sentence.

An exception here means that somebody asked for something that cannot be done. What may well happen in the
course of an orbit or a check (a singular point, a height budget) is not an exception but a status.

Each error is also a built-in kind, so that `except ValueError` in a user's script does what it says.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

_MISTAKES_SHOWN = 50


class KahanmapsError(Exception):
    """The root of all errors that kahanmaps raises on purpose."""


class InputError(KahanmapsError, ValueError):
    """A value that cannot be used: the message says what was found, what was expected, what to do."""


class InexactNumber(InputError, TypeError):
    """A machine float met an exact function."""


class ExpressionError(InputError):
    """A piece of text that is not the number, polynomial or rational function it should be.

    Attributes: `text` (as given), `column` (0-based position of the mistake, or None).
    """

    def __init__(self, message: str, text: str = "", column: int | None = None) -> None:
        self.message = message
        self.text = text
        self.column = column
        super().__init__(message if column is None else f"{message}\n{_caret(text, column)}")


class SystemFileError(InputError):
    """A system file with mistakes: all of them at once, each with its key.

    Attributes: `where` (the file), `mistakes` (pairs of key path and sentence).
    """

    def __init__(self, where: str, mistakes: Sequence[tuple[str, str]]) -> None:
        self.where = where
        self.mistakes = tuple(mistakes)
        lines = [f"{where}: {counted(len(self.mistakes), 'mistake')}"]
        lines += [f"  {key}: {_indent(what)}" for key, what in self.mistakes[:_MISTAKES_SHOWN]]
        if len(self.mistakes) > _MISTAKES_SHOWN:
            lines.append(f"  and {len(self.mistakes) - _MISTAKES_SHOWN} more")
        super().__init__("\n".join(lines))


class HypothesisError(InputError):
    """The objects given do not belong to the commuting family (A not skew-Hamiltonian, H not in its space)."""


class BadPrime(InputError):
    """The prime divides a denominator, so the object has no reduction modulo it. Attribute: `prime`."""

    def __init__(self, message: str, prime: int) -> None:
        self.prime = prime
        super().__init__(message)


class SingularStep(KahanmapsError, ZeroDivisionError):
    """det(I - eps f'(x)) = 0: the Kahan map has no value here. Attributes: `point`, `eps`."""

    def __init__(self, message: str, point: Any = None, eps: Any = None) -> None:
        self.point = point
        self.eps = eps
        super().__init__(message)


class SingularMatrix(KahanmapsError, ZeroDivisionError):
    """A linear system with a singular matrix."""


class PrecisionLost(KahanmapsError, ArithmeticError):
    """Balls have grown too wide to decide whether a number is zero: more bits are needed."""


def _caret(text: str, column: int, width: int = 72) -> str:
    """The piece of `text` around `column`, and a caret below the character."""
    start = max(0, column - width // 2)
    end = min(len(text), start + width)
    before = "..." if start > 0 else ""
    after = "..." if end < len(text) else ""
    # One printable cell a character, or the caret would point elsewhere; this also disarms escape sequences.
    piece = "".join(c if c.isprintable() else " " for c in text[start:end])
    return f"  {before}{piece}{after}\n  {' ' * (len(before) + column - start)}^"


def _indent(message: str) -> str:
    return message.replace("\n", "\n    ")


def counted(number: int, word: str) -> str:
    """1 step, 2 steps."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def suggestion(value: Any, known: Sequence[str]) -> str:
    """A hint at what was probably meant, or nothing.

    >>> suggestion("alhpa", ["alpha", "beta"])
    '; did you mean alpha?'
    """
    from difflib import get_close_matches

    close = get_close_matches(value, known, n=2, cutoff=0.6) if isinstance(value, str) else []
    return f"; did you mean {' or '.join(close)}?" if close else ""
