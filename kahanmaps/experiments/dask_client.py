"""The connection to dask: a client of a running scheduler that has commands run and collects what they came to.

dask calls back in threads of its own. Nothing of that leaves this file: the caller asks for what has arrived.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import json
import logging
import queue
import re
import subprocess
import threading
import uuid
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from kahanmaps.errors import InputError

RESULTS_AT_ONCE = 32  # results that may lie here unread; others are left on the workers
COUNT_EVERY = 2.0  # seconds between two looks at who the workers are

_LOGGERS = ("distributed", "tornado")
_ADDRESS = re.compile(r"([a-z]+://)?[^\s/]+:\d+/?")


@dataclass(frozen=True)
class Result:
    """What dask says of a command, by the number it was given: how it ended, or the exception in its place."""

    number: int
    process: subprocess.CompletedProcess[bytes] | None = None
    error: BaseException | None = None

    @property
    def stdout(self) -> bytes:
        """What it printed, be it until its time was over."""
        return getattr(self.process or self.error, "stdout", None) or b""

    @property
    def stderr(self) -> bytes:
        """The same of its standard error."""
        return getattr(self.process or self.error, "stderr", None) or b""


class DaskClient:
    """A client of the scheduler at `address`, which is "tcp://host:port" or the path of its scheduler file.

    `threads` says how many threads the workers have, when last looked at; `lost` why the scheduler is lost, or None.
    While one of these is open, the log of distributed in this process is silent: its news arrive as exceptions here.
    Raises InputError when nobody answers within `timeout` seconds.
    """

    def __init__(self, address: str, timeout: float) -> None:
        self.threads = 0
        self.lost: str | None = None
        self._results: queue.Queue[Result | str] = queue.Queue()  # a string: why the scheduler is lost
        self._fetching: set[Future[None]] = set()  # coroutines on dask's loop, one for each command that has ended
        self._client = _connected(address, timeout)
        self._loop: asyncio.AbstractEventLoop = self._client.loop.asyncio_loop
        self._room = asyncio.Semaphore(RESULTS_AT_ONCE)
        self._counted = threading.Event()
        self._counter = asyncio.run_coroutine_threadsafe(self._count_threads(), self._loop)
        self._counted.wait(timeout)

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
            future.add_done_callback(partial(self._ended, number))
        except Exception as error:  # the client has closed itself after losing the scheduler
            self.lost = self.lost or _loss(error)

    def drained(self, timeout: float) -> list[Result]:
        """All results that are there; one is waited for. What comes after the loss of the scheduler is dropped."""
        found: list[Result] = []
        try:
            while self.lost is None:
                result = self._results.get_nowait() if found else self._results.get(timeout=timeout)
                if isinstance(result, str):
                    self.lost = result
                else:
                    self._loop.call_soon_threadsafe(self._room.release)
                    found.append(result)
        except queue.Empty:
            pass
        return found

    def close(self) -> None:
        """End at once, whether or not the scheduler is still there. To be called once."""
        for running in [self._counter, *self._fetching.copy()]:
            running.cancel()
        # A scheduler that is gone must not hold us up, and there is nothing to be done about its last words.
        with contextlib.suppress(Exception), warnings.catch_warnings(action="ignore"):
            self._client.close(timeout=2)
        _SILENCE.end()

    # In dask's threads: nothing here but the queue is shared with the caller's

    def _ended(self, number: int, future: Any) -> None:
        """Have the result of a command fetched. Callbacks share one thread, which no result may hold up."""
        fetching = self._fetched(number, future)
        try:
            running = asyncio.run_coroutine_threadsafe(fetching, self._loop)
        except RuntimeError:  # the loop has been closed
            fetching.close()
            return
        self._fetching.add(running)
        running.add_done_callback(self._fetching.discard)

    async def _fetched(self, number: int, future: Any) -> None:
        """Put the result of a command into the queue. A result that was lost with its worker is computed anew first."""
        try:
            if not future.cancelled():
                await self._room.acquire()  # given back when the result has been read
            result = Result(number, process=await future)
        except Exception as error:
            if future.status != "error":  # then it is no error of the command's, but of the way to it
                self._results.put(_loss(error))
                return
            result = Result(number, error=error)
        finally:
            with contextlib.suppress(Exception):
                future.release()
        self._results.put(result)

    async def _count_threads(self) -> None:
        """Keep count of the workers' threads, and notice a scheduler that went away while nothing was in flight."""
        try:
            # A client that has lost its scheduler would wait for another one before the question fails.
            while self._client.status == "running":
                self.threads = sum((await self._client.nthreads()).values())
                self._counted.set()
                await asyncio.sleep(COUNT_EVERY if self.threads else COUNT_EVERY / 4)
            self._results.put("the connection was closed")
        except Exception as error:
            self._results.put(_loss(error))


def distributed() -> Any:
    """The package distributed, which takes a second to import. Some versions of it say what types they have."""
    return importlib.import_module("distributed")


def told(error: BaseException | None) -> str:
    """An exception on one line."""
    said = " ".join(str(error).split())
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def _connected(address: str, timeout: float) -> Any:
    """A client of the scheduler, with distributed's log silenced; or InputError with a sentence."""
    try:
        client = distributed().Client
    except ModuleNotFoundError as error:
        raise InputError(
            f"a cluster needs the package distributed, which is not there ({error}): pip install 'kahanmaps[cluster]'"
        ) from None
    chosen = _scheduler(address)
    _SILENCE.begin()
    try:
        # A warning of other versions of some package: our tasks are the standard library's, whose version may differ.
        with warnings.catch_warnings(action="ignore"):
            make = partial(client, chosen, timeout=timeout, set_as_default=False, name="kahanmaps")
            try:
                return _in_time(make, timeout + 1)
            except AssertionError:  # distributed's own, where its thread did not run for ten seconds: a busy machine
                return _in_time(make, timeout + 1)
    except BaseException as error:
        _SILENCE.end()
        if isinstance(error, ImportError):  # the scheduler says that versions cannot go together
            sentence = f"the scheduler at {address} runs other versions than this client: {error}"
        elif isinstance(error, Exception):
            sentence = (
                f"no dask scheduler answers at {address} within {timeout:g} s ({told(error)}): "
                "is the address right, and does `dask scheduler` run there?"
            )
        else:
            raise
        raise InputError(sentence) from error


def _in_time(make: Callable[[], Any], seconds: float) -> Any:
    """What `make` returns. distributed itself waits for ever where something listens that is no scheduler."""
    made: Future[Any] = Future()

    def run() -> None:
        try:
            made.set_result(make())
        except BaseException as error:
            made.set_exception(error)

    threading.Thread(target=run, daemon=True).start()
    return made.result(seconds)


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


def _loss(error: BaseException) -> str:
    """Why the scheduler is lost, as briefly as can be: distributed puts a reason into every cancelled future."""
    found = re.search(r"reason: ([\w-]+)", str(error))
    reason = found.group(1) if found else told(error)
    return "the connection was closed" if reason == "scheduler-connection-lost" else reason


class _Silence:
    """Keeps the loggers of distributed from printing, while at least one executor is open."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._users = 0
        self._before: list[tuple[logging.Logger, list[logging.Handler], bool]] = []

    def begin(self) -> None:
        with self._lock:
            self._users += 1
            if self._users == 1:
                # Those that distributed makes later hand on to the first ones, which are silent by then.
                known = [name for name in logging.Logger.manager.loggerDict if name.split(".")[0] in _LOGGERS]
                for logger in map(logging.getLogger, sorted({*_LOGGERS, *known})):
                    self._before.append((logger, logger.handlers, logger.propagate))
                    logger.handlers, logger.propagate = [logging.NullHandler()], False

    def end(self) -> None:
        with self._lock:
            self._users -= 1
            while self._users == 0 and self._before:
                logger, handlers, propagate = self._before.pop()
                logger.handlers, logger.propagate = handlers, propagate


_SILENCE = _Silence()
