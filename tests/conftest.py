"""Settings for all tests."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

# No deadline: exact numbers vary in size, and the time of one example with them, the more so on a busy machine; nor a
# complaint that examples are drawn slowly, which there is no reason for but the same. An identity of polynomials that
# is wrong fails at nearly every point, so that fifty say what hypothesis' hundred would.
settings.register_profile("kahanmaps", max_examples=50, deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("kahanmaps")

# What a shell without job control or nohup starts is deaf to these signals, and so is all that it starts itself.
for number, handler in [
    (signal.SIGINT, signal.default_int_handler),
    (signal.SIGQUIT, signal.SIG_DFL),
    (signal.SIGHUP, signal.SIG_DFL),
]:
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collecting makes half a million objects that stay to the end: no search for garbage among them, then or later.

    This saves a third of the time of collecting, and a tenth of that of the tests.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()
