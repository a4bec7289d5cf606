"""Two processes find what one finds; what goes wrong in the second is done again in the first."""

import os
import pickle
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from flint import fmpq, fmpq_mat, fmpq_poly, fmpz_poly

import kahanmaps.algebra.written.pickles  # noqa: F401
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


@needs_fork
def test_parts_that_are_apart_are_done_elsewhere_and_the_others_here() -> None:
    here = replace(apart("second", where), is_apart=False)
    found = analyze(load("harmonic"), parts=[apart("first", where), here], processes=2)
    assert found["first"] != os.getpid() == found["second"]
    assert not found.pending


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

    here = [replace(apart(name, look), is_apart=False) for name, look in (("third", slow), ("fourth", seen))]
    found = analyze(load("harmonic"), parts=[apart("first", where), apart("second", where), *here], processes=2)
    assert found["first"] != os.getpid()
    assert found["fourth"] == (found["first"], found["second"])


@needs_fork
def test_progress_is_told_here_of_what_is_waited_for(tmp_path: Path) -> None:
    def look(run: Run, progress: Callable[[str], None], **_: Any) -> int:
        progress("halfway")
        time.sleep(0.2)
        return os.getpid()

    log = tmp_path / "log"
    log.touch()

    def told(text: str) -> None:
        with log.open("a") as file:
            file.write(f"{os.getpid()} {text}\n")

    found = analyze(load("harmonic"), parts=[apart("first", look)], processes=2, progress=told)
    assert found["first"] != os.getpid()
    assert log.read_text().splitlines() == [f"{os.getpid()} first"]


@needs_fork
def test_an_interrupt_is_for_the_first_process() -> None:
    def look(*_: Any, **__: Any) -> int:
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGINT)
        return os.getpid()

    assert analyze(load("harmonic"), parts=[apart("first", look)], processes=2)["first"] != os.getpid()


@needs_fork
def test_an_interrupt_while_a_process_is_made_leaves_none(forked: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    fork = os.fork

    def interrupted() -> int:
        made = fork()
        if made:
            os.kill(os.getpid(), signal.SIGINT)
        return made

    monkeypatch.setattr("os.fork", interrupted)
    with pytest.raises(KeyboardInterrupt):
        analyze(load("harmonic"), parts=[apart("first", lambda *_, **__: time.sleep(60))], processes=2)
    require_gone(forked)


@needs_fork
def test_the_answer_that_comes_first_is_taken_first() -> None:
    def slow(*_: Any, **__: Any) -> int:
        time.sleep(3)
        return 0

    parts = [
        apart("slow", slow),
        replace(apart("here", where), is_apart=False),
        replace(apart("quick", where), needs=("here",)),
        replace(apart("last", lambda run, **_: run.found["slow"]), is_apart=False, needs=("quick",)),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    assert (found["slow"], found["last"]) == (0, None)
    assert len({found["here"], found["quick"]}) == 2


@pytest.mark.parametrize("processes", [1, 2])
def test_parts_given_twice_are_done_twice_and_those_in_a_circle_are_refused(processes: int) -> None:
    part = replace(apart("first", where), is_apart=False)
    assert analyze(load("harmonic"), parts=[part, part], processes=processes)["first"] == os.getpid()
    assert not analyze(load("harmonic"), parts=[apart("first", where)] * 2, processes=processes).pending
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
def test_who_waits_for_no_children_gets_an_analysis_too() -> None:
    before = signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        assert analyze(load("harmonic"), parts=[apart("first", where)], processes=2)["first"] != os.getpid()
    finally:
        signal.signal(signal.SIGCHLD, before)


@needs_fork
def test_what_a_killed_process_did_not_do_is_done_here() -> None:
    parts = [apart("first", where), apart("second", killed_elsewhere), apart("third", where)]
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
        analyze(load("harmonic"), parts=[apart("first", failing)], processes=2)
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
def test_what_needs_others_waits_for_them_and_then_has_them() -> None:
    def slow(*_: Any, **__: Any) -> int:
        time.sleep(0.3)
        return os.getpid()

    def seen(*names: str) -> Callable[..., Any]:
        return lambda run, **_: (*(run.found[name] for name in names), os.getpid())

    parts = [
        replace(apart("last", seen("first", "third")), is_apart=False, needs=("first", "third")),
        apart("first", slow),
        replace(apart("third", seen("second")), needs=("second",)),
        replace(apart("second", where), is_apart=False),
    ]
    found = analyze(load("harmonic"), parts=parts, processes=2)
    here, first, (second, third) = os.getpid(), found["first"], found["third"]
    assert len({here, first, third}) == 3
    assert second == here
    assert found["last"] == (first, (here, third), here)


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
