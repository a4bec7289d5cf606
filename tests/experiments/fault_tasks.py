"""Tasks that go wrong, for tests of the machinery: KAHANMAPS_TASKS=fault_tasks brings them in.

`prime` says what happens, `seed` when: the odd ones go wrong, the even ones are done.
"""

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from flint import fmpz, fmpz_mat

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


def _kill(number: int) -> None:
    print(f"about to die of {number}", file=sys.stderr, flush=True)
    os.kill(os.getpid(), number)
    time.sleep(60)


def _hang() -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())  # like a long call of FLINT
    while True:
        time.sleep(60)


def _exhaust_memory(allocate: Callable[[], Any]) -> None:
    hoard = []
    while True:
        hoard.append(allocate())


def _fail(error: Exception) -> None:
    raise error


def _chatter() -> dict[str, Any]:
    print("noise on standard output")
    sys.stderr.write("x" * 300_000 + "the end of the noise\n")
    return {"said": "much"}


class Awkward(Exception):
    """What `pickle` cannot make again."""

    def __init__(self, reason: str, more: str) -> None:
        super().__init__(reason)


def _openblas() -> None:
    print("OpenBLAS error: Memory allocation still failed after 10 retries, giving up.", file=sys.stderr, flush=True)
    os._exit(1)


FAULTS: dict[int, Callable[[], Any]] = {
    1: lambda: _kill(signal.SIGKILL),
    2: lambda: _kill(signal.SIGABRT),
    3: lambda: ctypes.string_at(0),
    4: _hang,
    5: lambda: _exhaust_memory(lambda: bytearray(1 << 20)),
    6: lambda: _exhaust_memory(lambda: fmpz_mat(3000, 3000)),
    7: lambda: fmpz(1) << 400_000_000_000,
    8: lambda: _fail(InputError("found nothing, expected something")),
    9: lambda: {"quotient": 1 // 0},
    10: lambda: {"value": float("nan")},
    11: _chatter,
    12: lambda: os._exit(7),
    13: lambda: {"digits": "7" * 3_000_000, "hash_seed": os.environ["PYTHONHASHSEED"]},
    14: lambda: _fail(Awkward("for a reason", "and more")),
    15: lambda: {"forked": os.fork() >= 0},
    16: lambda: os._exit(0),
    17: lambda: {"read": sys.stdin.read()},
    18: lambda: {"value": {1, 2}},
    19: lambda: {"verdict": ["proved"]},
    20: lambda: {"pid": subprocess.Popen(["sleep", "60"]).pid},
    21: lambda: _fail(ImportError("numbers.so: failed to map segment from shared object")),
    22: _openblas,
    23: lambda: sys.exit("I leave"),
}
