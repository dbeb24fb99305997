"""roslaunch.core: nodes, parameters and machines, and the output of roslaunch."""

from __future__ import annotations

import contextlib
import functools
import logging
import socket
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit
from xml.sax.saxutils import escape

from minirospy.base import names
from minirospy.base.environment import Environment, is_own_host
from minirospy.ros.roslaunch.launcher.command import node_environment
from minirospy.ros.roslaunch.launcher.output import ERROR, Output
from minirospy.ros.roslaunch.launcher.spec import MachineSpec, NodeSpec, TestSpec
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    from xmlrpc.client import MultiCall, ServerProxy

__all__ = [
    "PHASE_RUN",
    "PHASE_SETUP",
    "PHASE_TEARDOWN",
    "TEST_TIME_LIMIT_DEFAULT",
    "Executable",
    "Machine",
    "Master",
    "Node",
    "Param",
    "RLException",
    "RosbinExecutable",
    "Test",
    "_xml_escape",
    "add_printerrlog_handler",
    "add_printlog_handler",
    "clear_printerrlog_handlers",
    "clear_printlog_handlers",
    "generate_run_id",
    "get_master_uri_env",
    "is_child_mode",
    "is_machine_local",
    "local_machine",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "remap_localhost_uri",
    "rle_wrapper",
    "set_child_mode",
    "setup_env",
]

PHASE_SETUP, PHASE_RUN, PHASE_TEARDOWN = "setup", "run", "teardown"

TEST_TIME_LIMIT_DEFAULT = 60  # default time limit in seconds for a <test>


class RLException(Exception):
    """Raised if a launch fails."""


class Master:
    """The master for the nodes; ``uri`` defaults to the environment's master URI."""

    ROSMASTER = "rosmaster"

    def __init__(self, type_: str | None = None, uri: str | None = None, auto: bool | None = None) -> None:
        self.type = type_ or self.ROSMASTER
        self.uri = uri or Environment.read().master_uri
        self.auto = auto

    @property
    def environment(self) -> Environment:
        """Return an environment that contains this master's URI."""
        return Environment.read()._replace(master_uri=self.uri)

    def get_host(self) -> str:
        """Return the host in the master's URI. Raise ValueError if it is not a URL."""
        return _host_and_port(self.uri)[0]

    def get_port(self) -> int:
        """Return the port in the master's URI, by default 80. Raise ValueError if the URI is not a URL."""
        return _host_and_port(self.uri)[1]

    def get(self) -> ServerProxy:
        """Return an xmlrpc.client.ServerProxy for the master."""
        from xmlrpc.client import ServerProxy

        return ServerProxy(self.uri)

    def get_multi(self) -> MultiCall:
        """Return a proxy that sends several calls in one request."""
        from xmlrpc.client import MultiCall

        return MultiCall(self.get())

    def is_running(self) -> bool:
        """Return whether the master responds."""
        with contextlib.closing(MasterProxy(self.uri, "/roslaunch")) as proxy:
            return proxy.is_online()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Master) and (self.type, self.uri) == (other.type, other.uri)

    def __hash__(self) -> int:
        return hash(self.uri)


class Param:
    """A parameter's global name and value."""

    def __init__(self, key: str, value: object) -> None:
        self.key = names.canonicalize(key)
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Param) and (self.key, self.value) == (other.key, other.value)

    def __hash__(self) -> int:
        return hash(self.key)

    def __repr__(self) -> str:
        return f"{self.key}={self.value}"


class Machine:
    """A machine that runs nodes."""

    @classmethod
    def of(cls, spec: MachineSpec) -> Machine:
        """Create a Machine from a launch file's machine."""
        return cls(
            spec.name, spec.address, spec.env_loader or None, spec.ssh_port, spec.user or None, spec.password or None,
            timeout=spec.timeout,
        )  # fmt: skip

    def __init__(
        self,
        name: str,
        address: str,
        env_loader: str | None = None,
        ssh_port: int = 22,
        user: str | None = None,
        password: str | None = None,
        assignable: bool = True,
        env_args: Sequence[object] = (),
        timeout: float | None = None,
    ) -> None:
        self.name = name
        self.address = address
        self.env_loader = env_loader

        self.ssh_port = ssh_port
        self.user = user
        self.password = password
        self.assignable = assignable
        self.timeout = timeout or 10.0

    @property
    def spec(self) -> MachineSpec:
        """Convert the machine to a MachineSpec."""
        return MachineSpec(
            self.name, self.address, self.env_loader or "", self.user or "", self.password or "", self.ssh_port,
            self.timeout,
        )  # fmt: skip

    def config_key(self) -> str:
        """Return a key that is equal for machines with the same address and setup."""
        return (
            f"Machine(address[{self.address}] env_loader[{self.env_loader}] ssh_port[{self.ssh_port}] "
            f"user[{self.user or ''}] password[{self.password or ''}] timeout[{self.timeout}])"
        )

    def config_equals(self, m2: object) -> bool:
        """Return whether another machine has the same address and setup, ignoring the names."""
        return isinstance(m2, Machine) and self.config_key() == m2.config_key()

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Machine)
            and (self.name, self.assignable) == (other.name, other.assignable)
            and self.config_equals(other)
        )

    def __hash__(self) -> int:
        return hash(self.name)

    def __str__(self) -> str:
        return (
            f"Machine(name[{self.name}] env_loader[{self.env_loader}] address[{self.address}] ssh_port[{self.ssh_port}] "
            f"user[{self.user}] assignable[{self.assignable}] timeout[{self.timeout}])"
        )


@functools.cache
def local_machine() -> Machine:
    """Return this machine, always as the same object."""
    return Machine("", "localhost")


def is_machine_local(machine: Machine) -> bool:
    """Return whether a machine is this one and names no user. Raise RLException if its address cannot be resolved."""
    try:
        socket.getaddrinfo(machine.address or ".", None)
    except (OSError, UnicodeError) as error:
        raise RLException(f"cannot resolve host address for machine [{machine.address}]") from error
    return not machine.user and is_own_host(machine.address)


class Executable:
    """A command that roslaunch runs during a ``phase`` of the launch."""

    def __init__(self, cmd: str, args: Sequence[str], phase: str = PHASE_RUN) -> None:
        self.command = cmd
        self.args = args
        self.phase = phase

    def __repr__(self) -> str:
        return f"{self.command} {' '.join(self.args)}"


class RosbinExecutable(Executable):
    """A ROS command, such as rosparam."""

    def __repr__(self) -> str:
        return f"ros/bin/{super().__repr__()}"


class Node:
    """A node to launch. Without a ``name``, it gets a generated one at launch."""

    def __init__(
        self,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str | None = "/",
        machine_name: str | None = None,
        args: str | None = "",
        respawn: bool = False,
        respawn_delay: float = 0.0,
        remap_args: Sequence[Sequence[str]] | None = None,
        env_args: Sequence[tuple[str, str]] | None = None,
        output: str | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        required: bool = False,
        filename: str = "<unknown>",
    ) -> None:
        if not package.strip():
            raise ValueError("package must be non-empty")
        if not node_type.strip():
            raise ValueError("type must be non-empty")
        if name and "/" in name:
            raise ValueError("node name cannot contain a namespace")
        if output not in (None, "log", "screen"):
            raise ValueError("output must be one of 'log', 'screen'")
        if cwd == "ros_home":
            cwd = "ROS_HOME"
        if cwd not in (None, "ROS_HOME", "node"):
            raise ValueError("cwd must be one of 'ROS_HOME', 'node'")
        if required and respawn:
            raise ValueError("respawn and required cannot both be set to true")

        self.package = package
        self.type = node_type
        self.name = name or None
        self.namespace = "/" + "".join(f"{part}/" for part in (namespace or "").split("/") if part)
        self.machine_name = machine_name or None
        self.args = args or ""
        self.respawn = respawn
        self.respawn_delay = respawn_delay

        self.machine: Machine | None = None
        self.process_name: str | None = None

        # As in ROS, keep the caller's list, which the caller may change later.
        self.remap_args: Sequence[Sequence[str]] = remap_args or []
        self.env_args: Sequence[tuple[str, str]] = env_args or []
        self.output = output
        self.cwd = cwd
        self.launch_prefix = launch_prefix or None
        self.required = required
        self.filename = filename

    @classmethod
    def of(cls, spec: NodeSpec) -> Node:
        """Create a Node from a launch file's node."""
        return cls(
            spec.package, spec.type, spec.base_name, spec.namespace, spec.machine or None, spec.args, spec.respawn,
            spec.respawn_delay, [[*pair] for pair in spec.remaps], [*spec.env], spec.output or None, spec.cwd or None,
            spec.launch_prefix, spec.required, spec.file,
        )  # fmt: skip

    def give_name(self) -> None:
        """Generate a unique name if the node has no name."""
        self.name = self.spec.named().base_name

    def xmltype(self) -> str:
        """Return the XML tag's name."""
        return "node"

    def xmlattrs(self) -> list[tuple[str, object]]:
        """Return (name, value) for each XML attribute; the value of an unset attribute is None."""
        return [
            *self._placed(),
            ("respawn", self.respawn),
            ("respawn_delay", self.respawn_delay),
            *self._named(),
        ]

    def to_xml(self) -> str:
        """Return the node in launch-file syntax."""
        return self._as_tag(self.xmlattrs())

    def to_remote_xml(self) -> str:
        """Return the node in launch-file syntax, without its machine."""
        return self._as_tag([each for each in self.xmlattrs() if each[0] != "machine"])

    def _placed(self) -> list[tuple[str, object]]:
        return [
            ("pkg", self.package), ("type", self.type), ("machine", self.machine_name), ("ns", self.namespace),
            ("args", self.args), ("output", self.output), ("cwd", self.cwd),
        ]  # fmt: skip

    def _named(self) -> list[tuple[str, object]]:
        return [("name", self.name), ("launch-prefix", self.launch_prefix), ("required", self.required)]

    def _as_tag(self, attributes: list[tuple[str, object]]) -> str:
        words = [f"{name}={_quoted(value)}" for name, value in attributes if value is not None]
        remaps = [f"  <remap from={_quoted(old)} to={_quoted(new)} />" for old, new in self.remap_args]
        variables = [
            f"  <env name={_quoted(name)} value={_quoted(value)} />" for name, value in self.env_args
        ]
        lines = [f"<{self.xmltype()} {' '.join(words)}>", *remaps, *variables, f"</{self.xmltype()}>"]
        return "\n".join(lines)

    @property
    def spec(self) -> NodeSpec:
        """Convert the node to a NodeSpec."""
        return NodeSpec(
            name=f"{self.namespace}{self.name or ''}",
            package=self.package,
            type=self.type,
            args=self.args,
            output=self.output or "",
            respawn=self.respawn,
            respawn_delay=self.respawn_delay,
            required=self.required,
            cwd=self.cwd or "",
            launch_prefix=self.launch_prefix or "",
            machine=self.machine_name or "",
            remaps=tuple((a, b) for a, b in self.remap_args),
            env=tuple((a, b) for a, b in self.env_args),
            file="" if self.filename == "<unknown>" else self.filename,
        )


class Test(Node):
    """A ``<test>`` in a launch file."""

    def __init__(
        self,
        test_name: str,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str | None = "/",
        machine_name: str | None = None,
        args: str | None = "",
        remap_args: Sequence[Sequence[str]] | None = None,
        env_args: Sequence[tuple[str, str]] | None = None,
        time_limit: float | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        retry: int | None = None,
        filename: str = "<unknown>",
    ) -> None:
        super().__init__(
            package, node_type, name, namespace, machine_name, args, remap_args=remap_args, env_args=env_args,
            output="log", cwd=cwd, launch_prefix=launch_prefix, filename=filename,
        )  # fmt: skip

        self.test_name = test_name
        limit = time_limit or TEST_TIME_LIMIT_DEFAULT
        if not isinstance(limit, (int, float)):
            raise ValueError("'time-limit' must be a number")
        self.time_limit = float(limit)
        if self.time_limit <= 0:
            raise ValueError("'time-limit' must be a positive number")
        self.retry = retry or 0

    def xmltype(self) -> str:
        """Return the XML tag's name."""
        return "test"

    def xmlattrs(self) -> list[tuple[str, object]]:
        """Return (name, value) for each XML attribute; retry and time-limit only if they differ from the defaults."""
        attributes = [*self._placed(), *self._named(), ("test-name", self.test_name)]
        if self.retry:
            attributes.append(("retry", str(self.retry)))
        if self.time_limit != TEST_TIME_LIMIT_DEFAULT:
            attributes.append(("time-limit", self.time_limit))
        return attributes

    @classmethod
    def of_test(cls, spec: TestSpec) -> Test:
        """Create a Test from a launch file's test."""
        node = spec.node
        return cls(
            spec.test_name, node.package, node.type, node.base_name, node.namespace, node.machine or None, node.args,
            [[*pair] for pair in node.remaps], [*node.env], spec.time_limit, node.cwd or None, node.launch_prefix, spec.retry,
            node.file,
        )  # fmt: skip


def _host_and_port(uri: str) -> tuple[str, int]:
    parts = urlsplit(uri)
    if not parts.hostname:
        raise ValueError("not a valid URL")
    return parts.hostname, parts.port or 80


def _quoted(value: object) -> str:
    return '"' + escape(str(value), {'"': "&quot;"}) + '"'


class _Handler:
    """Passes printed lines to a function: only errors if ``errors`` is True, only other lines if it is False."""

    def __init__(self, function: Callable[[str], object], *, errors: bool) -> None:
        self._function = function
        self.errors = errors

    def __call__(self, level: int, text: str) -> None:
        if (level >= ERROR) == self.errors:
            try:
                self._function(text)
            except Exception:  # the program's function failed; as in ROS, still print the line
                logging.getLogger("roslaunch").debug("a handler of roslaunch's output raised", exc_info=True)


def add_printlog_handler(h: Callable[[str], object]) -> None:
    """Add a function to call with each line that roslaunch writes to stdout."""
    Output.handlers.append(_Handler(h, errors=False))


def add_printerrlog_handler(h: Callable[[str], object]) -> None:
    """Add a function to call with each line that roslaunch writes to stderr."""
    Output.handlers.append(_Handler(h, errors=True))


def clear_printlog_handlers() -> None:
    """Remove the functions added by add_printlog_handler()."""
    _clear(errors=False)


def clear_printerrlog_handlers() -> None:
    """Remove the functions added by add_printerrlog_handler()."""
    _clear(errors=True)


def generate_run_id() -> str:
    """Return a new run id."""
    return str(uuid.uuid1())


def get_master_uri_env() -> str:
    """Return the master URI from the environment."""
    return Environment.read().master_uri


def setup_env(
    node: Node | None, machine: Machine, master_uri: str, env: Mapping[str, str] | None = None
) -> dict[str, str]:
    """Return a node's environment, based on ``env`` (default: this process's environment)."""
    environment = Environment.read()._replace(master_uri=master_uri)
    return node_environment((node or Node("p", "t", "n")).spec, environment, env)


def printlog(msg: str) -> None:
    """Print a line to stdout."""
    Output().print(msg)


def printlog_bold(msg: str) -> None:
    """Print a line to stdout, bold on a terminal."""
    Output().print(msg, bold=True)


def printerrlog(msg: str) -> None:
    """Print a line to stderr, red on a terminal."""
    Output().warn(msg)


def _clear(*, errors: bool) -> None:
    Output.handlers[:] = [
        each for each in Output.handlers if not (isinstance(each, _Handler) and each.errors == errors)
    ]


_child_mode = [False]


def is_child_mode() -> bool:
    """Return whether this process runs a launch's nodes for a roslaunch on another machine."""
    return _child_mode[0]


def set_child_mode(child_mode: bool) -> None:
    """Set the value that :func:`is_child_mode` returns."""
    _child_mode[0] = child_mode


def rle_wrapper(fn: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls ``fn`` and converts all exceptions to RLException."""

    def call(*args: object) -> object:
        try:
            return fn(*args)
        except Exception as error:
            raise RLException(f"ERROR: {error}") from error

    return call


def remap_localhost_uri(uri: str, force_localhost: bool = False) -> str:
    """Replace the host in a URI with this machine's address if it is localhost or if ``force_localhost`` is True."""
    parts = urlsplit(uri)
    if force_localhost or parts.hostname == "localhost":
        return f"http://{Environment.read().host}:{parts.port}/"
    return uri


def _xml_escape(s: object) -> object:
    """Escape a string for XML; return other values unchanged."""
    from xml.sax.saxutils import escape

    return escape(s, {'"': "&quot;"}) if isinstance(s, str) else s
