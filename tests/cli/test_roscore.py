"""roscore as a process: restoring the session, the log folder, its options, the health line."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.errors import MasterUnreachableError
from minirospy.command.command import warn
from minirospy.ros.rosmaster.commands import master as commands
from minirospy.ros.rosmaster.commands.master import main, roscore
from minirospy.ros.rostopic.commands.rostopic import main as rostopic
from minirospy.runtime.master.journal import Journal
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import free_port

from .conftest import own_lines

BIN = Path(sys.executable).parent
pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no such signals between processes"
)


class Core:
    """A roscore that has reported that it is ready."""

    def __init__(self, *options: str) -> None:
        self.process = subprocess.Popen(
            [str(BIN / "roscore"), *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert self.process.stdout
        self.said = ""
        for line in self.process.stdout:
            self.said += line
            if "Ctrl-C" in line:
                break

    def end(self, number: int = signal.SIGTERM) -> str:
        """Stop roscore; return its remaining output."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.communicate(timeout=30)[0]


Start = Callable[..., Core]


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Start roscore on the test's port, which ROS_MASTER_URI names."""
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    started: list[Core] = []

    def run(*options: str) -> Core:
        started.append(Core(*options))
        return started[-1]

    yield run
    for core in started:
        core.end(signal.SIGKILL)


def proxy() -> MasterProxy:
    return MasterProxy(os.environ["ROS_MASTER_URI"], "/test")


def test_killed_session_is_continued(start: Start) -> None:
    first = start()
    master = proxy()
    run_id = master.get_param("/run_id")
    master.set_param("/kept", {"a": [1, 2]})
    first.end(signal.SIGKILL)
    second = start()
    assert "journal: recovered 0 nodes and 4 parameters of the master that stopped" in second.said
    assert f"setting /run_id to {run_id}\n" in second.said
    assert master.get_param("/kept") == {"a": [1, 2]}
    # The registration and address of the killed roscore's /rosout are not listed twice.
    assert master.get_system_state().publishers == {"/rosout_agg": ["/rosout"]}
    second.end()
    third = start()
    assert "journal" not in third.said
    assert master.get_param("/run_id") != run_id
    assert set(master.get_param_names()) == {"/run_id", "/rosdistro", "/rosversion"}
    master.close()
    assert not list(Path(os.environ["ROS_HOME"], "master").glob("*.damaged"))


@pytest.mark.parametrize("options", [["--fresh"], ["--no-journal"]])
def test_killed_session_is_ignored_with_fresh_or_no_journal(start: Start, options: list[str]) -> None:
    start(*options).end(signal.SIGKILL)
    core = start(*options)
    assert "recovered" not in core.said
    master = proxy()
    assert set(master.get_param_names()) == {"/run_id", "/rosdistro", "/rosversion"}
    assert Path(os.environ["ROS_HOME"], "master").exists() == (options == ["--fresh"])
    master.close()


def test_closed_terminal_is_a_clean_shutdown(start: Start) -> None:
    core = start()
    assert list(Path(os.environ["ROS_HOME"], "master").glob("journal-*[0-9]"))
    assert core.end(signal.SIGHUP) == "master stopped\n"
    assert not list(Path(os.environ["ROS_HOME"], "master").glob("journal-*[0-9]"))


def test_pid_file_exists_while_the_master_runs(start: Start) -> None:
    core = start()
    port = os.environ["ROS_MASTER_URI"].rpartition(":")[2]
    pid_file = Path(os.environ["ROS_HOME"], f"roscore-{port}.pid")
    assert pid_file.read_text() == str(core.process.pid)
    os.kill(int(pid_file.read_text()), signal.SIGTERM)
    assert core.process.wait(30) == 0
    assert not pid_file.exists()


def test_shutdown_call_is_a_clean_shutdown(start: Start) -> None:
    core = start()
    master = proxy()
    master.call("shutdown", "enough")
    master.close()
    assert core.process.wait(30) == 0
    assert not list(Path(os.environ["ROS_HOME"], "master").glob("journal-*[0-9]"))


def test_folders_that_cannot_be_created_are_reported(
    start: Start, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """roscore runs without the folders and prints one line for the logs and one for the journal."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("ROS_LOG_DIR")
    core = start()
    master = proxy()
    run_id = master.get_param("/run_id")

    assert (
        f"WARNING: cannot write logs to {tmp_path}/file/log/{run_id}: Not a directory; set ROS_LOG_DIR\n"
        in core.said
    )
    assert ", no log file\n" in core.said
    assert f"{tmp_path}/file/master/journal-" in core.said
    assert " cannot be written: Not a directory; set ROS_HOME (it is tried again every 30 s)\n" in core.said
    assert "Errno" not in core.said
    assert f"setting /run_id to {run_id}\n" in core.said

    # The /rosout node receives log messages, and continues without its file.
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.2)
    assert rostopic(["pub", "-1", "/rosout", "rosgraph_msgs/Log", "{level: 2, msg: hello}"]) == 0
    master.close()

    assert core.end() == "master stopped\n"


def test_address_of_another_network_is_reported(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_HOSTNAME")
    for address, is_ours in (("203.0.113.9", False), ("127.0.0.1", True)):
        monkeypatch.setenv("ROS_IP", address)
        core = start()
        warning = f"WARNING: ROS_IP={address} is not an address of this machine: correct only behind NAT or in a container"
        assert (warning in core.said) != is_ours
        core.end()
    monkeypatch.setenv("ROS_IP", "::1")
    assert "WARNING: ROS_IP=::1 is an IPv6 address, where no node listens without ROS_IPV6=on" in start().said


@pytest.mark.parametrize(
    ("uri", "what"),
    [
        ("http://localhost:1", "port [1] does not match this roscore [{}]"),
        ("http://203.0.113.9:{}", "[http://203.0.113.9:{}] host is not set to this machine"),
    ],
)
def test_uri_of_another_master_is_reported(
    start: Start, monkeypatch: pytest.MonkeyPatch, uri: str, what: str
) -> None:
    port = os.environ["ROS_MASTER_URI"].rpartition(":")[2]
    monkeypatch.setenv("ROS_MASTER_URI", uri.format(port))
    core = start("-p", port)
    assert core.process.stdout
    said = core.said if "WARNING" in core.said else core.process.stdout.readline()
    assert f"WARNING: ROS_MASTER_URI {what.format(port)}: nodes find it with ROS_MASTER_URI=http://" in said


def test_log_folder(start: Start) -> None:
    core = start()
    master = proxy()
    folder = Path(os.environ["ROS_LOG_DIR"]) / master.get_param("/run_id")
    master.register_publisher("/t", "a/B", "http://127.0.0.1:1/")
    master.set_param("/p", 1)
    master.call("subscribeParam", "http://127.0.0.1:1/", "/p")
    master.call("unsubscribeParam", "http://127.0.0.1:1/", "/p")
    master.close()
    core.end()

    # The file exists from the start, for `tail -f`, and starts with the lines that real rosout writes.
    assert re.fullmatch(r"\n\n[0-9]+\.[0-9]{9}  Node Startup\n", (folder / "rosout.log").read_text())
    log = (folder / "master.log").read_text()
    assert "[minirospy.master][INFO] " in log
    assert ": +PUB [/t] /test http://127.0.0.1:1/\n" in log
    assert ": +PARAM [/p] by /test\n" in log
    assert ": +CACHEDPARAM [/p] by /test\n" in log
    assert ": -CACHEDPARAM [/p] by /test\n" in log
    assert "listening on 127.0.0.1:" in log
    assert (folder.parent / "latest").resolve() == folder.resolve()


LOGS = """
import queue
import rospy
from rosgraph_msgs.msg import Log

rospy.init_node("talk", disable_rosout=True)
publisher, heard = rospy.Publisher("/rosout", Log, queue_size=9), queue.Queue()
subscriber = rospy.Subscriber("/rosout_agg", Log, heard.put)
while not (publisher.get_num_connections() and subscriber.get_num_connections()):
    rospy.sleep(0.01)
message = Log(name="/talk", file="f.py", function="g", line=7, topics=["/t", "/rosout"])
message.header.stamp = rospy.Time(5, 6)
for omit, message.level, message.msg in (
    (False, 4, "a\\nb \u00e9"), (True, 2, "no topics"), (1, 16, "no boolean"), (False, 1, "last\\x1b[2J")
):
    rospy.set_param("/rosout/omit_topics", omit)
    publisher.publish(message)
    assert heard.get(timeout=30).msg == message.msg
"""


def test_rosout_log_contains_messages_of_nodes(start: Start) -> None:
    """The lines have the same format as real rosout's."""
    core = start()
    subprocess.run([sys.executable, "-c", LOGS], check=True, timeout=60)
    core.end()
    (file,) = Path(os.environ["ROS_LOG_DIR"]).glob("*-*/rosout.log")
    assert file.read_text(encoding="utf-8").partition("Node Startup\n")[2] == (
        "5.000000006 WARN /talk [f.py:7(g)] [topics: /t, /rosout] a\nb \u00e9\n"
        "5.000000006 INFO /talk [f.py:7(g)] no topics\n"
        "5.000000006 FATAL /talk [f.py:7(g)] [topics: /t, /rosout] no boolean\n"
        "5.000000006 DEBUG /talk [f.py:7(g)] [topics: /t, /rosout] last\\x1b[2J\n"
    )


def test_rosout_log_that_cannot_be_written_is_reported(start: Start) -> None:
    start().end(signal.SIGKILL)
    (file,) = Path(os.environ["ROS_LOG_DIR"]).glob("*-*/rosout.log")
    file.unlink()
    file.mkdir()
    start().end()
    log = file.with_name("master.log").read_text()
    assert f"{file} cannot be written: Is a directory" in log


def test_verbose_quiet_and_levels(start: Start) -> None:
    core = start("-v", "--master-logger-level=error", "-w", "3", "-t", "1.5")
    master = proxy()
    master.set_param("/p", 1)
    folder = Path(os.environ["ROS_LOG_DIR"]) / master.get_param("/run_id")
    master.close()
    assert "+PARAM [/p] by /test\n" in core.said + core.end()
    assert "+PARAM" not in (folder / "master.log").read_text()


def test_without_rosout(start: Start) -> None:
    core = start("--no-rosout")
    assert "rosout" not in core.said
    master = proxy()
    assert master.get_system_state().publishers == {}
    master.close()


def test_allow_names_the_networks(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    core = start("--allow", "192.168.65.0/24", "--allow", "10.0.0.1")
    assert "open to 192.168.65.0/24, 10.0.0.1/32\n" in core.said
    master = proxy()
    assert master.get_pid() == core.process.pid
    master.close()
    core.end()
    monkeypatch.setenv("MINIROSPY_ALLOW", "10.1.0.0/16")
    assert "open to 10.1.0.0/16\n" in start().said


def test_status_line(start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    core = start()
    assert main(["--status"]) == 0
    line = capsys.readouterr().out
    assert line.startswith(f"{os.environ['ROS_MASTER_URI']}: pid {core.process.pid}, up 0:0")
    assert " 1 nodes, 2 topics, " in line
    assert " 3 parameters, " in line
    assert f"journal: {os.environ['ROS_HOME']}/master/journal-" in line
    assert line.count("\n") == 1
    core.end()
    assert roscore(["--status"]) == 1
    assert "no ROS master answers" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--allow", "here"], "'here' is not a network"),
        (["-t", "0"], "the timeout is more than 0 seconds"),
        (["-t", "nan"], "the timeout is more than 0 seconds"),
        (["--allow", ""], "--allow wants a network"),
        (["--allow", "10.0.0.0/8", "--allow", " ,"], "--allow wants a network"),
        (["--master-logger-level", "loud"], "invalid choice: 'loud'"),
    ],
)
def test_usage_errors(words: list[str], says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert roscore(words) == 2
    error: Any = capsys.readouterr().err
    assert says in error
    assert len(own_lines(error)) == 1


def test_rosout_node_lists_and_sets_the_loggers_of_the_master(
    start: Start, capsys: pytest.CaptureFixture[str]
) -> None:
    """Real ROS's /rosout does the same: it is a roscpp node, whose root logger is `ros`."""
    from minirospy.ros.rosservice.commands.rosservice import main as rosservice

    start()
    assert rosservice(["list"]) == 0
    assert capsys.readouterr().out.split() == ["/rosout/get_loggers", "/rosout/set_logger_level"]
    assert rosservice(["call", "/rosout/get_loggers"]) == 0
    assert 'name: "ros"\n    level: "info"' in capsys.readouterr().out
    assert rosservice(["call", "/rosout/set_logger_level", "ros.runtime.notifier", "Debug"]) == 0
    assert rosservice(["call", "/rosout/set_logger_level", "mine", "error"]) == 0
    rosservice(["call", "/rosout/get_loggers"])
    assert 'name: "ros.runtime.notifier"\n    level: "debug"' in capsys.readouterr().out
    assert rosservice(["call", "/rosout/set_logger_level", "ros", "loud"]) != 0
    assert "[loud] is not one of the levels debug, info, warn, error, fatal" in capsys.readouterr().err


def test_closed_standard_output_does_not_stop_the_master(start: Start) -> None:
    """For `roscore -v | head -3`, later output is discarded, and registrations continue to work."""
    core = start("-v", "--no-journal")
    assert core.process.stdout
    core.process.stdout.close()
    proxy = MasterProxy(os.environ["ROS_MASTER_URI"], "/node")
    for number in range(3):
        proxy.register_publisher(f"/t{number}", "std_msgs/Bool", "http://localhost:1/")
    assert {"/t0", "/t1", "/t2"} <= set(proxy.get_system_state().publishers)
    proxy.close()
    core.process.send_signal(signal.SIGTERM)
    assert core.process.wait(30) == 0
    core.process.stdout = None


def test_missing_standard_output_does_not_stop_the_master(start: Start) -> None:
    read, write = os.pipe()
    os.close(read)
    core = subprocess.Popen([str(BIN / "roscore"), "--no-journal"], stdout=write, stderr=subprocess.DEVNULL)
    os.close(write)
    master, found = proxy(), dict[str, list[str]]()
    while "/rosout" not in found:
        assert core.poll() is None
        with contextlib.suppress(MasterUnreachableError):
            found = master.get_system_state().subscribers
    master.close()
    core.terminate()
    assert core.wait(30) == 0


@pytest.mark.parametrize("is_held", [True, False])
def test_silent_master_at_the_port_is_known_by_its_journal(
    is_held: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A master that holds the journal's lock is busy reading the journal, or suspended. Any other program is not a master."""
    monkeypatch.setattr(commands, "ANSWER_SECONDS", 0.05)
    path = tmp_path / "journal-1"
    journal = Journal(path, list)
    journal.lock()
    if not is_held:
        journal.close()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        in_use = OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))
        said = str(commands._port_error("roscore", "localhost", port, path, in_use))
    journal.close()
    assert ("another roscore/master is already running" in said) == is_held
    assert (f"port {port} is taken by another program" in said) != is_held
    reason = "it is suspended, or reads a large journal" if is_held else "or by a suspended master (no answer"
    assert reason in said


@pytest.mark.skipif(sys.platform == "win32", reason="no program of Windows is suspended by a signal")
def test_roscore_next_to_a_suspended_master(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    def beside(*options: str) -> tuple[Core, str, subprocess.Popen[str]]:
        """Suspend a roscore on a new port, and start another one on the same port."""
        uri = f"http://localhost:{free_port()}"
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        core = start(*options)
        core.process.send_signal(signal.SIGSTOP)
        second = subprocess.Popen([str(BIN / "roscore"), *options], stderr=subprocess.PIPE, text=True)
        return core, uri.rpartition(":")[2], second

    with_journal, without = beside(), beside("--no-journal")
    errors = []
    for core, _, second in (with_journal, without):
        errors.append(second.communicate()[1])
        core.process.send_signal(signal.SIGCONT)
        assert second.returncode == 1
    assert errors[0].endswith(
        f"; it (pid {with_journal[0].process.pid}) does not answer: it is suspended, or reads a large journal\n"
    )
    assert errors[1].endswith(
        f"port {without[1]} is taken by another program or by a suspended master (no answer within 4 s): choose one "
        "with `roscore -p PORT`\n"
    )


@pytest.mark.parametrize(("stream", "call"), [("stderr", warn), ("stdout", commands._show)])
def test_a_line_is_one_write(
    stream: str, call: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a buffer (PYTHONUNBUFFERED), one thread's line could be printed in the middle of another's."""
    raw = Writes()
    monkeypatch.setattr(sys, stream, io.TextIOWrapper(raw, "utf-8", write_through=True))
    call("text")
    assert [data for data in raw.writes if data] == [b"WARNING: text\n" if call is warn else b"text\n"]


class Writes(io.RawIOBase):
    """A stream that records each write."""

    def __init__(self) -> None:
        self.writes: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data: Any, /) -> int:
        self.writes.append(bytes(data))
        return len(data)
