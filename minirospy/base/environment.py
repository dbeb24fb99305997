"""Read ROS's and minirospy's environment variables into one frozen record.

The record is created once at the start of a process (a command's main, init_node) and passed on as an argument.
Source: http://wiki.ros.org/ROS/EnvironmentVariables and http://wiki.ros.org/ROS/NetworkSetup.
"""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Mapping, MutableMapping
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import UsageError
from minirospy.base.escape import escaped, has_controls

if TYPE_CHECKING:
    from pathlib import Path

__all__ = [
    "DEFAULT_MASTER_PORT",
    "DISTRO",
    "LOOPBACK",
    "ROS_VERSION",
    "Environment",
    "export_local",
    "is_local",
    "is_own_host",
    "master_and_namespace",
    "run_folder",
    "split_uri",
]

DEFAULT_MASTER_PORT = 11311

_SWITCH = {"": False, "0": False, "off": False, "false": False, "1": True, "on": True, "true": True}

DISTRO = "noetic\n"
"""The value of /rosdistro: the ROS 1 distribution that minirospy behaves like. It ends with a newline, as in ROS."""

ROS_VERSION = "1.17.0\n"  # the value of /rosversion


_RUN_ID = re.compile(r"[\w-][\w.+@ -]{0,99}")


_NO_FOLDER = "/nonexistent"  # Debian's home folder for users that have none


LOOPBACK = "127.0.0.0/8, ::1"
"""Networks whose hosts may connect to a local process. Listening only on loopback is not enough: if net.ipv4.route_localnet
is set in the kernel, as on container hosts, neighbouring machines can connect to it.
"""


class Environment(NamedTuple):
    """The master's URI, this process's address, and the folders for its files.

    ``host`` is the name advertised to peers; ``bind_host`` is the address that servers listen on (loopback if ``host``
    is loopback, else every interface; IPv6 addresses if ``ipv6`` is set). ``ports`` are the ports that a node's servers
    may use (None: any), such as those that a firewall or a container allows; ``allow`` lists the networks that may
    connect ("": all). If ``transport`` is "tcp", Unix sockets are disabled; if it is "unix", shared
    memory is. ``local`` restricts the process to this machine, see :meth:`on_this_machine`.
    """

    master_uri: str
    host: str
    namespace: str
    home: Path
    log_dir: Path
    package_path: tuple[Path, ...] = ()
    ipv6: bool = False
    ports: range | None = None
    allow: str = ""
    transport: str = ""
    local: bool = False

    @classmethod
    def read(cls, environ: Mapping[str, str] | None = None, **overrides: str) -> Environment:
        """Read the settings from ``environ`` (default: os.environ). ``overrides`` may contain master_uri, host and namespace.

        Raise UsageError if ROS_MASTER_URI is not http://host:port, ROS_HOSTNAME or ROS_IP is not just a name or
        address, MINIROSPY_PORTS is not a range such as 40000-40100, MINIROSPY_TRANSPORT or MINIROSPY_LOCAL is unknown,
        or the master is on another machine although MINIROSPY_LOCAL is 1.
        """
        from pathlib import Path

        environ = os.environ if environ is None else environ
        home = Path(environ.get("ROS_HOME") or os.path.join(_user_folder(), ".ros"))
        master_uri, namespace = master_and_namespace(environ, **overrides)
        local = is_local(environ)
        environment = cls(
            master_uri=master_uri,
            host="localhost" if local else overrides.get("host") or _advertised_host(environ),
            namespace=namespace,
            home=home,
            log_dir=Path(environ.get("ROS_LOG_DIR") or home / "log"),
            package_path=tuple(Path(p) for p in environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p),
            ipv6=environ.get("ROS_IPV6") == "on",
            ports=_port_range(environ.get("MINIROSPY_PORTS", "")),
            allow=environ.get("MINIROSPY_ALLOW", ""),
            transport=_checked_transport(environ.get("MINIROSPY_TRANSPORT", "")),
        )
        return environment.on_this_machine() if local else environment

    def on_this_machine(self) -> Environment:
        """Return a copy that makes a process listen on loopback, advertise localhost and refuse other machines."""
        return self._replace(host="localhost", allow=LOOPBACK, local=True)

    @property
    def bind_host(self) -> str:
        """Return the address to listen on, chosen as in rospy."""
        if self.host.startswith("127."):
            return self.host
        if self.host in {"localhost", "::1"}:
            return "::1" if self.ipv6 else "127.0.0.1"
        return "::" if self.ipv6 else "0.0.0.0"

    @property
    def same_host(self) -> bool:
        """Return whether Unix sockets may be used for connections to processes on this machine."""
        return self.transport != "tcp"

    @property
    def shares_memory(self) -> bool:
        """Return whether large messages to processes on this machine may go through shared memory."""
        return self.transport not in ("tcp", "unix")

    @property
    def uri_host(self) -> str:
        """Return ``host`` as written in a URI: an IPv6 address is in brackets."""
        return f"[{self.host}]" if ":" in self.host else self.host

    @property
    def master_address(self) -> tuple[str, int]:
        """Return the master's (host, port)."""
        host, port, _ = split_uri(self.master_uri)
        return host, port

    @property
    def master_is_local(self) -> bool:
        """Return whether the master's host is this machine. A tool may start a master only if it is."""
        return is_own_host(self.master_address[0], self.host)


def master_and_namespace(
    environ: Mapping[str, str], *, master_uri: str = "", namespace: str = "", **_: str
) -> tuple[str, str]:
    """Return the master's URI and the namespace: the settings that a tool's queries need.

    Raise UsageError as Environment.read does, if a variable is invalid.
    """
    uri = master_uri or environ.get("ROS_MASTER_URI") or f"http://localhost:{DEFAULT_MASTER_PORT}"
    uri = _checked_uri(uri)
    if is_local(environ):
        uri = _local_uri(uri)
    return uri, "/" + (namespace or environ.get("ROS_NAMESPACE") or "").strip("/")


def is_local(environ: Mapping[str, str]) -> bool:
    """Return whether MINIROSPY_LOCAL restricts this process to this machine. Raise UsageError if the value is unknown."""
    text = environ.get("MINIROSPY_LOCAL", "")
    if text.lower() not in _SWITCH:
        raise UsageError(f"MINIROSPY_LOCAL [{text}] is neither 1 nor 0")
    return _SWITCH[text.lower()]


def export_local(environ: MutableMapping[str, str]) -> None:
    """Restrict programs started with ``environ`` to this machine if MINIROSPY_LOCAL is set.

    Set ROS's own variables, because programs with other ROS clients ignore MINIROSPY_LOCAL. Raise UsageError as
    Environment.read does, if a variable is invalid.
    """
    if is_local(environ):
        environ["ROS_MASTER_URI"], _ = master_and_namespace(environ)
        environ["ROS_HOSTNAME"] = "localhost"
        environ.pop("ROS_IP", None)


def split_uri(uri: str, scheme: str = "http") -> tuple[str, int, str]:
    """Split ``scheme://host:port/path`` into (host, port, path). Raise ValueError if the URI is malformed.

    This does not use urllib.parse, because importing it takes a twentieth of a command's run time.
    """
    # Reject control characters and spaces: the path is sent in the first line of a request, and the URI is written to logs.
    if has_controls(uri) or " " in uri:
        raise ValueError(f"[{escaped(uri)}] is not of the form {scheme}://host:port")
    found, _, rest = uri.partition("://")
    address, slash, path = rest.partition("/")
    host, _, port = address.rpartition(":")
    # `http://[hostname]:11311` is a documentation placeholder, not an IPv6 address.
    if host.startswith("[") and host.endswith("]") and ":" in host:
        host = host[1:-1]
    is_host = host.isprintable() and host[:1] not in ("", "[")
    if found.lower() != scheme or not is_host or not (port.isascii() and port.isdecimal()):
        raise ValueError(f"[{uri}] is not of the form {scheme}://host:port")
    if not 0 < int(port) < 65536:
        raise ValueError(f"[{uri}]: a port is between 1 and 65535")
    return host.lower(), int(port), slash + path or "/"


def is_own_host(host: str, own: str = "localhost") -> bool:
    """Return whether a name or address belongs to this machine, which advertises itself as ``own``."""
    if host in {"localhost", "::1", own, socket.gethostname()} or host.startswith("127."):
        return True
    try:
        address = socket.gethostbyname(host)
        if address.startswith("127."):
            return True
        # Try to bind: only this machine's addresses can be bound. (Use TCP, because Wine binds any address for datagrams.)
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.bind((address, 0))
    except OSError:
        return False
    return True


def wrong_address(environment: Environment) -> str:
    """Describe the error in ROS_IP or ROS_HOSTNAME, which peers use to reach this process. Return "" if there is none.

    Names are not checked, because an unreachable name server would delay every program.
    """
    host = environment.host
    variable = "ROS_HOSTNAME" if os.environ.get("ROS_HOSTNAME") else "ROS_IP"
    if host.replace(".", "").isdigit() and not is_own_host(host):
        return (
            f"{variable}={host} is not an address of this machine: correct only behind NAT or in a container"
        )
    if ":" in host and not environment.ipv6:
        return f"{variable}={host} is an IPv6 address, where no node listens without ROS_IPV6=on"
    return ""


def run_folder(log_dir: Path, run_id: object) -> Path | None:
    """Return the folder for a run's log files, or None if ``run_id`` is not a valid folder name.

    Any node may set /run_id, even to a path that leads outside of ``log_dir``.
    """
    if not isinstance(run_id, str) or not _RUN_ID.fullmatch(run_id):
        return None
    return log_dir / run_id


def _checked_uri(uri: str) -> str:
    try:
        split_uri(uri)
    except ValueError as error:
        raise UsageError(
            f"ROS_MASTER_URI [{uri}] is not of the form http://host:port, as http://localhost:11311"
        ) from error
    return uri


def _local_uri(uri: str) -> str:
    """Return the URI of a master on this machine with the host replaced by localhost, unless it is already loopback."""
    host, port, path = split_uri(uri)
    if host in ("localhost", "127.0.0.1", "::1"):
        return uri
    if is_own_host(host):
        return f"http://localhost:{port}{path}"
    raise UsageError(
        f"MINIROSPY_LOCAL=1 keeps everything on this machine, but the master [{uri}] is on another one: "
        f"`unset MINIROSPY_LOCAL`, or `export ROS_MASTER_URI=http://localhost:{port}`"
    )


def _checked_host(host: str, variable: str) -> str:
    # A host with a single colon contains a port; one with several colons is an IPv6 address.
    if "/" in host or host.count(":") == 1 or host != host.strip() or "[" in host:
        raise UsageError(f"{variable} [{host}] must be a name or an address alone, without http:// and port")
    return host


def _checked_transport(name: str) -> str:
    if name.lower() not in ("", "auto", "tcp", "unix"):
        raise UsageError(f"MINIROSPY_TRANSPORT [{name}] is neither 'tcp', 'unix' nor 'auto'")
    return name.lower()


def _port_range(text: str) -> range | None:
    if not text.strip():
        return None
    first, _, last = text.partition("-")
    try:
        ports = range(int(first), int(last or first) + 1)
    except ValueError:
        ports = range(0)
    if not ports or ports[0] < 1 or ports[-1] > 65535:
        raise UsageError(f"MINIROSPY_PORTS [{text}] is not a range of ports, as 40000-40100")
    return ports


def _user_folder() -> str:
    """Return the user's home folder, or one that does not exist if the user has none, as in containers with any user id."""
    folder = os.path.expanduser("~")
    # Do not create a folder named "~": `rm -r ~` would then delete the real home folder.
    return _NO_FOLDER if folder == "~" else folder


def _advertised_host(environ: Mapping[str, str]) -> str:
    """Return ROS_HOSTNAME, else ROS_IP, else this machine's name if it resolves, else loopback."""
    for variable in ("ROS_HOSTNAME", "ROS_IP"):
        named = environ.get(variable)
        if named:
            return _checked_host(named, variable)
    name = socket.gethostname()
    try:
        # Pass bytes: looking up a str would import the IDNA codec.
        socket.getaddrinfo(name.encode() if name.isascii() else name, None, socket.AF_INET)
    except OSError:
        return "localhost"
    return name
