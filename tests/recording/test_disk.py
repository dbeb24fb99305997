"""recording/disk: the thread that writes files."""

from __future__ import annotations

from minirospy.recording.disk import DiskThread


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
