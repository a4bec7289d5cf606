"""Kinds of tasks: a function registers itself, its signature says what it can be asked; modules are brought in."""

import sys
from typing import Any

import pytest
from flint import fmpq
from helpers import refuses

from kahanmaps.experiments import registry
from kahanmaps.experiments.options import VOCABULARY
from kahanmaps.experiments.registry import ENVIRONMENT, MEMBER, task, task_kind, task_kinds


@pytest.fixture(autouse=True)
def own_registry(monkeypatch):
    """What a test registers is gone after it."""
    task_kinds()
    monkeypatch.setattr(registry, "_KINDS", dict(registry._KINDS))


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """A folder of modules that can be imported, and are forgotten after the test."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


TASK = """
from kahanmaps.experiments.registry import task
@task("NAME")
def f(seed: int = 0):
    '''Do it.'''
    return {"seed": seed}
"""


def test_a_signature_says_what_a_task_can_be_asked():
    @task("a-task", needs=MEMBER)
    def f(system: Any, eps: Any, steps: int = 5, start: Any = None) -> dict[str, Any]:
        """Do it.\n\nAnd more."""
        return {}

    kind = task_kind("a-task")
    assert (kind.summary, kind.needs, kind.required) == ("Do it.", MEMBER, ("eps",))
    assert list(kind.options) == ["eps", "steps", "start"]
    assert all(kind.options[name] is VOCABULARY[name] for name in kind.options)
    assert dict(kind.defaults) == {"steps": 5, "start": None}


def test_a_task_is_done_with_what_its_options_stand_for():
    requested = {}

    @task("a-task")
    def f(system: Any, eps: Any, start: Any, at: Any, other: Any = None) -> dict[str, Any]:
        requested.update(locals())
        return {"verdict": "proved"}

    options = {"eps": "1/10", "start": "1/2,0", "at": None, "other": "a system"}
    assert task_kind("a-task").perform("S", options) == {"verdict": "proved"}
    expected = {"system": "S", "eps": fmpq(1, 10), "start": (fmpq(1, 2), fmpq(0)), "at": None, "other": "a system"}
    assert {name: requested[name] for name in expected} == expected


def test_an_unknown_task_is_refused_with_the_known_ones_and_a_suggestion():
    known = ", ".join(task_kinds())
    refuses(f"^there is no task 'orbot', expected one of {known}; did you mean orbit", task_kind, "orbot")


def test_tasks_of_ones_own_are_brought_in_by_the_environment(modules, monkeypatch):
    for name in ("one", "two"):
        (modules / f"own_{name}.py").write_text(TASK.replace("NAME", name))
    monkeypatch.setenv(ENVIRONMENT, "own_one,own_two")
    assert task_kind("two").perform(None, {"seed": 4}) == {"seed": 4}
    assert "one" in task_kinds()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "ModuleNotFoundError: No module named 'own_one'"),
        ("def f(:", "SyntaxError: invalid syntax"),
        (TASK.replace("NAME", "orbit"), "TypeError: there are two tasks with the name orbit"),
        (TASK.replace("seed", "sed"), "TypeError: task NAME: sed is not an option; did you mean seed"),
    ],
)
def test_a_module_that_cannot_be_imported_is_reported_in_a_sentence(modules, monkeypatch, text, words):
    if text is not None:
        (modules / "own_one.py").write_text(text)
    monkeypatch.setenv(ENVIRONMENT, "own_one")
    refuses(f"^{ENVIRONMENT} names the module own_one, which cannot be imported: {words}", task_kinds)
