"""What programs know of launch files: the classes of roslaunch.core and roslaunch.config, over a LaunchSpec.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from minirospy import names
from minirospy.environment import DISTRO, ROS_VERSION, Environment, is_own_host
from minirospy.errors import LaunchError, MinirospyError, NotFoundError
from minirospy.launch.load import STDIN, Source, load_sources
from minirospy.launch.spec import LaunchSpec, MachineSpec, NodeSpec, TestSpec
from minirospy.launch.substitution import Substitution, SubstitutionError
from minirospy.launch.summary import summary
from minirospy.runtime.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from xmlrpc.client import MultiCall, ServerProxy

__all__ = [
    "TEST_TIME_LIMIT_DEFAULT", "ArgException", "LaunchFile", "Machine", "Master", "Node", "NodeParamsException", "Param",
    "RLException", "ROSLaunchConfig", "SubstitutionException", "Test", "XmlLoader", "XmlParseException",
    "assignments", "get_roscore_filename", "is_machine_local", "load_config_default", "local_machine", "namespaces_of",
    "resolve_args",
]  # fmt: skip

LaunchFile = str | tuple[str, Sequence[str]]
"""A launch file, or one with its arguments ``["name:=value", ...]``."""


TEST_TIME_LIMIT_DEFAULT = 60
"""Seconds that a <test> has."""


class RLException(Exception):
    """roslaunch cannot do what was asked."""


class XmlParseException(RLException):
    """A launch file does not load."""


class SubstitutionException(Exception):
    """A substitution argument cannot be resolved."""


class ArgException(SubstitutionException):
    """An arg that is not set."""


class NodeParamsException(Exception):
    """The command of a node cannot be made."""


class Master:
    """The master that nodes are started with; ``uri`` is that of the environment where none is given."""

    ROSMASTER = "rosmaster"

    def __init__(self, type_: str | None = None, uri: str | None = None, auto: bool | None = None) -> None:
        self.type = type_ or self.ROSMASTER
        self.uri = uri or Environment.read().master_uri
        self.auto = auto

    @property
    def environment(self) -> Environment:
        """The environment with this master."""
        return Environment.read()._replace(master_uri=self.uri)

    def get_host(self) -> str:
        """The host of its URI."""
        return self.environment.master_address[0]

    def get_port(self) -> int:
        """The port of its URI."""
        return self.environment.master_address[1]

    def get(self) -> ServerProxy:
        """A proxy of Python's own for its calls."""
        from xmlrpc.client import ServerProxy

        return ServerProxy(self.uri)

    def get_multi(self) -> MultiCall:
        """The same, which sends several calls at once."""
        from xmlrpc.client import MultiCall

        return MultiCall(self.get())

    def is_running(self) -> bool:
        """Whether it answers."""
        with contextlib.closing(MasterProxy(self.uri, "/roslaunch")) as proxy:
            return proxy.is_online()


class Param:
    """A parameter: its global name and value."""

    def __init__(self, key: str, value: Any) -> None:
        self.key = key
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Param) and (self.key, self.value) == (other.key, other.value)

    def __hash__(self) -> int:
        return hash(self.key)

    def __repr__(self) -> str:
        return f"{self.key}={self.value}"


class Machine:
    """A machine that nodes run on."""

    def __init__(
        self,
        name: str,
        address: str,
        env_loader: str | None = None,
        ssh_port: int = 22,
        user: str | None = None,
        password: str | None = None,
        assignable: bool = True,
        env_args: Sequence[Any] = (),
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
        """As a launch file says it."""
        return MachineSpec(
            self.name, self.address, self.env_loader or "", self.user or "", self.password or "", self.ssh_port,
            self.timeout,
        )  # fmt: skip

    def __str__(self) -> str:
        return (
            f"Machine(name[{self.name}] env_loader[{self.env_loader}] address[{self.address}] ssh_port[{self.ssh_port}] "
            f"user[{self.user}] assignable[{self.assignable}] timeout[{self.timeout}])"
        )


def local_machine() -> Machine:
    """This machine."""
    return Machine("", "localhost")


def is_machine_local(machine: Machine) -> bool:
    """Whether a machine is this one."""
    return not machine.user and is_own_host(machine.address)


class Node:
    """A node to be launched. One without a ``name`` gets a new one when it is."""

    def __init__(
        self,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        respawn: bool = False,
        respawn_delay: float = 0.0,
        remap_args: Iterable[tuple[str, str]] | None = None,
        env_args: Iterable[tuple[str, str]] | None = None,
        output: str | None = None,
        cwd: str | None = None,
        launch_prefix: str | None = None,
        required: bool = False,
        filename: str = "<unknown>",
    ) -> None:
        if not package:
            raise ValueError("package must be non-empty")
        if not node_type:
            raise ValueError("type must be non-empty")
        if name and "/" in name:
            raise ValueError("node name cannot contain a namespace")
        if output not in (None, "log", "screen"):
            raise ValueError("output must be one of 'log', 'screen'")
        if cwd not in (None, "ROS_HOME", "node"):
            raise ValueError("cwd must be one of 'ROS_HOME', 'node'")
        if required and respawn:
            raise ValueError("respawn and required cannot both be set to true")
        self.package = package
        self.type = node_type
        self.name = name or None
        self.namespace = "/" + "".join(f"{part}/" for part in namespace.split("/") if part)
        self.machine_name = machine_name or None
        self.args = args
        self.respawn = respawn
        self.respawn_delay = respawn_delay
        self.machine: Machine | None = None
        self.process_name: str | None = None
        self.remap_args = [list(pair) for pair in remap_args or ()]
        self.env_args = [tuple(pair) for pair in env_args or ()]
        self.output = output
        self.cwd = cwd
        self.launch_prefix = launch_prefix or None
        self.required = required
        self.filename = filename

    @classmethod
    def of(cls, spec: NodeSpec) -> Node:
        """The node that a launch file says."""
        return cls(
            spec.package, spec.type, spec.base_name, spec.namespace, spec.machine or None, spec.args, spec.respawn,
            spec.respawn_delay, spec.remaps, spec.env, spec.output, spec.cwd, spec.launch_prefix, spec.required,
            spec.file,
        )  # fmt: skip

    def give_name(self) -> None:
        """Give it a name that no other node has, where it has none."""
        if not self.name:
            self.name = names.anonymous_name("".join(c if c.isalnum() else "_" for c in self.type))

    def to_xml(self) -> str:
        """As the text of a launch file."""
        return self.spec.to_xml()

    @property
    def spec(self) -> NodeSpec:
        """As a launch file says it."""
        return NodeSpec(
            name=f"{self.namespace}{self.name or ''}",
            package=self.package,
            type=self.type,
            args=self.args,
            output=self.output or "log",
            respawn=self.respawn,
            respawn_delay=self.respawn_delay,
            required=self.required,
            cwd=self.cwd or "ROS_HOME",
            launch_prefix=self.launch_prefix or "",
            machine=self.machine_name or "",
            remaps=tuple((a, b) for a, b in self.remap_args),
            env=tuple((a, b) for a, b in self.env_args),
            file="" if self.filename == "<unknown>" else self.filename,
        )


class Test(Node):
    """A ``<test>``."""

    def __init__(
        self,
        test_name: str,
        package: str,
        node_type: str,
        name: str | None = None,
        namespace: str = "/",
        machine_name: str | None = None,
        args: str = "",
        remap_args: Iterable[tuple[str, str]] | None = None,
        env_args: Iterable[tuple[str, str]] | None = None,
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
        self.time_limit = float(TEST_TIME_LIMIT_DEFAULT if time_limit is None else time_limit)
        self.retry = retry or 0

    @classmethod
    def of_test(cls, spec: TestSpec) -> Test:
        """The test that a launch file says."""
        node = spec.node
        return cls(
            spec.test_name, node.package, node.type, node.base_name, node.namespace, None, node.args, node.remaps,
            node.env, spec.time_limit, node.cwd, node.launch_prefix, spec.retry, node.file,
        )  # fmt: skip


class ROSLaunchConfig:
    """What launch files say: ``nodes``, ``params`` (by global name), ``machines``, ``tests``, ``clear_params``."""

    def __init__(self) -> None:
        self.master = Master()
        self.nodes: list[Node] = []
        self.nodes_core: list[Node] = []
        self.executables: list[object] = []
        self.tests: list[Test] = []
        self.params: dict[str, Param] = {}
        self.machines: dict[str, Machine] = {"": local_machine()}
        self.clear_params: list[str] = []
        self.roslaunch_files: list[str] = []
        self.config_errors: list[str] = []
        self._spec = LaunchSpec()

    @property
    def resolved_node_names(self) -> list[str]:
        """The global names of the nodes."""
        return [node.spec.name for node in (*self.nodes, *self.nodes_core, *self.tests) if node.name]

    def add_node(self, node: Node, core: bool = False, verbose: bool = True) -> None:
        """Add a node. Raises RLException where there is one of its name."""
        if node.name and node.spec.name in self.resolved_node_names:
            raise RLException(
                f"roslaunch file contains multiple nodes named [{node.spec.name}].\n"
                "Please check all <node> 'name' attributes to make sure they are unique.\n"
                "Also check that $(anon id) use different ids."
            )
        (self.nodes_core if core else self.nodes).append(node)

    def add_test(self, test: Test, verbose: bool = True) -> None:
        """Add a test."""
        self.tests.append(test)

    def add_roslaunch_file(self, f: str) -> None:
        """Add a file to those that were read."""
        if f not in self.roslaunch_files:
            self.roslaunch_files.append(f)

    def set_master(self, m: Master) -> None:
        """Set the master that nodes are started with."""
        self.master = m

    def assign_machines(self) -> None:
        """Set ``machine`` of each node to the one of its ``machine_name``. Raises RLException."""
        spec = self.spec
        for node in (*self.nodes, *self.tests):
            try:
                found = spec.machine_of(node.spec)
            except LaunchError as error:
                raise RLException(str(error)) from error
            node.machine = self.machines[found.name if found else ""]

    def has_remote_nodes(self) -> bool:
        """Whether a node runs on another machine, as assign_machines() found."""
        nodes = (*self.nodes, *self.tests)
        return any(node.machine is not None and not is_machine_local(node.machine) for node in nodes)

    def summary(self, local: bool = False) -> str:
        """What roslaunch shows before it starts anything."""
        return summary(
            self.spec.nodes, {name: param.value for name, param in self.params.items()}, self.clear_params
        )

    def add_param(self, p: Param, filename: str | None = None, verbose: bool = True) -> None:
        """Add a parameter."""
        self.params[p.key] = p

    def add_clear_param(self, param: str) -> None:
        """Have a namespace deleted before the parameters are set."""
        self.clear_params.append(param)

    def add_machine(self, m: Machine, verbose: bool = True) -> None:
        """Add a machine."""
        self.machines[m.name] = m

    def add_config_error(self, msg: str) -> None:
        """Add a warning."""
        self.config_errors.append(msg)

    def add(self, spec: LaunchSpec) -> None:
        """Add all that launch files say."""
        self._spec.commands += spec.commands
        self._spec.warnings += spec.warnings
        self._spec.default_machine = spec.default_machine or self._spec.default_machine
        for node in spec.nodes:
            self.add_node(Node.of(node))
        self.tests += map(Test.of_test, spec.tests)
        self.params.update({name: Param(name, value) for name, value in spec.params.items()})
        for each in spec.machines.values():
            self.machines[each.name] = Machine(
                each.name, each.address, each.env_loader or None, each.ssh_port, each.user or None, each.password or None,
                timeout=each.timeout,
            )  # fmt: skip
        self.clear_params += spec.clear
        self.roslaunch_files += [file for file in spec.files if file not in self.roslaunch_files]
        self.config_errors += map(str, spec.warnings)

    @property
    def spec(self) -> LaunchSpec:
        """All of it, as it is run."""
        return LaunchSpec(
            nodes=[node.spec for node in self.nodes],
            params={name: param.value for name, param in self.params.items()},
            clear=self.clear_params,
            commands=self._spec.commands,
            files=self.roslaunch_files,
            machines={name: machine.spec for name, machine in self.machines.items() if name},
            default_machine=self._spec.default_machine,
            warnings=self._spec.warnings,
        )


class XmlLoader:
    """Loads launch files into a configuration."""

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        self.resolve_anon = resolve_anon
        self.args_only = args_only
        self.ignore_unset_args = False
        self._packages = Packages()

    def load(
        self,
        filename: str,
        ros_config: ROSLaunchConfig,
        core: bool = False,
        argv: Sequence[str] | None = None,
        verbose: bool = True,
    ) -> None:
        """Load a file, its args given as ``["name:=value", ...]``. Raises XmlParseException."""
        self._load(Source(filename, None, assignments(argv or ())), ros_config)

    def load_string(
        self, xml_text: str, ros_config: ROSLaunchConfig, core: bool = False, verbose: bool = True
    ) -> None:
        """Load a text. Raises XmlParseException."""
        self._load(Source(STDIN, xml_text.encode(), {}), ros_config)

    def _load(self, source: Source, config: ROSLaunchConfig) -> None:
        try:
            config.add(load_sources([source], self._packages))
        except MinirospyError as error:
            raise XmlParseException(str(error)) from error


def load_config_default(
    roslaunch_files: Sequence[LaunchFile],
    port: int | None,
    roslaunch_strs: Sequence[str] | None = None,
    loader: XmlLoader | None = None,
    verbose: bool = False,
    assign_machines: bool = True,
    ignore_unset_args: bool = False,
) -> ROSLaunchConfig:
    """The configuration that launch files and texts say together. Raises RLException."""
    config, loader = ROSLaunchConfig(), loader or XmlLoader()
    if port:
        environment = Environment.read()
        config.set_master(Master(uri=f"http://{environment.uri_host}:{port}/"))
    for name, value in (("/rosversion", ROS_VERSION), ("/rosdistro", DISTRO)):
        config.add_param(Param(name, value))
    for each in roslaunch_files:
        file, argv = (each, []) if isinstance(each, str) else each
        loader.load(file, config, argv=argv)
    for text in roslaunch_strs or ():
        loader.load_string(text, config)
    if assign_machines:
        config.assign_machines()
    return config


def resolve_args(
    arg_str: str,
    context: dict[str, Any] | None = None,
    resolve_anon: bool = True,
    filename: str | None = None,
) -> str:
    """A text with its substitution arguments made; ``context`` may hold the args as ``{"arg": {name: value}}``.

    Raises SubstitutionException, and ArgException where an arg is not set.
    """
    context = {} if context is None else context
    args, anonymous = context.setdefault("arg", {}), context.setdefault("anon", {})
    substitution = Substitution(Packages(), os.environ, filename or "", args, anonymous)
    if "dirname" in arg_str and not filename:
        raise SubstitutionException("Cannot substitute $(dirname), no file/directory information available.")
    try:
        return substitution.apply(arg_str)
    except NotFoundError as error:
        raise SubstitutionException(str(error)) from error
    except SubstitutionError as error:
        unset = substitution.used - set(args)
        raise (ArgException(min(unset)) if unset else SubstitutionException(str(error))) from error


def assignments(argv: Sequence[str]) -> dict[str, str]:
    """What ``["name:=value", ...]`` gives: name -> value."""
    return {name: value for name, sep, value in (word.partition(":=") for word in argv) if sep}


def get_roscore_filename() -> str | None:
    """The launch file of a master's own nodes: None, the master needs none."""
    return None


def namespaces_of(name: str) -> list[str]:
    """The namespaces that a global name lies in, the root first."""
    parts = name.strip("/").split("/")[:-1]
    return ["/", *("/" + "/".join(parts[: i + 1]) for i in range(len(parts)))]
