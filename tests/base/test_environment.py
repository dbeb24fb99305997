"""environment: the meaning of the variables, and which values are rejected."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

import pytest

from minirospy.base.environment import (
    LOOPBACK,
    Environment,
    export_local,
    is_local,
    master_and_namespace,
    run_folder,
    split_uri,
)
from minirospy.base.errors import UsageError


def test_defaults_are_those_of_ros() -> None:
    environment = Environment.read({})
    assert environment.master_uri == "http://localhost:11311"
    assert environment.master_address == ("localhost", 11311)
    assert environment.namespace == "/"
    assert environment.log_dir == Path.home() / ".ros" / "log"
    assert environment.master_is_local


def test_variables_are_read() -> None:
    environment = Environment.read(
        {
            "ROS_MASTER_URI": "http://robot:11411/",
            "ROS_IP": "192.0.2.7",
            "ROS_NAMESPACE": "wg/",
            "ROS_HOME": "/home/x/.ros",
            "ROS_PACKAGE_PATH": os.pathsep.join(["/a", "", "/b"]),
        }
    )
    assert environment.master_address == ("robot", 11411)
    assert environment.host == "192.0.2.7"
    assert environment.bind_host == "0.0.0.0"
    assert environment.namespace == "/wg"
    assert environment.log_dir == Path("/home/x/.ros/log")
    assert environment.package_path == (Path("/a"), Path("/b"))


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no user ids")
def test_a_user_without_a_home_folder_has_an_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a container, the user id may be missing in /etc/passwd, and HOME unset: a node then runs without a log file."""
    import pwd

    def fail(uid: int) -> None:
        raise KeyError(f"getpwuid(): uid not found: {uid}")

    monkeypatch.setattr(pwd, "getpwuid", fail)
    monkeypatch.delenv("HOME")
    environment = Environment.read({})
    assert (environment.home, environment.log_dir) == (
        Path("/nonexistent/.ros"),
        Path("/nonexistent/.ros/log"),
    )


def test_ros_hostname_has_precedence_over_ros_ip() -> None:
    environment = Environment.read({"ROS_HOSTNAME": "localhost", "ROS_IP": "192.0.2.7"})
    assert (environment.host, environment.bind_host) == ("localhost", "127.0.0.1")


def test_name_that_does_not_resolve_is_not_advertised(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise socket.gaierror

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    assert Environment.read({}).host == "localhost"


def test_overrides_have_precedence() -> None:
    environment = Environment.read({"ROS_MASTER_URI": "http://a:1"}, master_uri="http://b:2", host="c")
    assert (environment.master_uri, environment.host) == ("http://b:2", "c")


@pytest.mark.parametrize(
    "uri",
    [
        "localhost:11311",
        "http://",
        "http://a",
        "http://a:b",
        "ftp://a:1",
        "http://[:1",
        "http://[hostname]:11311",
    ],
)
def test_invalid_master_uri_is_refused_with_a_reason(uri: str) -> None:
    with pytest.raises(UsageError, match="is not of the form http://host:port"):
        Environment.read({"ROS_MASTER_URI": uri})


@pytest.mark.parametrize(
    ("variables", "bind_host", "uri_host"),
    [
        ({"ROS_IP": "192.0.2.7"}, "0.0.0.0", "192.0.2.7"),
        ({"ROS_HOSTNAME": "robot"}, "0.0.0.0", "robot"),
        ({"ROS_HOSTNAME": "localhost"}, "127.0.0.1", "localhost"),
        ({"ROS_IP": "127.0.1.1"}, "127.0.1.1", "127.0.1.1"),
        ({"ROS_IP": "::1"}, "127.0.0.1", "[::1]"),
        ({"ROS_IP": "::1", "ROS_IPV6": "on"}, "::1", "[::1]"),
        ({"ROS_HOSTNAME": "localhost", "ROS_IPV6": "on"}, "::1", "localhost"),
        ({"ROS_HOSTNAME": "robot", "ROS_IPV6": "on"}, "::", "robot"),
        ({"ROS_IP": "fe80::1", "ROS_IPV6": "on"}, "::", "[fe80::1]"),
        ({"ROS_HOSTNAME": "robot", "ROS_IPV6": "ON"}, "0.0.0.0", "robot"),
    ],
)
def test_bind_address_is_that_of_rosgraph_network(
    variables: dict[str, str], bind_host: str, uri_host: str
) -> None:
    environment = Environment.read(variables)
    assert (environment.bind_host, environment.uri_host) == (bind_host, uri_host)


@pytest.mark.parametrize("host", ["http://robot", "robot:11311", "robot/", " robot", "[::1]"])
@pytest.mark.parametrize("variable", ["ROS_HOSTNAME", "ROS_IP"])
def test_host_with_scheme_or_port_is_refused_with_a_reason(variable: str, host: str) -> None:
    with pytest.raises(UsageError, match="must be a name or an address alone"):
        Environment.read({variable: host})


def test_port_range_is_parsed() -> None:
    assert Environment.read({}).ports is None
    assert Environment.read({"MINIROSPY_PORTS": "40000-40100"}).ports == range(40000, 40101)
    assert Environment.read({"MINIROSPY_PORTS": "40000"}).ports == range(40000, 40001)


@pytest.mark.parametrize("text", ["a-b", "40100-40000", "0-5", "1-70000", "-5"])
def test_invalid_port_range_is_refused_with_a_reason(text: str) -> None:
    with pytest.raises(UsageError, match="is not a range of ports"):
        Environment.read({"MINIROSPY_PORTS": text})


@pytest.mark.parametrize(
    "run_id", ["", ".", "..", "a/b", "/a", "a\\b", "a\n", "a\0", "\x1b", "x" * 101, 1, None, ["a"]]
)
def test_run_id_that_is_not_one_folder_is_refused(run_id: object) -> None:
    assert run_folder(Path("/log"), run_id) is None


@pytest.mark.parametrize("run_id", ["a-run", "9c1c52e0-c7b5-11ee-b3b5-0242ac110002", "run_1.2", "my run"])
def test_run_id_is_a_folder_of_the_logs(run_id: str) -> None:
    assert run_folder(Path("/log"), run_id) == Path("/log") / run_id


@pytest.mark.parametrize(
    "uri",
    [
        "http://a:1/ HTTP/1.1\r\nX: y",
        "http://a:1/\nx",
        "http://a b:1/",
        "http://a\t:1/",
        "http://a:1/\x9b",
        "http://\x1ba:1",
        "http://a:1/\u2028",
    ],
)
def test_uri_with_control_characters_is_refused(uri: str) -> None:
    with pytest.raises(ValueError, match="is not of the form") as raised:
        split_uri(uri)
    assert str(raised.value).isprintable()


@pytest.mark.parametrize(
    "elsewhere", [{}, {"ROS_IP": "192.0.2.7"}, {"ROS_HOSTNAME": "robot"}, {"MINIROSPY_ALLOW": "192.0.2.7"}]
)
def test_minirospy_local_has_precedence_over_addresses(elsewhere: dict[str, str]) -> None:
    environment = Environment.read({"MINIROSPY_LOCAL": "1", **elsewhere}, host="here")
    assert (environment.host, environment.bind_host, environment.allow) == (
        "localhost",
        "127.0.0.1",
        LOOPBACK,
    )
    assert environment.local
    assert environment.master_uri == "http://localhost:11311"
    assert not Environment.read({"MINIROSPY_LOCAL": "0", **elsewhere}).local


def test_minirospy_local_with_ipv6_binds_its_loopback() -> None:
    assert Environment.read({"MINIROSPY_LOCAL": "1", "ROS_IPV6": "on"}).bind_host == "::1"


@pytest.mark.parametrize(
    ("uri", "reached"),
    [
        (f"http://{socket.gethostname()}:11411/", "http://localhost:11411/"),
        ("http://127.0.1.1:11411", "http://localhost:11411/"),
        ("http://localhost:11411", "http://localhost:11411"),
        ("http://[::1]:11411", "http://[::1]:11411"),
    ],
)
def test_minirospy_local_reaches_a_master_of_this_machine_by_loopback(uri: str, reached: str) -> None:
    """A master that listens on 127.0.0.1 cannot be reached at the address to which this machine's host name resolves."""
    environ = {"MINIROSPY_LOCAL": "1", "ROS_MASTER_URI": uri}
    assert Environment.read(environ).master_uri == reached
    assert master_and_namespace(environ)[0] == reached


def test_minirospy_local_refuses_a_master_of_another_machine() -> None:
    environ = {"MINIROSPY_LOCAL": "1", "ROS_MASTER_URI": "http://192.0.2.200:11311"}
    for read in (Environment.read, master_and_namespace, export_local):
        with pytest.raises(UsageError) as refused:
            read(environ)
        assert str(refused.value) == (
            "MINIROSPY_LOCAL=1 keeps everything on this machine, but the master [http://192.0.2.200:11311] is on another "
            "one: `unset MINIROSPY_LOCAL`, or `export ROS_MASTER_URI=http://localhost:11311`"
        )


@pytest.mark.parametrize(
    ("text", "local"), [("", False), ("0", False), ("off", False), ("1", True), ("ON", True)]
)
def test_minirospy_local_is_on_or_off(text: str, local: bool) -> None:
    assert is_local({"MINIROSPY_LOCAL": text}) == local


def test_an_unknown_minirospy_local_is_refused() -> None:
    """A misspelt value must not allow access that the user wanted to prevent."""
    with pytest.raises(UsageError, match=r"MINIROSPY_LOCAL \[yes please\] is neither 1 nor 0"):
        Environment.read({"MINIROSPY_LOCAL": "yes please"})


def test_export_local_keeps_nodes_of_other_clients_on_this_machine() -> None:
    environ = {"ROS_IP": "192.0.2.7"}
    export_local(environ)
    assert environ == {"ROS_IP": "192.0.2.7"}
    environ = {"MINIROSPY_LOCAL": "1", "ROS_IP": "192.0.2.7", "ROS_MASTER_URI": "http://127.0.1.1:11411"}
    export_local(environ)
    assert environ == {
        "MINIROSPY_LOCAL": "1",
        "ROS_HOSTNAME": "localhost",
        "ROS_MASTER_URI": "http://localhost:11411/",
    }
