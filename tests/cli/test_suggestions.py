"""Whatever is misspelt on the command line, something close to it is suggested; and nothing that is far from it."""

from __future__ import annotations

from pathlib import Path

import pytest

ORBIT = "--start 1,2,3 --eps 1/10 --steps 1"


@pytest.mark.parametrize(
    "command", ["family xyzzy", f"orbit euler_top {ORBIT} --format xyzzy", "find-commuting three_wave --shape xyzzy"]
)
def test_nothing_is_suggested_for_what_is_like_nothing(kahanmaps, command):
    outcome = kahanmaps(command)
    assert outcome.status == 2
    assert "Did you mean" not in outcome.err


@pytest.mark.parametrize("command", ["check-measure {}", "systems {}", "check-commute euler_top {}", "family show {}"])
def test_files_named_like_one_that_is_not_there_are_suggested(kahanmaps, tmp_path, command):
    (tmp_path / "my_system.toml").touch()
    (tmp_path / "other.toml").touch()
    outcome = kahanmaps(command.format(tmp_path / "my_sytem.toml"))
    assert outcome.status == 2
    assert f"No such file or directory, did you mean {tmp_path / 'my_system.toml'}?" in outcome.err


@pytest.mark.parametrize(
    "command",
    [f"orbit euler_top {ORBIT} -o", "ensemble euler_top --random 2 --eps 1/10 --steps 1 -o", "family new --m 1 -o"],
)
def test_a_file_in_a_folder_that_is_not_there_cannot_be_made(kahanmaps, tmp_path, command):
    outcome = kahanmaps(command, Path(tmp_path / "nowhere" / "x.npy"), *(["--arithmetic float"] * ("orbit" in command)))
    assert outcome.status == 2
    assert f"there is no folder {tmp_path / 'nowhere'}: make it first, or check the name" in outcome.err


def test_what_is_missing_is_told_with_its_help(kahanmaps):
    outcome = kahanmaps("orbit euler_top --eps 1/10 --steps 1")
    assert outcome.status == 2
    assert "Error: Missing option '--start': The start, e.g. 1/2,-1/3,0.25.\n" in outcome.err
