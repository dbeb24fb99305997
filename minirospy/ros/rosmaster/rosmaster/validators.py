"""rosmaster.validators: validates the arguments of calls to the master.

Each function returns a check, which is called with (value, caller_id). The check returns the value, or raises
ParameterInvalid with rosmaster's message.
"""

from __future__ import annotations

from collections.abc import Callable

from minirospy.base.names import is_global
from minirospy.ros.rosgraph.rosgraph.names import resolve_name
from minirospy.ros.rospy.rospy.names import ParameterInvalid

__all__ = [
    "ANYTYPE",
    "ROSRPC",
    "TYPE_SEPARATOR",
    "ParameterInvalid",
    "empty_or_valid_name",
    "global_name",
    "is_api",
    "is_service",
    "is_topic",
    "non_empty",
    "non_empty_str",
    "not_none",
    "valid_name",
    "valid_name_validator_resolved",
    "valid_name_validator_unresolved",
    "valid_type_name",
]

ANYTYPE = "*"
ROSRPC = "rosrpc://"
TYPE_SEPARATOR = "/"

Check = Callable[[object, str], object]


def not_none(param_name: str) -> Check:
    """Return a validator that requires a value other than None."""

    def check(value: object, caller_id: str) -> object:
        if value is None:
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be specified")
        return value

    return check


def non_empty(param_name: str) -> Check:
    """Return a validator that requires a non-empty value."""

    def check(value: object, caller_id: str) -> object:
        if not value:
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be specified and non-empty")
        return value

    return check


def non_empty_str(param_name: str) -> Check:
    """Return a validator that requires a non-empty string."""

    def check(value: object, caller_id: str) -> object:
        if not isinstance(non_empty(param_name)(value, caller_id), str):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a string")
        return value

    return check


def empty_or_valid_name(param_name: str) -> Check:
    """Return a validator that requires an empty string or a valid name; it returns the resolved name."""

    def check(value: object, caller_id: str) -> object:
        if not isinstance(value, str):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a string")
        return resolve_name(value, caller_id) if value else ""

    return check


def global_name(param_name: str) -> Check:
    """Return a validator that requires a global name."""

    def check(value: object, caller_id: str) -> object:
        name = _text(param_name, value)
        if not is_global(name):
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a globally referenced name")
        return name

    return check


def valid_name_validator_resolved(param_name: str, param_value: object, caller_id: str) -> str:
    """Return the resolved name. Raise ParameterInvalid if it is not a valid name."""
    return resolve_name(valid_name_validator_unresolved(param_name, param_value, caller_id), caller_id)


def valid_name_validator_unresolved(param_name: str, param_value: object, caller_id: str) -> str:
    """Return the name unchanged. Raise ParameterInvalid if it is not a valid name."""
    name = _text(param_name, param_value)
    if ":" in name or " " in name:
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] contains illegal chars")
    return name


def valid_name(param_name: str, resolve: bool = True) -> Check:
    """Return a validator that requires a valid name and, if ``resolve`` is set, resolves it."""
    chosen = valid_name_validator_resolved if resolve else valid_name_validator_unresolved

    def check(value: object, caller_id: str) -> object:
        return chosen(param_name, value, caller_id)

    return check


def is_topic(param_name: str) -> Check:
    """Return a validator that requires a topic name other than the global namespace; it returns the resolved name."""

    def check(value: object, caller_id: str) -> object:
        name = valid_name_validator_unresolved(param_name, value, caller_id)
        if name == "/":
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] cannot be the global namespace")
        return resolve_name(name, caller_id)

    return check


def is_service(param_name: str) -> Check:
    """Return a validator that requires a service name other than the global namespace; it returns the resolved name."""
    return is_topic(param_name)


def is_api(paramName: str) -> Check:
    """Return a validator that requires the URI of a node or service API."""

    def check(value: object, caller_id: str) -> object:
        if not value or not isinstance(value, str):
            raise ParameterInvalid(f"ERROR: parameter [{paramName}] is not an XMLRPC URI")
        if not value.startswith(("http://", "rosrpc://")):
            raise ParameterInvalid(f"ERROR: parameter [{paramName}] is not an RPC URI")
        return value

    return check


def valid_type_name(param_name: str) -> Check:
    """Return a validator that requires ``package/Type``, or ``*`` for any type."""

    def check(value: object, caller_id: str) -> object:
        name = _text(param_name, value)
        if name != "*" and name.count("/") != 1:
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] is not a valid package resource name")
        return name

    return check


def _text(param_name: str, value: object) -> str:
    if not value or not isinstance(value, str):
        raise ParameterInvalid(f"ERROR: parameter [{param_name}] must be a non-empty string")
    return value
