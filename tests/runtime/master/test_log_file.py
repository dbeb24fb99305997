"""runtime/master/log_file: lines are written in batches, and a warning immediately."""

from __future__ import annotations

import asyncio
import errno
import io
import logging
import sys
import threading
from pathlib import Path

import pytest

from minirospy.runtime.master import log_file
from minirospy.runtime.master.log_file import LogFile, LogFileHandler


def test_flood_of_warnings_is_written_in_batches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(log_file, "FLUSH_SECONDS", 0.05)
    written: list[int] = []
    again = asyncio.Event()

    async def scene() -> None:
        file = LogFile(tmp_path / "master.log", 1_000_000, "master")

        def write_out() -> None:
            written.append(len(written))
            LogFile._write_out(file)
            again.set()

        monkeypatch.setattr(file, "_write_out", write_out)
        for number in range(20):
            file.line(f"line {number}")
            file.handle(logging.LogRecord("x", logging.WARNING, "", 0, f"warning {number}", None, None))
        # By now the file contains the warning, and the lines before it.
        assert (tmp_path / "master.log").read_text().count("\n") == 40
        at_once = len(written)
        file.line("the last")
        again.clear()
        await again.wait()
        # Timers of each line and warning would have fired by then.
        await asyncio.sleep(2 * log_file.FLUSH_SECONDS)
        assert len(written) == at_once + 1
        assert (tmp_path / "master.log").read_text().endswith(": the last\n")
        file.close()

    asyncio.run(scene())


def test_much_text_is_written_before_the_time_is_up(tmp_path: Path) -> None:
    async def scene() -> None:
        file = LogFile(tmp_path / "rosout.log", 10_000_000, "rosout")
        for _ in range(100):
            file.text("x" * 999)
        # Each batch of 64 KiB has 66 lines, because one more does not fit.
        assert (tmp_path / "rosout.log").stat().st_size == 66 * 1000
        file.close()
        assert (tmp_path / "rosout.log").stat().st_size == 100 * 1000

    asyncio.run(scene())


def test_no_line_is_lost_if_several_threads_log(tmp_path: Path) -> None:
    file = LogFile(tmp_path / "master.log", 10_000_000, "master")
    stop = threading.Event()

    def write_out() -> None:
        while not stop.is_set():
            file.flush()

    flusher = threading.Thread(target=write_out)
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        flusher.start()
        for number in range(3000):
            file.handle(logging.LogRecord("x", logging.INFO, "", 0, f"line {number}", None, None))
    finally:
        sys.setswitchinterval(before)
        stop.set()
        flusher.join()
        file.close()
    assert (tmp_path / "master.log").read_text().count("\n") == 3000


def test_a_node_warns_once_of_a_full_disk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    class FullDisk(io.StringIO):
        def flush(self) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

    handler = LogFileHandler(tmp_path / "log")
    handler.stream.close()
    handler.stream = FullDisk()  # type: ignore[assignment]
    for text in ("a", "b"):
        handler.handle(logging.makeLogRecord({"msg": text}))
    handler.stream = None  # type: ignore[assignment]
    handler.close()
    assert capsys.readouterr().err == (
        f"WARNING: cannot write the log file [{tmp_path / 'log'}]: No space left on device\n"
    )


def test_disk_that_was_full_is_written_again(tmp_path: Path) -> None:
    class Full(io.StringIO):
        def flush(self) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        def close(self) -> None:
            if not self.closed:
                super().close()
                self.flush()

    def warn(text: str) -> None:
        file.handle(logging.LogRecord("x", logging.WARNING, "", 0, text, None, None))

    file = LogFile(tmp_path / "master.log", 1_000_000, "master")
    file.stream.close()
    file.stream = Full()  # type: ignore[assignment]
    warn("lost")
    warn("kept")
    file.stream.close()
    file.stream = Full()  # type: ignore[assignment]
    warn("lost")
    file.close()
    assert (tmp_path / "master.log").read_text().endswith(": kept\n")


def test_text_of_a_peer_does_not_start_another_line(tmp_path: Path) -> None:
    async def scene() -> None:
        file = LogFile(tmp_path / "master.log", 1_000_000, "master")
        file.line("+PUB [/a\n+PUB [/forged]] /x\x1b[2J")
        record = logging.LogRecord("x", logging.WARNING, "", 0, "from %s", ("/a\nforged\x9b",), None)
        file.handle(record)
        file.close()

    asyncio.run(scene())
    first, second = (tmp_path / "master.log").read_text().splitlines()
    assert first.endswith(": +PUB [/a\\n+PUB [/forged]] /x\\x1b[2J")
    assert second.endswith(": from /a\\nforged\\x9b")
