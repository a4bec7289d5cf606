"""Progress of long work on standard error: nothing for the first second, one line redrawn on a terminal, a line now and
then elsewhere."""

from __future__ import annotations

import sys
import time


class Progress:
    """Call it with a sentence as often as you like; `done` clears the line."""

    def __init__(self, quiet: bool = False) -> None:
        self._quiet = quiet
        self._terminal = sys.stderr.isatty()
        self._start = self._last = time.monotonic()
        self._shown = 0

    def __call__(self, sentence: str) -> None:
        now = time.monotonic()
        if self._quiet or now - self._start < 1 or now - self._last < (0.1 if self._terminal else 10):
            return
        self._last = now
        text = f"{sentence} ({now - self._start:.0f} s)"
        if self._terminal:
            sys.stderr.write("\r" + text[:79].ljust(self._shown))
            self._shown = len(text[:79])
        else:
            sys.stderr.write(text + "\n")
        sys.stderr.flush()

    def done(self) -> None:
        """Remove the line from the terminal."""
        if self._terminal and self._shown:
            sys.stderr.write("\r" + " " * self._shown + "\r")
            sys.stderr.flush()
            self._shown = 0
