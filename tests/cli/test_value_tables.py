"""heights, find-integrals and cycles over values of parameters, as degrees: a record for each in JSON."""

import pytest


@pytest.mark.parametrize(
    "line",
    [
        "heights henon_heiles -p c=-1..0 --steps 30",
        """find-integrals --rhs "x' = y; y' = c*x" -p c=-1..0""",
        "cycles henon_heiles -p c=-1..0 --prime 11 --eps 3",
    ],
)
def test_there_is_a_record_for_each_value(kahanmaps, line):
    command = line.split()[0]
    records = kahanmaps(f"{line} --json").records
    assert [one["command"] for one in records] == [command] * 2
    assert [one["document"]["parameters"]["c"] for one in records] == ["-1", "0"]
