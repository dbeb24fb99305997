"""environment: what the variables mean, and what is refused."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from minirospy.environment import Environment, run_folder, split_uri
from minirospy.errors import UsageError


def test_the_defaults_are_roses() -> None:
    environment = Environment.read({})
    assert environment.master_uri == "http://localhost:11311"
    assert environment.master_address == ("localhost", 11311)
    assert environment.namespace == "/"
    assert environment.log_dir == Path.home() / ".ros" / "log"
    assert environment.master_is_local


def test_the_variables_are_read() -> None:
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


def test_ros_hostname_goes_before_ros_ip() -> None:
    environment = Environment.read({"ROS_HOSTNAME": "localhost", "ROS_IP": "192.0.2.7"})
    assert (environment.host, environment.bind_host) == ("localhost", "127.0.0.1")


def test_a_name_that_does_not_resolve_is_not_told_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise socket.gaierror

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    assert Environment.read({}).host == "localhost"


def test_overrides_win() -> None:
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
def test_a_bad_master_uri_is_refused_in_words(uri: str) -> None:
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
def test_where_servers_listen_as_rosgraph_network_tells(
    variables: dict[str, str], bind_host: str, uri_host: str
) -> None:
    environment = Environment.read(variables)
    assert (environment.bind_host, environment.uri_host) == (bind_host, uri_host)


@pytest.mark.parametrize("host", ["http://robot", "robot:11311", "robot/", " robot", "[::1]"])
@pytest.mark.parametrize("variable", ["ROS_HOSTNAME", "ROS_IP"])
def test_a_host_that_is_more_than_a_host_is_refused_in_words(variable: str, host: str) -> None:
    with pytest.raises(UsageError, match="must be a name or an address alone"):
        Environment.read({variable: host})


def test_a_range_of_ports() -> None:
    assert Environment.read({}).ports is None
    assert Environment.read({"MINIROSPY_PORTS": "40000-40100"}).ports == range(40000, 40101)
    assert Environment.read({"MINIROSPY_PORTS": "40000"}).ports == range(40000, 40001)


@pytest.mark.parametrize("text", ["a-b", "40100-40000", "0-5", "1-70000", "-5"])
def test_a_range_that_is_none_is_refused_in_words(text: str) -> None:
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
