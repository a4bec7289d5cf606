"""Orbits written from Python are those of the command, and are read back as they were."""

import csv
import json

import numpy as np
import pytest

import kahanmaps as km
from kahanmaps.checks.conserve import functions_along
from kahanmaps.documents.catalog import load

TOP = load("euler_top")
ARITHMETICS = ["exact", "float", "mod:101", "ball:100"]


def walk(arithmetic="exact", **options):
    orbit = km.orbit(TOP, [1, "1/2", "-1/3"], "1/10", **({"steps": 4} | options), arithmetic=arithmetic)
    orbit.integrals = functions_along(TOP, [("", "F1"), ("p", "1/(x1 - 1)")], arithmetic == "float")
    return orbit


def read(path):
    """The texts of the points in a file, and its first and last record."""
    if path.suffix == ".jsonl":
        header, *points, end = map(json.loads, path.read_text().splitlines())
        return [[str(entry) for entry in point["x"]] for point in points], header, end
    if path.suffix == ".csv":
        meta = json.loads(path.with_name("o.csv.meta.json").read_text())
        _, *rows = csv.reader(path.read_text().splitlines())
        return [row[1:4] for row in rows], meta["header"], meta["end"]
    with np.load(path) as held:
        meta, x = json.loads(str(held["meta"])), held["x"].tolist()
    return [[e.decode() if isinstance(e, bytes) else str(e) for e in row] for row in x], meta["header"], meta["end"]


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("ending", ["csv", "jsonl", "npz"])
def test_what_is_written_is_read_again(tmp_path, arithmetic, ending):
    path = tmp_path / f"o.{ending}"
    status = walk(arithmetic).write(path, name="top").status
    points, header, end = read(path)
    assert (status, end["status"], header["system"]) == ("completed", "completed", "top")
    assert points == [list(point.text) for point in walk(arithmetic)]


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_table_has_the_values_of_integrals_and_none_at_a_pole(arithmetic):
    rows = walk(arithmetic).rows()
    assert list(rows[0]) == ["step", *TOP.variables, "F1", "p"]
    assert rows[0]["p"] is None
    assert rows[1]["p"] is not None
    if arithmetic in ("exact", "mod:101"):
        assert len({row["F1"] for row in rows}) == 1
