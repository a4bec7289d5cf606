"""The exceptions of kahanmaps, and functions that help to write messages.

An exception means that a request cannot be fulfilled. An event along an orbit or during a check, such as a singular
point or an exhausted digit budget, is reported as a status instead.

Each exception is also an exception of Python, such as ValueError, so that `except ValueError` in a script catches it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import date, time
from errno import EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC
from typing import Any

_MISTAKES_SHOWN = 50  # maximal number of mistakes that a message lists
_CONTEXT_WIDTH = 72  # number of characters of a text that are shown around a mistake in it
# Error codes of the operating system for a full or broken disk, or for another exhausted resource.
_MACHINE_ERRORS = frozenset({EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC})
# Parts of messages of the dynamic linker, and of libraries that were loaded with too little memory.
_NO_MEMORY = re.compile(r"failed to map segment|[Cc]annot allocate memory|[Nn]ot enough memory|Unable to allocate")
_MAX_WORD, _MAX_LINE, _MAX_LINES = 300, 1000, 200  # maximal lengths of a word and of a line, maximal number of lines


class KahanmapsError(Exception):
    """Base class of the exceptions of kahanmaps; `bounded` shortens messages that are too long."""

    def __str__(self) -> str:
        return bounded(super().__str__())

    def __reduce__(self) -> tuple[Any, ...]:
        # By default, unpickling calls the class with the message only, but some subclasses require more arguments.
        return _restore_error, (type(self), self.args), self.__dict__


def _restore_error(kind: type[KahanmapsError], args: tuple[Any, ...]) -> KahanmapsError:
    """Restore a pickled exception without calling its constructor; pickle restores its attributes afterwards."""
    return kind.__new__(kind, *args)


class InputError(KahanmapsError, ValueError):
    """An invalid value; the message says what was found, what was expected, and what to do."""


class InexactNumber(InputError, TypeError):
    """A floating-point number was passed to an exact function."""


class ExpressionError(InputError):
    """A text that cannot be parsed as the expected number, polynomial or rational function.

    Attributes: `text` (the text as given), `column` (the position of the mistake, counted from 0, or None).
    """

    def __init__(self, message: str, text: str = "", column: int | None = None) -> None:
        self.message = message
        self.text = text
        self.column = column
        if column is not None:
            # Append the part of `text` around `column`, and a line with a caret below the character at `column`.
            start = max(0, column - _CONTEXT_WIDTH // 2)
            end = min(len(text), start + _CONTEXT_WIDTH)
            before, after = "..." * (start > 0), "..." * (end < len(text))
            # Print each character in one cell, so that the caret is aligned; this also removes escape sequences.
            context = "".join(c if c.isprintable() else " " for c in text[start:end])
            message += f"\n  {before}{context}{after}\n  {' ' * (len(before) + column - start)}^"
        super().__init__(message)


class UnknownName(ExpressionError):
    """An expression contains an unknown name."""


class SystemFileError(InputError):
    """A system file with mistakes, which are reported together, each with its key in the file.

    Attributes: `where` (the name of the file), `mistakes` (pairs of key path and message).
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
    """A prime that divides a denominator, so that there is no reduction modulo it. Attribute: `prime`."""

    def __init__(self, message: str, prime: int) -> None:
        self.prime = prime
        super().__init__(message)


class SingularStep(KahanmapsError, ZeroDivisionError):
    """The Kahan map is undefined at a point x: det(I - eps f'(x)) = 0. Attributes: `point` (x), `eps`."""

    def __init__(self, message: str, point: Any = None, eps: Any = None) -> None:
        self.point = point
        self.eps = eps
        super().__init__(message)


class SingularMatrix(KahanmapsError, ZeroDivisionError):
    """A linear system with a singular matrix."""


class PrecisionLost(KahanmapsError, ArithmeticError):
    """The number in a ball may be zero or not, since the ball is too wide: a higher precision is needed."""


class UnknownCurve(KahanmapsError):
    """No curve that contains an orbit was found; whether such a curve exists remains undecided."""


def show(value: Any, width: int = 60) -> str:
    """Format a value as a file would contain it, shortened to `width` and with control characters escaped.

    >>> show(True), show("two"), show({"a": 1})
    ('true', "'two'", "{'a': 1}")
    """
    if isinstance(value, date | time):  # a datetime is a date too
        return value.isoformat()
    try:
        text = str(value).lower() if isinstance(value, bool) else repr(value)
    except (RecursionError, ValueError):  # e.g. deeply nested tables, or integers with too many digits
        return "a value too large to show"
    return text if len(text) <= width else f"{text[: width - 20]}...{text[-15:]}"


def quoted(text: str, width: int = 40) -> str:
    """Return `text` in quotes, shortened to `width` characters and with control characters escaped.

    >>> quoted("12345", 5), quoted("1" * 50, 5)
    ("'12345'", "'11111...'")
    """
    return repr(str(text) if len(text) <= width else text[:width] + "...")


def printable(text: str) -> str:
    """Return a text with its control characters escaped, except line ends and tabs.

    >>> len(printable(chr(27) + "[31m")) - len("[31m")
    4
    """
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def bounded(message: str) -> str:
    """Return a message in which very long words and lines are shortened, with their lengths added.

    Values given by the user are shortened where a message is written; this function is for the remaining cases.

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
    """Shorten a text to `max_length` characters, most of them from its beginning; its length is added."""
    if len(text) <= max_length:
        return text
    length = f" ({len(text)} characters)"
    tail = (max_length - len(length)) // 4
    return f"{text[: max_length - len(length) - tail - 3]}...{text[-tail:]}{length}"


@contextmanager
def reading(name: object) -> Iterator[None]:
    """Add the name of the source that is read to an unexpected exception that the block raises.

    Without the name the exception would suggest a bug in kahanmaps, although the source may be damaged.
    """
    try:
        yield
    except Exception as error:
        note_source(error, name)
        raise


def note_source(error: BaseException, name: object) -> None:
    """Add a note to an unexpected exception: the name of the source that is read."""
    if isinstance(error, Exception) and not isinstance(error, (KahanmapsError, OSError, MemoryError)):
        error.add_note(str(name))


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an exception means that memory is exhausted, even if a library could not be loaded for this reason."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError) and error.errno == ENOMEM:
        return True
    return isinstance(error, (ImportError, OSError)) and _NO_MEMORY.search(str(error)) is not None


def is_machine_failure(error: OSError) -> bool:
    """Whether an error is due to the state of the machine: the same request may succeed later or elsewhere."""
    return error.errno in _MACHINE_ERRORS


def counted(number: int, word: str) -> str:
    """Return a number with its noun in the singular or plural, such as 1 step, 2 steps."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def suggestion(value: Any, known: Sequence[str]) -> str:
    """Return a hint with known names that are similar to `value`, or an empty text.

    >>> suggestion("alhpa", ["alpha", "beta"])
    '; did you mean alpha?'
    """
    from difflib import get_close_matches

    similar_names = get_close_matches(value, known, n=2, cutoff=0.6) if isinstance(value, str) else []
    return f"; did you mean {' or '.join(similar_names)}?" if similar_names else ""
