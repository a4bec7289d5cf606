"""Talk on standard error: messages, and the progress of long work.

Progress is nothing for the first second, then one line redrawn on a terminal, a line now and then elsewhere. Nobody
has to listen: a standard error that cannot be written to changes neither the work nor its exit status.
"""

from __future__ import annotations

import math
import os
import shlex
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from itertools import pairwise
from threading import Event, RLock, Thread
from types import TracebackType
from typing import Any, Self

import click

from kahanmaps import internals as lib
from kahanmaps.errors import printable

_FIRST_TOLD = 16  # step; what the first ones take says nothing
_SHORTEST = 0.01  # seconds that are measured well
_CENTURIES = 22.0  # a growth of the time, as a logarithm, that nobody waits for


def say(message: str) -> None:
    """Print a message, with nothing in it that a terminal would obey."""
    with suppress(OSError):
        click.echo(printable(message), err=True)


def as_typed(words: Iterable[str]) -> str:
    """The words of a command as one would type them, on one line of UTF-8."""
    typed = []
    for word in words:
        if word.isprintable():
            typed.append(shlex.quote(word))
            continue
        # What cannot be printed is spelt out as a shell reads it, such as bytes that are not UTF-8.
        codes = (chr(b) if 32 <= b < 127 and chr(b) not in "'\\" else f"\\x{b:02x}" for b in os.fsencode(word))
        typed.append(f"$'{''.join(codes)}'")
    return " ".join(typed)


class Progress:
    """Call it with a sentence as often as you like inside a `with` block, whose end clears the line.

    On a terminal the clock behind the last sentence moves by itself, for a step may take minutes.
    """

    def __init__(self, quiet: bool = False) -> None:
        self.quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._start = self._last = time.monotonic()
        self._shown = 0
        self._sentence = ""
        self._drawing = RLock()  # a signal may come while it is held
        self._ended = Event()

    def __call__(self, sentence: str) -> None:
        self._sentence = sentence
        now = time.monotonic()
        if self.quiet or now - self._start < 1 or now - self._last < (0.1 if self._terminal else 10):
            return
        self._last = now
        self._draw(now)

    def _draw(self, now: float) -> None:
        text = f"{printable(self._sentence)} ({now - self._start:.0f} s)"
        if not self._terminal:
            _write(text + "\n")
            return
        with self._drawing:
            try:  # a line longer than the terminal below standard error could not be drawn again
                width = max(20, os.get_terminal_size(sys.stderr.fileno()).columns)
            except (OSError, ValueError):
                width = 80
            text = text[: width - 1]
            _write("\r" + text.ljust(self._shown))
            self._shown = len(text)

    def _tick(self) -> None:
        while not self._ended.wait(1):
            if self._sentence:
                self._draw(time.monotonic())

    def clear(self) -> None:
        """Take the line away from a terminal, until the next sentence."""
        with self._drawing:
            self._sentence = ""
            if self._shown:
                _write("\r" + " " * self._shown + "\r")
                self._shown = 0

    def __enter__(self) -> Self:
        if self._terminal and not self.quiet:
            Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self.clear()


class SearchProgress(Progress):
    """The progress of a search that --seconds ends, and the units of work that it takes.

    The options are "quiet" and, as far as a command has them, "effort" and "seconds"; `since` is when the seconds
    began, if that was before. When they are over the search is given up, a line says what was being done, and the exit
    status is 3. Where a function makes a partial result of its TimeLimit the line is said as well, and `is_over` holds
    after the block.
    """

    def __init__(self, options: Mapping[str, Any], since: float | None = None) -> None:
        super().__init__(options["quiet"])
        self.work: dict[str, Any] = {}  # after the block: what a record says of it
        self._was_over: bool | None = None  # after the block
        self._effort, self._seconds, self._since = options.get("effort"), options.get("seconds"), since

    def __call__(self, sentence: str) -> None:
        if self.is_over:  # who made a partial result is not the last who is called
            raise lib.TimeLimit
        super().__call__(sentence)

    @property
    def is_over(self) -> bool:
        """Whether the seconds are over, or were at the end of the block."""
        if self._was_over is not None:
            return self._was_over
        return self._time_is_over()

    @property
    def ending(self) -> str:
        """Why it was stopped, and what was cut."""
        return f"stopped after {self._seconds:g} s (--seconds){self._sentence and ': '}{self._sentence}"

    def __enter__(self) -> Self:
        left = self._seconds
        if left is not None and self._since is not None:
            left = max(1e-6, left - (time.monotonic() - self._since))
        self._limit, self._budget = lib.time_limit(left), lib.Budget()
        self._time_is_over = self._limit.__enter__()
        return super().__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._was_over = self.is_over
        self._limit.__exit__(None, None, None)
        self.work = {"effort": self._effort, "units": self._budget.spent}
        words, is_stopped = self.ending if self.is_over else "", isinstance(error, lib.TimeLimit)
        super().__exit__(kind, error, trace)
        if words and not self.quiet and (is_stopped or error is None):
            say(words)
        if is_stopped:
            raise click.exceptions.Exit(3) from error


class TimeLeft:
    """How long steps still take that become dearer.

    What n of them took grew like a power of n, from n/2 to n: heights that grow like n^2 make it a power between 3 and
    4. Where each of the last three steps made the time longer by two fifths it grows exponentially. Else the time is a
    lower bound.

    >>> clock = iter([0.0, 1.0, 8.0])
    >>> left = TimeLeft(64, lambda: next(clock))
    >>> left(16), left(32)
    ('', ', at least 56 s left')
    >>> clock = iter([0.0, 0.25, 0.5, 1.0, 2.0])
    >>> left = TimeLeft(12, lambda: next(clock))
    >>> [left(step) for step in (5, 6, 7, 8)][-1]
    ', at least 30 s left'
    """

    def __init__(self, steps: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._steps, self._clock = steps, clock
        self._start = clock()
        self._before, self._last = (0, 0.0), (0, 0.0)
        self._recent: list[tuple[int, float]] = []

    def __call__(self, step: int) -> str:
        """Words for behind the sentence of progress; empty where it is too early to tell."""
        spent = self._clock() - self._start
        self._recent = [*self._recent[-3:], (step, spent)]
        if step >= 2 * self._last[0] and step >= _FIRST_TOLD:
            self._before, self._last = self._last, (step, spent)
        if step >= self._steps:
            return ""
        # The growth is the logarithm of how much longer all steps take than those up to this one.
        (first, began), *later = self._recent
        n, t = self._before
        if len(later) == 3 and began > _SHORTEST and all(t >= 1.4 * s for (_, s), (_, t) in pairwise(self._recent)):
            growth = math.log(spent / began) * (self._steps - step) / (step - first)
        elif step < _FIRST_TOLD or t <= 0 or spent <= t:
            return ""  # it is too early
        else:
            growth = max(1.0, math.log(spent / t) / math.log(step / n)) * math.log(self._steps / step)
        seconds = spent * math.expm1(min(growth, _CENTURIES))
        return f", at least {duration(seconds) if growth < _CENTURIES else 'centuries'} left"


def duration(seconds: float) -> str:
    """A time for people: 8 s, 3 min, 2 h 5 min, 3 d 3 h.

    >>> duration(8.2), duration(200), duration(7500), duration(273_000)
    ('8 s', '3 min 20 s', '2 h 5 min', '3 d 3 h')
    """
    whole = round(seconds)
    parts = [(whole // 86400, "d"), (whole // 3600 % 24, "h"), (whole // 60 % 60, "min"), (whole % 60, "s")]
    first = next((k for k, (number, _) in enumerate(parts) if number), 3)
    return " ".join(f"{number} {unit}" for number, unit in parts[first : first + 2] if number) or "0 s"


def _write(text: str) -> None:
    with suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()
