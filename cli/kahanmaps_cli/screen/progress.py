"""Messages and progress on standard error.

Progress appears after the first second: on a terminal one line that is redrawn, otherwise a line every ten seconds. If
standard error cannot be written to, the work and the exit status do not change.
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

_MIN_TIMED_STEP = 16  # first step with an estimate of the time left: earlier steps are too fast to be timed
_MIN_SECONDS = 0.01  # shorter times cannot be measured reliably
_MAX_LOG_GROWTH = 22.0  # maximal log(total time / elapsed time) for which the time left is printed as a number


def print_stderr(message: str) -> None:
    """Print a message on standard error, with control characters escaped."""
    with suppress(OSError):
        click.echo(printable(message), err=True)


def as_typed(words: Iterable[str]) -> str:
    """Return a command as it would be typed in a shell, on one line of UTF-8."""
    typed = []
    for word in words:
        if word.isprintable():
            typed.append(shlex.quote(word))
            continue
        # Unprintable characters, such as bytes that are not UTF-8, are written in the shell's notation $'...'.
        codes = (chr(b) if 32 <= b < 127 and chr(b) not in "'\\" else f"\\x{b:02x}" for b in os.fsencode(word))
        typed.append(f"$'{''.join(codes)}'")
    return " ".join(typed)


class Progress:
    """Show the latest progress message during a `with` block; call the object with each message, as often as needed.

    On a terminal a thread updates the elapsed time between two messages, since a step may take minutes.
    """

    def __init__(self, quiet: bool = False) -> None:
        self.quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._start = self._latest = time.monotonic()
        self._shown_length = 0
        self._sentence = ""
        self._lock = RLock()  # reentrant: a signal handler may print while the main program has acquired the lock
        self._has_ended = Event()

    def __call__(self, sentence: str) -> None:
        self._sentence = sentence
        now = time.monotonic()
        if self.quiet or now - self._start < 1 or now - self._latest < (0.1 if self._terminal else 10):
            return
        self._latest = now
        self._draw(now)

    def _draw(self, now: float) -> None:
        text = f"{printable(self._sentence)} ({now - self._start:.0f} s)"
        if not self._terminal:
            _write(text + "\n")
            return
        with self._lock:
            try:  # cut the line: a line longer than the terminal is wide could not be overwritten
                width = max(20, os.get_terminal_size(sys.stderr.fileno()).columns)
            except (OSError, ValueError):
                width = 80
            text = text[: width - 1]
            _write("\r" + text.ljust(self._shown_length))
            self._shown_length = len(text)

    def _tick(self) -> None:
        while not self._has_ended.wait(1):
            if self._sentence:
                self._draw(time.monotonic())

    def clear(self) -> None:
        """Clear the progress line on a terminal until the next message."""
        with self._lock:
            self._sentence = ""
            if self._shown_length:
                _write("\r" + " " * self._shown_length + "\r")
                self._shown_length = 0

    def __enter__(self) -> Self:
        if self._terminal and not self.quiet:
            Thread(target=self._tick, daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._has_ended.set()
        self.clear()


class SearchProgress(Progress):
    """Progress of a search with a time limit (--seconds); it also counts the units of work of the search.

    `options` are the options of the command: "quiet" and, if the command has them, "effort" and "seconds"; `since` is
    the reading of time.monotonic() from which the limit is counted (default: the start of the block). When the limit
    expires, TimeLimit interrupts the search, a message names the current step, and the exit status is 3. If a function
    catches TimeLimit and returns a partial result, the message is printed too, and `is_over` is true after the block.
    """

    def __init__(self, options: Mapping[str, Any], since: float | None = None) -> None:
        super().__init__(options["quiet"])
        self.work: dict[str, Any] = {}  # effort and units of work, set at the end of the block
        self._was_over: bool | None = None  # the value of `is_over` at the end of the block
        self._effort, self._seconds, self._since = options.get("effort"), options.get("seconds"), since

    def __call__(self, sentence: str) -> None:
        if self.is_over:  # the function that returned a partial result may call others
            raise lib.TimeLimit
        super().__call__(sentence)

    @property
    def is_over(self) -> bool:
        """Whether the time limit has expired; after the block, whether it had expired when the block ended."""
        if self._was_over is not None:
            return self._was_over
        return self._time_is_over()

    @property
    def ending(self) -> str:
        """Return the message that the search was stopped by the time limit, with the current step."""
        return f"stopped after {self._seconds:g} s (--seconds){self._sentence and ': '}{self._sentence}"

    def __enter__(self) -> Self:
        seconds = self._seconds
        if seconds is not None and self._since is not None:
            seconds = max(1e-6, seconds - (time.monotonic() - self._since))
        self._limit, self._budget = lib.time_limit(seconds), lib.Budget()
        self._time_is_over = self._limit.__enter__()
        return super().__enter__()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._was_over = self.is_over
        self._limit.__exit__(None, None, None)
        self.work = {"effort": self._effort, "units": self._budget.spent}
        message, is_stopped = self.ending if self.is_over else "", isinstance(error, lib.TimeLimit)
        super().__exit__(kind, error, trace)
        if message and not self.quiet and (is_stopped or error is None):
            print_stderr(message)
        if is_stopped:
            raise click.exceptions.Exit(3) from error


class TimeLeft:
    """Estimate the remaining time of steps that become more expensive.

    The time T(n) of the first n steps is modelled by a power of n through T at about n/2 and n (if heights grow
    quadratically, the exponent is between 3 and 4), or by an exponential if at each of the last three calls the time
    had grown by at least 40 percent since the previous call. The estimate is meant as a lower bound.

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
        self._reference, self._latest = (0, 0.0), (0, 0.0)
        self._recent_steps: list[tuple[int, float]] = []

    def __call__(self, step: int) -> str:
        """Return the estimate as text to append to a progress message; empty if no estimate is possible yet."""
        elapsed = self._clock() - self._start
        self._recent_steps = [*self._recent_steps[-3:], (step, elapsed)]
        if step >= 2 * self._latest[0] and step >= _MIN_TIMED_STEP:
            self._reference, self._latest = self._latest, (step, elapsed)
        if step >= self._steps:
            return ""
        # `growth` is log(T(all steps) / T(step)).
        (first, first_time), *later = self._recent_steps
        n, t = self._reference
        is_exponential = all(t >= 1.4 * s for (_, s), (_, t) in pairwise(self._recent_steps))
        if len(later) == 3 and first_time > _MIN_SECONDS and is_exponential:
            growth = math.log(elapsed / first_time) * (self._steps - step) / (step - first)
        elif step < _MIN_TIMED_STEP or t <= 0 or elapsed <= t:
            return ""
        else:
            growth = max(1.0, math.log(elapsed / t) / math.log(step / n)) * math.log(self._steps / step)
        seconds = elapsed * math.expm1(min(growth, _MAX_LOG_GROWTH))
        return f", at least {duration(seconds) if growth < _MAX_LOG_GROWTH else 'centuries'} left"


def duration(seconds: float) -> str:
    """Format a duration: 8 s, 3 min, 2 h 5 min, 3 d 3 h.

    >>> duration(8.2), duration(200), duration(7500), duration(273_000)
    ('8 s', '3 min 20 s', '2 h 5 min', '3 d 3 h')
    """
    total = round(seconds)
    parts = [(total // 86400, "d"), (total // 3600 % 24, "h"), (total // 60 % 60, "min"), (total % 60, "s")]
    first = next((k for k, (number, _) in enumerate(parts) if number), 3)
    return " ".join(f"{number} {unit}" for number, unit in parts[first : first + 2] if number) or "0 s"


def _write(text: str) -> None:
    with suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()
