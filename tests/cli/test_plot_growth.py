"""kahanmaps plot degrees, plot heights and plot drift: records are drawn, and algebraic parameters rounded."""

import io
import json
import sys
from types import SimpleNamespace

import pytest


@pytest.fixture
def piped(monkeypatch):
    """Put text on standard input."""
    return lambda text: monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(text.encode())))


def test_degrees_of_a_record_are_the_same_picture(kahanmaps, tmp_path, piped):
    first, second = tmp_path / "a.png", tmp_path / "b.png"
    record = kahanmaps("degrees euler_top --json").out
    assert kahanmaps("plot degrees euler_top --size 4 -q -o", first).status == 0
    (tmp_path / "record.json").write_text(record)
    assert kahanmaps("plot degrees --size 4 -q --from", tmp_path / "record.json", "-o", second).status == 0
    piped(record)
    assert kahanmaps("plot degrees --from - --size 4 -q -o", tmp_path / "c.png").status == 0
    # The metadata tell the two commands; the pixels are the same.
    import matplotlib.image as image

    assert (image.imread(first) == image.imread(second)).all()
    assert (image.imread(first) == image.imread(tmp_path / "c.png")).all()


@pytest.mark.usefixtures("unrendered")
def test_a_record_of_an_incomplete_survey_is_reported(kahanmaps, tmp_path):
    record = kahanmaps("heights weierstrass --eps 1/10 --starts 1 --steps 20 --json").json
    (tmp_path / "r.json").write_text(json.dumps({**record, "complete": False}))
    done = kahanmaps("plot heights -o - --format svg --from", tmp_path / "r.json")
    assert (done.status, "stopped early" in done.err) == (3, True)
