"""The command rosclean: sizes as du shows them, the folders that purge removes, and its confirmation."""

from __future__ import annotations

import io
import os
from pathlib import Path

import pytest

from minirospy.ros.rosclean.commands import rosclean

from .conftest import Command


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a log folder of 3 MB: `old` (2 MB, with `latest` pointing there) and `new` (1 MB)."""
    home = tmp_path / "home"
    folder = home / "log"
    for name, megabytes, changed in (("old", 2, 1_000_000_000), ("new", 1, 1_700_000_000)):
        (folder / name).mkdir(parents=True)
        (folder / name / "node.log").write_bytes(b"x" * (megabytes * 1024 * 1024))
        os.utime(folder / name, (changed, changed))
    (folder / "latest").symlink_to("old")
    monkeypatch.setenv("ROS_HOME", str(home))
    monkeypatch.delenv("ROS_LOG_DIR")
    return folder


def answer(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(text))


def test_check(command: Command, logs: Path) -> None:
    (logs.parent / "rosmake").mkdir()
    status, out, err = command("rosclean", "check")
    assert (status, err) == (0, "")
    assert out.splitlines()[0].split(" ", 1)[1] == "ROS node logs"
    assert out.splitlines()[1].split(" ", 1)[1] == "rosmake logs"
    assert out.startswith("3.")


def test_without_logs_nothing_is_printed(command: Command, tmp_path: Path) -> None:
    assert command("rosclean", "check") == (0, "", "")
    assert command("rosclean", "purge") == (0, "", "")


def test_purge_requests_confirmation(command: Command, logs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    question = f"PLEASE BE CAREFUL TO VERIFY THE COMMAND BELOW!\nOkay to perform:\n\nrm -rf {logs}\n(y/n)?\n"
    for said in ("n\n", ""):
        answer(monkeypatch, said)
        assert command("rosclean", "purge") == (0, "Purging ROS node logs.\n" + question, "")
        assert logs.is_dir()
    answer(monkeypatch, "what\ny\n")
    assert command("rosclean", "purge") == (0, "Purging ROS node logs.\n" + question * 2, "")
    assert not logs.exists()


def test_purge_without_a_question(command: Command, logs: Path) -> None:
    assert command("rosclean", "purge", "-y") == (0, "Purging ROS node logs.\n", "")
    assert not logs.exists()


def test_purge_of_a_folder_behind_a_link(command: Command, logs: Path) -> None:
    logs.rename(logs.parent / "elsewhere")
    logs.symlink_to("elsewhere")
    assert command("rosclean", "purge", "-y") == (0, "Purging ROS node logs.\n", "")
    assert [path.name for path in logs.parent.iterdir()] == ["elsewhere"]


def test_purge_down_to_a_size(command: Command, logs: Path) -> None:
    assert command("rosclean", "purge", "-y", "--size", "9").out == (
        "Directory size of ROS node logs is 3 MB which is already below the requested threshold of 9 MB.\n"
    )
    assert command("rosclean", "purge", "-y", "--size", "2").out == (
        "Purging ROS node logs until directory size is at most 2 MB (currently 3 MB).\n"
    )
    assert [path.name for path in logs.iterdir()] == ["new"]


def test_typed_wrong(command: Command) -> None:
    assert command("rosclean", "purge", "--size", "x").status == 2
    assert command("rosclean", "purge", "--size", "-1").status == 2
    assert "did you mean purge" in command("rosclean", "purg").err


@pytest.mark.parametrize(
    ("size", "shown"),
    [(0, "0"), (4096, "4.0K"), (4097, "4.1K"), (10240, "10K"), (10241, "11K"), (1023 * 1024, "1023K"),
     (1024 * 1024, "1.0M"), (11_001_500, "11M"), (5 * 1024**3, "5.0G"), (2**50, "1024T")],
)  # fmt: skip
def test_sizes_as_du_shows_them(size: int, shown: str) -> None:
    assert rosclean.human_size(size) == shown
