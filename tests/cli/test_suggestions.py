"""Whatever is misspelt on the command line, something close to it is suggested; and nothing that is far from it."""

from pathlib import Path

import pytest

ORBIT = "--start 1,2,3 --eps 1/10 --steps 1"


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
