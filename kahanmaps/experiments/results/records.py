"""What a batch is made of: tasks with their keys, limits, and the records of what became of them.

All of it is plain data that JSON holds, because it crosses processes and lies in databases: matrices and polynomials of
FLINT do neither. The key of a task is a hash of its canonical text, so that the same question has the same key in every
batch, on every machine.
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
# digest of a system document -> its canonical text
Documents = Callable[[str], str]

KEY_LENGTH = 32  # hexadecimal digits: 128 bits, no two tasks will ever share them


def canonical(data: Any) -> str:
    """Plain data as JSON that is the same wherever it is written: sorted names, no spaces, ASCII.

    >>> canonical({"m": 2, "eps": "1/10"})
    '{"eps":"1/10","m":2}'
    """
    return _ENCODER.encode(data)


def digest(text: str) -> str:
    """The hash by which tasks and documents are known."""
    return sha256(text.encode()).hexdigest()[:KEY_LENGTH]


def encodable(text: str) -> str:
    """The text, with lone surrogates spelled out: a file name or what a child printed may be no UTF-8."""
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()


@dataclass(frozen=True)
class Task:
    """One question: `kind` names the task, `system` says how to come by the system, `options` has every option.

    `system` is {"family": {"m": 3, "seed": 7, ...}}, or {"document": DIGEST, "name": ..., "parameters": {...}}, or None
    for tasks without a system. `options` are canonical: all that the kind of task knows, numbers as exact text.

    >>> Task("orbit", {"family": {"m": 2}}, {"eps": "1/10"}).key
    'aaf89ac6cf9009846f5b9932af33dd31'
    """

    kind: str
    system: Mapping[str, Any] | None
    options: Mapping[str, Any]

    @cached_property
    def text(self) -> str:
        """The canonical text, from which `from_text` makes the task again."""
        return canonical({"task": self.kind, "system": self.system, "options": self.options})

    @cached_property
    def key(self) -> str:
        """The hash of the canonical text."""
        return digest(self.text)

    @property
    def documents(self) -> list[str]:
        """The digests of the documents that it needs, those of its system and of a second one."""
        system_spec = (self.system, self.options.get("other"))
        return [recipe["document"] for recipe in system_spec if isinstance(recipe, Mapping) and "document" in recipe]

    @classmethod
    def from_text(cls, text: str) -> Task:
        """The task with this canonical text."""
        data = json.loads(text)
        return cls(data["task"], data["system"], data["options"])

    def value(self, name: str) -> Any:
        """The option, or the piece of the system's recipe, of this name: m, seed, eps, parameters.a; None if absent."""
        if name in self.options:
            return self.options[name]
        recipe = self.system or {}
        if name.startswith("parameters."):
            return recipe.get("parameters", {}).get(name.removeprefix("parameters."))
        return recipe.get("family", {}).get(name)


def system_words(recipe: Mapping[str, Any] | None) -> str:
    """A recipe of a system as people read it.

    >>> system_words({"document": "51b2", "name": "euler_top", "parameters": {"a1": "1/2"}}), system_words(None)
    ('euler_top a1=1/2', '-')
    """
    if recipe is None:
        return "-"
    if "family" in recipe:
        return "family " + option_words(recipe["family"])
    return f"{recipe.get('name', recipe['document'])} {option_words(recipe['parameters'])}".rstrip()


def option_words(values: Mapping[str, Any]) -> str:
    """Names with their values: m=3 seed=0 size=null."""
    return " ".join(f"{name}={v if isinstance(v, str) else json.dumps(v)}" for name, v in values.items())


@dataclass(frozen=True)
class TaskLimits:
    """What one task may take: `time` in seconds, `memory` in bytes beyond what an idle child has; None: no limit.

    Limits do not belong to a task and not to its key: a task that ran out of time may be tried again with more.
    """

    time: float | None = None
    memory: int | None = None


@dataclass(frozen=True)
class Job:
    """A task to be done, within limits."""

    task: Task
    limits: TaskLimits = TaskLimits()


class Outcome(StrEnum):
    """What became of a task. Everything but `ok` is a failure of the task, not of a claim: that is its verdict.

    `lost` is no result: what did the task was killed from outside at every try. No database has it, and the task stays
    without a result.
    """

    OK = "ok"
    FAILED = "failed"
    CRASHED = "crashed"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out-of-memory"
    LOST = "lost"


VERDICTS = ("proved", "supported", "refuted", "undecided")  # of checks; tasks of one's own may have others
KEPT = tuple(outcome for outcome in Outcome if outcome is not Outcome.LOST)  # the outcomes of results


@dataclass(frozen=True)
class Record:
    """What became of one task, and where and how.

    `result` is plain data, None unless the outcome is ok; `verdict` is that of a check. `message` says what happened
    otherwise, `stderr` is the end of what the child printed. `seconds` and `peak_memory` (bytes, None: not known) are
    those of the task alone; `host`, `versions` and `finished` (UTC, ISO 8601) say where and when.
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
        """Whether the task was done."""
        return self.outcome is Outcome.OK

    def to_json(self) -> dict[str, Any]:
        """The record as plain data."""
        return {**asdict(self), "outcome": str(self.outcome)}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Record:
        """The record that `to_json` wrote."""
        return cls(**{**data, "outcome": Outcome(data["outcome"])})


@dataclass(frozen=True)
class Row:
    """A task in its place: experiment, number in it (from 0), and its record, None while it is missing."""

    experiment: str
    number: int
    task: Task
    record: Record | None


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
