"""Files that another process has open, which Windows neither replaces nor removes. Other systems simulate its error."""

from __future__ import annotations

import errno
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from minirospy.base import private_files
from minirospy.board.server import _LogOnDemand


@pytest.fixture
def paths(tmp_path: Path) -> tuple[Path, Path]:
    """Return a new file, and the file that it replaces."""
    new, old = tmp_path / "new", tmp_path / "old"
    new.write_text("new")
    old.write_text("old")
    return new, old


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], threading.Event]:
    """Return a function that makes os.replace fail several times, as on Windows, and returns an event for the first failure."""

    def refuse(times: int) -> threading.Event:
        replace, failed, left = os.replace, threading.Event(), [times]

        def replace_later(source: Path, target: Path) -> None:
            try:
                if left[0] > 0:
                    left[0] -= 1
                    raise PermissionError(errno.EACCES, "open elsewhere", str(target))
                replace(source, target)
            except PermissionError:
                failed.set()
                raise

        monkeypatch.setattr(os, "replace", replace_later)
        return failed

    monkeypatch.setattr(private_files, "_REFUSES_OPEN_FILES", True)
    return refuse


def test_replace_file_waits_until_the_file_is_closed(
    paths: tuple[Path, Path], refused: Callable[[int], threading.Event], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(private_files, "OPEN_ELSEWHERE_PATIENCE", 60.0)
    refused(3)
    new, old = paths
    private_files.replace_file(new, old)
    assert old.read_text() == "new"
    assert not new.exists()


def test_replace_file_gives_up_after_a_while(
    paths: tuple[Path, Path], refused: Callable[[int], threading.Event], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(private_files, "OPEN_ELSEWHERE_PATIENCE", 0.0)
    refused(1)
    new, old = paths
    with pytest.raises(PermissionError, match="open elsewhere"):
        private_files.replace_file(new, old)
    assert old.read_text() == "old"


def test_replace_file_does_not_retry_without_permission(
    paths: tuple[Path, Path], refused: Callable[[int], threading.Event], monkeypatch: pytest.MonkeyPatch
) -> None:
    refused(1)
    monkeypatch.setattr(private_files, "_REFUSES_OPEN_FILES", False)
    new, old = paths
    with pytest.raises(PermissionError):
        private_files.replace_file(new, old)


@pytest.mark.skipif(sys.platform != "win32", reason="only Windows refuses it")
def test_file_that_a_reader_has_open_is_replaced(
    paths: tuple[Path, Path], refused: Callable[[int], threading.Event], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(private_files, "OPEN_ELSEWHERE_PATIENCE", 60.0)
    failed = refused(0)
    new, old = paths
    with old.open():
        thread = threading.Thread(target=private_files.replace_file, args=(new, old))
        thread.start()
        assert failed.wait(60)
    thread.join(60)
    assert old.read_text() == "new"


@pytest.mark.skipif(sys.platform != "win32", reason="only Windows refuses it")
def test_file_that_a_reader_has_open_is_not_removed(
    paths: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(private_files, "OPEN_ELSEWHERE_PATIENCE", 0.0)
    _, old = paths
    with old.open(), pytest.raises(PermissionError):
        private_files.remove_file(old)
    private_files.remove_file(old)
    private_files.remove_file(old)
    assert not old.exists()


def test_log_of_a_board_exists_only_after_trouble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "board.log"
    log = _LogOnDemand(path)
    monkeypatch.setattr(sys, "stderr", log)
    assert not path.exists()
    print("one", file=sys.stderr)
    print("twö", file=sys.stderr)
    assert path.read_text(encoding="utf-8") == "one\ntwö\n"
    path.unlink()
