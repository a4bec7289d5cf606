"""A limit on wall-clock time, which interrupts a computation; no other result of kahanmaps depends on a clock."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import isfinite
from typing import Any

from kahanmaps.errors import InputError

_REPEAT_SECONDS = 1.0


class TimeLimit(KeyboardInterrupt):
    """The limit of `time_limit` has expired; like Ctrl-C, this exception can interrupt the computation at any point."""


@contextmanager
def time_limit(seconds: float | None) -> Iterator[Callable[[], bool]]:
    """Raise TimeLimit in the block after this number of seconds; None means no limit.

    `seconds` is positive. Results stored before the limit remain. The value after `as` is a function that returns
    whether the limit has expired. Raises InputError for an invalid limit, outside the main thread, and on Windows.

    >>> with time_limit(60) as is_over:
    ...     print(is_over())
    False
    """
    if seconds is None:
        yield lambda: False
        return
    if not (isfinite(seconds) and seconds > 0):
        raise InputError(f"found {seconds} seconds, expected a positive number")
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        raise InputError("found a time limit in another thread or on Windows, expected the main thread: give effort=")
    expirations: list[bool] = []

    def stop(*_: Any) -> None:
        expirations.append(True)
        raise TimeLimit(f"the time limit of {seconds:g} s is over")

    stop.ends_a_time_limit = True  # type: ignore[attr-defined]
    outer_seconds, interval = signal.getitimer(signal.ITIMER_REAL)
    previous = signal.getsignal(signal.SIGALRM)
    is_nested = outer_seconds > 0 and getattr(previous, "ends_a_time_limit", False)
    if is_nested and outer_seconds <= seconds:  # the limit of the enclosing block expires first
        yield lambda: False
        return
    signal.signal(signal.SIGALRM, stop)
    try:
        # The alarm is repeated, since an exception that is raised in a callback of a compiler is lost.
        signal.setitimer(signal.ITIMER_REAL, seconds, _REPEAT_SECONDS)
        yield lambda: bool(expirations)
    finally:
        remaining, _ = signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
        if outer_seconds:  # restart the timer that ran before the block
            elapsed = seconds + _REPEAT_SECONDS * len(expirations) - remaining
            signal.setitimer(signal.ITIMER_REAL, max(outer_seconds - elapsed * is_nested, 1e-6), interval)
