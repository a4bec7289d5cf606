"""The program `kahanmaps`: Ctrl-C is told in a word from the first moment on to the last.

Python itself prints a traceback where it is interrupted before it comes here. What is imported above `main` is there by
then, or costs nothing: the handler is in place before anything is loaded.
"""

import _signal  # type: ignore[import-not-found]  # the module `signal` loads enumerations first
import os
import sys

_INTERRUPTED = 130


def _end(signum: int, frame: object) -> None:
    try:
        os.write(2, b"interrupted\n")
    finally:
        os._exit(_INTERRUPTED)  # nothing has begun that would have to be ended, or everything has been


def main() -> int:
    """Run the command line and return its exit status."""
    is_ours = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler  # not ignored, as below nohup
    if is_ours:
        _signal.signal(_signal.SIGINT, _end)
    import atexit

    from kahanmaps_cli.limited_memory import look_for_room
    from kahanmaps_cli.main import main as run
    from kahanmaps_cli.signals import handle

    look_for_room()
    if not is_ours:
        return run()
    # Python takes handlers away at its end, and the status is known by then.
    atexit.register(_signal.signal, _signal.SIGINT, _signal.SIG_IGN)
    try:
        handle(_signal.SIGINT, _signal.default_int_handler)
        return run()
    except KeyboardInterrupt:  # just before `run` looks for it, or just after
        _end(_signal.SIGINT, None)
        raise
    finally:
        _signal.signal(_signal.SIGINT, _end)


if __name__ == "__main__":
    sys.exit(main())
