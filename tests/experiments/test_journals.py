"""Which journal is used where: a wrong answer would cost data."""

from __future__ import annotations

from pathlib import Path

import pytest

from kahanmaps.experiments.locks import file_system, journal_for

MOUNTS = r"""
/dev/sda1 / ext4 rw 0 0
tmpfs /tmp tmpfs rw 0 0
server:/home /home nfs4 rw 0 0
/dev/sdb1 /home/scratch xfs rw 0 0
host:/x /mnt/my\040disk fuse.sshfs rw 0 0
server:/data /data ext4 rw 0 0
server:/data /data lustre rw 0 0
what /new shinyfs rw 0 0
overlay /over overlay rw 0 0
"""


@pytest.mark.parametrize(
    ("path", "kind", "journal"),
    [
        ("/results.db", "ext4", "wal"),
        ("/homes/results.db", "ext4", "wal"),  # /home is not a folder above it
        ("/home/me/results.db", "nfs4", "delete"),
        ("/home/scratch/me/results.db", "xfs", "wal"),
        ("/mnt/my disk/results.db", "fuse.sshfs", "delete"),
        ("/data/results.db", "lustre", "delete"),  # mounted over another one
        ("/new/results.db", "shinyfs", "delete"),  # unknown: the slow way is always right
        ("/over/results.db", "overlay", "wal"),
    ],
)
def test_wal_is_used_on_local_file_systems_only(tmp_path, path, kind, journal):
    mounts = tmp_path / "mounts"
    mounts.write_text(MOUNTS.lstrip())
    assert file_system(Path(path), mounts) == kind
    assert journal_for(Path(path), mounts) == journal


def test_without_a_list_of_mounts_there_is_no_wal(tmp_path):
    assert file_system(tmp_path, tmp_path / "nothing") is None
    assert journal_for(tmp_path, tmp_path / "nothing") == "delete"
