"""environment: what the variables mean, and what is refused."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from minirospy.environment import Environment
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
    "uri", ["localhost:11311", "http://", "http://a", "http://a:b", "ftp://a:1", "http://[:1"]
)
def test_a_bad_master_uri_is_refused_in_words(uri: str) -> None:
    with pytest.raises(UsageError, match="is not of the form http://host:port"):
        Environment.read({"ROS_MASTER_URI": uri})
