"""The program `kahanmaps`: Ctrl-C is told in a word from the first moment on, while the libraries are still loaded."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from typing import Any

_INTERRUPTED = 130


def _end(signum: int, frame: Any) -> None:
    with suppress(OSError):
        os.write(2, b"interrupted\n")
    os._exit(_INTERRUPTED)  # nothing has begun that would have to be ended


def main() -> int:
    """Run the command line and return its exit status."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # and is not ignored, as below nohup
        signal.signal(signal.SIGINT, _end)
    from kahanmaps_cli.limited_memory import look_for_room
    from kahanmaps_cli.main import main as run

    look_for_room()
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return run()


if __name__ == "__main__":
    sys.exit(main())
