"""ros/rosbag/recording/disk: the thread that writes files."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from minirospy.ros.rosbag.recording.disk import DiskThread, QueuedFile


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_link_that_waits_at_the_name_of_a_recording_is_not_followed(tmp_path: Path) -> None:
    victim, link = tmp_path / "victim", tmp_path / "x.bag.active"
    victim.write_text("precious", encoding="utf-8")
    link.symlink_to(victim)
    disk = DiskThread(lambda error: None)
    try:
        with pytest.raises(OSError, match="symbolic link"):
            QueuedFile(disk, link, lambda error: None)
        link.unlink()
        link.write_bytes(b"of an earlier recording")
        file = QueuedFile(disk, link, lambda error: None)
        file.write(b"new")
        file.close_file()
    finally:
        disk.close()
    assert (victim.read_text(encoding="utf-8"), link.read_bytes()) == ("precious", b"new")


def test_a_call_that_raises_is_reported_and_the_next_one_made() -> None:
    errors: list[Exception] = []
    done: list[str] = []
    disk = DiskThread(errors.append)

    def fail() -> None:
        raise MemoryError

    disk.submit(fail, 7)
    disk.submit(lambda: done.append("next"))
    disk.close()

    assert [type(each) for each in errors] == [MemoryError]
    assert done == ["next"]
    assert disk.pending == 0
