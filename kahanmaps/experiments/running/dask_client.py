"""The connection to dask: a client of a running scheduler that has commands run and collects what they came to."""

from __future__ import annotations

import json
import logging
import queue
import re
import subprocess
import threading
import time
import uuid
import warnings
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from kahanmaps.errors import InputError

RESULTS_AT_ONCE = 32  # results that are fetched from the workers before their records are handed on
LOOK_EVERY = 2.0  # seconds between two looks at who the workers are

_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


class Result(NamedTuple):
    """What dask says of a command, by the number it was given: how it ended, or the exception in its place."""

    number: int
    process: subprocess.CompletedProcess[bytes] | None = None
    error: BaseException | None = None

    def output(self, name: str) -> bytes:
        """What it printed on stdout or stderr, be it until its time was over."""
        return getattr(self.process or self.error, name, None) or b""


class DaskClient:
    """A client of the scheduler at `address` that has commands run, and collects what they came to.

    `threads` says how many threads the workers have, when last looked at; `lost` why the scheduler is lost, or None.
    The log of distributed is silent from here on: its news arrive as exceptions. Raises InputError when nobody answers
    within `timeout` seconds.
    """

    def __init__(self, address: str, timeout: float) -> None:
        self.threads = 0
        self.lost: str | None = None
        self._ended: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()  # put by a thread of dask's
        self._client: Any = _connected(address, timeout)
        self._looked = -LOOK_EVERY
        self._look()

    def submit(self, number: int, command: Sequence[str], text: bytes, timeout: float | None) -> None:
        """Have a worker run a command on this input. Never raises: a scheduler that is gone is told by `lost`."""
        try:
            # distributed warns of arguments beyond 10 MB: a single document may be as large.
            with warnings.catch_warnings(action="ignore"):
                future = self._client.submit(
                    subprocess.run,
                    command,
                    input=text,
                    capture_output=True,
                    timeout=timeout,
                    pure=False,
                    key=f"kahanmaps-{uuid.uuid4().hex}",
                )
            future.add_done_callback(lambda ended: self._ended.put((number, ended)))
        except Exception as error:  # the client has closed itself after losing the scheduler
            self.lost = self.lost or told(error)

    def drained(self, timeout: float) -> list[Result]:
        """Results that are there; one is waited for. What comes after the loss of the scheduler is dropped."""
        found: list[Result] = []
        with suppress(queue.Empty):
            while self.lost is None and len(found) < RESULTS_AT_ONCE:
                number, future = self._ended.get_nowait() if found else self._ended.get(timeout=timeout)
                try:
                    found.append(Result(number, process=future.result()))
                except Exception as error:
                    if future.status == "error":
                        found.append(Result(number, error=error))
                    else:  # no error of the command's, but of the way to it
                        self.lost = "the connection was closed"
                with suppress(Exception):
                    future.release()
        self._look()
        return found

    def close(self) -> None:
        """End at once, whether or not the scheduler is still there. May be called twice."""
        # A scheduler that is gone must not hold us up, and there is nothing to be done about its last words.
        with suppress(Exception), warnings.catch_warnings(action="ignore"):
            self._client.close(timeout=2)

    def _look(self) -> None:
        """Count the workers' threads now and then, and notice a scheduler that went away meanwhile."""
        if self._client.status != "running":  # to ask it anything would wait for another scheduler
            self.lost = self.lost or "the connection was closed"
        elif time.monotonic() - self._looked >= (LOOK_EVERY if self.threads else LOOK_EVERY / 4):
            self._looked = time.monotonic()
            try:
                self.threads = sum(self._client.nthreads().values())
            except Exception as error:
                self.lost = self.lost or told(error)


def told(error: BaseException | None) -> str:
    """An exception on one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def _connected(address: str, timeout: float) -> Any:
    """A client of the scheduler; or InputError with a sentence."""
    try:
        client = import_module("distributed").Client  # which takes a second to import
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs the package distributed, which is not there ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    chosen = _scheduler(address)
    for name in list(logging.Logger.manager.loggerDict):
        if name.split(".")[0] in ("distributed", "tornado"):
            logging.getLogger(name).disabled = True
    made: Future[Any] = Future()

    def make() -> None:
        try:
            # Of other versions of some package: our tasks are the standard library's, whose version may differ.
            with warnings.catch_warnings(action="ignore"):
                made.set_result(client(chosen, timeout=timeout, set_as_default=False, name="kahanmaps"))
        except BaseException as error:
            made.set_exception(error)

    # In a thread: distributed itself waits for ever where something listens that is no scheduler.
    threading.Thread(target=make, daemon=True).start()
    try:
        return made.result(timeout + 1)
    except Exception as error:
        raise InputError(
            f"no dask scheduler answers at {address} within {timeout:g} s ({told(error)}): "
            "is the address right, and does `dask scheduler` run there?"
        ) from error


def _scheduler(address: str) -> str:
    """How a client is told where the scheduler is. A file is looked at first: distributed waits for it for ever."""
    path = Path(address)
    if "://" not in address and (path.is_file() or address.endswith(".json")):
        try:
            return str(json.loads(path.read_text(encoding="utf-8"))["address"])
        except OSError as error:
            raise InputError(f"cannot read the scheduler file {address}: {error.strerror}") from None
        except (ValueError, LookupError, TypeError):
            raise InputError(f"{address} is not the file that `dask scheduler --scheduler-file` writes") from None
    if not _ADDRESS.fullmatch(address):
        raise InputError(
            f"{address!r} is not the address of a scheduler: write tcp://host:port, or the path of a scheduler file"
        )
    return address
