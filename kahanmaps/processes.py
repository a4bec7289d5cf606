"""The number of processors, and how child processes end together with their parent."""

from __future__ import annotations

import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def processors() -> int:
    """Return the number of processors that the current process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every operating system has this function
        return os.cpu_count() or 1


def end_with_parent(parent: int) -> None:
    """Let the kernel kill the current process when the process `parent` ends (on Linux only)."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # the parent ended before the kernel knew the request
        os._exit(1)
