"""runtime/master/journal: the file itself, with a clock that the test controls and without a master."""

from __future__ import annotations

import errno
import logging
import os
import stat
import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.steps import PAUSE, Steps, finish
from minirospy.core.wire.journal import HEAD, parse_journal, serialize_record, unpack
from minirospy.runtime.master import journal as journal_module
from minirospy.runtime.master.journal import RETRY_SECONDS, Journal, JournalBusyError, boot_id
from tests.waiting import wait_until

MIB = 1024 * 1024


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


class Disk:
    """A disk that refuses writes while ``error`` is set."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.error: OSError | None = None
        self.calls: list[str] = []
        real_write, real_fsync, real_replace = os.write, os.fsync, os.replace

        def write(file: int, data: Any) -> int:
            self._do("write")
            return real_write(file, data)

        def fsync(file: int) -> None:
            self._do("fsync")
            assert os.fstat(file).st_size > 0, "what is synced is written"
            real_fsync(file)

        def replace(old: Any, new: Any) -> None:
            self._do("replace")
            real_replace(old, new)

        patch.setattr(os, "write", write)
        patch.setattr(os, "fsync", fsync)
        patch.setattr(os, "replace", replace)

    def fail(self, number: int = errno.ENOSPC) -> None:
        self.error = OSError(number, os.strerror(number))

    def _do(self, what: str) -> None:
        if self.error:
            raise self.error
        self.calls.append(what)


@pytest.fixture(autouse=True)
def _no_file_is_left_open() -> Iterator[None]:
    before = open_files()
    yield
    # Threads from earlier tests may still close their files.
    wait_until(lambda: open_files() <= before)


def open_files() -> int:
    return len(os.listdir("/proc/self/fd")) if sys.platform == "linux" else 0


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def state() -> list[list[Any]]:
    """Return the records that describe the current state."""
    return [["set", "/", {"a": 1}]]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "home" / "master" / "journal-1"


@pytest.fixture
def journal(path: Path, state: list[list[Any]], clock: Clock) -> Iterator[Journal]:
    journal = Journal(path, lambda: state, clock)
    yield journal
    journal.close()


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    return Disk(monkeypatch)


def records(path: Path) -> list[list[Any]]:
    """Return the records in the file; a value in parts is one record."""
    recovered = parse_journal(path.read_bytes())
    assert not recovered.damage
    found: list[list[Any]] = []
    parts: dict[int, bytes] = defaultdict(bytes)
    for record in recovered.records:
        match record:
            case ["part", number, piece]:
                parts[number] += piece
            case ["put", key, number]:
                found.append(["set", key, unpack(parts.pop(number))])
            case _:
                found.append(record)
    return found


# --- rewriting


def test_start_writes_the_boot_and_the_state(journal: Journal, path: Path, state: list[list[Any]]) -> None:
    assert (journal.size, journal.trouble) == (0, "")
    journal.start()
    assert records(path) == [["boot", boot_id()], *state]
    assert journal.size == path.stat().st_size
    assert not journal.trouble
    assert sorted(each.name for each in path.parent.iterdir()) == ["journal-1", "journal-1.lock"]


def test_rewrite_syncs_the_new_file_before_it_replaces_the_old_one(journal: Journal, disk: Disk) -> None:
    """Otherwise a power cut could leave an empty file with the journal's name."""
    journal.start()
    disk.calls.clear()
    journal.rewrite()
    assert disk.calls[-2:] == ["fsync", "replace"]
    assert disk.calls.count("fsync") == 1


def test_append_does_not_sync(journal: Journal, disk: Disk) -> None:
    """kill -9 loses no data that was written, and a sync for each call would slow the master down."""
    journal.start()
    disk.calls.clear()
    journal.append("set", "/p", 1)
    assert disk.calls == ["write"]


def test_rewrite_never_changes_the_old_file(journal: Journal, path: Path) -> None:
    journal.start()
    journal.append("set", "/p", 1)
    before, number = path.read_bytes(), path.stat().st_ino
    with path.open("rb") as old:
        journal.rewrite()
        assert old.read() == before
    assert path.stat().st_ino != number
    assert not path.with_name("journal-1.new").exists()


@pytest.mark.parametrize("step", ["write", "fsync", "replace"])
def test_rewrite_that_fails_leaves_the_old_file_alone(
    journal: Journal, path: Path, step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal.start()
    journal.append("set", "/p", 1)
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(errno.EIO, "no")

    before_failing = open_files()
    with monkeypatch.context() as patch:
        patch.setattr(os, step, fail)
        with pytest.raises(OSError, match="no"):
            journal.rewrite()
    assert path.read_bytes() == before
    assert not path.with_name("journal-1.new").exists()
    journal.rewrite()
    assert len(records(path)) == 2
    wait_until(lambda: open_files() <= before_failing)


def test_rewrite_is_complete_after_partial_writes(
    journal: Journal, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.write
    monkeypatch.setattr(os, "write", lambda file, data: real(file, bytes(data)[:7]))
    journal.start()
    journal.append("set", "/p", "x" * 100)
    assert records(path)[-1] == ["set", "/p", "x" * 100]


# --- compaction


def sizes(journal: Journal, record: Callable[[int], tuple[Any, ...]], count: int) -> list[int]:
    """Return the size after each of ``count`` records."""
    found = []
    for number in range(count):
        journal.append(*record(number))
        found.append(journal.size)
    return found


def test_journal_is_rewritten_once_it_is_larger_than_a_mebibyte(journal: Journal, path: Path) -> None:
    journal.start()
    small = journal.size
    text = "x" * (MIB // 8)
    found = sizes(journal, lambda number: ("set", f"/{number}", text), 8)
    assert found[:7] == sorted(found[:7])
    assert found[6] < MIB
    assert found[7] == small == path.stat().st_size
    assert len(records(path)) == 2
    # The size grows again in the same way.
    found = sizes(journal, lambda number: ("set", f"/{number}", text), 8)
    assert found[6] > small
    assert found[7] == small


def test_a_mebibyte_exactly_is_not_rewritten(journal: Journal) -> None:
    journal.start()
    frame = len(serialize_record(["set", "/", ""]))
    # Strings of this length have a length prefix of five bytes in place of one.
    text = "x" * (MIB - journal.size - frame - 4)
    journal.append("set", "/", text)
    assert journal.size == MIB
    journal.append("set", "/", 1)
    assert journal.size < 1000


def test_large_journal_is_rewritten_at_four_times_what_it_holds(
    journal: Journal, state: list[list[Any]]
) -> None:
    state.append(["set", "/large", "x" * MIB])
    journal.start()
    small, text = journal.size, "x" * (MIB // 2)
    found = sizes(journal, lambda number: ("set", "/large", text), 7)
    assert found[4] > 3 * MIB
    assert found[5] > small
    # A value stored in parts takes some more bytes.
    assert small <= found[6] < small + 1000


# --- in steps


@pytest.fixture
def steps() -> list[Steps[None]]:
    """Return the work that a journal schedules in steps."""
    return []


@pytest.fixture
def stepping(path: Path, state: list[list[Any]], clock: Clock, steps: list[Steps[None]]) -> Iterator[Journal]:
    """Return a journal that has grown enough to be rewritten."""
    journal = Journal(path, lambda: iter(list(state)), clock, steps.append)
    journal.start()
    journal.append("set", "/p", "x" * MIB)
    yield journal
    journal.close()
    for each in steps:
        each.close()


def test_rewrite_in_steps_keeps_records_appended_meanwhile(
    stepping: Journal, path: Path, state: list[list[Any]], steps: list[Steps[None]]
) -> None:
    state += [["set", f"/{number}", number] for number in range(500)]
    old = path.stat().st_ino
    count = 0

    for count, _ in enumerate(steps[0], 1):
        stepping.append("set", "/meanwhile", count)
        # A crash at this point would not lose anything, either.
        assert records(path)[-1] == ["set", "/meanwhile", count]

    assert path.stat().st_ino != old
    assert count > 3
    found = records(path)
    meanwhile = [["set", "/meanwhile", number] for number in range(1, count + 1)]
    assert found == [["boot", boot_id()], *state, *meanwhile]
    assert stepping.size == path.stat().st_size
    assert len(steps) == 1
    stepping.append("set", "/after", 1)
    assert records(path)[-1] == ["set", "/after", 1]
    assert not path.with_name("journal-1.new").exists()


def test_large_values_are_rewritten_in_parts(
    stepping: Journal, path: Path, state: list[list[Any]], steps: list[Steps[None]]
) -> None:
    large = list(range(300_000))
    state += [["set", "/large", large], ["set", "/other", large]]
    assert sum(1 for _ in steps[0]) > 10
    found = records(path)
    assert found == [["boot", boot_id()], *state]
    assert max(len(str(record)) for record in parse_journal(path.read_bytes()).records) < 500_000


def test_rewrite_in_steps_writes_two_hundred_records_at_a_time(
    stepping: Journal, state: list[list[Any]], steps: list[Steps[None]]
) -> None:
    state += [["set", f"/{number}", number] for number in range(399)]
    # The work consists of the header, two times two hundred records, and nothing else.
    assert [each for each in steps[0] if each is None] == [None] * 4


def test_close_while_the_new_file_is_synced_gives_it_up(
    stepping: Journal, path: Path, steps: list[Steps[None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    may_sync = threading.Event()

    def fsync(file: int) -> None:
        assert may_sync.wait(60)

    monkeypatch.setattr(os, "fsync", fsync)
    while next(steps[0]) is not PAUSE:
        pass
    before = path.read_bytes()
    stepping.close()
    may_sync.set()
    finish(steps[0])
    assert path.read_bytes() == before


def test_nothing_is_written_to_the_new_file_while_it_is_synced(
    stepping: Journal, path: Path, steps: list[Steps[None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    # While a disk syncs a file, writes to the file block.
    may_sync = threading.Event()
    monkeypatch.setattr(os, "fsync", lambda file: may_sync.wait(60))
    while next(steps[0]) is not PAUSE:
        pass
    new = path.with_name("journal-1.new")
    before = new.read_bytes()
    stepping.append("set", "/meanwhile", 1)
    assert new.read_bytes() == before
    may_sync.set()
    finish(steps[0])
    assert records(path)[-1] == ["set", "/meanwhile", 1]
    assert stepping.size == path.stat().st_size


@pytest.mark.parametrize("step", ["write", "fsync", "replace"])
def test_rewrite_in_steps_that_fails_goes_on_with_the_old_file(
    stepping: Journal,
    path: Path,
    step: str,
    steps: list[Steps[None]],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(errno.EIO, "no")

    with monkeypatch.context() as patch:
        patch.setattr(os, step, fail)
        finish(steps[0])
    assert path.read_bytes() == before
    assert not path.with_name("journal-1.new").exists()
    assert "could not be rewritten, it keeps growing" in caplog.text
    assert not stepping.trouble
    # The rewrite is retried only when the journal has doubled.
    stepping.append("set", "/p", "x" * (MIB // 2))
    assert len(steps) == 1
    stepping.append("set", "/p", "x" * MIB)
    assert len(steps) == 2
    finish(steps[1])
    assert path.stat().st_size < 1000


def test_disk_that_fails_for_the_new_file_alone_ends_the_rewrite(
    stepping: Journal, path: Path, steps: list[Steps[None]], monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.write
    new = path.with_name("journal-1.new")

    def write(file: int, data: Any) -> int:
        if new.exists() and os.path.samestat(os.fstat(file), new.stat()):
            raise OSError(errno.ENOSPC, "full")
        return real(file, data)

    may_sync = threading.Event()
    monkeypatch.setattr(os, "fsync", lambda file: may_sync.wait(60))
    while next(steps[0]) is not PAUSE:
        pass
    monkeypatch.setattr(os, "write", write)
    stepping.append("set", "/q", 1)
    may_sync.set()
    finish(steps[0])
    assert not new.exists()
    assert not stepping.trouble
    assert records(path)[-1] == ["set", "/q", 1]
    assert stepping.size == path.stat().st_size
    # The rewrite is retried only when the journal has doubled.
    stepping.append("set", "/p", "x" * (MIB // 2))
    assert len(steps) == 1
    stepping.append("set", "/p", "x" * MIB)
    assert len(steps) == 2


def test_disk_that_fails_ends_the_rewrite_in_steps(
    stepping: Journal, path: Path, steps: list[Steps[None]], disk: Disk, clock: Clock
) -> None:
    next(steps[0])
    disk.fail()
    stepping.append("set", "/q", 1)
    assert stepping.trouble
    assert not path.with_name("journal-1.new").exists()
    disk.error = None
    finish(steps[0])
    clock.now += RETRY_SECONDS
    stepping.retry()
    assert not stepping.trouble
    assert path.stat().st_size < 1000


def test_rewrite_that_was_given_up_leaves_a_later_one_alone(
    stepping: Journal, path: Path, state: list[list[Any]], steps: list[Steps[None]]
) -> None:
    next(steps[0])
    stepping.rewrite()
    stepping.append("set", "/p", "x" * MIB)
    next(steps[1])
    finish(steps[0])
    assert path.with_name("journal-1.new").exists()
    finish(steps[1])
    assert records(path)[1:] == state
    # The rewrite does not start.
    stepping.append("set", "/p", "x" * MIB)
    stepping.rewrite()
    finish(steps[2])
    assert records(path)[1:] == state


def test_close_ends_a_rewrite_in_steps(stepping: Journal, path: Path, steps: list[Steps[None]]) -> None:
    next(steps[0])
    before = path.read_bytes()
    stepping.close()
    finish(steps[0])
    assert path.read_bytes() == before
    assert [each.name for each in sorted(path.parent.iterdir())] == ["journal-1", "journal-1.lock"]


# --- large values


def test_store_writes_parts_that_a_record_refers_to(journal: Journal, path: Path) -> None:
    journal.start()
    large = {"of": list(range(200_000))}
    numbers = [finish(journal.store(value)) for value in (large, [1])]
    assert numbers == [1, 2]
    journal.append("put", "/large", 1)
    journal.append("put", "/small", 2)
    assert records(path)[2:] == [["set", "/large", large], ["set", "/small", [1]]]
    assert journal.size == path.stat().st_size


def test_store_that_is_interrupted_leaves_no_value(
    journal: Journal, path: Path, state: list[list[Any]]
) -> None:
    journal.start()
    storing = journal.store(list(range(200_000)))
    next(storing)
    storing.close()
    state.append(["set", "/p", "of the tables"])
    journal.append("put", "/p", 1)
    assert records(path)[1:] == state


def test_value_that_was_stored_before_the_disk_failed_is_written_again(
    journal: Journal, path: Path, state: list[list[Any]], disk: Disk, clock: Clock
) -> None:
    journal.start()
    number = finish(journal.store(list(range(1000))))
    disk.fail()
    journal.append("set", "/p", 1)
    disk.error = None
    clock.now += RETRY_SECONDS
    journal.retry()
    state.append(["set", "/large", "of the tables"])
    journal.append("put", "/large", number)
    assert records(path)[1:] == state


def test_store_on_a_full_disk_is_reported(
    journal: Journal, disk: Disk, caplog: pytest.LogCaptureFixture
) -> None:
    journal.start()
    disk.fail()
    finish(journal.store(list(range(1000))))
    assert journal.trouble == os.strerror(errno.ENOSPC)
    assert "cannot be written, a crash would lose the graph" in caplog.text
    # There is no retry within half a minute.
    disk.error = None
    finish(journal.store([1]))
    assert "write" not in disk.calls[disk.calls.index("fsync") :][2:]


def test_store_waits_for_a_rewrite_in_steps(stepping: Journal, path: Path, steps: list[Steps[None]]) -> None:
    storing = stepping.store([1, 2])
    assert [next(storing) for _ in range(3)] == [PAUSE] * 3
    next(steps[0])
    assert next(storing) is PAUSE
    finish(steps[0])
    stepping.append("put", "/p", finish(storing))
    assert records(path)[-1] == ["set", "/p", [1, 2]]


def test_journal_is_not_rewritten_between_a_value_and_its_record(
    stepping: Journal, path: Path, steps: list[Steps[None]]
) -> None:
    finish(steps[0])
    number = finish(stepping.store([1, 2]))
    stepping.append("set", "/p", "x" * MIB)
    assert len(steps) == 1
    stepping.append("put", "/q", number)
    assert len(steps) == 2
    assert records(path)[-1] == ["set", "/q", [1, 2]]


# --- where the disk fails


def test_failed_append_is_logged_once_and_retried_after_30_s(
    journal: Journal,
    path: Path,
    state: list[list[Any]],
    clock: Clock,
    disk: Disk,
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.WARNING)
    journal.start()
    before = path.read_bytes()
    disk.fail()
    for number in range(5):
        journal.append("set", "/p", number)
    assert journal.trouble == os.strerror(errno.ENOSPC)
    assert [record.getMessage() for record in caplog.records] == [
        f"the journal {path} cannot be written, a crash would lose the graph: {os.strerror(errno.ENOSPC)}"
    ]

    disk.error = None
    clock.now += RETRY_SECONDS - 0.1
    journal.append("set", "/p", 6)
    assert path.read_bytes() == before, "too early"
    state.append(["set", "/p", 7])
    clock.now += 0.1
    journal.append("set", "/p", 7)
    assert records(path)[1:] == state
    assert not journal.trouble
    assert caplog.records[-1].getMessage() == f"the journal {path} is written again"
    journal.append("set", "/p", 8)
    assert records(path)[-1] == ["set", "/p", 8]


def test_retry_that_fails_waits_as_long_again(journal: Journal, path: Path, clock: Clock, disk: Disk) -> None:
    disk.fail()
    journal.start()
    assert journal.trouble
    assert RETRY_SECONDS == 30.0
    clock.now += RETRY_SECONDS
    disk.fail(errno.EIO)
    journal.retry()
    assert journal.trouble == os.strerror(errno.EIO)
    disk.error = None
    clock.now += RETRY_SECONDS - 0.1
    journal.retry()
    assert journal.trouble
    clock.now += 0.1
    journal.retry()
    assert not journal.trouble
    assert records(path)


def test_retry_without_trouble_does_nothing(journal: Journal, path: Path, clock: Clock, disk: Disk) -> None:
    journal.start()
    disk.calls.clear()
    clock.now += 10 * RETRY_SECONDS
    journal.retry()
    assert disk.calls == []


def test_retry_does_not_open_a_journal_that_is_closed(
    journal: Journal, path: Path, clock: Clock, disk: Disk
) -> None:
    disk.fail()
    journal.start()
    disk.error = None
    journal.remove()
    clock.now += RETRY_SECONDS
    journal.retry()
    journal.append("set", "/p", 1)
    assert not path.exists()


def test_value_that_the_journal_cannot_hold_is_reported(journal: Journal) -> None:
    journal.start()
    journal.append("set", "/p", object())
    assert journal.trouble == "a journal holds no object"


def test_state_that_the_journal_cannot_hold_is_reported(journal: Journal, state: list[list[Any]]) -> None:
    state.append(["set", "/p", object()])
    journal.start()
    assert journal.trouble == "a journal holds no object"


# --- the lock


def test_lock_is_held_until_close_and_holds_the_pid(journal: Journal, path: Path) -> None:
    journal.lock()
    journal.lock()
    lock = path.with_name("journal-1.lock")
    assert lock.read_text() == f"{os.getpid()}\n"
    other = Journal(path, list)
    with pytest.raises(JournalBusyError) as busy:
        other.lock()
    assert (busy.value.path, busy.value.pid) == busy.value.args == (path, os.getpid())
    assert str(busy.value) == f"{path} is held by another master (pid {os.getpid()})"
    # A journal that does not have the lock changes nothing in the file.
    journal.start()
    other.start()
    assert other.trouble == str(busy.value)
    other.remove()
    assert path.exists()
    journal.close()
    other.lock()
    other.close()


def test_lock_replaces_the_pid_of_a_master_that_was_killed(journal: Journal, path: Path) -> None:
    path.parent.mkdir(parents=True)
    path.with_name("journal-1.lock").write_text("1234567890123\n")
    journal.lock()
    assert path.with_name("journal-1.lock").read_text() == f"{os.getpid()}\n"


def test_lock_of_a_master_that_has_not_written_its_pid(journal: Journal, path: Path) -> None:
    journal.lock()
    path.with_name("journal-1.lock").write_text("")
    with pytest.raises(JournalBusyError) as busy:
        Journal(path, list).lock()
    assert (busy.value.pid, str(busy.value)) == (0, f"{path} is held by another master")


@pytest.mark.skipif(sys.platform == "win32", reason="no fcntl")
def test_lock_on_a_file_system_without_locks(
    journal: Journal, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import fcntl

    def fail(*_: object) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(fcntl, "flock", fail)
    journal.start()
    assert not journal.trouble
    assert path.with_name("journal-1.lock").read_text() == f"{os.getpid()}\n"


# --- what was left


def test_read_of_nothing(journal: Journal, tmp_path: Path) -> None:
    assert journal.read() is None
    (tmp_path / "file").touch()
    assert Journal(tmp_path / "file" / "journal-1", list).read() is None


def test_read_returns_the_changes_the_age_and_the_boot(
    journal: Journal, path: Path, state: list[list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    journal.start()
    journal.append("set", "/p", 1)
    os.utime(path, (1, time.time() - 100))
    left = journal.read()

    assert left
    assert left.recovered.records == [*state, ["set", "/p", 1]]
    assert 100 <= left.age < 100 + 60
    assert left.same_boot
    assert left.copy is None

    monkeypatch.setattr(journal_module, "boot_id", lambda: "another")
    left = journal.read()
    assert left
    assert not left.same_boot

    # This simulates a clock that was set back.
    os.utime(path, (1, time.time() + 100))
    left = journal.read()
    assert left
    assert left.age == 0.0


def test_read_keeps_a_copy_of_a_damaged_file(journal: Journal, path: Path, disk: Disk) -> None:
    journal.start()
    damaged = path.read_bytes() + b"torn"
    path.write_bytes(damaged)
    left = journal.read()
    assert left
    assert left.recovered.damage
    assert left.copy == path.with_name("journal-1.damaged")
    assert left.copy.read_bytes() == damaged
    assert stat.S_IMODE(left.copy.stat().st_mode) == 0o600
    disk.fail()
    left = journal.read()
    assert left
    assert left.copy is None


@pytest.mark.skipif(sys.platform == "win32", reason="makes a link")
def test_read_sets_unreadable_files_aside(journal: Journal, path: Path, disk: Disk) -> None:
    path.parent.mkdir(parents=True)
    path.symlink_to("elsewhere")
    disk.fail()
    left = journal.read()
    assert left
    assert left.copy is None
    disk.error = None
    left = journal.read()
    assert left
    assert left.recovered == ([], 0, "it cannot be read: it is a symbolic link, which is not followed")
    assert (left.age, left.same_boot, left.copy) == (0.0, True, path.with_name("journal-1.damaged"))
    assert not os.path.lexists(path)


def test_discard_drops_what_was_left(journal: Journal, path: Path) -> None:
    journal.start()
    journal.discard()
    journal.discard()
    assert journal.read() is None


# --- the end


def test_remove_leaves_nothing_to_recover(journal: Journal, path: Path) -> None:
    journal.start()
    journal.remove()
    journal.remove()
    assert not path.exists()


def test_close_leaves_the_journal_as_it_is(journal: Journal, path: Path) -> None:
    journal.start()
    before = path.read_bytes()
    journal.close()
    journal.append("set", "/p", 1)
    assert path.read_bytes() == before


def test_touch_is_a_sign_of_life(journal: Journal, path: Path) -> None:
    journal.start()
    os.utime(path, (1, 1))
    journal.touch()
    assert time.time() - path.stat().st_mtime < 60
    path.unlink()
    journal.touch()


@pytest.mark.skipif(sys.platform == "win32", reason="makes a link")
def test_touch_follows_no_link(journal: Journal, path: Path, tmp_path: Path) -> None:
    (tmp_path / "other").touch()
    os.utime(tmp_path / "other", (1, 1))
    journal.start()
    path.unlink()
    path.symlink_to(tmp_path / "other")
    journal.touch()
    assert (tmp_path / "other").stat().st_mtime == 1


@pytest.mark.skipif(sys.platform != "linux", reason="a file of Linux")
def test_boot_id_is_the_systems() -> None:
    assert boot_id() == Path("/proc/sys/kernel/random/boot_id").read_text().strip()


def test_boot_id_elsewhere_is_the_minute_of_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    import psutil

    def fail(path: Path) -> str:
        raise FileNotFoundError(path)

    monkeypatch.setattr(Path, "read_text", fail)
    monkeypatch.setattr(psutil, "boot_time", lambda: 6000.4)
    assert boot_id() == "100"


def test_journal_begins_with_its_format(journal: Journal, path: Path) -> None:
    journal.start()
    assert path.read_bytes().startswith(HEAD)
    assert HEAD == b"minirospy journal 1\n"
