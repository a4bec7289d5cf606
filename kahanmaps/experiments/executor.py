"""What runs tasks: the interface that `run` drives, whether the children are here or on a cluster."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from kahanmaps.experiments.records import Job, Record

# digest of a system document -> its canonical text
Documents = Callable[[str], str]


class Executor(Protocol):
    """Takes jobs while it is `free`, hands back records in `wait`; never raises for what happens inside a task."""

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""

    @property
    def in_flight(self) -> int:
        """How many jobs have been submitted and not yet handed back."""

    def submit(self, job: Job) -> None:
        """Take a job. Its record comes out of `wait` some time."""

    def wait(self, timeout: float) -> list[Record]:
        """Records that are ready, as soon as there is one, or none after `timeout` seconds."""

    def close(self) -> None:
        """End at once: whatever is in flight is killed and forgotten. May be called twice."""
