"""The data types of a batch: tasks and their keys, limits, and records of the outcomes of tasks.

All of them consist of plain data that JSON can represent, since they are sent between processes and stored in
databases. Matrices and polynomials of FLINT can be neither sent nor stored. The key of a task is a hash of its
canonical text, so that equal tasks have equal keys in every batch and on every machine.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from functools import cached_property
from hashlib import sha256
from typing import Any, Protocol

_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"), allow_nan=False)
# A function that maps the digest of a system document to the canonical text of the document.
Documents = Callable[[str], str]

KEY_LENGTH = 32  # number of hexadecimal digits: with 128 bits collisions are negligible


def canonical(data: Any) -> str:
    """Return plain data as canonical JSON: sorted keys, no spaces, ASCII.

    >>> canonical({"m": 2, "eps": "1/10"})
    '{"eps":"1/10","m":2}'
    """
    return _ENCODER.encode(data)


def digest(text: str) -> str:
    """Return the hash of a canonical text, which identifies a task or a document."""
    return sha256(text.encode()).hexdigest()[:KEY_LENGTH]


def encodable(text: str) -> str:
    """Return the text with lone surrogates escaped: file names and output of workers need not be valid UTF-8."""
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()


@dataclass(frozen=True)
class Task:
    """A task: the name of its kind, the spec of its system, and a value for each of its options.

    `system` is {"family": {"m": 3, "seed": 7, ...}}, or {"document": DIGEST, "name": ..., "parameters": {...}}, or None
    for tasks without a system. `options` are canonical: a value for every option of the kind of task, with numbers as
    exact text.

    >>> Task("orbit", {"family": {"m": 2}}, {"eps": "1/10"}).key
    'aaf89ac6cf9009846f5b9932af33dd31'
    """

    kind: str
    system: Mapping[str, Any] | None
    options: Mapping[str, Any]

    @cached_property
    def text(self) -> str:
        """The canonical text of the task, from which `from_text` restores it."""
        return canonical({"task": self.kind, "system": self.system, "options": self.options})

    @cached_property
    def key(self) -> str:
        """The hash of the canonical text of the task."""
        return digest(self.text)

    @property
    def documents(self) -> list[str]:
        """The digests of the documents of the system of the task, and of a second system if there is one."""
        specs = (self.system, self.options.get("other"))
        return [spec["document"] for spec in specs if isinstance(spec, Mapping) and "document" in spec]

    @classmethod
    def from_text(cls, text: str) -> Task:
        """Return the task from its canonical text."""
        data = json.loads(text)
        return cls(data["task"], data["system"], data["options"])

    def value(self, name: str) -> Any:
        """Return the value of the option or system spec entry called `name`, such as parameters.a; None if absent."""
        if name in self.options:
            return self.options[name]
        spec = self.system or {}
        if name.startswith("parameters."):
            return spec.get("parameters", {}).get(name.removeprefix("parameters."))
        return spec.get("family", {}).get(name)


def system_words(spec: Mapping[str, Any] | None) -> str:
    """Return the spec of a system as readable text.

    >>> system_words({"document": "51b2", "name": "euler_top", "parameters": {"a1": "1/2"}}), system_words(None)
    ('euler_top a1=1/2', '-')
    """
    if spec is None:
        return "-"
    if "family" in spec:
        return "family " + option_words(spec["family"])
    return f"{spec.get('name', spec['document'])} {option_words(spec['parameters'])}".rstrip()


def option_words(values: Mapping[str, Any]) -> str:
    """Return options as text, such as m=3 seed=0 size=null."""
    return " ".join(f"{name}={v if isinstance(v, str) else json.dumps(v)}" for name, v in values.items())


@dataclass(frozen=True)
class TaskLimits:
    """Limits of one task, None for no limit: `time` in seconds, `memory` in bytes beyond the memory of an idle worker.

    Limits are not part of the task or its key: a task that exceeded its time limit may be run again with a larger one.
    """

    time: float | None = None
    memory: int | None = None


@dataclass(frozen=True)
class Job:
    """A task to be run, with its limits."""

    task: Task
    limits: TaskLimits = TaskLimits()


class Outcome(StrEnum):
    """The outcome of a task: `ok` (even if a check refutes its claim) or a kind of failure.

    `lost` means that the worker was killed from outside in every attempt. This outcome is never stored: the task
    remains without a result.
    """

    OK = "ok"
    FAILED = "failed"
    CRASHED = "crashed"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out-of-memory"
    LOST = "lost"


VERDICTS = ("proved", "supported", "refuted", "undecided")  # verdicts of checks; tasks of users may have others
STORED_OUTCOMES = tuple(outcome for outcome in Outcome if outcome is not Outcome.LOST)  # outcomes of stored results


@dataclass(frozen=True)
class Record:
    """The record of a task: its outcome, its result, its cost, and where it was run.

    `result` is plain data, None unless the outcome is ok; `verdict` is that of a check. `message` explains a failure,
    and `stderr` is the end of the output of the worker. `seconds` and `peak_memory` (bytes; None: unknown) are those of
    this task alone. `host`, `versions` and `finished` (UTC, ISO 8601) say where and when the task was run.
    """

    key: str
    outcome: Outcome
    result: Mapping[str, Any] | None = None
    verdict: str | None = None
    message: str = ""
    stderr: str = ""
    seconds: float = 0.0
    peak_memory: int | None = None
    host: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    finished: str = ""

    @property
    def is_ok(self) -> bool:
        """Whether the task was completed."""
        return self.outcome is Outcome.OK

    def to_json(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return {**asdict(self), "outcome": str(self.outcome)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Record:
        """Return the record that `to_json` wrote."""
        return cls(**{**data, "outcome": Outcome(data["outcome"])})


@dataclass(frozen=True)
class Row:
    """A row of a plan: experiment, number (from 0), task, and the record of the task, None if it is missing."""

    experiment: str
    number: int
    task: Task
    record: Record | None


class Executor(Protocol):
    """An executor of jobs: `submit` takes one while `is_free` is true; `wait` returns records, also of failed tasks."""

    @property
    def is_free(self) -> bool:
        """Whether one more job may be submitted now."""

    @property
    def in_flight(self) -> int:
        """The number of submitted jobs whose records have not been returned yet."""

    def submit(self, job: Job) -> None:
        """Accept a job; `wait` will return its record."""

    def wait(self, timeout: float) -> list[Record]:
        """Return the records of finished jobs as soon as there is one; an empty list after `timeout` seconds."""

    def close(self) -> None:
        """Kill all jobs in flight without waiting for them. Closing twice has no effect."""
