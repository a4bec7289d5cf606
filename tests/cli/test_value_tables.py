"""heights, find-integrals and cycles over values of parameters, as degrees: a line for each, a record in JSON."""

from __future__ import annotations

import pytest

TABLES = {
    "heights henon_heiles -p c=-1..0 --steps 30": [
        "bit lengths grow quadratically on all 6",
        "bit lengths grow exponentially on all 6",
    ],
    "find-integrals henon_heiles -p c=-1..0": ["2 functionally independent", "1 functionally independent"],
    "cycles henon_heiles -p c=-1..0 --prime 11 --eps 3": ["longest cycle 45 modulo 11", "longest cycle 103 modulo 11"],
}


@pytest.mark.parametrize(("line", "expected"), TABLES.items())
def test_there_is_a_line_for_each_value(kahanmaps, line, expected):
    outcome = kahanmaps(line)
    rows = [row.split("\t") for row in outcome.out.splitlines()]
    assert [row[0] for row in rows] == ["c = -1", "c = 0"]
    assert all(row[1].startswith(words) for row, words in zip(rows, expected, strict=True))


@pytest.mark.parametrize("line", TABLES)
def test_there_is_a_record_for_each_value(kahanmaps, line):
    command = line.split()[0]
    records = kahanmaps(f"{line} --json").records
    assert [one["command"] for one in records] == [command] * 2
    assert [one["document"]["parameters"]["c"] for one in records] == ["-1", "0"]


def test_several_ranges_are_combined(kahanmaps):
    line = """cycles --rhs "x' = a*x*y; y' = b*x^2" -p a=1..2 -p b=0..1:1/2 --prime 7 --eps 1"""
    assert [row.split("\t")[0] for row in kahanmaps(line).out.splitlines()] == [
        f"a = {a}, b = {b}" for a in (1, 2) for b in ("0", "1/2", "1")
    ]


def test_what_is_undecided_is_counted(kahanmaps):
    outcome = kahanmaps("heights henon_heiles -p c=-1..0 --steps 4")
    assert outcome.status == 3
    assert outcome.err == "undecided, or stopped early: 2 of 2\n"


@pytest.mark.parametrize("option", ["--toml", "--flow", "--darboux 2", "--monomials x,1"])
def test_a_table_of_integrals_goes_without_other_forms(kahanmaps, option):
    outcome = kahanmaps(f"find-integrals lyness -p a=1..2 {option}")
    assert (outcome.status, outcome.out) == (2, "")
    assert "a range of values goes without" in outcome.err


@pytest.mark.parametrize("form", ["", "--json"])
def test_a_value_without_a_map_is_told_and_the_others_go_on(kahanmaps, form):
    outcome = kahanmaps(f"degrees --vars x,y --image y --image x/a+y^2 -p a=-1..1 --terms 4 {form}")
    assert outcome.status == 3
    assert len(outcome.out.splitlines()) == 2
    assert "a = 0: inline: 1 mistake\n  map.image[2]: found a division by 0" in outcome.err
    assert outcome.err.endswith("undecided, or stopped early: 1 of 3\n")
    outcome = kahanmaps("cycles henon_heiles -p c=1..2:1/3 --prime 3 --eps 1")
    assert [row.split("\t")[0] for row in outcome.out.splitlines()] == ["c = 1", "c = 2"]
    assert "c = 4/3: the prime 3 divides a denominator" in outcome.err


def test_what_is_wrong_for_every_value_is_wrong_use(kahanmaps):
    outcome = kahanmaps("heights henon_heiles -p c=1..2 --start 1,2")
    assert (outcome.status, outcome.out) == (2, "")
    assert outcome.err == "Error: found a point with 2 coordinates, expected 4: q1, q2, p1, p2\n"
