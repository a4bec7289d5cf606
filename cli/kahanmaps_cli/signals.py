"""Interrupts: the first Ctrl-C or SIGTERM ends long work where its output is valid, the next ones end it at once."""

from __future__ import annotations

import ctypes
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERRUPTED = 130  # the exit status


def handle(number: int, handler: Callable[[int, Any], None]) -> Any:
    """Set a handler for one signal and return the previous one; a second signal ends the process at once.

    Python runs a handler only after the current call into C returns, and a call of FLINT with long numbers may take
    minutes. So the handler is installed with System V semantics: the disposition is reset to the default when the
    first signal arrives. Where the C library lacks sysv_signal, a second signal waits as well.
    """
    previous = signal.signal(number, handler)
    C = ctypes.CDLL(None)
    if hasattr(C, "sysv_signal"):
        C.signal.restype = ctypes.c_void_p
        C.sysv_signal.argtypes = (ctypes.c_int, ctypes.c_void_p)
        C.sysv_signal(number, C.signal(number, None))
    return previous


@contextmanager
def interruptible(interrupt: Callable[[], None]) -> Iterator[None]:
    """Call `interrupt`, which requests the work to end, at the first Ctrl-C or SIGTERM; end at once at the second."""

    def handler(signum: int, frame: Any) -> None:
        handle(signum, signal.default_int_handler)
        interrupt()

    previous = {number: handle(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, action in previous.items():
            signal.signal(number, action)
