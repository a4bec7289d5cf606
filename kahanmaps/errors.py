"""The exceptions of kahanmaps, and helpers for messages.

An exception means that a request cannot be fulfilled. Events in the course of an orbit or a check, such as a singular
point or an exhausted digit budget, are statuses, not exceptions.

Each exception is also a Python one, so that `except ValueError` in a script works.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import date, time
from errno import EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC
from typing import Any

_MISTAKES_SHOWN = 50  # number of mistakes in one message
_CONTEXT_WIDTH = 72  # characters of a text that are shown around a mistake in it
# Codes of the operating system for a full or broken disk, or for another exhausted resource.
_MACHINE_ERRORS = frozenset({EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC})
# Messages of the dynamic linker, and of libraries loaded with too little memory.
_NO_MEMORY = re.compile(r"failed to map segment|[Cc]annot allocate memory|[Nn]ot enough memory|Unable to allocate")
_MAX_WORD, _MAX_LINE, _MAX_LINES = 300, 1000, 200  # characters in a word, characters in a line, lines in a message


class KahanmapsError(Exception):
    """Base class of the exceptions of kahanmaps. Long messages are shortened by `bounded`."""

    def __str__(self) -> str:
        return bounded(super().__str__())

    def __reduce__(self) -> tuple[Any, ...]:
        # By default an exception is unpickled by a call with its message only; some subclasses need more arguments.
        return _restore_error, (type(self), self.args), self.__dict__


def _restore_error(kind: type[KahanmapsError], args: tuple[Any, ...]) -> KahanmapsError:
    """Restore a pickled exception without calling its constructor; its attributes are not restored."""
    return kind.__new__(kind, *args)


class InputError(KahanmapsError, ValueError):
    """An invalid value; the message names the value, what was expected, and what to do."""


class InexactNumber(InputError, TypeError):
    """A floating-point number was passed to an exact function."""


class ExpressionError(InputError):
    """Text that cannot be parsed as the expected number, polynomial or rational function.

    Attributes: `text` (as given), `column` (0-based position of the mistake, or None).
    """

    def __init__(self, message: str, text: str = "", column: int | None = None) -> None:
        self.message = message
        self.text = text
        self.column = column
        if column is not None:
            # Append the part of `text` around `column`, and below it a caret under the character at `column`.
            start = max(0, column - _CONTEXT_WIDTH // 2)
            end = min(len(text), start + _CONTEXT_WIDTH)
            before, after = "..." * (start > 0), "..." * (end < len(text))
            # Print every character in one cell, so that the caret is aligned; escape sequences are removed as well.
            context = "".join(c if c.isprintable() else " " for c in text[start:end])
            message += f"\n  {before}{context}{after}\n  {' ' * (len(before) + column - start)}^"
        super().__init__(message)


class UnknownName(ExpressionError):
    """An expression contains an unknown name."""


class SystemFileError(InputError):
    """A system file with mistakes, which are all reported together, each with its key in the file.

    Attributes: `where` (the file), `mistakes` (pairs of key path and sentence).
    """

    def __init__(self, where: str, mistakes: Sequence[tuple[str, str]]) -> None:
        self.where = where
        self.mistakes = tuple(mistakes)
        mistakes_shown = [(key, sentence.replace("\n", "\n    ")) for key, sentence in self.mistakes[:_MISTAKES_SHOWN]]
        lines = [f"{where}: {counted(len(self.mistakes), 'mistake')}"]
        lines += [f"  {key}: {indented}" for key, indented in mistakes_shown]
        if len(self.mistakes) > _MISTAKES_SHOWN:
            lines.append(f"  and {len(self.mistakes) - _MISTAKES_SHOWN} more")
        super().__init__("\n".join(lines))


class HypothesisError(InputError):
    """(A, H) is no member of the commuting family: A is not skew-Hamiltonian, or H is not in the space of A."""


class BadPrime(InputError):
    """A prime that divides a denominator: there is no reduction modulo this prime. Attribute: `prime`."""

    def __init__(self, message: str, prime: int) -> None:
        self.prime = prime
        super().__init__(message)


class SingularStep(KahanmapsError, ZeroDivisionError):
    """The Kahan map is undefined at a point: det(I - eps f'(x)) = 0. Attributes: `point`, `eps`."""

    def __init__(self, message: str, point: Any = None, eps: Any = None) -> None:
        self.point = point
        self.eps = eps
        super().__init__(message)


class SingularMatrix(KahanmapsError, ZeroDivisionError):
    """A linear system with a singular matrix."""


class PrecisionLost(KahanmapsError, ArithmeticError):
    """A ball is too wide to decide whether its number is zero: a higher precision is needed."""


class UnknownCurve(KahanmapsError):
    """No curve was found that contains an orbit; whether there is one remains undecided."""


def show(value: Any, width: int = 60) -> str:
    """Format a value as in a file, shortened and with control characters escaped.

    >>> show(True), show("two"), show({"a": 1})
    ('true', "'two'", "{'a': 1}")
    """
    if isinstance(value, date | time):  # datetime is a subclass of date
        return value.isoformat()
    try:
        text = str(value).lower() if isinstance(value, bool) else repr(value)
    except (RecursionError, ValueError):  # tables nested by dotted keys; hexadecimal integers of any length
        return "a value too large to show"
    return text if len(text) <= width else f"{text[: width - 20]}...{text[-15:]}"


def quoted(text: str, width: int = 40) -> str:
    """Return `text` in quotes, safe to print and shortened to `width`.

    >>> quoted("12345", 5), quoted("1" * 50, 5)
    ("'12345'", "'11111...'")
    """
    return repr(str(text) if len(text) <= width else text[:width] + "...")


def printable(text: str) -> str:
    """Escape the control characters of a text; line ends and tabs remain.

    >>> len(printable(chr(27) + "[31m")) - len("[31m")
    4
    """
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def bounded(message: str) -> str:
    """Shorten very long words and lines of a message, and add their lengths.

    Values of the user are already shortened where messages are written; this function catches the remaining cases.

    >>> len(bounded("there is no file " + "x" * 200_000))
    317
    """
    lines = message.split("\n")
    shown_lines = [
        _cut(re.sub(rf"\S{{{_MAX_WORD + 1},}}", lambda word: _cut(word[0], _MAX_WORD), line), _MAX_LINE)
        for line in lines[:_MAX_LINES]
    ]
    if len(lines) > _MAX_LINES:
        shown_lines.append(f"... and {len(lines) - _MAX_LINES} more lines")
    return "\n".join(shown_lines)


def _cut(text: str, max_length: int) -> str:
    """Shorten a text to `max_length` characters, mostly from its beginning, and add its length."""
    if len(text) <= max_length:
        return text
    length = f" ({len(text)} characters)"
    tail = (max_length - len(length)) // 4
    return f"{text[: max_length - len(length) - tail - 3]}...{text[-tail:]}{length}"


@contextmanager
def reading(name: object) -> Iterator[None]:
    """Add the name of the source that is being read to an unexpected exception raised in the block.

    Without this name the exception would suggest a bug, although the source may be damaged.
    """
    try:
        yield
    except Exception as error:
        note_source(error, name)
        raise


def note_source(error: BaseException, name: object) -> None:
    """Add the source of the data to an unexpected exception."""
    if isinstance(error, Exception) and not isinstance(error, (KahanmapsError, OSError, MemoryError)):
        error.add_note(str(name))


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an exception means that memory is exhausted; it may come from a library that could not be loaded."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError) and error.errno == ENOMEM:
        return True
    return isinstance(error, (ImportError, OSError)) and _NO_MEMORY.search(str(error)) is not None


def is_machine_failure(error: OSError) -> bool:
    """Whether the error is due to the state of the machine, so that the same request may succeed later or elsewhere."""
    return error.errno in _MACHINE_ERRORS


def counted(number: int, word: str) -> str:
    """Return the number with the noun in singular or plural: 1 step, 2 steps."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def suggestion(value: Any, known: Sequence[str]) -> str:
    """Return a hint that suggests similar known names, or an empty text.

    >>> suggestion("alhpa", ["alpha", "beta"])
    '; did you mean alpha?'
    """
    from difflib import get_close_matches

    similar_names = get_close_matches(value, known, n=2, cutoff=0.6) if isinstance(value, str) else []
    return f"; did you mean {' or '.join(similar_names)}?" if similar_names else ""
