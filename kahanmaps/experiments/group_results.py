"""What has become of a group of jobs: the records that its command printed, and why there are no more of them."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime

from kahanmaps.experiments.dask_client import Result, distributed, told
from kahanmaps.experiments.endings import ending
from kahanmaps.experiments.records import Outcome, Record

TAIL = 2000  # characters of standard error kept


@dataclass(frozen=True)
class Failure:
    """Why a group ended without all its records.

    A task has a process of its own below the group command, whose limits the command keeps and whose death it tells in
    a record: so what becomes of the command itself is the machine's doing, and no result. `is_unfit`: it ended by
    itself, as if it could not be run at all; `is_the_workers`: they died, and it with them.
    """

    message: str
    stderr: str
    is_unfit: bool = False
    is_the_workers: bool = False

    def record(self, key: str) -> Record:
        """The record of a job that is not tried again."""
        return Record(
            key,
            Outcome.LOST,
            message=self.message,
            stderr=self.stderr,
            finished=datetime.now(UTC).isoformat(timespec="seconds"),
        )


def record_on(line: bytes) -> Record | None:
    """The record on a line; None if it is something else, such as the half of one."""
    if not line.startswith(b"{"):
        return None
    try:
        return Record.from_json(json.loads(line))
    except (ValueError, TypeError, LookupError):
        return None


def failure_of(result: Result, timeout: float | None) -> Failure:
    """Why a group ended without all its records; `timeout` is the one that its command had."""
    process, error = result.process, result.error
    stderr = result.stderr.decode(errors="replace")[-TAIL:]
    if process is not None:
        status = process.returncode
        message = f"the worker's command {ending(status)}" + (" and no record" if status == 0 else "")
        return Failure(message, stderr, is_unfit=status >= 0)
    if isinstance(error, subprocess.TimeoutExpired):
        message = f"the worker's command did not end within {timeout or 0:g} s"
        return Failure(message, stderr)
    if isinstance(error, distributed().KilledWorker):
        message = f"{error.allowed_failures + 1} workers died one after the other while they ran it"
        return Failure(message, stderr, is_the_workers=True)
    return Failure(f"the worker could not run its command: {told(error)}", stderr, is_unfit=True)
