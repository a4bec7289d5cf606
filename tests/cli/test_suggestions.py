"""Whatever is misspelt on the command line, something close to it is suggested; and nothing that is far from it."""

import pytest


@pytest.mark.parametrize("command", ["check-measure {}", "systems {}", "check-commute euler_top {}", "family show {}"])
def test_files_named_like_one_that_is_not_there_are_suggested(kahanmaps, tmp_path, command):
    (tmp_path / "my_system.toml").touch()
    (tmp_path / "other.toml").touch()
    outcome = kahanmaps(command.format(tmp_path / "my_sytem.toml"))
    assert outcome.status == 2
    assert f"No such file or directory, did you mean {tmp_path / 'my_system.toml'}?" in outcome.err
