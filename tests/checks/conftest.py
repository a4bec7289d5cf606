"""Fixtures that several files of tests share."""

import pytest

from kahanmaps.checks import certify


@pytest.fixture
def at_points_only(monkeypatch):
    """Proof by expansion, which makes many a supported claim a proved one, has its own tests in test_certify.py."""
    monkeypatch.setattr(certify, "expansion", lambda *_: None)
