"""The contents of launch files, with all substitutions resolved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from minirospy.base.errors import LaunchError
from minirospy.base.names import anonymous_name

__all__ = ["ArgDoc", "LaunchSpec", "MachineSpec", "NodeSpec", "ParameterCommand", "TestSpec"]


@dataclass(frozen=True)
class NodeSpec:
    """A ``<node>``. ``name`` is global; ``remaps`` and ``env`` include those of enclosing groups.

    If a ``<test>`` has no name, ``name`` is a namespace that ends with a slash. The test's parameters are set in that
    namespace, and ``named()`` generates a name before the test runs. ``output`` and ``cwd`` are empty if the file does not set
    them, which means ``log`` and ``ROS_HOME``.
    """

    name: str
    package: str
    type: str
    args: str = ""
    output: str = ""
    respawn: bool = False
    respawn_delay: float = 0.0
    required: bool = False
    cwd: str = ""
    launch_prefix: str = ""
    machine: str = ""
    remaps: tuple[tuple[str, str], ...] = ()
    env: tuple[tuple[str, str], ...] = ()
    file: str = ""
    line: int = 0

    @property
    def base_name(self) -> str:
        """Return the name without its namespace."""
        return self.name.rpartition("/")[2]

    @property
    def namespace(self) -> str:
        """Return the namespace, with a trailing slash."""
        return self.name.rpartition("/")[0] + "/"

    def named(self) -> NodeSpec:
        """Return the node, or a copy with a unique generated name if it has no name."""
        if self.base_name:
            return self
        base = "".join(c if c.isalnum() else "_" for c in self.type)
        return replace(self, name=f"{self.namespace}{anonymous_name(base)}")

    def to_xml(self) -> str:
        """Return the node in launch-file syntax, without its machine."""
        # Imported here, because this import takes longer than all other roslaunch modules together.
        from xml.sax.saxutils import quoteattr

        attributes = {
            "pkg": self.package,
            "type": self.type,
            "name": self.base_name,
            "ns": self.namespace,
            "args": self.args,
            "output": self.output or "log",
            "cwd": self.cwd or "ROS_HOME",
            "respawn": str(self.respawn).lower(),
            "respawn_delay": f"{self.respawn_delay:g}",
            "required": str(self.required).lower(),
            "launch-prefix": self.launch_prefix,
        }
        words = " ".join(f"{key}={quoteattr(value)}" for key, value in attributes.items())
        lines = [f"<node {words}>"]
        lines += [f"  <env name={quoteattr(a)} value={quoteattr(b)}/>" for a, b in self.env]
        lines += [f"  <remap from={quoteattr(a)} to={quoteattr(b)}/>" for a, b in self.remaps]
        return "\n".join([*lines, "</node>"])


@dataclass(frozen=True)
class TestSpec:
    """A ``<test>`` for rostest: the name in its results, its node, time limit in seconds, and number of retries."""

    test_name: str
    node: NodeSpec
    time_limit: float
    retry: int


@dataclass(frozen=True)
class MachineSpec:
    """A ``<machine>`` that runs nodes: its ssh address, and the script ``env_loader`` that sets up ROS there."""

    name: str
    address: str
    env_loader: str = ""
    user: str = ""
    password: str = ""
    ssh_port: int = 22
    timeout: float = 10.0
    file: str = ""
    line: int = 0


@dataclass(frozen=True)
class ParameterCommand:
    """A ``<rosparam>`` that deletes the namespace ``name`` on the master or dumps it to ``file``."""

    name: str
    file: str | None = None


@dataclass(frozen=True)
class ArgDoc:
    """An ``<arg>`` of the first file, with its default (None: required) and doc."""

    name: str
    default: str | None
    doc: str | None


@dataclass
class LaunchSpec:
    """The combined content of all launch files.

    ``params``: values by name; ``clear``: namespaces to delete; ``commands``: <rosparam> commands to run before the
    parameters are set; ``files``: all files read, without duplicates; ``includes``: (file, included file); ``args``:
    declarations of the first file; ``machines``: by name; ``warnings``: content that was ignored.
    """

    nodes: list[NodeSpec] = field(default_factory=list)
    tests: list[TestSpec] = field(default_factory=list)
    params: dict[str, object] = field(default_factory=dict)
    clear: list[str] = field(default_factory=list)
    commands: list[ParameterCommand] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    includes: list[tuple[str, str]] = field(default_factory=list)
    args: dict[str, ArgDoc] = field(default_factory=dict)
    machines: dict[str, MachineSpec] = field(default_factory=dict)
    warnings: list[LaunchError] = field(default_factory=list)

    # --- adding: called by the loader in the order of the tags

    def add_file(self, path: str, name: str) -> None:
        """Record a file that is being read; ``name`` is its path as written."""
        if path not in self.files:
            self.files.append(path)

    def end_include(self, name: str) -> None:
        """Do nothing. Called at the end of an included file; subclasses may override this method."""

    def add_node(self, node: NodeSpec) -> None:
        """Add a node."""
        self.nodes.append(node)

    def add_test(self, test: TestSpec) -> None:
        """Add a test."""
        self.tests.append(test)

    def add_param(
        self, name: str, value: object, error: Callable[[str], LaunchError], file: str | None = None
    ) -> None:
        """Add a parameter. ``error`` creates errors with the tag's line.

        ``file`` contains the ``<param>``, unless it is in a node.
        """
        upper = name
        while upper := upper.rpartition("/")[0]:
            if upper in self.params and not isinstance(self.params[upper], dict):
                self.add_warning(error(f"parameter [{name}] conflicts with parent parameter [{upper}]"))
        self.params[name] = value

    def add_clear(self, name: str) -> None:
        """Add a namespace to delete."""
        self.clear.append(name)

    def add_command(self, command: ParameterCommand) -> None:
        """Add a command for the parameter server."""
        self.commands.append(command)

    def add_machine(self, machine: MachineSpec) -> None:
        """Add a machine. Raise LaunchError if a different one has the same name."""
        other = self.machines.setdefault(machine.name, machine)
        if replace(other, file=machine.file, line=machine.line) != machine:
            text = f"machine [{machine.name}] is declared otherwise at {other.file}:{other.line}"
            raise LaunchError(machine.file, machine.line, text)

    def add_warning(self, warning: LaunchError, ros_text: str = "") -> None:
        """Add a warning about ignored content; ``ros_text`` is roslaunch's wording, if it differs."""
        self.warnings.append(warning)

    def runs_command(self, text: str) -> None:
        """Do nothing. Called when a ``<param>``'s command starts; subclasses may override this method."""

    # --- reading

    def runnables(self) -> Iterator[NodeSpec]:
        """Yield the nodes, then the tests' nodes."""
        yield from self.nodes
        yield from (test.node for test in self.tests)

    def named_runnables(self) -> Iterator[NodeSpec]:
        """Yield the nodes and test nodes that already have a name."""
        return (node for node in self.runnables() if node.base_name)

    def machine_of(self, node: NodeSpec) -> MachineSpec | None:
        """Return a node's machine, or None for this machine. Raise LaunchError if the machine is unknown."""
        name = node.machine
        if name in ("", "localhost"):
            return None
        machine = self.machines.get(name)
        if machine is None:
            known = f" (there are: {', '.join(self.machines)})" if self.machines else ""
            raise LaunchError(node.file, node.line, f"unknown machine [{name}]{known}")
        return machine
