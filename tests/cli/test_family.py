"""kahanmaps family: members of the commuting family, drawn and written as system files, shown and taken apart."""

from pathlib import Path

import pytest
from helpers import together


@together(
    "options, m",
    [
        ("--m 3", 3),
        ("--eigenvalues 1,-2,3", 3),
        ("--eigenvalues 2,2,5", 3),
        ("--eigenvalues 1e300,-7", 2),
        ("--m 3 --generic", 3),
        ("--chi t^2-2", 2),
        ("--chi (t-1)^2", 2),
        ("--m 2 --size 1000000", 2),
        ("--chi (t-1)*(t^2+1) --signs=-1,1", 3),
        (f"--m 2 --seed {10**40}", 2),
    ],
)
def test_what_is_drawn_is_a_system_file(kahanmaps, tmp_path, options, m):
    path = tmp_path / "drawn.toml"
    assert kahanmaps(f"family new {options} -o", path).status == 0
    shown = kahanmaps("family show", path, "--json").json
    assert (shown["system"], shown["m"], shown["dim"]) == ("drawn", m, 2 * m)


def test_a_member_with_repeated_roots_has_no_normal_form(kahanmaps, tmp_path):
    kahanmaps("family new --eigenvalues 1,1 -q -o", tmp_path / "a.toml")
    refused = kahanmaps("plot invariant-curves", tmp_path / "a.toml", "--start 1,0,0,1 --eps 1/20 -o x.svg")
    assert (refused.status, "chi has a repeated root" in refused.err) == (2, True)
    outcome = kahanmaps("family show", tmp_path / "a.toml", "--normal-form --json")
    assert (outcome.status, outcome.out) == (2, "")
    assert "chi has the repeated factor (t - 1)" in outcome.err


def test_the_associated_systems_are_written_as_files(kahanmaps, pair, tmp_path):
    listed = kahanmaps("family associated", pair, "--json --write-to", tmp_path / "new" / "folder").json["associated"]
    for row, signs in zip(listed, ("pp", "pm"), strict=True):
        path = Path(row["file"])
        assert path == tmp_path / "new" / "folder" / f"pair-{signs}.toml"
        shown = kahanmaps("systems", path, "--json").json
        assert shown["name"] == f"pair-{signs}"
        assert shown["document"]["family"].get("signs", [1, 1]) == row["signs"]


def test_associated_systems_over_number_fields_are_written_as_files_that_commute(kahanmaps, tmp_path):
    file, folder = tmp_path / "mix.toml", tmp_path / "new"
    assert kahanmaps("family new --chi '(t-1)*(t^2-2)' --seed 1 -o", file).status == 0
    rows = kahanmaps("family associated", file, "--json --write-to", folder).json["conjugate"]
    assert [(row["root"], row["signs"]) for row in rows] == [("root of t^2 - 2", [1, 1]), ("root of t^2 - 2", [-1, 1])]
    assert [Path(row["file"]).name for row in rows] == ["mix-pp-t.toml", "mix-mp-t.toml"]
    assert "++ but at t, a root of t^2 - 2\tB = [t + 2, -1/2*t, -1/2*t - 1]" in kahanmaps("family associated", file).out
    small = tmp_path / "small.toml"
    assert kahanmaps("family new --chi t^2-2 --seed 1 -o", small).status == 0
    (row,) = kahanmaps("family associated", small, "--json --write-to", folder).json["conjugate"]
    assert kahanmaps("check-commute", small, row["file"], "--eps 1/10").status == 0


@pytest.mark.parametrize("name", ["../escape", "..", "a b\\c"])
def test_files_stay_in_their_folder_whatever_the_name_of_the_system(kahanmaps, tmp_path, name):
    kahanmaps(f"family new --eigenvalues 1,2 --name '{name}' -o", tmp_path / "a.toml")
    folder = tmp_path / "sub" / "folder"
    assert kahanmaps("family associated", tmp_path / "a.toml", "--write-to", folder).status == 0
    assert len(list(folder.iterdir())) == 2
    assert sorted(path.name for path in tmp_path.rglob("*.toml") if path.parent != folder) == ["a.toml"]


def test_a_system_over_an_algebra_is_written_over_Q_with_what_it_inherits(kahanmaps, tmp_path):
    file = tmp_path / "top.toml"
    said = kahanmaps("family tensor euler_top --algebra t^2-2 -o", file).err
    assert "dimension 6; 4 of 4 integrals inherited" in said
    assert kahanmaps("check-integrals", file).status == 0
    assert kahanmaps("check-measure", file).status == 0
    statements = kahanmaps("analyze", file, "--effort -3 --json").json
    assert statements["algebra"]["text"] == "a system in 3 variables over K = Q[t]/(t^2 - 2)"
