"""heights, find-integrals and cycles over values of parameters, as degrees: a line for each, a record in JSON."""

import pytest

TABLES = {
    "heights henon_heiles -p c=-1..0 --steps 30": [
        "bit lengths grow quadratically on all 6",
        "bit lengths grow exponentially on all 6",
    ],
    "find-integrals henon_heiles -p c=-1..0": ["2 functionally independent", "1 functionally independent"],
    "cycles henon_heiles -p c=-1..0 --prime 11 --eps 3": ["longest cycle 45 modulo 11", "longest cycle 103 modulo 11"],
}


@pytest.mark.parametrize("line", TABLES)
def test_there_is_a_record_for_each_value(kahanmaps, line):
    command = line.split()[0]
    records = kahanmaps(f"{line} --json").records
    assert [one["command"] for one in records] == [command] * 2
    assert [one["document"]["parameters"]["c"] for one in records] == ["-1", "0"]
