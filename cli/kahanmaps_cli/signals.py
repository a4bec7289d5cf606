"""Interrupts: the first Ctrl-C or SIGTERM ends a long computation with valid output, the second ends the process."""

from __future__ import annotations

import ctypes
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERRUPTED = 130  # the exit status
_REPEAT_SECONDS = 1.0  # CPU time in seconds between two KeyboardInterrupts after one signal


def handle(number: int, handler: Callable[[int, Any], None]) -> Any:
    """Set a handler for one signal and return the previous handler; a second signal of this kind ends the process.

    Python runs a handler only after the current call into C returns, and a call of FLINT with long numbers may take
    minutes. So the handler is installed with System V semantics: the arrival of the first signal restores the default
    action. If the C library has no sysv_signal, a second signal also waits until the call returns.
    """
    previous = signal.signal(number, handler)
    C = ctypes.CDLL(None)
    if hasattr(C, "sysv_signal"):
        C.signal.restype = ctypes.c_void_p
        C.sysv_signal.argtypes = (ctypes.c_int, ctypes.c_void_p)
        C.sysv_signal(number, C.signal(number, None))
    return previous


def raise_interrupt(signum: int, frame: Any) -> None:
    """Raise KeyboardInterrupt, now and after every further second of CPU time, until `end_interrupts` is called.

    One exception may be lost: if it is raised during the creation of a class, Python turns it into a RuntimeError, and
    matplotlib's import of three-dimensional axes takes any exception for a missing library.
    """
    signal.signal(signal.SIGVTALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_VIRTUAL, _REPEAT_SECONDS, _REPEAT_SECONDS)
    raise KeyboardInterrupt


def end_interrupts() -> None:
    """Stop raising KeyboardInterrupt; call this function after catching it."""
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)


@contextmanager
def interruptible(interrupt: Callable[[], None]) -> Iterator[None]:
    """Call `interrupt` at the first Ctrl-C or SIGTERM, to request the end of the work; exit at once at the second."""

    def handler(signum: int, frame: Any) -> None:
        handle(signum, raise_interrupt)
        interrupt()

    previous = {number: handle(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
