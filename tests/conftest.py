"""Settings for all tests."""

import gc
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# No deadline: exact numbers vary in size, and the time of one example with them, the more so on a busy machine; nor a
# complaint that examples are drawn slowly, which there is no reason for but the same. An identity of polynomials that
# is wrong fails at nearly every point, so that ten say what hypothesis' hundred would; `make test-slow`
# takes fifty.
for profile, examples in [("quick", 10), ("thorough", 50)]:
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

THOROUGH = frozenset((Path(__file__).parent / "thorough.txt").read_text(encoding="utf-8").splitlines())


WRONGLY_LEFT = pytest.StashKey[list[str]]()


@pytest.hookimpl(tryfirst=True)  # before `-m` chooses
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests and cases that thorough.txt names: dear ones, whose subject has quicker tests as well."""
    daily = dict[str, int]()
    for item in items:
        test = item.nodeid.split("[")[0]
        if not THOROUGH.isdisjoint({item.nodeid, test}):
            item.add_marker(pytest.mark.slow)
            item.add_marker(pytest.mark.thorough)
        daily[test] = daily.get(test, 0) + (item.get_closest_marker("slow") is None)
    if not any("::" in argument for argument in config.args):
        cases = {name for name in THOROUGH if "[" in name and name.split("[")[0] in daily}
        stale = cases - {item.nodeid for item in items}
        config.stash[WRONGLY_LEFT] = sorted(stale | {name for name in cases if not daily[name.split("[")[0]]})


@pytest.fixture
def wrongly_left(pytestconfig: pytest.Config) -> list[str]:
    """Lines of thorough.txt, as far as tests were collected, that name no case or leave no case to each day."""
    return pytestconfig.stash.get(WRONGLY_LEFT, [])


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
