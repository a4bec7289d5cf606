"""Kinds of tasks: a function registers itself, its signature says what it can be asked; others' modules are brought in.

Tests register names of their own and take them away again: the registry is one for the whole process.
"""

import sys
from pathlib import Path
from typing import Any

import pytest
from flint import fmpq

from kahanmaps.errors import InputError
from kahanmaps.experiments import registry
from kahanmaps.experiments.options import VOCABULARY
from kahanmaps.experiments.registry import ENVIRONMENT, MEMBER, task, task_kind, task_kinds

LIBRARY = (
    "check-commute", "check-integrals", "check-measure", "check-poisson", "verify", "verify-universal", "family-space",
    "orbit", "ensemble", "heights", "period", "degrees", "find-integrals", "find-density", "find-poisson",
    "find-symmetry", "find-commuting", "analyze", "singularities", "cycles", "lyapunov",
)  # fmt: skip


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


def named(folder: Path, monkeypatch: pytest.MonkeyPatch, **texts: str) -> None:
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.setenv(ENVIRONMENT, ",".join(texts))


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
        """Do it.

        And more.
        """
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
    with pytest.raises(InputError) as caught:
        task_kind("orbot")
    assert str(caught.value).startswith("there is no task 'orbot', expected one of ")
    assert str(caught.value).endswith("; did you mean orbit?")
    assert all(name in str(caught.value) for name in LIBRARY)


def test_tasks_of_ones_own_are_brought_in_by_the_environment(modules, monkeypatch):
    named(modules, monkeypatch, own_one=TASK.replace("NAME", "one"), own_two=TASK.replace("NAME", "two"))
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
        named(modules, monkeypatch, own_one=text)
    monkeypatch.setenv(ENVIRONMENT, "own_one")
    with pytest.raises(InputError) as caught:
        task_kinds()
    assert str(caught.value).startswith(f"{ENVIRONMENT} names the module own_one, which cannot be imported: {words}")
