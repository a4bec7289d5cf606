"""A hard stop by the clock: what is being done then is given up, and nothing else is ever decided by a clock."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import isfinite
from typing import Any

from kahanmaps.errors import InputError

_AGAIN = 1.0  # seconds


class TimeLimit(KeyboardInterrupt):
    """The time of a `time_limit` is over. Like Ctrl-C, it ends what is being done wherever that is."""


@contextmanager
def time_limit(seconds: float | None) -> Iterator[Callable[[], bool]]:
    """Raise TimeLimit in what is done within the block, once so many seconds are over; never for None.

    What had been completed before stays as it is; what was in flight is lost. The block is given a function that says
    whether the time is over. Only in the main thread of a process, and not on Windows. Raises InputError elsewhere, and
    for a time that is not positive.

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
    over: list[bool] = []

    def stop(*_: Any) -> None:
        over.append(True)
        raise TimeLimit(f"the time limit of {seconds:g} s is over")

    stop.ends_a_time_limit = True  # type: ignore[attr-defined]
    outer, interval = signal.getitimer(signal.ITIMER_REAL)
    before = signal.getsignal(signal.SIGALRM)
    is_nested = outer > 0 and getattr(before, "ends_a_time_limit", False)
    if is_nested and outer <= seconds:  # the limit around this one is over first
        yield lambda: False
        return
    signal.signal(signal.SIGALRM, stop)
    try:
        # Again and again: what is raised within a callback of a compiler is lost.
        signal.setitimer(signal.ITIMER_REAL, seconds, _AGAIN)
        yield lambda: bool(over)
    finally:
        left, _ = signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        if outer:  # a timer of somebody else begins anew
            taken = seconds + _AGAIN * len(over) - left
            signal.setitimer(signal.ITIMER_REAL, max(outer - taken * is_nested, 1e-6), interval)
