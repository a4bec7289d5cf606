"""Two processes find what one finds; what goes wrong in the second is done again in the first."""

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz_poly

from kahanmaps.algebra.polynomials import ring
from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.laboratory import analysis
from kahanmaps.laboratory.analyses import beside
from kahanmaps.laboratory.analyses.beside import CAN_FORK
from kahanmaps.laboratory.analyses.part import Of, Part, Run
from kahanmaps.laboratory.analyses.table import ANALYSES
from kahanmaps.laboratory.analysis import Analysis, analyze
from kahanmaps.laboratory.preserve.integrals import find_integrals

needs_fork = pytest.mark.skipif(not CAN_FORK, reason="a second process is for Linux")


@pytest.fixture(autouse=True)
def two_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysis, "processors", lambda: 2)


@pytest.fixture
def forked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The processes that are made: others may be left from other tests."""
    made, fork = list[int](), os.fork

    def noted() -> int:
        made.append(fork())
        return made[-1]

    monkeypatch.setattr("os.fork", noted)
    return made


def require_gone(forked: list[int]) -> None:
    assert forked or not CAN_FORK
    for process in forked:
        with pytest.raises(ChildProcessError):
            os.waitpid(process, os.WNOHANG)


def told(found: Analysis) -> dict[str, Any]:
    return found.to_json() | {"seconds": None}


@pytest.mark.parametrize("name", ["euler_top", "lotka_volterra", "hky", "paper_m2"])
def test_two_processes_find_what_one_finds(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = told(analyze(load(name)))
    done = beside.outcome

    def there(run: Run, part: Part) -> tuple[Any, str]:
        if CAN_FORK and os.getpid() == HERE:
            pytest.fail(f"{part.name} was done again here")
        return done(run, part)

    monkeypatch.setattr(beside, "outcome", there)
    assert told(analyze(load(name), processes=2)) == expected


def apart(name: str, look: Callable[..., Any]) -> Part:
    return Part(name, look, of=Of.EVERY, is_apart=True, json=lambda found: {name: found[name]})


def where(*_: Any, **__: Any) -> int:
    return os.getpid()


def killed_elsewhere(*_: Any, **__: Any) -> int:
    if os.getpid() != HERE:
        os.kill(os.getpid(), signal.SIGKILL)
    return os.getpid()


def failing(*_: Any, **__: Any) -> int:
    raise ZeroDivisionError("a mistake of ours")


def giving_up(*_: Any, **__: Any) -> int:
    raise InputError("too hard")


HERE = os.getpid()


class Signal:
    """Something that one process tells another."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def given(self, look: Callable[..., Any] = where) -> Callable[..., Any]:
        """`look`, but first it is told."""

        def told(*args: Any, **budget: Any) -> Any:
            self.path.touch()
            return look(*args, **budget)

        return told

    def awaited(self, look: Callable[..., Any] = where) -> Callable[..., Any]:
        """`look`, when it was told."""

        def waits(*args: Any, **budget: Any) -> Any:
            end = time.monotonic() + 60
            while not self.path.exists():
                assert time.monotonic() < end
                time.sleep(0.01)
            return look(*args, **budget)

        return waits


@pytest.fixture
def begun(tmp_path: Path) -> Signal:
    return Signal(tmp_path / "begun")


@pytest.fixture
def done(tmp_path: Path) -> Signal:
    return Signal(tmp_path / "done")


def here(name: str, look: Callable[..., Any] = where) -> Part:
    return replace(apart(name, look), is_apart=False)


@needs_fork
def test_parts_that_are_apart_are_done_elsewhere_and_the_others_here(begun: Signal) -> None:
    parts = [apart("first", begun.given()), here("second", begun.awaited())]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["first"] != os.getpid() == found["second"]
    assert not found.pending


@needs_fork
def test_who_is_free_takes_what_nobody_has_begun_with(begun: Signal, done: Signal) -> None:
    parts = [
        apart("long", begun.given(done.awaited())),
        apart("second", done.given()),
        here("first", begun.awaited()),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["long"] != found["first"] == found["second"] == os.getpid()


@needs_fork
def test_what_needs_something_that_is_apart_goes_with_it(begun: Signal, done: Signal) -> None:
    parts = [
        apart("long", begun.given(done.awaited())),
        replace(apart("after", lambda run, **_: (run.found["long"], os.getpid())), needs=("long",)),
        here("first", begun.awaited()),
        apart("other", done.given()),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["after"] == (found["long"], found["long"])
    assert found["long"] != found["other"] == os.getpid()


@needs_fork
def test_long_answers_keep_nobody_waiting(done: Signal) -> None:
    parts = [
        apart("long", lambda *_, **__: bytes(500_000)),
        apart("second", done.given()),
        here("first", done.awaited()),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert len(found["long"]) == 500_000
    assert found["second"] != os.getpid()


def test_very_many_parts_are_all_done() -> None:
    parts = [apart(f"part {k}", where) for k in range(300)]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert all(found[part.name] for part in parts)
    assert not found.pending


@needs_fork
def test_an_error_where_the_copy_begins_ends_the_copy_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(parent: int) -> None:
        raise SystemExit(1)

    monkeypatch.setattr(beside, "end_with_parent", failing)
    found = analyze(load("harmonic"), parts=[apart("first", where), here("second")], processes=2)
    assert found["first"] == found["second"] == os.getpid()


def test_what_comes_last_is_not_waited_for() -> None:
    def seen(run: Run, **_: Any) -> Any:
        return run.found["first"]

    parts = [here("first"), replace(here("second", seen), needs=("first",))]
    assert analyze(load("harmonic"), parts=parts)["second"] == os.getpid()
    parts[0] = replace(parts[0], slow_above=1)
    assert analyze(load("harmonic"), parts=parts)["second"] is None


def test_what_is_quick_is_done_when_the_time_is_over() -> None:
    parts = [here("first", lambda *_, **__: time.sleep(0.3)), here("second"), replace(here("third"), share=0)]
    found = analyze(load("harmonic"), parts=parts, seconds=0.1)
    assert found.skipped == ["second: the time was over"]
    assert found["third"] == os.getpid()


@pytest.mark.parametrize(("processes", "available"), [(1, 2), (2, 1)])
def test_with_one_process_or_processor_all_are_done_here(
    processes: int, available: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(analysis, "processors", lambda: available)
    assert analyze(load("harmonic"), parts=[apart("first", where)], processes=processes)["first"] == os.getpid()


@needs_fork
def test_what_has_come_is_taken_between_two_parts() -> None:
    def slow(*_: Any, **__: Any) -> int:
        time.sleep(0.5)
        return 0

    def seen(run: Run, **_: Any) -> tuple[Any, Any]:
        return run.found["first"], run.found["second"]

    parts = [apart("first", where), apart("second", where), here("third", slow), here("fourth", seen)]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["first"] != os.getpid()
    assert found["fourth"] == (found["first"], found["second"])


@needs_fork
def test_progress_is_told_here_of_what_is_waited_for(tmp_path: Path, begun: Signal) -> None:
    def look(run: Run, progress: Callable[[str], None], **_: Any) -> int:
        progress("halfway")
        time.sleep(0.2)
        return os.getpid()

    log = tmp_path / "log"
    log.touch()

    def told(text: str) -> None:
        with log.open("a") as file:
            file.write(f"{os.getpid()} {text}\n")

    parts = [apart("first", begun.given(look)), here("second", begun.awaited())]
    found = analyze(load("harmonic"), parts=parts, processes=2, progress=told)
    assert found["first"] != os.getpid()
    assert log.read_text().splitlines() == [f"{os.getpid()} second", f"{os.getpid()} first"]


@needs_fork
def test_an_interrupt_is_for_the_first_process(begun: Signal) -> None:
    def look(*_: Any, **__: Any) -> int:
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGINT)
        return os.getpid()

    parts = [apart("first", begun.given(look)), here("second", begun.awaited())]
    assert analyze(load("harmonic"), parts=parts, processes=2)["first"] != os.getpid()


INTERRUPTED = """
import os, signal
from kahanmaps.documents.catalog import load
from kahanmaps.laboratory import analysis

made, fork = [], os.fork

def interrupted():
    made.append(fork())
    if made[-1]:
        os.kill(os.getpid(), signal.SIGINT)
    return made[-1]

os.fork, analysis.processors = interrupted, lambda: 2
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    analysis.analyze(load("euler_top"), processes=2)
except KeyboardInterrupt:
    try:
        os.waitpid(made[0], os.WNOHANG)
    except ChildProcessError:
        print("gone")
"""


@needs_fork
def test_an_interrupt_while_a_process_is_made_leaves_none() -> None:
    # On its own: a process with other threads may be interrupted in any of them.
    assert subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True).stdout == "gone\n"


@needs_fork
def test_while_the_other_process_is_busy_all_else_is_done_here(begun: Signal, done: Signal) -> None:
    parts = [
        apart("long", begun.given(done.awaited())),
        here("first", begun.awaited()),
        replace(apart("second", where), needs=("first",)),
        replace(here("last", done.given(lambda run, **_: run.found["long"])), needs=("second",)),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["last"] is None
    assert found["long"] != found["first"] == found["second"] == os.getpid()


@pytest.mark.parametrize("processes", [1, 2])
def test_parts_given_twice_are_done_twice_and_those_in_a_circle_are_refused(processes: int) -> None:
    part = replace(apart("first", where), is_apart=False)
    assert analyze(load("harmonic"), parts=[part, part], processes=processes)["first"] == os.getpid()
    assert not analyze(load("harmonic"), parts=[apart("first", where)] * 2, processes=processes).pending
    after = replace(apart("after", where), needs=("first",))
    assert not analyze(load("harmonic"), parts=[apart("first", where)] * 2 + [after], processes=processes).pending
    second = replace(part, name="second", needs=("first",))
    with pytest.raises(ValueError, match="need each other: first, second"):
        analyze(load("harmonic"), parts=[replace(part, needs=("second",)), second], processes=processes)


@needs_fork
def test_the_second_process_ends_with_the_first_and_with_its_analysis(forked: list[int]) -> None:
    def sleeping(*_: Any, **__: Any) -> int:
        time.sleep(60)
        return 0

    began = time.monotonic()
    parts = [apart("first", sleeping), replace(apart("second", failing), is_apart=False)]
    with pytest.raises(ZeroDivisionError):
        analyze(load("harmonic"), parts=parts, processes=2)
    assert time.monotonic() - began < 30
    require_gone(forked)


@needs_fork
def test_who_waits_for_no_children_gets_an_analysis_too(begun: Signal) -> None:
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        parts = [apart("first", begun.given()), here("second", begun.awaited())]
        assert analyze(load("harmonic"), parts=parts, processes=2)["first"] != os.getpid()
    finally:
        signal.signal(signal.SIGCHLD, before)


@needs_fork
def test_what_a_killed_process_did_not_do_is_done_here(begun: Signal) -> None:
    parts = [
        apart("first", where),
        apart("second", begun.given(killed_elsewhere)),
        apart("third", where),
        here("fourth", begun.awaited()),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert found["first"] != os.getpid()
    assert found["second"] == found["third"] == os.getpid()
    assert found.skipped == []


def test_where_there_is_no_second_process_all_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> int:
        raise BlockingIOError("Resource temporarily unavailable")

    monkeypatch.setattr("os.fork", refused)
    found = analyze(load("harmonic"), parts=[apart("first", where), apart("second", where)], processes=2)
    assert found["first"] == found["second"] == os.getpid()


def test_mistakes_are_not_swallowed_and_no_process_is_left(forked: list[int]) -> None:
    with pytest.raises(ZeroDivisionError):
        analyze(load("harmonic"), parts=[apart("first", failing), apart("second", failing)], processes=2)
    require_gone(forked)


def test_a_part_that_gives_up_elsewhere_is_told() -> None:
    parts = [apart("first", giving_up), apart("second", where), replace(apart("third", giving_up), is_apart=False)]
    told: list[list[str]] = []
    found = analyze(load("harmonic"), parts=parts, processes=2, reached=lambda known: told.append(known.skipped))
    assert found.skipped == told[-1] == ["first: too hard", "third: too hard"]
    assert found["first"] is None


def without(chosen: list[Part]) -> list[Part]:
    return [part for part in ANALYSES if part not in chosen]


@cache
def whole(name: str) -> Analysis:
    return analyze(load(name))


def needed(names: tuple[str, ...]) -> list[Part]:
    """Those parts with what they need in turn."""
    return [one for part in ANALYSES if part.name in names for one in (*needed(part.needs), part)]


@pytest.mark.parametrize("needs", sorted({part.needs for part in ANALYSES if part.is_apart}))
@pytest.mark.parametrize("name", ["euler_top", "lorenz"])
def test_parts_that_are_apart_read_what_they_need_and_are_read_by_those_that_need_them(
    name: str, needs: tuple[str, ...]
) -> None:
    together = [part for part in ANALYSES if part.is_apart and part.needs == needs]
    readers = [part for part in ANALYSES if any(one.name in part.needs for one in together)]
    for checked, parts in (
        (together, [*needed(needs), *together]),
        (without(together + readers), without(together + readers)),
    ):
        kept = analyze(load(name), parts=parts)
        # What a reader adds to is not yet whole.
        checked = [part for part in checked if part.result not in {one.result for one in readers}]
        assert [part.name for part in checked if part.to_json(kept) != part.to_json(whole(name))] == []
        assert [str(kept[one.result]) for one in checked] == [str(whole(name)[one.result]) for one in checked]


def test_the_flow_of_a_polarised_map_is_part_of_the_report() -> None:
    found = whole("duffing_polarised")
    assert dict(found.sections)["the flow"]
    assert [line for line in found.skipped if "flow" in line or "limit" in line] == []


def test_without_integrals_there_is_nothing_of_the_flow() -> None:
    parts = [part for part in ANALYSES if part.result in ("flow", "densities")]
    found = analyze(load("euler_top"), parts=parts)
    assert (found.flow, found.skipped) == (None, [])


def test_integrals_of_members_are_counted_where_the_flow_is_looked_at() -> None:
    def none(run: Run, **_: Any) -> Any:
        found = find_integrals(run.bare)
        return replace(found, integrals=(), profile=replace(found.profile, nullities=()), by_theorems=0)

    parts = [replace(part, look=none) if part.name == "integrals" else part for part in ANALYSES]
    parts = [part for part in parts if part.result in ("hamiltonian", "normal_form", "integrals", "flow")]
    assert analyze(load("paper_m2"), parts=parts).flow.without_limit == 2


@needs_fork
def test_what_needs_others_waits_for_them_and_then_has_them(begun: Signal, done: Signal) -> None:
    def seen(*names: str) -> Callable[..., Any]:
        return lambda run, **_: (*(run.found[name] for name in names), os.getpid())

    parts = [
        replace(here("last", seen("first", "third")), needs=("first", "third")),
        apart("first", begun.given(done.awaited())),
        replace(apart("third", done.given(seen("second"))), needs=("second",)),
        here("second", begun.awaited()),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    me, first, (second, third) = os.getpid(), found["first"], found["third"]
    assert first != second == third == me
    assert found["last"] == (first, (me, me), me)


x, y = ring(["x", "y"]).gens()


@pytest.mark.parametrize(
    "value",
    [fmpq_mat(2, 1, [fmpq(1, 2), -3]), fmpq_poly([1, fmpq(2, 3)]), fmpz_poly([0, 5]), x**2 * y - y / 7, 0 * x],
)
def test_pickles(value: Any) -> None:
    again = pickle.loads(pickle.dumps(value))
    assert type(again) is type(value)
    assert again == value
    assert again + value == 2 * value
