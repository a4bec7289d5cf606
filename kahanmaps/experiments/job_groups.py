"""Groups of jobs that a cluster is sent, each a few seconds of work, by what the last tasks of the same kind took.

A group is plain text on its way out: what the command in `group` reads.
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import asdict, dataclass, field
from typing import NamedTuple

from kahanmaps.experiments.records import Documents, Limits, Task

START_UP = 60.0  # seconds a group may take beyond the limits of its jobs, on a cold and busy worker,
START_UP_OF_A_JOB = 5.0  # and for each job in it
LARGEST_TEXT = 1 << 20  # bytes in a group, of what is sent and of what is expected back: this bounds memory
MEMORY_OF_MEANS = 20  # a mean follows a batch that goes from cheap tasks to dear ones


class KeptJob(NamedTuple):
    """A job in flight, and how many tries of it alone have failed.

    Its canonical text is a quarter as large as the task with its dictionaries.
    """

    kind: str
    text: str
    limits: Limits
    tries: int = 0


@dataclass
class JobGroup:
    """Jobs that one command does, by key; what has come back is taken out."""

    jobs: dict[str, KeptJob] = field(default_factory=dict)
    documents: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    sent: int = 0  # bytes, about
    expected: float = 0.0  # bytes, about
    is_alone: bool = False  # so small that a failure is its only job's
    is_suspect: bool = False  # its worker died, again and again

    @property
    def timeout(self) -> float | None:
        """How long the command may take: what its jobs may, and a generous start; None if one of them is unlimited."""
        times = [job.limits.time for job in self.jobs.values()]
        return None if None in times else START_UP + sum((time or 0.0) + START_UP_OF_A_JOB for time in times)

    @property
    def text(self) -> bytes:
        """What the group command reads."""
        jobs = [{"task": job.text, "limits": asdict(job.limits)} for job in self.jobs.values()]
        return json.dumps({"documents": self.documents, "jobs": jobs}).encode()


class Grouping:
    """Fills groups to about `seconds` of work and at most `largest` jobs; `documents` gives the text of a document.

    `means` are of the records of each kind of task; one of which nothing is known takes a whole group's time.
    """

    def __init__(self, documents: Documents, seconds: float, largest: int) -> None:
        self._documents = documents
        self._group_seconds = seconds
        self._largest_group = largest
        self.means: defaultdict[str, Means] = defaultdict(lambda: Means(seconds))

    def fits(self, group: JobGroup, kind: str) -> bool:
        """Whether the group comes nearer to its time with a job of this kind, and stays within its size."""
        return (
            group.seconds + self.means[kind].seconds / 2 <= self._group_seconds
            and group.expected + self.means[kind].size <= LARGEST_TEXT
        )

    def is_full(self, group: JobGroup) -> bool:
        """Whether the group is to be sent without another job."""
        return (
            len(group.jobs) >= self._largest_group
            or group.seconds >= self._group_seconds
            or group.sent >= LARGEST_TEXT
            or group.expected >= LARGEST_TEXT
        )

    def add(self, group: JobGroup, task: Task, limits: Limits, tries: int = 0) -> None:
        """Put a job into the group, with the documents that it needs."""
        for wanted in task.documents:
            if wanted not in group.documents:
                group.documents[wanted] = self._documents(wanted)
                group.sent += len(group.documents[wanted])
        group.jobs[task.key] = KeptJob(task.kind, task.text, limits, tries)
        group.seconds += self.means[task.kind].seconds
        group.expected += self.means[task.kind].size
        group.sent += len(task.text)


@dataclass
class Means:
    """What a record of one kind of task takes, on average over the last ones."""

    seconds: float
    size: float = 0.0
    seen: int = 0

    def learn(self, seconds: float, size: int) -> None:
        """One record more."""
        self.seen = min(self.seen + 1, MEMORY_OF_MEANS)
        self.seconds += (seconds - self.seconds) / self.seen
        self.size += (size - self.size) / self.seen
