"""Ctrl-C and SIGTERM ask long work to end where its output is valid."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def interruptible(interrupt: Callable[[], None]) -> Iterator[None]:
    """The first Ctrl-C or SIGTERM calls `interrupt`, which asks the work to end; the second one ends it at once."""

    def handler(signum: int, frame: Any) -> None:
        signal.signal(signum, signal.default_int_handler)
        interrupt()

    previous = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
