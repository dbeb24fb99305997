"""introspect/doctor: findings on environments, addresses and clocks. For the graph: tests/cli/test_doctor.py."""

from __future__ import annotations

import importlib.util
import os
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, RpcError, RpcUnreachable
from minirospy.base.installation import install_command
from minirospy.introspect.doctor import Examination, Finding, Status, reach
from minirospy.introspect.doctor.graph import NodeAnswer, check_large_messages
from minirospy.introspect.doctor.machine import (
    check_packages,
    check_python,
    check_shared_memory,
    check_variables,
)
from minirospy.introspect.doctor.master import clock_finding
from minirospy.introspect.doctor.reach import (
    Fault,
    MasterLocation,
    addresses,
    addresses_of,
    in_parallel,
    is_own_address,
    own_address_towards,
    trouble_of,
)
from minirospy.introspect.graph import NodeAddress
from minirospy.runtime.rpc.master_proxy import BusConnection, MasterProxy
from minirospy.runtime.transport import shared_memory
from minirospy.workspace.packages import built_in_roots

HERE = MasterLocation("localhost", 11311, ["127.0.0.1"])
AFAR = MasterLocation("robot", 11311, ["192.0.2.7"])


# --- addresses


def test_query_that_takes_too_long_times_out(monkeypatch: pytest.MonkeyPatch) -> None:
    end = threading.Event()
    # The times at the start, before the first result, and before the second, when the time limit has passed.
    times = iter([0.0, 0.0, 60.0])
    monkeypatch.setattr(reach, "time", SimpleNamespace(monotonic=lambda: next(times)))
    answered = threading.Event()
    answered.set()
    found = in_parallel(threading.Event.wait, [answered, end], 60.0)
    end.set()
    assert found[0] is True
    assert isinstance(found[1], TimeoutError)


def test_queries_run_in_parallel() -> None:
    def ask(number: int) -> int:
        if number == 3:
            raise OSError("no")
        return number * 2

    found = in_parallel(ask, range(100), 30.0)
    assert isinstance(found[3], OSError)
    assert [each for each in found if not isinstance(each, Exception)] == [
        2 * n for n in range(100) if n != 3
    ]


def test_names_are_looked_up_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    end = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: end.wait(60) and [])
    start = time.monotonic()
    found = addresses_of([f"robot{number}" for number in range(20)], 0.3)
    end.set()
    assert time.monotonic() - start < 20
    assert found == {f"robot{number}": [] for number in range(20)}


def test_addresses() -> None:
    assert addresses("127.0.0.1") == ["127.0.0.1"]
    assert addresses("no-such-host.invalid") == []
    assert is_own_address("127.0.0.1")
    assert not is_own_address("192.0.2.7")
    assert own_address_towards("127.0.0.1") == "127.0.0.1"


@pytest.fixture
def listener() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server


def fault_at(uri: str, timeout: float = 60.0) -> Fault:
    master = MasterProxy(uri, "/test", timeout)
    try:
        master.get_pid()
    except (MasterUnreachableError, RpcError) as error:
        return trouble_of(error).fault
    finally:
        master.close()
    raise AssertionError("somebody answers")


def test_why_an_address_does_not_answer(listener: socket.socket) -> None:
    port = listener.getsockname()[1]
    assert fault_at("http://127.0.0.1:1") is Fault.REFUSED
    assert fault_at("http://no-such-host.invalid:1") is Fault.NAME
    assert fault_at(f"http://127.0.0.1:{port}", 0.3) is Fault.LATE
    assert trouble_of(TimeoutError()).fault is Fault.SILENT
    assert trouble_of(RpcUnreachable("http://x:1", "odd")).fault is Fault.OTHER


def test_server_without_ros_is_reported(listener: socket.socket) -> None:
    def hang_up() -> None:
        peer, _ = listener.accept()
        with peer:
            peer.recv(100)
            peer.sendall(b"220 mail ready\r\n\r\n")

    thread = threading.Thread(target=hang_up)
    thread.start()
    assert fault_at(f"http://127.0.0.1:{listener.getsockname()[1]}") is Fault.STRANGER
    thread.join()


# --- variables


def said(environ: dict[str, str], place: MasterLocation) -> list[Finding]:
    environ = {"ROS_HOME": "/tmp", **environ}
    environment = Environment.read(environ)
    known = addresses_of((environment.host, environ.get("ROS_HOSTNAME") or environment.host))
    return list(check_variables(environ, environment, place, known))


@pytest.mark.parametrize(
    ("environ", "place", "status", "text"),
    [
        ({"ROS_HOSTNAME": "localhost"}, HERE, "ok", "ROS_HOSTNAME=localhost"),
        (
            {"ROS_IP": "127.0.0.1"},
            AFAR,
            "problem",
            "is this machine alone, but the master is on another one (robot)",
        ),
        ({"ROS_HOSTNAME": "localhost"}, AFAR, "problem", "ROS_HOSTNAME=localhost is this machine alone"),
        (
            {"ROS_HOSTNAME": "nowhere.invalid"},
            HERE,
            "problem",
            "ROS_HOSTNAME=nowhere.invalid is not a name that this machine knows",
        ),
        ({"ROS_IP": "192.0.2.1"}, AFAR, "warning", "ROS_IP=192.0.2.1 is not an address of this machine"),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_IP": "192.0.2.1"},
            HERE,
            "problem",
            "are both set, and say different things: ROS_HOSTNAME counts",
        ),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_IP": "127.0.0.1"},
            HERE,
            "warning",
            "are both set: ROS_HOSTNAME counts",
        ),
        ({"ROS_IP": "localhost"}, HERE, "warning", "ROS_IP=localhost is a name, not an IP address"),
        ({"ROS_IP": "127.1"}, HERE, "warning", "ROS_IP=127.1 is not a whole IP address"),
        ({"ROS_IP": "X.invalid"}, HERE, "problem", "ROS_IP=X.invalid is neither an IP address nor a name"),
        ({"ROS_IP": "0.0.0.0"}, HERE, "problem", "ROS_IP=0.0.0.0 is every address and none"),
        ({"ROS_IP": "::1"}, HERE, "problem", "ROS_IP=::1 is an IPv6 address, and nodes listen on IPv4 alone"),
        ({"ROS_IP": "::1", "ROS_IPV6": "on"}, HERE, "ok", "ROS_IP=::1"),
        ({"ROS_HOSTNAME": "localhost", "ROS_IPV6": "1"}, HERE, "warning", "ROS_IPV6=1 has no effect"),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_NAMESPACE": "a b"},
            HERE,
            "problem",
            "ROS_NAMESPACE=a b is not a legal name",
        ),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_PACKAGE_PATH": "/nowhere"},
            HERE,
            "warning",
            "which is not a folder",
        ),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_LOG_DIR": "/dev/null/log"},
            HERE,
            "problem",
            "logs cannot be written to /dev/null/log: /dev/null is a file, no folder",
        ),
        (
            {"ROS_HOSTNAME": "localhost", "ROS_PYTHON_LOG_CONFIG_FILE": "/nowhere"},
            HERE,
            "warning",
            "ROS_PYTHON_LOG_CONFIG_FILE=/nowhere is not a file",
        ),
    ],
)
def test_variables(environ: dict[str, str], place: MasterLocation, status: str, text: str) -> None:
    (finding,) = said(environ, place)
    assert (finding.status.value, text in finding.text) == (status, True), finding
    assert bool(finding.advice) == (status != "ok")


def test_folder_of_another_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`sudo roscore` leaves such a folder. The advice never covers a folder above the one in question."""
    monkeypatch.setattr(os, "access", lambda path, _: Path(path) != tmp_path)
    environ = {"ROS_HOSTNAME": "localhost", "ROS_HOME": str(tmp_path)}
    (finding,) = said(environ, HERE)
    assert finding.text == f"logs cannot be written to {tmp_path}: {tmp_path} may not be written by this user"
    assert finding.advice == f"export ROS_HOME=<a folder of your own>, or `sudo chown -R $USER {tmp_path}`"
    (finding,) = said({**environ, "ROS_HOME": f"{tmp_path}/a/b"}, HERE)
    assert finding.advice == "export ROS_HOME=<a folder of your own>"


def test_a_variable_that_cannot_be_read_ends_the_examination() -> None:
    with Examination({"ROS_MASTER_URI": "robot:11311"}) as examination:
        last = list(examination.findings())[-1]
    assert last.status is Status.PROBLEM
    assert "ROS_MASTER_URI [robot:11311] is not of the form http://host:port" in last.text


# --- shared memory


@pytest.mark.parametrize("transport", ["unix", "tcp"])
def test_shared_memory_that_is_turned_off(transport: str) -> None:
    (finding,) = check_shared_memory(Environment.read({"MINIROSPY_TRANSPORT": transport}))
    text = f"off, by MINIROSPY_TRANSPORT={transport}: messages use sockets"
    assert finding == Finding("shared memory", Status.OK, text)


@pytest.mark.skipif(not shared_memory.is_possible(), reason="shared memory needs Linux")
def test_shared_memory_that_works() -> None:
    (finding,) = check_shared_memory(Environment.read({}))
    text = "works: large messages between processes of this user use it"
    assert finding == Finding("shared memory", Status.OK, text)


def test_shared_memory_that_the_system_does_not_have(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    (finding,) = check_shared_memory(Environment.read({}))
    assert finding == Finding("shared memory", Status.OK, "none: it needs Linux; large messages use sockets")


def test_shared_memory_that_python_does_not_have(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delattr(os, "memfd_create", raising=False)
    (finding,) = check_shared_memory(Environment.read({}))
    assert finding.status is Status.OK
    assert (
        finding.text == "none: this Python has no os.memfd_create or os.eventfd; large messages use sockets"
    )


@pytest.mark.skipif(not shared_memory.is_possible(), reason="shared memory needs Linux")
def test_shared_memory_that_a_container_forbids(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(*_: object) -> int:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "memfd_create", forbidden)
    (finding,) = check_shared_memory(Environment.read({}))
    assert finding == Finding(
        "shared memory",
        Status.WARNING,
        "does not work: Operation not permitted; large messages use sockets, which is slower",
        "in a container: allow memfd_create, eventfd2 and /proc, and enough memory",
    )


def test_topics_of_large_messages() -> None:
    def link(subscriber: str, topic: str, words: str, direction: str = "o") -> BusConnection:
        info = f"UNIXROS connection to [unix on socket 9]{words}"
        return BusConnection(9, subscriber, direction, "TCPROS", topic, True, info)

    by_ring = "; 118 of 120 large messages by shared memory"
    by_socket = "; 0 of 120 large messages by shared memory: the subscriber belongs to another user"
    links = (
        link("/viewer", "/image", by_ring),
        link("/recorder", "/image", by_ring),
        link("/remote", "/image", by_socket),
        link("/remote_too", "/image", by_socket),
        link("/viewer", "/words", ""),
        # Only the publisher knows.
        link("http://x/", "/cloud", by_ring, "i"),
        BusConnection(7, "/b", "o", "TCPROS", "/odd", True, None),  # type: ignore[arg-type]
    )
    answers = {"/camera": NodeAnswer(NodeAddress("/camera", "http://localhost:1/"), links=links)}
    assert list(check_large_messages(answers)) == [
        Finding("large messages", Status.OK, "shared memory: /image of /camera"),
        Finding(
            "large messages",
            Status.OK,
            "socket: /image of /camera to /remote, /remote_too: the subscriber belongs to another user",
        ),
    ]
    assert list(check_large_messages({})) == []


# --- clocks


@pytest.mark.parametrize(
    ("theirs", "status", "text"),
    [
        (100.0, "ok", "is the same"),
        (100.05, "ok", "is the same"),
        (100.5, "warning", "0.4 s ahead of this one"),
        (99.5, "warning", "0.5 s behind this one"),
        (3700.0, "problem", "3599.9 s ahead of this one"),
    ],
)
def test_clocks(theirs: float, status: str, text: str) -> None:
    finding = clock_finding("robot", theirs, before=100.0, after=100.1)
    assert (finding.status.value, text in finding.text) == (status, True), finding


# --- packages


def test_python_and_libraries_are_fine() -> None:
    assert [finding.status for finding in check_python()] == [Status.OK]


def test_library_that_is_not_installed_is_named_with_its_command(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name in ("yaml", "segno") else real(name)
    )
    _, finding = check_python()
    assert (finding.status, finding.text) == (Status.PROBLEM, "not installed: PyYAML, segno")
    assert finding.advice == install_command("PyYAML", "segno")


@pytest.mark.parametrize(("version", "count"), [((3, 12, 1), 1), ((3, 12, 3), 0), ((3, 11, 9), 0)])
def test_python_that_loses_threads_is_reported(
    version: tuple[int, int, int], count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "version_info", (*version, "final", 0))
    warnings = [finding for finding in check_python() if finding.status is Status.WARNING]
    assert len(warnings) == count
    assert all("3.12.3" in finding.text for finding in warnings)


def package(folder: Path, name: str, *depends: str) -> None:
    folder.mkdir(parents=True)
    needs = "".join(f"<exec_depend>{each}</exec_depend>" for each in depends)
    (folder / "package.xml").write_text(
        f'<package format="2"><name>{name}</name><version>0.1.0</version><description>d</description>'
        f'<maintainer email="a@b.c">a</maintainer><license>BSD</license>{needs}</package>'
    )


def test_packages(tmp_path: Path) -> None:
    package(tmp_path / "a" / "arm", "arm", "rospy", "std_msgs", "hand_msgs", "python3-numpy", "tf2_ros")
    package(tmp_path / "b" / "arm", "arm")
    package(tmp_path / "b" / "leg", "leg")
    (tmp_path / "b" / "leg" / "package.xml").write_text("<package><name>leg</name>")
    environ = {"ROS_PACKAGE_PATH": os.pathsep.join([str(tmp_path / "a"), str(tmp_path / "b")])}
    found = list(check_packages(Environment.read(environ), tmp_path))
    texts = [each.text for each in found]
    assert texts[0] == f"arm is in {tmp_path}/a/arm and in {tmp_path}/b/arm: the first counts"
    assert texts[1] == "arm needs hand_msgs, which is not a package here"
    assert f"{tmp_path}/b/leg/package.xml" in texts[2]
    assert [each.status.value for each in found] == ["warning", "warning", "problem"]


def test_new_package_of_the_workshop_has_no_findings(tmp_path: Path) -> None:
    """In the course, students create `rpi_msgs`, which minirospy includes, so a workspace has both."""
    package(tmp_path / "rpi_msgs", "rpi_msgs", "rospy")
    paths = os.pathsep.join(map(str, (tmp_path, *built_in_roots())))
    (finding,) = check_packages(Environment.read({"ROS_PACKAGE_PATH": paths}), tmp_path)
    assert finding == Finding("packages", Status.OK, "1 in ROS_PACKAGE_PATH")


def test_a_workspace_that_was_not_sourced(tmp_path: Path) -> None:
    (tmp_path / "devel").mkdir()
    (tmp_path / "devel" / "setup.bash").touch()
    package(tmp_path / "src" / "arm", "arm")
    (finding,) = check_packages(Environment.read({}), tmp_path / "src" / "arm")
    assert finding.advice == f"source {tmp_path}/devel/setup.bash"
    (finding,) = check_packages(Environment.read({"ROS_PACKAGE_PATH": f"{tmp_path}/src"}), tmp_path / "src")
    assert finding == Finding("packages", Status.OK, "1 in ROS_PACKAGE_PATH")
