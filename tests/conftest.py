"""Settings for all tests."""

import gc
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

# No deadline and no check for slow examples: the time of one example follows the size of its numbers and the load of
# the machine. A wrong identity of polynomials fails at nearly every point. Hence six examples suffice for every day,
# the first of them trivial (zeros); `make test-slow` takes fifty.
for profile, examples in [("quick", 6), ("thorough", 50)]:
    settings.register_profile(
        profile, max_examples=examples, deadline=None, suppress_health_check=[HealthCheck.too_slow]
    )
settings.load_profile("quick")

# What a shell without job control or nohup starts is deaf to these signals, and so is all that it starts itself.
for number, handler in [
    (signal.SIGINT, signal.default_int_handler),
    (signal.SIGQUIT, signal.SIG_DFL),
    (signal.SIGHUP, signal.SIG_DFL),
]:
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, handler)

ENTRIES = [line.split(" => ") for line in (Path(__file__).parent / "thorough.txt").read_text("utf-8").splitlines()]
THOROUGH = {f"{test}[{case}]" for test, *cases in ENTRIES for case in cases} | {e[0] for e in ENTRIES if len(e) == 1}


@pytest.hookimpl(tryfirst=True)  # before `-m` chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow the tests of thorough.txt, or the cases behind ` => `: their subjects have quicker tests as well.

    Public functions that were used before sessions are collected are found in `kahanmaps` as well as in their files,
    where the names of their sessions are known.
    """
    items[:] = [item for item in items if not item.nodeid.startswith("kahanmaps/__init__.py::kahanmaps.")]
    for item in items:
        if not THOROUGH.isdisjoint({item.nodeid, item.nodeid.split("[")[0]}):
            item.add_marker(pytest.mark.slow)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collecting makes half a million objects that stay to the end: no search for garbage among them, then or later.

    This saves a third of the time of collecting, and a tenth of that of the tests. What tests make is searched seldom:
    every 700 objects, as Python does it unasked, would take another twentieth.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(50_000)
        gc.enable()


@pytest.fixture(autouse=True)
def stopped_clock_of_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands run in this process print no progress: it appears after some seconds, so on a busy machine only."""
    monkeypatch.setattr("kahanmaps_cli.screen.progress.time", SimpleNamespace(monotonic=lambda: 0.0))


@pytest.fixture
def at_points_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Proof by expansion, which makes many a supported claim a proved one, has its own tests in test_certify.py."""
    monkeypatch.setattr("kahanmaps.checks.certify.expansion", lambda *_: None)
