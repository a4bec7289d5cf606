"""Tasks that go wrong, for tests of the machinery: KAHANMAPS_TASKS=fault_tasks brings them in.

`prime` says what happens, `seed` when: the odd ones go wrong, the even ones are done.
"""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError
from kahanmaps.experiments.registry import task


@task("fault")
def fault(arithmetic: str = "exact", seed: int = 0, order: int = 1, report: bool = False) -> dict[str, Any]:
    """Go wrong in the way that `order` names, where the seed is odd."""
    if seed % 2 == 0:
        return {"seed_squared": seed**2, "verdict": "proved"}
    return FAULTS[order]()


@task("pause")
def pause(steps: int = 0, seed: int = 0) -> dict[str, Any]:
    """Sleep for so many milliseconds."""
    time.sleep(steps / 1000)
    return {"seed_squared": seed**2, "verdict": "proved" if seed % 3 else "refuted"}


@task("use")
def use(steps: int = 0, seed: int = 0) -> dict[str, Any]:
    """Use so many megabytes, in small pieces, which Python keeps for later."""
    return {"pieces": len([bytes(968) for _ in range(1000 * steps)])}


@task("first")
def first(steps: int = 0, seed: int = 0) -> dict[str, Any]:
    """Fail unless it is the first one in its child."""
    _seen.append(seed)
    if len(_seen) > 1:
        raise RuntimeError(f"after {_seen[0]}")
    return {"seed": seed}


_seen: list[int] = []


@task("signalled")
def signalled(order: int = 0, seed: int = 0) -> dict[str, Any]:
    """Send signal `order` to oneself in the first `seed` tries, which are counted in the folder FAULT_TRIES."""
    tries = Path(os.environ["FAULT_TRIES"], f"{order}-{seed}")
    with tries.open("a") as file:
        file.write("x")
    if tries.stat().st_size <= seed:
        os.kill(os.getpid(), order)
    return {"lived": True}


def _kill(number: int) -> dict[str, Any]:
    print(f"about to die of {number}", file=sys.stderr, flush=True)
    os.kill(os.getpid(), number)
    time.sleep(60)
    return {}


def _segfault() -> dict[str, Any]:
    ctypes.string_at(0)
    return {}


def _hang() -> dict[str, Any]:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # like a long call of FLINT
    while True:
        time.sleep(60)


def _python_bomb() -> dict[str, Any]:
    hoard = []
    while True:
        hoard.append(bytearray(1 << 20))


def _flint_bomb() -> dict[str, Any]:
    from flint import fmpz_mat

    hoard = []
    while True:
        hoard.append(fmpz_mat(3000, 3000))


def _gmp_bomb() -> dict[str, Any]:
    from flint import fmpz

    return {"bits": (fmpz(1) << 400_000_000_000).bit_length()}


def _input_error() -> dict[str, Any]:
    raise InputError("found nothing, expected something")


def _bug() -> dict[str, Any]:
    return {"quotient": 1 // 0}


def _not_a_number() -> dict[str, Any]:
    return {"value": float("nan")}


def _chatter() -> dict[str, Any]:
    print("noise on standard output")
    sys.stderr.write("x" * 300_000 + "the end of the noise\n")
    return {"said": "much"}


def _exit() -> dict[str, Any]:
    os._exit(7)


def _large() -> dict[str, Any]:
    return {"digits": "7" * 3_000_000, "hash_seed": os.environ["PYTHONHASHSEED"]}


def _awkward() -> dict[str, Any]:
    class Awkward(Exception):
        def __init__(self, reason: str, more: str) -> None:  # what `pickle` cannot make again
            super().__init__(reason)

    raise Awkward("for a reason", "and more")


def _leave() -> dict[str, Any]:
    sys.exit("I leave")


def _exit_0() -> dict[str, Any]:
    os._exit(0)


def _twins() -> dict[str, Any]:
    os.fork()
    return {"forked": True}


def _reader() -> dict[str, Any]:
    return {"read": sys.stdin.read()}


def _not_plain() -> dict[str, Any]:
    return {"value": {1, 2}}


def _verdict_of_no_text() -> dict[str, Any]:
    return {"verdict": ["proved"]}


def _not_loaded() -> dict[str, Any]:
    raise ImportError("numbers.so: failed to map segment from shared object")


def _openblas() -> dict[str, Any]:
    print("OpenBLAS error: Memory allocation still failed after 10 retries, giving up.", file=sys.stderr, flush=True)
    os._exit(1)


def _starter() -> dict[str, Any]:
    return {"pid": subprocess.Popen(["sleep", "60"]).pid}


FAULTS = {
    1: lambda: _kill(signal.SIGKILL),
    2: lambda: _kill(signal.SIGABRT),
    3: _segfault,
    4: _hang,
    5: _python_bomb,
    6: _flint_bomb,
    7: _gmp_bomb,
    8: _input_error,
    9: _bug,
    10: _not_a_number,
    11: _chatter,
    12: _exit,
    13: _large,
    14: _awkward,
    15: _twins,
    16: _exit_0,
    17: _reader,
    18: _not_plain,
    19: _verdict_of_no_text,
    20: _starter,
    21: _not_loaded,
    22: _openblas,
    23: _leave,
}
