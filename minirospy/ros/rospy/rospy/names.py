"""rospy.names: remappings, and validators for the arguments of calls.

Source: http://wiki.ros.org/Names and the behaviour of rospy.names.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from minirospy.base import names
from minirospy.base.errors import ROSException, ROSInitException
from minirospy.client import get_caller_id, get_name, get_namespace, remap_name, resolve_name
from minirospy.client.session import current_session
from minirospy.ros.ros_names import (
    GLOBALNS,
    REMAP,
    SEP,
    canonicalize_name,
    get_ros_namespace,
    is_global,
    is_private,
    isstring,
    load_mappings,
    make_global_ns,
    namespace,
    ns_join,
)
from minirospy.ros.rosgraph.rosgraph.names import resolve_name as resolve_name_for

__all__ = [
    "ANYTYPE",
    "GLOBALNS",
    "REMAP",
    "SEP",
    "SERVICE_ANYTYPE",
    "TOPIC_ANYTYPE",
    "ParameterInvalid",
    "ROSException",
    "ROSInitException",
    "_set_caller_id",
    "canonicalize_name",
    "get_caller_id",
    "get_mappings",
    "get_name",
    "get_namespace",
    "get_resolved_mappings",
    "get_ros_namespace",
    "global_name",
    "initialize_mappings",
    "is_global",
    "is_private",
    "isstring",
    "load_mappings",
    "make_global_ns",
    "namespace",
    "ns_join",
    "reload_mappings",
    "remap_name",
    "resolve_name",
    "resolve_name_without_node_name",
    "scoped_name",
    "valid_name",
    "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
]


def _set_caller_id(caller_id: str) -> None:
    """Change the node's name without notifying the master. Raise ValueError if ``caller_id`` is None."""
    namespace(caller_id)
    current_session().identity.be_called(caller_id)


ANYTYPE = TOPIC_ANYTYPE = SERVICE_ANYTYPE = "*"

Validator = Callable[[object, str], str]
"""A function that checks an argument of a call from the node ``caller_id``, and returns the value to use."""


class ParameterInvalid(Exception):
    """Raised if an argument of a call is invalid."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self._message = message

    def __str__(self) -> str:
        return self._message


def get_mappings() -> dict[str, str]:
    """Return the remappings on this node's command line as written, including ``__name`` and other special keys.

    :func:`initialize_mappings` applies changes to the dict.
    """
    return current_session().identity.mappings


def get_resolved_mappings() -> dict[str, str]:
    """Return the remappings with global names, empty before init_node. Changes to the dict take effect immediately."""
    return current_session().identity.remappings


def reload_mappings(argv: Sequence[str]) -> None:
    """Replace this node's command line with ``argv``."""
    current_session().identity.reload_arguments(argv)


def initialize_mappings(node_name: str) -> None:
    """Resolve the remappings again, for the node name ``node_name``.

    Raise ValueError if there are any names to resolve and ``node_name`` is not a name.
    """
    identity = current_session().identity
    if any(not name.startswith("__") for name in identity.mappings):
        namespace(node_name)
    identity.remappings = identity.resolved_mappings(node_name)


def resolve_name_without_node_name(name: str) -> str:
    """Return a topic's global name without using the node's name. Raise ValueError if the name is private."""
    if is_private(name):
        raise ValueError("~name topics cannot be created before init_node() has been called")
    return current_session().identity.resolve_topic(name or "")


def scoped_name(caller_id: str, name: str) -> str:
    """Return ``name`` without the namespace of ``caller_id``. Raise ROSException if ``caller_id`` is not global."""
    if not is_global(caller_id):
        raise ROSException("caller_id must be global")
    return names.canonicalize(name)[len(names.namespace_of(caller_id)) :]


def global_name(param_name: str) -> Validator:
    """Return a validator for global names. For other values, it raises ParameterInvalid with ``param_name`` in the message."""

    def validator(param_value: object, caller_id: str) -> str:
        text = _text(param_name, param_value)
        if not is_global(text):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a globally referenced name")
        return text

    return validator


def valid_name(param_name: str, resolve: bool = True) -> Validator:
    """Return a validator for names that also resolves them.

    The check raises ParameterInvalid if the name is invalid.
    """
    check = valid_name_validator_resolved if resolve else valid_name_validator_unresolved
    return lambda param_value, caller_id: check(param_name, param_value, caller_id)


def valid_name_validator_resolved(param_name: str, param_value: object, caller_id: str) -> str:
    """Return an argument's global name without remapping it. Raise ParameterInvalid if it is not a valid name."""
    return resolve_name_for(valid_name_validator_unresolved(param_name, param_value, caller_id), caller_id)


def valid_name_validator_unresolved(param_name: str, param_value: object, caller_id: str) -> str:
    """Return an argument unchanged. Raise ParameterInvalid if it is not a valid name."""
    text = _text(param_name, param_value)
    if ":" in text or " " in text:
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] contains illegal chars")
    return text


def _text(param_name: str, param_value: object) -> str:
    if not param_value or not isinstance(param_value, str):
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a non-empty string")
    return param_value
