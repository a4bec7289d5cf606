"""The errors of kahanmaps: usage errors, told in a sentence.

An exception here means that somebody asked for something that cannot be done. What may well happen in the
course of an orbit or a check (a singular point, a height budget) is not an exception but a status.

Each error is also a built-in kind, so that `except ValueError` in a user's script does what it says.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import date, time
from errno import EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC
from typing import Any

_MISTAKES_SHOWN = 50
# The disk is full or broken, or the machine has no more of something.
_OF_THE_MACHINE = frozenset({EDQUOT, EFBIG, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC})
# What the dynamic linker and the libraries say that are loaded where memory is short.
_NO_ROOM = re.compile(r"failed to map segment|[Cc]annot allocate memory|[Nn]ot enough memory|Unable to allocate")
_LONGEST_WORD, _LONGEST_LINE, _MOST_LINES = 300, 1000, 200  # of a message


class KahanmapsError(Exception):
    """The root of all errors that kahanmaps raises on purpose. Its message is `bounded`."""

    def __str__(self) -> str:
        return bounded(super().__str__())

    def __reduce__(self) -> tuple[Any, ...]:
        # An exception is restored by a call with its message, which is less than some of them take.
        return _restore_error, (type(self), self.args), self.__dict__


def _restore_error(kind: type[KahanmapsError], args: tuple[Any, ...]) -> KahanmapsError:
    """The error that was pickled, without its attributes."""
    return kind.__new__(kind, *args)


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


class UnknownName(ExpressionError):
    """An expression has a letter or word that stands for nothing."""


class SystemFileError(InputError):
    """A system file with mistakes: all of them at once, each with its key.

    Attributes: `where` (the file), `mistakes` (pairs of key path and sentence).
    """

    def __init__(self, where: str, mistakes: Sequence[tuple[str, str]]) -> None:
        self.where = where
        self.mistakes = tuple(mistakes)
        shown = [(key, what.replace("\n", "\n    ")) for key, what in self.mistakes[:_MISTAKES_SHOWN]]
        lines = [f"{where}: {counted(len(self.mistakes), 'mistake')}"]
        lines += [f"  {key}: {indented}" for key, indented in shown]
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


def show(value: Any, width: int = 60) -> str:
    """A value as it might stand in a file, shortened, with nothing in it that a terminal would obey.

    >>> show(True), show("two"), show({"a": 1})
    ('true', "'two'", "{'a': 1}")
    """
    if isinstance(value, date | time):  # of which datetime is one
        return value.isoformat()
    try:
        found = str(value).lower() if isinstance(value, bool) else repr(value)
    except (RecursionError, ValueError):  # tables nested by dotted keys; hexadecimal integers of any length
        return "a value too large to show"
    return found if len(found) <= width else f"{found[: width - 20]}...{found[-15:]}"


def quoted(text: str, width: int = 40) -> str:
    """`text` in quotes, safe to print, cut where it is long.

    >>> quoted("12345", 5), quoted("1" * 50, 5)
    ("'12345'", "'11111...'")
    """
    return repr(str(text) if len(text) <= width else text[:width] + "...")


def printable(text: str) -> str:
    """The text with nothing in it that a terminal would obey, but for ends of lines and tabs.

    >>> len(printable(chr(27) + "[31m")) - len("[31m")
    4
    """
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def bounded(message: str) -> str:
    """A message without the middle of words and lines that nobody would read to their end; their length is told.

    What somebody wrote is shortened where a message is made; this holds for what was forgotten.

    >>> len(bounded("there is no file " + "x" * 200_000))
    317
    """
    lines = message.split("\n")
    shown = [
        _cut(re.sub(rf"\S{{{_LONGEST_WORD + 1},}}", lambda word: _cut(word[0], _LONGEST_WORD), line), _LONGEST_LINE)
        for line in lines[:_MOST_LINES]
    ]
    if len(lines) > _MOST_LINES:
        shown.append(f"... and {len(lines) - _MOST_LINES} more lines")
    return "\n".join(shown)


def _cut(text: str, most: int) -> str:
    """At most `most` characters of a text, mostly from its beginning, and how many it has."""
    if len(text) <= most:
        return text
    length = f" ({len(text)} characters)"
    tail = (most - len(length)) // 4
    return f"{text[: most - len(length) - tail - 3]}...{text[-tail:]}{length}"


@contextmanager
def reading(name: object) -> Iterator[None]:
    """Inside, data from outside are read: an error that nobody expected is told together with where they come from.

    The file may be damaged in a way that no check has foreseen, so the error alone would blame the wrong one.
    """
    try:
        yield
    except Exception as error:
        note_source(error, name)
        raise


def note_source(error: BaseException, name: object) -> None:
    """Note in an error that nobody expected where the data came from."""
    if isinstance(error, Exception) and not isinstance(error, (KahanmapsError, OSError, MemoryError)):
        error.add_note(str(name))


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error means that there was not enough memory: also where a library could not be loaded for that."""
    if isinstance(error, MemoryError):
        return True
    if isinstance(error, OSError) and error.errno == ENOMEM:
        return True
    return isinstance(error, (ImportError, OSError)) and _NO_ROOM.search(str(error)) is not None


def is_of_the_machine(error: OSError) -> bool:
    """Whether nobody made a mistake: the same may well be possible later, or elsewhere."""
    return error.errno in _OF_THE_MACHINE


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
