"""What a child makes of a task: what errors mean for the record, and that a limit of memory is the task's alone."""

import errno
import json
import sys

import pytest

from kahanmaps.errors import InputError
from kahanmaps.experiments.results.records import Outcome, Task
from kahanmaps.experiments.running.child import _answer, _failure, perform

SPACE = Task("family-space", {"family": {"draw": "eigenvalues", "m": 2, "seed": 0}}, {})


def raised(error: Exception, cause: Exception | None = None, context: Exception | None = None) -> Exception:
    """The error as it arrives: raised from a cause, or while another one was handled."""
    error.__cause__, error.__context__ = cause, context
    return error


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
        ImportError("libgmp.so: failed to map segment from shared object"),
        ImportError("libflint.so: cannot allocate memory in static TLS block"),
        raised(InputError("found no numbers"), cause=MemoryError()),
        raised(ValueError("no value"), context=MemoryError()),
        raised(ValueError("no value"), context=raised(KeyError("x"), context=OSError(errno.ENOMEM, "no memory"))),
    ],
)
def test_an_error_that_comes_of_a_want_of_memory_is_told_as_such(error: Exception):
    assert _failure(error) == {"outcome": Outcome.OUT_OF_MEMORY, "message": "out of memory"}


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.EIO, "Input/output error"),
        ImportError("No module named 'numbers_of_mine'"),
        ValueError("cannot allocate memory"),  # somebody's words, not the system's
        raised(KeyError("x"), context=ValueError("y")),
    ],
)
def test_any_other_error_is_a_failure_with_its_traceback(error: Exception):
    found = _failure(error)
    assert found["outcome"] is Outcome.FAILED
    assert found["message"].startswith(f"{type(error).__name__}: ")
    assert "stderr" in found


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is no limit of memory")
def test_the_limit_of_memory_ends_with_the_task_so_that_its_result_can_be_told():
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    try:
        done = perform(SPACE, 1 << 40, {})
        after = resource.getrlimit(resource.RLIMIT_AS)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    assert done["outcome"] is Outcome.OK
    assert after == (before[1], before[1])


@pytest.mark.parametrize("verdict", [["proved"], 1, True])
def test_a_verdict_that_is_no_text_is_a_failure_of_the_task(monkeypatch, verdict):
    monkeypatch.setattr("kahanmaps.experiments.running.child._result", lambda task, documents: {"verdict": verdict})
    done = perform(SPACE, None, {})
    assert (done["outcome"], done["message"]) == (
        Outcome.FAILED,
        f"found the verdict {verdict}, expected a text",
    )


def test_what_json_lacks_is_a_failure_of_the_task():
    told = json.loads(_answer({"key": "k", "outcome": Outcome.OK, "result": {"value": float("inf")}}))
    assert (told["key"], told["outcome"]) == ("k", "failed")
    assert told["message"].startswith("the result cannot be kept: ")
