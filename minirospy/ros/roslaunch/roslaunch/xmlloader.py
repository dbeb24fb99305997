"""roslaunch.xmlloader: loads launch files into a configuration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from minirospy.base import names
from minirospy.base.errors import LaunchError, MinirospyError
from minirospy.ros.roslaunch.launcher.load import STDIN, LaunchSource, load_sources
from minirospy.ros.roslaunch.launcher.spec import (
    LaunchSpec,
    MachineSpec,
    NodeSpec,
    ParameterCommand,
    TestSpec,
)
from minirospy.ros.roslaunch.roslaunch.core import (
    PHASE_SETUP,
    Executable,
    Machine,
    Node,
    Param,
    RLException,
    RosbinExecutable,
    Test,
    printlog,
)
from minirospy.ros.roslaunch.roslaunch.substitution_args import (
    ArgException,
    SubstitutionException,
    chosen_packages,
)

__all__ = [
    "ArgException",
    "Machine",
    "Node",
    "Param",
    "RLException",
    "SubstitutionException",
    "Test",
    "XmlLoader",
    "XmlParseException",
]


class XmlParseException(RLException):
    """Raised if a launch file cannot be loaded."""


class Configuration(Protocol):
    """The target for loading launch files: a ROSLaunchConfig, or a program's own object with these methods.

    The methods are called in the order of the tags.
    """

    def add_roslaunch_file(self, f: str) -> None:
        """Record that a file is being read."""

    def add_node(self, node: Node, core: bool = False, verbose: bool = True) -> object:
        """Add a node."""

    def add_test(self, test: Test, verbose: bool = True) -> object:
        """Add a test."""

    def add_param(self, p: Param, filename: str | None = None, verbose: bool = True) -> object:
        """Add a parameter. ``filename`` is given for a ``<param>`` outside a node."""

    def add_clear_param(self, param: str) -> object:
        """Add a namespace to delete before setting parameters."""

    def add_executable(self, exe: Executable) -> object:
        """Add a command."""

    def add_machine(self, m: Machine, verbose: bool = True) -> object:
        """Add a machine."""

    def add_config_error(self, msg: str) -> object:
        """Add a warning about ignored content."""


class ConfigError(str):
    """An error in a launch file, with ROS's wording; ``error`` is minirospy's version, with the line number."""

    error: LaunchError

    def __new__(cls, text: str, error: LaunchError) -> ConfigError:
        """Create a ConfigError with the text ``text`` and the attribute ``error``."""
        made = super().__new__(cls, text)
        made.error = error
        return made


class _Forwarded(LaunchSpec):
    """Forwards the content of launch files to a configuration."""

    def __init__(self, config: Configuration, *, core: bool, verbose: bool) -> None:
        super().__init__()
        self._config = config
        self._core = core
        self._verbose = verbose

    def add_file(self, path: str, name: str) -> None:
        """Print that a file is being loaded; add it to the configuration unless it was given as a string."""
        if name == STDIN:
            self._print("... loading XML")
            return
        self._print(f"... loading XML file [{name}]")
        self._config.add_roslaunch_file(name)

    def end_include(self, name: str) -> None:
        """Print that an included file has been loaded."""
        self._print(f"... done importing include file [{name}]")

    def runs_command(self, text: str) -> None:
        """Print a ``<param>``'s command."""
        self._print(f"... executing command param [{text}]")

    def add_node(self, node: NodeSpec) -> None:
        """Add a node to the configuration."""
        node = replace(node, file=_shown(node.file))
        self._config.add_node(Node.of(node), core=self._core, verbose=self._verbose)

    def add_test(self, test: TestSpec) -> None:
        """Add a test to the configuration."""
        test = replace(test, node=replace(test.node, file=_shown(test.node.file)))
        self._config.add_test(Test.of_test(test), verbose=self._verbose)

    def add_param(
        self, name: str, value: object, error: Callable[[str], LaunchError], file: str | None = None
    ) -> None:
        """Add a parameter to the configuration, with a file's bytes as an xmlrpc.client.Binary."""
        if isinstance(value, bytes):
            from xmlrpc.client import Binary

            value = Binary(value)
        param = Param(name, value)
        if file is None:
            self._config.add_param(param, verbose=self._verbose)
        else:
            self._config.add_param(param, filename=_shown(file), verbose=self._verbose)

    def add_clear(self, name: str) -> None:
        """Add to the configuration a namespace whose parameters are to be deleted."""
        self._config.add_clear_param(f"{name.rstrip('/')}/")

    def add_command(self, command: ParameterCommand) -> None:
        """Add a command to the configuration."""
        words: tuple[str, ...] = ("delete", command.name)
        if command.file is not None:
            words = ("dump", command.file, f"{command.name.rstrip('/')}/")
        self._config.add_executable(RosbinExecutable("rosparam", words, PHASE_SETUP))

    def add_machine(self, machine: MachineSpec) -> None:
        """Add a machine to the configuration."""
        self._config.add_machine(Machine.of(machine), verbose=self._verbose)

    def add_warning(self, warning: LaunchError, ros_text: str = "") -> None:
        """Add a warning to the configuration."""
        text = ros_text.replace(f"[{STDIN}]", "[string]") if ros_text else warning.text
        self._config.add_config_error(ConfigError(text, warning))

    def _print(self, text: str) -> None:
        if self._verbose:
            printlog(text)


def _shown(file: str) -> str:
    """Return a file's name as ROS prints it."""
    return "string" if file == STDIN else file


class XmlLoader:
    """Loads launch files into a configuration."""

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        self.resolve_anon = resolve_anon
        self.args_only = args_only
        self.ignore_unset_args = False

    def load(
        self,
        filename: str,
        ros_config: Configuration,
        core: bool = False,
        argv: Sequence[str] | None = None,
        verbose: bool = True,
    ) -> None:
        """Load a file with args ``["name:=value", ...]``. Raise XmlParseException if it is invalid."""
        source = LaunchSource(filename, None, names.parse_launch_arguments(argv or ()))
        self._load(source, _Forwarded(ros_config, core=core, verbose=verbose))

    def load_string(
        self, xml_text: str, ros_config: Configuration, core: bool = False, verbose: bool = True
    ) -> None:
        """Load a launch file from a string. Raise XmlParseException if it is invalid."""
        source = LaunchSource(STDIN, xml_text.encode(), {})
        self._load(source, _Forwarded(ros_config, core=core, verbose=verbose))

    def _load(self, source: LaunchSource, spec: LaunchSpec) -> None:
        try:
            load_sources([source], chosen_packages(), spec=spec)
        except MinirospyError as error:
            raise XmlParseException(str(error)) from error
