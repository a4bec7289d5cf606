"""Short specs, what is asked of them, and tasks as a child does them, for several files of tests."""

import json
from typing import Any

import pytest

from kahanmaps.documents.files import SystemFile
from kahanmaps.experiments.experiment import Experiment
from kahanmaps.experiments.registry import task_kind
from kahanmaps.experiments.results.records import Task, canonical
from kahanmaps.experiments.results.system_spec import spec_of, system_from
from kahanmaps.experiments.spec import SpecError, parse_spec

LORENZ = '[experiments.a]\ntask = "orbit"\nsystem = "lorenz"\n'
FAMILY = '[experiments.a]\ntask = "orbit"\nsystem = "family"\n'
COMMUTE = '[experiments.a]\ntask = "check-commute"\n'
SPACE = '[experiments.a]\ntask = "family-space"\n'
ROTOR = 'variables = ["x", "y"]\n[parameters]\na = "2"\n[system]\nrhs = ["a*y", "-x*y"]\n'


def only(text: str, **keywords: Any) -> Experiment:
    """The one experiment of a spec."""
    (experiment,) = parse_spec(text, **keywords).experiments
    return experiment


def tasks(text: str, **keywords: Any) -> list[Task]:
    return list(only(text, **keywords).tasks())


def task_of(text: str, **keywords: Any) -> Task:
    (task,) = tasks(text, **keywords)
    return task


def option(text: str, name: str) -> list[Any]:
    """One option of all tasks, in order."""
    return [task.value(name) for task in tasks(text)]


def mistakes(text: str | bytes, **keywords: Any) -> list[tuple[str, str]]:
    with pytest.raises(SpecError) as caught:
        parse_spec(text, **keywords)
    assert caught.value.mistakes
    return list(caught.value.mistakes)


def keys(text: str | bytes, **keywords: Any) -> list[str]:
    return [key for key, _ in mistakes(text, **keywords)]


def made(file: SystemFile) -> SystemFile:
    """The system as a child has it: from the recipe of the file."""
    documents: dict[str, str] = {}
    return system_from(spec_of(file, documents), documents.__getitem__)


def member(m: int = 2, seed: int = 1, **recipe: Any) -> SystemFile:
    return system_from({"family": {"draw": "eigenvalues", "m": m, "seed": seed, **recipe}}, {}.__getitem__)


def perform(name: str, system: SystemFile | None, **requested: Any) -> dict[str, Any]:
    """What a task gives, with the defaults of its kind for what is not asked; it has to be plain data."""
    kind = task_kind(name)
    given = {key: value if key == "other" else kind.options[key].read(value) for key, value in requested.items()}
    result = kind.perform(system, {**kind.defaults, **given})
    assert json.loads(canonical(result)) == result
    return result
