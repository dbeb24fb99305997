"""The definitions of ROS 2 from rosbags, with the fields' types named as in rclpy's classes."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from rosbags.typesys import Stores, get_typestore

from minirospy.core.idl.load import Catalogue
from minirospy.core.idl.own_packages import own_definitions
from minirospy.core.idl.spec import MessageSpec
from minirospy.ros2.layouts import ros2_spec

_BASE, _NAME, _ARRAY = 1, 2, 3


@lru_cache
def typestore() -> Any:
    """Return ROS 2's types."""
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache
def catalogue() -> Catalogue:
    """Return the definitions of ROS 1."""
    return Catalogue.below(own_definitions())


@lru_cache
def ros2_lookup(name: str) -> MessageSpec:
    """Return the spec of ``pkg/Name`` in ROS 2. Raise KeyError if ROS 2 has no such type."""
    fields = typestore().fielddefs[name.replace("/", "/msg/")][1]
    return ros2_spec(name, {field: _text(type_) for field, type_ in fields})


def _text(type_: Any) -> str:
    kind, value = type_
    if kind == _BASE:
        return str(value[0])
    if kind == _NAME:
        return str(value).replace("/msg/", "/")
    if kind == _ARRAY:
        return f"{_text(value[0])}[{value[1]}]"
    return f"sequence<{_text(value[0])}>"
