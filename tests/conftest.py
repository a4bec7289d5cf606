"""Settings for all tests."""

from __future__ import annotations

from hypothesis import HealthCheck, settings

# No deadline: exact numbers vary in size, and the time of one example with them, the more so on a busy machine; nor a
# complaint that examples are drawn slowly, which there is no reason for but the same.
settings.register_profile("kahanmaps", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("kahanmaps")
