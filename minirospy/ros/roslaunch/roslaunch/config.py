"""The classes of roslaunch.core and roslaunch.config, through which programs read a LaunchSpec.

Source: http://wiki.ros.org/roslaunch/API%20Usage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from minirospy.base.environment import DEFAULT_MASTER_PORT, DISTRO, ROS_VERSION, Environment
from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec, ParameterCommand
from minirospy.ros.roslaunch.launcher.summary import summary
from minirospy.ros.roslaunch.roslaunch.core import (
    Executable,
    Machine,
    Master,
    Node,
    Param,
    RLException,
    Test,
    is_machine_local,
    local_machine,
    printlog,
)
from minirospy.ros.roslaunch.roslaunch.xmlloader import ConfigError, XmlLoader

__all__ = [
    "DEFAULT_MASTER_PORT",
    "Master",
    "RLException",
    "ROSLaunchConfig",
    "calculate_env_loader",
    "get_roscore_filename",
    "is_machine_local",
    "load_config_default",
    "local_machine",
    "namespaces_of",
]

LaunchFile = str | tuple[str, Sequence[str]]
"""A launch file, or a launch file with its arguments ``["name:=value", ...]``."""


class ROSLaunchConfig:
    """Launch file content: ``nodes``, ``params`` (by global name), ``machines``, ``tests`` and ``clear_params``."""

    def __init__(self) -> None:
        self.master = Master()
        self.nodes: list[Node] = []
        self.nodes_core: list[Node] = []
        self.executables: list[Executable] = []
        self.tests: list[Test] = []
        self.params: dict[str, Param] = {}
        self.machines: dict[str, Machine] = {"": local_machine()}
        self.clear_params: list[str] = []
        self.roslaunch_files: list[str] = []
        self.config_errors: list[str] = []
        self.resolved_node_names: list[str] = []  # global names of the nodes that have a name

    def add_node(self, node: Node, core: bool = False, verbose: bool = True) -> None:
        """Add a node. Raise RLException if its name is already used."""
        if node.name:
            if node.spec.name in self.resolved_node_names:
                raise RLException(
                    f"roslaunch file contains multiple nodes named [{node.spec.name}].\n"
                    "Please check all <node> 'name' attributes to make sure they are unique.\n"
                    "Also check that $(anon id) use different ids."
                )
            self.resolved_node_names.append(node.spec.name)
        if verbose:
            kind = "core node" if core else "node"
            printlog(f"Added {kind} of type [{node.package}/{node.type}] in namespace [{node.namespace}]")
        (self.nodes_core if core else self.nodes).append(node)

    def add_test(self, test: Test, verbose: bool = True) -> None:
        """Add a test."""
        self.tests.append(test)

    def add_executable(self, exe: Executable) -> None:
        """Add a command. Only `rosparam delete` and `rosparam dump` are run. Raise ValueError if ``exe`` is None."""
        if not exe:
            raise ValueError("exe is None")
        self.executables.append(exe)

    def add_roslaunch_file(self, f: str) -> None:
        """Add a file to the list of files read."""
        if f not in self.roslaunch_files:
            self.roslaunch_files.append(f)

    def set_master(self, m: Master) -> None:
        """Set the master that the nodes use."""
        self.master = m

    def assign_machines(self) -> None:
        """Set each node's ``machine`` from its ``machine_name``. Raise RLException if a machine is unknown."""
        spec = self.spec
        for node in (*self.nodes, *self.tests):
            try:
                found = spec.machine_of(node.spec)
            except LaunchError as error:
                raise RLException(str(error)) from error
            node.machine = self.machines[found.name if found else ""]

    def has_remote_nodes(self) -> bool:
        """Return whether assign_machines() has assigned any node to another machine."""
        nodes = (*self.nodes, *self.tests)
        return any(node.machine is not None and not is_machine_local(node.machine) for node in nodes)

    def summary(self, local: bool = False) -> str:
        """Return the summary that roslaunch prints before starting processes. It lists machines unless ``local``."""
        return summary(
            self.spec.nodes,
            {name: param.value for name, param in self.params.items()},
            self.spec.clear,
            None if local else [name for name in self.machines if name],
        )

    def add_param(self, p: Param, filename: str | None = None, verbose: bool = True) -> None:
        """Add a parameter. If its name is inside another parameter's namespace, record a configuration error."""
        for parent in namespaces_of(p.key):
            if parent in self.params:
                self.add_config_error(f"parameter [{p.key}] conflicts with parent parameter [{parent}]")
        self.params[p.key] = p
        if verbose:
            printlog(f"Added parameter [{p.key}]")

    def add_clear_param(self, param: str) -> None:
        """Add a namespace to delete before the parameters are set."""
        self.clear_params.append(param)

    def add_machine(self, m: Machine, verbose: bool = True) -> bool:
        """Add a machine; return False if it was already added. Raise RLException if a different one has the same name."""
        if m.name not in self.machines:
            self.machines[m.name] = m
            if verbose:
                printlog(f"Added machine [{m.name}]")
            return True
        if m != self.machines[m.name]:
            raise RLException(f"Machine [{m.name}] already added and does not match duplicate entry")
        return False

    def add_config_error(self, msg: str) -> None:
        """Add a configuration error to print as a warning."""
        self.config_errors.append(msg)

    @property
    def spec(self) -> LaunchSpec:
        """Return the whole configuration as a LaunchSpec for the launcher."""
        return LaunchSpec(
            nodes=[node.spec for node in self.nodes],
            params={name: _as_sent(param.value) for name, param in self.params.items()},
            clear=[name.rstrip("/") or "/" for name in self.clear_params],
            commands=[command for exe in self.executables if (command := _parameter_command(exe))],
            files=self.roslaunch_files,
            machines={name: machine.spec for name, machine in self.machines.items() if name},
            warnings=[_warning(text) for text in self.config_errors],
        )


def load_config_default(
    roslaunch_files: Sequence[LaunchFile],
    port: int | None,
    roslaunch_strs: Sequence[str] | None = None,
    loader: XmlLoader | None = None,
    verbose: bool = False,
    assign_machines: bool = True,
    ignore_unset_args: bool = False,
) -> ROSLaunchConfig:
    """Combine launch files and strings into a configuration. Raise RLException if one of them is invalid."""
    config, loader = ROSLaunchConfig(), loader or XmlLoader()
    if port:
        environment = Environment.read()
        config.set_master(Master(uri=f"http://{environment.uri_host}:{port}/"))

    for name, value in (("/rosversion", ROS_VERSION), ("/rosdistro", DISTRO)):
        config.add_param(Param(name, value), verbose=verbose)

    for each in roslaunch_files:
        file, argv = (each, []) if isinstance(each, str) else each
        loader.load(file, config, argv=argv, verbose=verbose)
    for text in roslaunch_strs or ():
        loader.load_string(text, config, verbose=verbose)

    if assign_machines:
        config.assign_machines()
    return config


def get_roscore_filename() -> str | None:
    """Return None: the master does not start nodes from a launch file."""
    return None


def _parameter_command(exe: Executable) -> ParameterCommand | None:
    """Convert a rosparam command for the launcher, or return None if it is not supported."""
    match (exe.command, *exe.args):
        case ("rosparam", "delete", name):
            return ParameterCommand(name)
        case ("rosparam", "dump", file, name):
            return ParameterCommand(name.rstrip("/") or "/", file)
    return None


def _warning(text: str) -> LaunchError:
    return text.error if isinstance(text, ConfigError) else LaunchError("<configuration>", 0, text)


def _as_sent(value: object) -> object:
    data = getattr(value, "data", None)
    return data if isinstance(data, bytes) else value


def namespaces_of(name: str) -> list[str]:
    """Return the namespaces that contain a global name, from the root downwards."""
    parts = name.strip("/").split("/")[:-1]
    return ["/", *("/" + "/".join(parts[: i + 1]) for i in range(len(parts)))]


def calculate_env_loader(env: Mapping[str, str] | None = None) -> str:
    """Return the path of the distribution's script that sets up the environment on another machine."""
    from minirospy.ros.rospkg.rospkg.distro import current_distro_codename

    return f"/opt/ros/{current_distro_codename()}/env.sh"
