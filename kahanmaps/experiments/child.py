"""The child that does tasks: one JSON line on standard input for each, one on standard output for what became of it.

    parent: {"document": DIGEST, "text": "..."}                      before the first task that needs it
    parent: {"task": "CANONICAL TEXT", "memory": BYTES or null}
    child:  {"ready": {"host": ..., "versions": {...}}}              once
    child:  {"key": ..., "outcome": ..., "result": ..., "seconds": ..., ...}

FLINT may abort this process, does not see Ctrl-C and takes whatever memory it can: that is why it is a process of its
own. It ends when its standard input ends, and on Linux at the moment its parent dies.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from typing import IO, Any

from kahanmaps.errors import InputError, KahanmapsError
from kahanmaps.experiments.options import OTHER
from kahanmaps.experiments.recipes import system_from
from kahanmaps.experiments.records import Outcome, Task, canonical
from kahanmaps.experiments.registry import task_kind, task_kinds
from kahanmaps.experiments.versions import host_name, versions

_TAIL = 2000  # characters of a message or a traceback that are kept
_PR_SET_PDEATHSIG = 1


def main(parent: int) -> None:
    """Do tasks until standard input ends. `parent` is the process that must be alive."""
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which decides
    answers = _private_stdout()
    documents: dict[str, str] = {}
    task_kinds()  # importing them is no part of any task
    _answer(answers, {"ready": {"host": host_name(), "versions": versions()}})
    for line in sys.stdin:
        message = json.loads(line)
        if "document" in message:
            documents[message["document"]] = message["text"]
            continue
        record = perform(Task.from_text(message["task"]), message["memory"], documents)
        try:
            _answer(answers, record)
        except ValueError as error:  # a number that JSON does not have
            text = f"the result cannot be kept: {error}"
            _answer(answers, {"key": record["key"], "outcome": "failed", "message": text})
        if record["outcome"] == Outcome.OUT_OF_MEMORY:
            return  # what is left of the memory nobody knows


def perform(task: Task, memory: int | None, documents: Mapping[str, str]) -> dict[str, Any]:
    """Do a task; what became of it, as plain data for a `Record`."""
    with suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # from here on the peak is that of the task
    _limit_memory(memory)
    begin = time.perf_counter()
    found: dict[str, Any] = {"key": task.key, "outcome": Outcome.OK}
    try:
        result = _result(task, documents)
        found |= {"verdict": result.pop("verdict", None), "result": result}
    except MemoryError:
        found |= {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
    except InputError as error:
        found |= {"outcome": Outcome.FAILED, "message": str(error)[-_TAIL:]}
    except Exception as error:  # whatever a task does wrong is its own affair
        found |= {"outcome": Outcome.FAILED, "message": f"{type(error).__name__}: {error}"[:_TAIL]}
        if not isinstance(error, KahanmapsError):
            found["stderr"] = traceback.format_exc()[-_TAIL:]
    _limit_memory(None)
    return {**found, "seconds": time.perf_counter() - begin, "peak_memory": _peak_memory()}


def _result(task: Task, documents: Mapping[str, str]) -> dict[str, Any]:
    kind = task_kind(task.kind)
    options = dict(task.options)
    if options.get(OTHER) is not None:
        options[OTHER] = system_from(options[OTHER], documents.__getitem__)
    system = None if task.system is None else system_from(task.system, documents.__getitem__)
    return kind.perform(system, options)


def end_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent dies, where it can (Linux)."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it died before we asked
        os._exit(1)


def _limit_memory(memory: int | None) -> None:
    """Bound the address space to what it is now and `memory` more; None: to what the user has."""
    with suppress(ImportError, OSError, ValueError):  # not on Windows; not below what is used already
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        soft = hard
        if memory is not None:
            with open("/proc/self/statm") as file:
                soft = int(file.read().split()[0]) * resource.getpagesize() + memory
            soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _peak_memory() -> int | None:
    """The largest resident size since the task began, in bytes."""
    with suppress(OSError), open("/proc/self/status") as file:
        for line in file:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    with suppress(ImportError):
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak if sys.platform == "darwin" else peak * 1024
    return None


def _private_stdout() -> IO[str]:
    """Standard output for answers alone: what anything else prints goes to standard error."""
    sys.stdout.flush()
    private = os.dup(1)
    os.set_inheritable(private, False)
    os.dup2(2, 1)
    return os.fdopen(private, "w", encoding="ascii", errors="strict")


def _answer(stream: IO[str], data: Mapping[str, Any]) -> None:
    stream.write(canonical(data) + "\n")
    stream.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]))
