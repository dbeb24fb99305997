"""roslaunch.xmlloader: loads launch files into a configuration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from minirospy.base import names
from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.launcher.load import STDIN, LaunchSource, load_sources
from minirospy.ros.roslaunch.launcher.spec import LaunchSpec
from minirospy.ros.roslaunch.roslaunch.core import Machine, Node, Param, RLException, Test
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
    """A launch file cannot be loaded."""


class Configuration(Protocol):
    """The object into which launch files are loaded: a ROSLaunchConfig."""

    def add(self, spec: LaunchSpec) -> None:
        """Add the content of launch files."""


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
        """Load a file, with its args as ``["name:=value", ...]``. Raise XmlParseException if it is invalid."""
        self._load(LaunchSource(filename, None, names.parse_launch_arguments(argv or ())), ros_config)

    def load_string(
        self, xml_text: str, ros_config: Configuration, core: bool = False, verbose: bool = True
    ) -> None:
        """Load a launch file given as a string. Raise XmlParseException if it is invalid."""
        self._load(LaunchSource(STDIN, xml_text.encode(), {}), ros_config)

    def _load(self, source: LaunchSource, config: Configuration) -> None:
        try:
            config.add(load_sources([source], chosen_packages()))
        except MinirospyError as error:
            raise XmlParseException(str(error)) from error
