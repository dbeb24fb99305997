"""A node's identity: its name, its namespace, and its settings from the command line and the environment.

Source: http://wiki.ros.org/Names, http://wiki.ros.org/Remapping%20Arguments.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections.abc import Mapping, Sequence

from minirospy.base import names
from minirospy.base.environment import Environment
from minirospy.base.errors import ROSInitException, RpcError, UsageError
from minirospy.base.yaml_text import safe_load
from minirospy.core.wire.xmlrpc import serialize_call

__all__ = ["Identity", "private_parameters", "warn_of_illegal_name"]

_UNNAMED = "unnamed"


class Identity:
    """A node's name, and name resolution relative to it.

    Before :meth:`take_name` is called, this is the identity of a program without a node.
    """

    def __init__(self, previous: Identity | None = None) -> None:
        """Create an identity that equals ``previous`` until :meth:`take_name` is called, except in :meth:`resolve_topic`."""
        # New names, keyed by the resolved old names and by __name and similar keys; empty before init_node.
        # Programs may change this dict and `mappings`.
        self.remappings: dict[str, str] = previous.remappings if previous else {}
        self._name: str | None = previous._name if previous else None
        # The namespace set by the program, or None
        self._namespace: str | None = previous._namespace if previous else None
        self._mappings: dict[str, str] | None = previous._mappings if previous else None
        self._arguments: names.Arguments | None = previous._arguments if previous else None
        self._environment: Environment | None = previous._environment if previous else None
        self._is_named = False

    @property
    def environment(self) -> Environment:
        """The environment, as read by :meth:`take_name`; before that, as read when it was first needed."""
        if self._environment is None:
            self._environment = _read_environment()
        return self._environment

    @property
    def arguments(self) -> names.Arguments:
        """The command line that was passed to init_node; before init_node, the process's own."""
        if self._arguments is None:
            self._arguments = names.parse_arguments(sys.argv)
        return self._arguments

    @property
    def mappings(self) -> dict[str, str]:
        """The remappings as written on the command line, including ``__name`` and other special keys."""
        if self._mappings is None:
            self._mappings = {**self.arguments.remappings, **self.arguments.special}
        return self._mappings

    @mappings.setter
    def mappings(self, mappings: dict[str, str]) -> None:
        self._mappings = mappings

    def resolved_mappings(self, node_name: str) -> dict[str, str]:
        """Return the remappings with old and new names resolved relative to ``node_name``; special keys stay unchanged."""
        return {
            key if key.startswith("__") else names.resolve(key, node_name): value
            if key.startswith("__")
            else names.resolve(value, node_name)
            for key, value in self.mappings.items()
        }

    @property
    def name(self) -> str:
        """This node's global name. Before init_node, it is ``unnamed`` in the node's namespace."""
        if self._name is None:
            self._name = names.join(self.environment.namespace, _UNNAMED)
        return self._name

    @property
    def namespace(self) -> str:
        """This node's namespace, with a trailing slash."""
        return names.namespace_of(self.name) if self._namespace is None else self._namespace

    def be_called(self, name: str, namespace: str | None = None) -> None:
        """Use the global name ``name`` until :meth:`take_name` is called.

        If ``namespace`` is given, report it as the namespace.
        """
        self._name = name
        self._namespace = namespace

    def resolve(self, name: str, caller_id: str | None = None) -> str:
        """Return ``name`` as a global name, resolved relative to this node or the node ``caller_id``."""
        node_name = caller_id or self.name
        if name and names.is_private(name):
            # As in rospy, keep a slash after `~`: `~/x` resolves to `/x`.
            resolved = names.join(node_name, names.canonicalize(name)[1:])
        else:
            resolved = names.resolve(name, node_name)
        return self.remappings.get(resolved, resolved)

    def resolve_topic(self, name: str) -> str:
        """Return the global name of a topic. A publisher or subscriber keeps the name that was resolved when it was created.

        Before init_node, apply the remappings on the process's command line, and raise ValueError if the name is private.
        """
        if self._is_named:
            return self.resolve(name)
        if names.is_private(name):
            raise ValueError("~name topics cannot be created before init_node() has been called")
        return names.resolve(name, self.name, self.resolved_mappings(self.name))

    def remap(self, name: str, caller_id: str | None = None) -> str:
        """Return the global name to which the command line remaps ``name``, or ``name`` itself if it is not remapped."""
        mapped = self.mappings.get(name)
        return name if mapped is None else names.resolve(mapped, caller_id or self.name)

    def reload_arguments(self, argv: Sequence[str]) -> None:
        """Use ``argv`` as the command line."""
        self._arguments = names.parse_arguments(argv)
        self._mappings = None

    def take_name(self, name: str, argv: Sequence[str], anonymous: bool) -> None:
        """Read the environment, and become the node ``name`` with the command line ``argv``.

        Raise ROSInitException if the environment or the command line is invalid.
        """
        self.reload_arguments(argv)
        arguments = self.arguments
        self._is_named = True
        try:
            self._environment = _read_environment()
        except UsageError as error:
            raise ROSInitException(str(error)) from error
        if "__name" in arguments.special:
            name = arguments.special["__name"]
        elif anonymous:
            name = f"{name}_{os.getpid()}_{time.time_ns() // 1_000_000}"
        self.be_called(names.resolve(name, names.join(self.environment.namespace, _UNNAMED)))
        self.remappings = self.resolved_mappings(self.name)


def private_parameters(arguments: names.Arguments) -> dict[str, object]:
    """Return the values of ``_param:=value`` arguments, parsed as YAML. Raise ROSInitException if one is not valid YAML."""
    if arguments.wrong:
        raise ROSInitException(
            f"invalid command-line parameters: [{arguments.wrong[0]}] has more than one :="
        )
    if not arguments.parameters:
        return {}
    import yaml

    values = {}
    for key, text in arguments.parameters.items():
        try:
            values[key] = safe_load(text)
            serialize_call("setParam", (key, values[key]))
        except (yaml.YAMLError, RpcError) as error:
            why = " ".join(str(error).split())
            raise ROSInitException(f"invalid command-line parameters: [_{key}:={text}]: {why}") from error
    return values


def warn_of_illegal_name(name: str, stacklevel: int = 3) -> None:
    """Warn, as rospy does, about an illegal graph name; the master may refuse the name later."""
    if not names.is_legal_name(name):
        warnings.warn(
            f"'{name}' is not a legal ROS graph resource name. This may cause problems with other ROS tools",
            stacklevel=stacklevel,
        )


def _read_environment() -> Environment:
    """Return the environment, with overrides from the process's own command line.

    As in rospy, the ``argv`` that a program passes to init_node is ignored here, except for ``__name``.
    """
    special: Mapping[str, str] = names.parse_arguments(sys.argv).special
    hosts = [value for key, value in special.items() if key in {"__ip", "__hostname"}]
    return Environment.read(
        master_uri=special.get("__master", ""),
        host=hosts[0] if hosts else "",
        namespace=special.get("__ns", ""),
    )
