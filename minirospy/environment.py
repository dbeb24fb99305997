"""What the environment says: ROS_MASTER_URI and its kin in, one frozen record out.

Read once where a process starts (a command's main, init_node) and handed on as an argument.
Source: http://wiki.ros.org/ROS/EnvironmentVariables and http://wiki.ros.org/ROS/NetworkSetup.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from minirospy.errors import UsageError

__all__ = ["DEFAULT_MASTER_PORT", "Environment"]

DEFAULT_MASTER_PORT = 11311


class Environment(NamedTuple):
    """Where the master is, how this process is reached, and where its files go.

    ``host`` is the name that peers are told; ``bind_host`` the address that servers listen on
    (loopback when ``host`` is, else every interface).
    """

    master_uri: str
    host: str
    namespace: str
    home: Path
    log_dir: Path
    package_path: tuple[Path, ...] = ()

    @classmethod
    def read(cls, environ: Mapping[str, str] | None = None, **overrides: str) -> Environment:
        """The record for ``environ`` (default: the process's). Overrides: master_uri, host, namespace.

        Raises UsageError on a ROS_MASTER_URI that is not http://host:port.
        """
        environ = os.environ if environ is None else environ
        home = Path(environ.get("ROS_HOME") or Path.home() / ".ros")
        uri = overrides.get("master_uri") or environ.get("ROS_MASTER_URI")
        return cls(
            master_uri=_checked_uri(uri or f"http://localhost:{DEFAULT_MASTER_PORT}"),
            host=overrides.get("host") or _advertised_host(environ),
            namespace="/" + (overrides.get("namespace") or environ.get("ROS_NAMESPACE") or "").strip("/"),
            home=home,
            log_dir=Path(environ.get("ROS_LOG_DIR") or home / "log"),
            package_path=tuple(Path(p) for p in environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p),
        )

    @property
    def bind_host(self) -> str:
        """The address to listen on, as rospy chooses it."""
        if self.host == "localhost" or self.host.startswith("127."):
            return "127.0.0.1"
        return "0.0.0.0"

    @property
    def master_address(self) -> tuple[str, int]:
        """(host, port) of the master."""
        parts = urlsplit(self.master_uri)
        return parts.hostname or "localhost", parts.port or DEFAULT_MASTER_PORT

    @property
    def master_is_local(self) -> bool:
        """Whether the master's host is this machine, so that a tool may start one."""
        host = self.master_address[0]
        if host in {"localhost", "::1", self.host, socket.gethostname()} or host.startswith("127."):
            return True
        try:
            address = socket.gethostbyname(host)
            if address.startswith("127."):
                return True
            # Only an address of this machine can be bound.
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind((address, 0))
        except OSError:
            return False
        return True


def _checked_uri(uri: str) -> str:
    try:
        parts = urlsplit(uri)
        usable = parts.scheme == "http" and bool(parts.hostname) and bool(parts.port)
    except ValueError:
        usable = False
    if not usable:
        raise UsageError(
            f"ROS_MASTER_URI [{uri}] is not of the form http://host:port, as http://localhost:11311"
        )
    return uri


def _advertised_host(environ: Mapping[str, str]) -> str:
    """ROS_HOSTNAME, else ROS_IP, else this machine's name where it resolves, else loopback."""
    named = environ.get("ROS_HOSTNAME") or environ.get("ROS_IP")
    if named:
        return named
    name = socket.gethostname()
    try:
        socket.getaddrinfo(name, None, socket.AF_INET)
    except OSError:
        return "localhost"
    return name
