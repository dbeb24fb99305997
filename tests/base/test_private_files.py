"""Files with predictable names: links, FIFOs and folders that belong to other users are rejected."""

from __future__ import annotations

import logging
import os
import signal
import socket
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from minirospy.base import private_files
from minirospy.board.directory import BoardDirectory
from minirospy.ros.roslaunch.launcher.output import Output
from minirospy.ros.roslaunch.launcher.process import start_process
from minirospy.ros.rosunit.runner.junit import Result
from minirospy.runtime.master.journal import Journal
from minirospy.runtime.master.log_file import LogFile, LogFileHandler
from tests.conftest import free_port

BIN = Path(sys.executable).parent

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="users of Windows may not make links")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """Return a file that belongs to the user, in another folder."""
    path = tmp_path / "mine"
    path.write_text("precious")
    return path


def symbolic(name: Path, target: Path) -> None:
    name.symlink_to(target)


LINKS: list[Callable[[Path, Path], None]] = [symbolic, lambda name, target: os.link(target, name)]


@pytest.mark.parametrize("link", LINKS, ids=["symbolic", "hard"])
@pytest.mark.parametrize("flags", [os.O_CREAT, os.O_APPEND, os.O_TRUNC, os.O_CREAT | os.O_EXCL])
def test_open_file_refuses_links(
    tmp_path: Path, mine: Path, link: Callable[[Path, Path], None], flags: int
) -> None:
    link(tmp_path / "name", mine)
    with pytest.raises(OSError, match=r"link|exists"):
        private_files.open_file(tmp_path / "name", os.O_RDWR | flags)
    assert mine.read_text() == "precious"


@pytest.mark.parametrize("has_flag", [True, False], ids=["O_NOFOLLOW", "a system without"])
def test_open_file_refuses_a_symbolic_link_to_nothing(
    tmp_path: Path, has_flag: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if has_flag:
        # Simulate a link that is created between the check and the opening.
        monkeypatch.setattr(os.path, "islink", lambda path: False)
    else:
        monkeypatch.setattr(private_files, "OPEN_FLAGS", 0)
    (tmp_path / "name").symlink_to(tmp_path / "created")
    with pytest.raises(OSError, match=r"(?i)symbolic link"):
        private_files.open_file(tmp_path / "name", os.O_WRONLY | os.O_CREAT)
    assert not (tmp_path / "created").exists()


def test_open_file_does_not_wait_for_the_other_end_of_a_fifo(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "name")
    with pytest.raises(OSError, match="not a regular file"):
        private_files.read_file(tmp_path / "name")
    with pytest.raises(OSError, match=r"No such device|not a regular file"):
        private_files.open_text(tmp_path / "name", "a")


def test_open_text_empties_or_appends(tmp_path: Path) -> None:
    path = tmp_path / "name"
    for mode, text in (("w", "a longer one"), ("w", "short"), ("a", " and more")):
        with private_files.open_text(path, mode) as file:
            assert os.get_blocking(file.fileno())
            file.write(text)
    assert path.read_text() == "short and more"
    private_files.open_text(path, "w").close()
    assert path.read_text() == ""


def test_read_file_reads_hard_links(tmp_path: Path, mine: Path) -> None:
    """Backups use hard links, and reading a hard link is harmless."""
    os.link(mine, tmp_path / "name")
    assert private_files.read_file(tmp_path / "name") == (b"precious", mine.stat().st_mtime)


def test_refused_file_is_closed(tmp_path: Path, mine: Path) -> None:
    os.link(mine, tmp_path / "name")
    with mine.open("rb") as probe:
        number = probe.fileno()
    with pytest.raises(OSError, match="hard link"):
        private_files.open_file(tmp_path / "name", os.O_RDWR)
    with mine.open("rb") as probe:
        assert probe.fileno() == number


def test_open_text_writes_to_a_device_that_the_user_named() -> None:
    with private_files.open_text(Path("/dev/null"), "w") as file:
        file.write("anything")


@pytest.mark.parametrize("link", LINKS, ids=["symbolic", "hard"])
def test_create_file_replaces_links(tmp_path: Path, mine: Path, link: Callable[[Path, Path], None]) -> None:
    link(tmp_path / "name", mine)
    with os.fdopen(private_files.create_file(tmp_path / "name"), "wb") as file:
        file.write(b"new")
    assert mine.read_text() == "precious"
    assert (tmp_path / "name").read_text() == "new"
    assert stat.S_IMODE((tmp_path / "name").stat().st_mode) == 0o600


@pytest.mark.parametrize("name", ["journal-1", "journal-1.lock", "journal-1.new", "journal-1.damaged"])
@pytest.mark.parametrize("link", LINKS, ids=["symbolic", "hard"])
def test_journal_follows_no_link(
    tmp_path: Path, mine: Path, name: str, link: Callable[[Path, Path], None]
) -> None:
    folder = tmp_path / "master"
    folder.mkdir()
    (folder / "journal-1").write_bytes(b"damaged")
    (folder / name).unlink(missing_ok=True)
    link(folder / name, mine)
    journal = Journal(folder / "journal-1", list)
    left = journal.read()
    journal.start()
    journal.append("set", "/p", 1)
    journal.touch()
    journal.remove()

    assert mine.read_text() == "precious"
    # Symbolic links are not read, either. Removing a hard link does not change the file.
    assert left
    assert not left.recovered.records


def test_journal_is_readable_only_by_its_user(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        path = tmp_path / "journal-1"
        path.write_bytes(b"damaged")
        path.with_name("journal-1.damaged").write_bytes(b"an older one")
        path.with_name("journal-1.damaged").chmod(0o644)
        path.with_name("journal-1.new").write_bytes(b"of a killed master")
        path.with_name("journal-1.new").chmod(0o644)
        journal = Journal(path, list)
        journal.read()
        journal.start()
        modes = {each.name: stat.S_IMODE(each.stat().st_mode) for each in tmp_path.iterdir()}
    finally:
        os.umask(before)
    assert modes == dict.fromkeys(["journal-1", "journal-1.damaged", "journal-1.lock"], 0o600)
    journal.close()


@pytest.mark.parametrize("link", LINKS, ids=["symbolic", "hard"])
def test_log_files_follow_no_link(tmp_path: Path, mine: Path, link: Callable[[Path, Path], None]) -> None:
    path = tmp_path / "log"
    link(path, mine)
    with pytest.raises(OSError, match="link"):
        LogFile(path, 1000, "master")
    with pytest.raises(OSError, match="link"):
        LogFileHandler(path)
    link(tmp_path / f"roslaunch-{socket.gethostname()}-{os.getpid()}.log", mine)
    with pytest.raises(OSError, match="link"):
        Output().log_to(tmp_path)
    with pytest.raises(Exception, match="link"):
        start_process("node", ["true"], environ=os.environ, stdout_file=path)
    assert mine.read_text() == "precious"


def test_log_file_that_becomes_a_link_is_not_followed(tmp_path: Path, mine: Path) -> None:
    handler = LogFileHandler(tmp_path / "log", 100, 1)
    for number in range(20):
        (tmp_path / "log.1").unlink(missing_ok=True)
        (tmp_path / "log.1").symlink_to(mine)
        handler.emit(logging.makeLogRecord({"msg": f"line {number}"}))
    handler.close()
    assert mine.read_text() == "precious"


def test_test_results_follow_no_link(tmp_path: Path, mine: Path) -> None:
    (tmp_path / "result.xml").symlink_to(mine)
    (tmp_path / "result.xml.part").symlink_to(mine)
    Result("name").write(tmp_path / "result.xml")
    assert mine.read_text() == "precious"
    assert not (tmp_path / "result.xml").is_symlink()


def test_board_in_a_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "boards").symlink_to(tmp_path / "real")
    (tmp_path / "real").chmod(0o777)
    with pytest.raises(Exception, match="open to others"):
        BoardDirectory.find(environ={"MINIROSPY_RUNTIME_DIR": str(tmp_path / "boards")}).prepare()


def test_roscore_follows_no_links_in_its_folder(
    tmp_path: Path, mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port, home = free_port(), tmp_path / "shared"
    (home / "master").mkdir(parents=True)
    (home / "log").mkdir()
    (tmp_path / "folder").mkdir()
    for name in [f"roscore-{port}.pid", f"master/journal-{port}.lock", f"master/journal-{port}"]:
        (home / name).symlink_to(mine)
    (home / "log" / "latest").symlink_to(tmp_path / "folder")
    monkeypatch.setenv("ROS_HOME", str(home))
    monkeypatch.delenv("ROS_LOG_DIR")
    core = subprocess.Popen(
        [str(BIN / "roscore"), "-p", str(port)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert core.stdout
    said = ""

    for line in core.stdout:
        said += line
        if "Ctrl-C" in line:
            break

    core.send_signal(signal.SIGTERM)
    said += core.communicate(timeout=30)[0]
    assert core.returncode == 0
    assert "it is a symbolic link, which is not followed; set ROS_HOME" in said
    assert mine.read_text() == "precious"
    assert not list((tmp_path / "folder").iterdir())
    assert (home / "log" / "latest" / "master.log").is_file()
