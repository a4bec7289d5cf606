"""The program `kahanmaps`. Ctrl-C and SIGTERM end it with status 130 and a message, even during imports.

The signal handlers are installed before large modules are imported: a signal during an import would print a traceback.
"""

import _signal  # type: ignore[import-not-found]  # the module `signal` loads enumerations first
import os
import sys

_INTERRUPTED = 130


def _end(signum: int, frame: object) -> None:
    try:
        os.write(2, b"interrupted\n")
    finally:
        os._exit(_INTERRUPTED)  # during imports and after the command nothing has to be cleaned up


# Library -> bytes of address space that are required to load it and to work with it: 1.5 times the measured number.
_MIN_MEMORY = {"numpy": 300 << 20, "matplotlib": 200 << 20, "numba": 300 << 20, "llvmlite": 300 << 20}


class _MemoryCheck:
    """An import hook that raises MemoryError before the import of a library for which the memory does not suffice.

    It finds no module itself. Without it OpenBLAS (used by numpy) would exit with status 1, which means `refuted`.
    """

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name in _MIN_MEMORY:
            import mmap

            try:
                mmap.mmap(-1, _MIN_MEMORY[name]).close()
            except OSError as error:
                raise MemoryError(f"not enough memory to load {name}") from error


def main() -> int:
    """Run the command line and return its exit status."""
    default_handlers = {_signal.SIGINT: _signal.default_int_handler, _signal.SIGTERM: _signal.SIG_DFL}
    handled_signals = [
        number for number, action in default_handlers.items() if _signal.getsignal(number) == action
    ]  # the signals that the parent process does not ignore
    for number in handled_signals:
        _signal.signal(number, _end)
    import atexit
    import gc
    import resource

    gc.set_threshold(20_000, 10, 10)  # by default garbage collection takes a tenth of the import time
    from kahanmaps_cli.main import main as run
    from kahanmaps_cli.signals import end_interrupts, handle, raise_interrupt

    if resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY:  # `ulimit -v` limits the address space
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        sys.meta_path.insert(0, _MemoryCheck())
    for number in handled_signals:  # Python removes its handlers at exit; the known status must not change
        atexit.register(_signal.signal, number, _signal.SIG_IGN)
    try:
        for number in handled_signals:
            handle(number, raise_interrupt)
        status = run()
        if status == _INTERRUPTED:
            os._exit(status)  # the streams are flushed; unloading large libraries would take a second
        return status
    except KeyboardInterrupt:  # raised outside the `try` block of `run`
        _end(_signal.SIGINT, None)
        raise
    finally:
        end_interrupts()
        for number in handled_signals:
            _signal.signal(number, _end)


if __name__ == "__main__":
    sys.exit(main())
