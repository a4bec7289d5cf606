"""Interrupts: the first Ctrl-C or SIGTERM ends long work with valid output, the second ends the process at once."""

from __future__ import annotations

import ctypes
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERRUPTED = 130  # the exit status
_REPEAT_SECONDS = 1.0  # CPU time between two interrupts after one signal


def handle(number: int, handler: Callable[[int, Any], None]) -> Any:
    """Set a handler for one signal and return the previous one; a second signal ends the process at once.

    Python runs a handler only after the current call into C returns, and a call of FLINT with long numbers may take
    minutes. So the handler is installed with System V semantics: the disposition is reset to the default when the
    first signal arrives. If the C library has no sysv_signal, a second signal also waits for the call to return.
    """
    previous = signal.signal(number, handler)
    C = ctypes.CDLL(None)
    if hasattr(C, "sysv_signal"):
        C.signal.restype = ctypes.c_void_p
        C.sysv_signal.argtypes = (ctypes.c_int, ctypes.c_void_p)
        C.sysv_signal(number, C.signal(number, None))
    return previous


def raise_interrupt(signum: int, frame: Any) -> None:
    """Raise KeyboardInterrupt, and again after each second of CPU time until `end_interrupts` is called.

    An exception may be lost: if it is raised while a class is created, Python turns it into a RuntimeError, which an
    `except Exception` around an import (in matplotlib, of three-dimensional axes) takes for a missing library.
    """
    signal.signal(signal.SIGVTALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_VIRTUAL, _REPEAT_SECONDS, _REPEAT_SECONDS)
    raise KeyboardInterrupt


def end_interrupts() -> None:
    """Stop raising KeyboardInterrupt; call this function after catching it."""
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)


@contextmanager
def interruptible(interrupt: Callable[[], None]) -> Iterator[None]:
    """Call `interrupt`, which requests the work to end, at the first Ctrl-C or SIGTERM; end at once at the second."""

    def handler(signum: int, frame: Any) -> None:
        handle(signum, raise_interrupt)
        interrupt()

    previous = {number: handle(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
