"""The program `kahanmaps`: Ctrl-C and SIGTERM end it with 130 and a word, from the first moment on to the last.

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


# Bytes of addresses that each takes while it is loaded and works, measured, and half as much again.
_ROOM = {"numpy": 300 << 20, "matplotlib": 200 << 20, "numba": 300 << 20, "llvmlite": 300 << 20}


class _Room:
    """A finder of modules that finds none, and raises MemoryError for libraries that would not have room to work in.

    Without it OpenBLAS, below numpy, ends the process by itself, with the status 1 that says `refuted`. Nothing can be
    done about it then, so room is looked for before, at the first part of a library.
    """

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name in _ROOM:
            import mmap

            try:
                mmap.mmap(-1, _ROOM[name]).close()
            except OSError as error:
                raise MemoryError(f"{name} would have no room") from error


def main() -> int:
    """Run the command line and return its exit status."""
    usual = {_signal.SIGINT: _signal.default_int_handler, _signal.SIGTERM: _signal.SIG_DFL}
    ours = [number for number, action in usual.items() if _signal.getsignal(number) == action]  # none that is ignored
    for number in ours:
        _signal.signal(number, _end)
    import atexit
    import resource

    from kahanmaps_cli.main import main as run
    from kahanmaps_cli.signals import handle

    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:  # ulimit -v
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        sys.meta_path.insert(0, _Room())
    for number in ours:  # Python takes handlers away at its end, and the status is known by then
        atexit.register(_signal.signal, number, _signal.SIG_IGN)
    try:
        for number in ours:
            handle(number, _signal.default_int_handler)
        status = run()
        if status == _INTERRUPTED:
            os._exit(status)  # all has been ended and flushed; to take large libraries apart takes a second
        return status
    except KeyboardInterrupt:  # just before `run` looks for it, or just after
        _end(_signal.SIGINT, None)
        raise
    finally:
        for number in ours:
            _signal.signal(number, _end)


if __name__ == "__main__":
    sys.exit(main())
