"""Fixtures that several files of tests share."""

from __future__ import annotations

from pathlib import Path

import pytest

from kahanmaps.experiments.store import Store


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "results.db"


@pytest.fixture
def store(path):
    with Store.open(path, create=True) as store:
        yield store
