"""Degrees read from what `kahanmaps degrees --json` wrote: the same ones, and nothing else."""

import pytest

from kahanmaps.documents.catalog import load
from kahanmaps.errors import InputError
from kahanmaps.laboratory.growth.degrees import degree_growth
from kahanmaps.plots.growth_records import degrees_of_record


@pytest.fixture(scope="module")
def found():
    return degree_growth(load("lotka_volterra").system, "1/7")


def test_what_is_read_is_what_was_written(found):
    assert degrees_of_record({"command": "degrees", "system": "lv", **found.to_json()}) == ("lv", found)


@pytest.mark.parametrize(
    "change",
    [
        {"degrees": []},
        {"degrees": [0]},
        {"degrees": [1, -1]},
        {"degrees": [1, 2.5]},
        {"degrees": [True]},
        {"degrees": [10**400]},
        {"degrees": "1, 2"},
        {"eps": "x"},
        {"lines": [{}]},
        {"seed": None},
    ],
)
def test_wrong_degrees_are_refused(found, change):
    with pytest.raises(InputError, match="record: found degrees that cannot be read"):
        degrees_of_record({"command": "degrees", "system": "lv", **found.to_json(), **change})


@pytest.mark.parametrize("record", [None, [], {}, {"command": "heights", "degrees": [1]}])
def test_another_record_is_refused(record):
    with pytest.raises(InputError, match="expected an object written by 'kahanmaps degrees --json'"):
        degrees_of_record(record)
