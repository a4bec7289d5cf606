"""Ctrl-C and SIGTERM ask long work to end where its output is valid; pressed again and again they end it anywhere."""

from __future__ import annotations

import ctypes
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERRUPTED = 130  # the exit status


def handle(number: int, handler: Callable[[int, Any], None]) -> Any:
    """Set a handler for one signal, and return the one before; the next signal ends the process, handled or not.

    Handlers written in Python wait for the call in hand, and one of FLINT with long numbers takes minutes. So the
    disposition goes back to the default as the signal arrives, which is what signal() does in System V; the handler
    may then set another. Where the C library has no such function, the next signal waits as well.
    """
    before = signal.signal(number, handler)
    C = ctypes.CDLL(None)
    if hasattr(C, "sysv_signal"):
        C.signal.restype = ctypes.c_void_p
        C.sysv_signal.argtypes = (ctypes.c_int, ctypes.c_void_p)
        C.sysv_signal(number, C.signal(number, None))
    return before


@contextmanager
def interruptible(interrupt: Callable[[], None]) -> Iterator[None]:
    """The first Ctrl-C or SIGTERM calls `interrupt`, which asks the work to end; the second one ends it at once."""

    def handler(signum: int, frame: Any) -> None:
        handle(signum, signal.default_int_handler)
        interrupt()

    previous = {number: handle(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
