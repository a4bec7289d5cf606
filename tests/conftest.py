"""Settings for all tests."""

from __future__ import annotations

from hypothesis import settings

# No deadline: exact numbers vary in size, and the time of one example with them, the more so on a busy machine.
settings.register_profile("kahanmaps", deadline=None)
settings.load_profile("kahanmaps")
