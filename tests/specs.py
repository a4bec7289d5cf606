"""Short specs, and what is asked of specs in several files of tests."""

from typing import Any

import pytest

from kahanmaps.experiments.experiment import Experiment
from kahanmaps.experiments.results.records import Task
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
