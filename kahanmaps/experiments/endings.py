"""How a process ended, and whose doing that was: the task's, or that of the machine it ran on.

A task's own are the signals that the processor or a limit of its own raises: its code, or a library that it called,
has died. Any other one was sent from outside: by a cancelled job, a service that stops, a shutdown. SIGKILL may also
come from the system for want of memory, of which the dead say nothing.
"""

from __future__ import annotations

from contextlib import suppress
from signal import Signals

# How often in all a task is tried while what does it is killed from outside, before it is given up as lost: a lost
# task has no result, and the next run tries it as often again.
TRIES = 5

_OWN = {
    Signals.SIGSEGV,
    Signals.SIGABRT,
    Signals.SIGFPE,
    Signals.SIGBUS,
    Signals.SIGILL,
    Signals.SIGSYS,
    Signals.SIGTRAP,
    Signals.SIGXCPU,
    Signals.SIGXFSZ,
}


def is_from_outside(status: int | None) -> bool:
    """Whether a process that ended with this status, as `subprocess` has it, was killed by no doing of its own."""
    return status is not None and status < 0 and -status not in _OWN


def ending(status: int | None) -> str:
    """How a process ended, in words.

    >>> ending(-15), ending(7)
    ('was killed by signal 15 (SIGTERM), from outside', 'ended with status 7')
    """
    if status is None:
        return "closed the pipe for its answers"
    if status >= 0:
        return f"ended with status {status}"
    words = f"was killed by signal {-status}"
    with suppress(ValueError):
        words += f" ({Signals(-status).name})"
    if not is_from_outside(status):
        return words
    return f"{words}, from outside" + (" or for want of memory" if -status == Signals.SIGKILL else "")
