"""dynamic_reconfigure: parameters that change while a node runs. Source: http://wiki.ros.org/dynamic_reconfigure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol, TypeAlias, TypedDict

__all__ = [
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "find_reconfigure_services",
    "get_parameter_names",
]

_SUFFIX = "/set_parameters"

Value: TypeAlias = bool | int | float | str
"""A parameter's value."""

Values: TypeAlias = Mapping[str, Any]
"""Values by the names of parameters; ``groups``, if it is there, holds the tree of groups or their states."""

GroupTree: TypeAlias = Mapping[str, Any]
"""A group, of a type's description or decoded: its number, name and state, its parameters, and the groups in it."""


class Entry(TypedDict, total=False):
    """A parameter or a constant, as a .cfg file describes it and the generated module has it."""

    name: str
    type: str
    ctype: str
    cconsttype: str
    description: str
    srcfile: str
    srcline: int
    # Of a constant.
    value: Value
    # Of a parameter.
    default: Value | None
    min: Value | None
    max: Value | None
    level: int
    edit_method: str


class DynamicReconfigureException(Exception):
    """An error of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter that the server does not have, or a value that it cannot have."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """The server's callback failed, or returned no configuration."""


class ConfigType(Protocol):
    """A module ``package.cfg.NAMEConfig``, which is generated from a .cfg file."""

    defaults: Mapping[str, Value]
    min: Mapping[str, Value]
    max: Mapping[str, Value]
    config_description: GroupTree


def find_reconfigure_services() -> list[str]:
    """Return the names of all servers, sorted. Raise ROSServiceIOException without a master."""
    from minirospy.ros.rosservice import rosservice

    names = rosservice.get_service_list()
    return sorted(name[: -len(_SUFFIX)] for name in names if name.endswith(_SUFFIX))


def get_parameter_names(descr: ConfigType) -> Iterable[str]:
    """Return the names of a type's parameters."""
    return descr.defaults.keys()
