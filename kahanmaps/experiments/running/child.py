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
import platform
import signal
import sys
import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import version
from typing import IO, Any

from kahanmaps.errors import InputError, KahanmapsError, is_out_of_memory
from kahanmaps.experiments.options import OTHER
from kahanmaps.experiments.registry import task_kind, task_kinds
from kahanmaps.experiments.results.recipes import system_from
from kahanmaps.experiments.results.records import Outcome, Task, canonical
from kahanmaps.processes import end_with_parent
from kahanmaps.version import __version__

_TAIL = 2000  # characters of a message or a traceback that are kept


def main(parent: int) -> None:
    """Do tasks until standard input ends. `parent` is the process that must be alive."""
    end_with_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which decides
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # held back until here
    questions, answers = _private_stdin(), _private_stdout()
    me = os.getpid()
    documents: dict[str, str] = {}
    task_kinds()  # importing them is no part of any task
    ready = canonical({"ready": {"host": platform.node(), "versions": _versions()}})
    idle = _address_space()
    answers.write(ready + "\n")
    answers.flush()
    for line in questions:
        message = json.loads(line)
        if "document" in message:
            documents[message["document"]] = message["text"]
            continue
        record = perform(Task.from_text(message["task"]), message["memory"], documents, idle)
        if os.getpid() != me:
            os._exit(0)  # the task has forked, and this is the copy
        answers.write(_answer(record) + "\n")
        answers.flush()
        if record["outcome"] == Outcome.OUT_OF_MEMORY:
            return  # what is left of the memory nobody knows


def _versions() -> dict[str, str]:
    """The versions that a result may depend on."""
    import flint

    return {
        "kahanmaps": __version__,
        "python": platform.python_version(),
        "python-flint": version("python-flint"),
        "flint": str(getattr(flint, "__FLINT_VERSION__", "unknown")),
    }


def perform(task: Task, memory: int | None, documents: Mapping[str, str], idle: int | None = None) -> dict[str, Any]:
    """Do a task; what became of it, as plain data for a `Record`.

    `idle` is the address space of a child that has done nothing yet: what earlier tasks left counts as memory of this
    one, which would otherwise have more of it here than in a new child.
    """
    with suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # from here on the peak is that of the task
    _limit_memory(memory, idle)
    begin = time.perf_counter()
    found: dict[str, Any] = {"key": task.key, "outcome": Outcome.OK}
    try:
        result = _result(task, documents)
        verdict = result.pop("verdict", None)
        if not isinstance(verdict, str | None):
            raise InputError(f"found the verdict {str(verdict)[:100]}, expected a text")
        found |= {"verdict": verdict, "result": result}
    except Exception as error:  # whatever a task does wrong is its own affair
        found |= _failure(error)
    _limit_memory(None, idle)
    return {**found, "seconds": time.perf_counter() - begin, "peak_memory": _peak_memory()}


def _failure(error: Exception) -> dict[str, Any]:
    """What an error means for the record; one that nobody raised on purpose has its traceback in it."""
    cause: BaseException | None = error
    while cause is not None and not is_out_of_memory(cause):
        cause = cause.__cause__ or cause.__context__
    if cause is not None:  # MemoryError or what says the same, a module not loaded say; or raised from it
        return {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}
    if isinstance(error, InputError):
        return {"outcome": Outcome.FAILED, "message": str(error)[:_TAIL]}
    found = {"outcome": Outcome.FAILED, "message": f"{type(error).__name__}: {error}"[:_TAIL]}
    return found if isinstance(error, KahanmapsError) else {**found, "stderr": traceback.format_exc()[-_TAIL:]}


def _result(task: Task, documents: Mapping[str, str]) -> dict[str, Any]:
    kind = task_kind(task.kind)
    options = dict(task.options)
    if options.get(OTHER) is not None:
        options[OTHER] = system_from(options[OTHER], documents.__getitem__)
    system = None if task.system is None else system_from(task.system, documents.__getitem__)
    result = kind.perform(system, options)
    if not isinstance(result, dict):
        raise InputError(f"found a result of type {type(result).__name__}, expected a dict")
    return result


def _limit_memory(memory: int | None, idle: int | None) -> None:
    """Bound the address space to `idle`, by default what it is now, and `memory` more; None: to what the user has."""
    with suppress(ImportError, OSError, ValueError):  # not on Windows; not below what is used already
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        soft = hard
        if memory is not None and (used := idle or _address_space()) is not None:
            soft = used + memory
            soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _address_space() -> int | None:
    """How much of it this process has, in bytes, where that is known."""
    with suppress(OSError), open("/proc/self/statm") as file:
        return int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return None


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


def _private_stdin() -> IO[str]:
    """Standard input for questions alone: whatever else reads it finds nothing."""
    private = os.dup(0)
    with open(os.devnull) as nothing:
        os.dup2(nothing.fileno(), 0)
    return os.fdopen(private, encoding="ascii")


def _private_stdout() -> IO[str]:
    """Standard output for answers alone: what anything else prints goes to standard error."""
    sys.stdout.flush()
    private = os.dup(1)
    os.dup2(2, 1)
    return os.fdopen(private, "w", encoding="ascii", errors="strict")


def _answer(record: Mapping[str, Any]) -> str:
    """The record as text. What JSON does not have (nan, a Fraction, an array) makes it a failure."""
    try:
        return canonical(record)
    except (ValueError, TypeError, RecursionError) as error:
        message = f"the result cannot be kept: {error}"[:_TAIL]
        return canonical({"key": record["key"], "outcome": Outcome.FAILED, "message": message})


if __name__ == "__main__":
    main(int(sys.argv[1]))
