"""Converts channels of MCAP files that are not ROS 1 channels. Only this module knows the converter, and imports it on demand."""

from __future__ import annotations

import importlib
from typing import Protocol

from minirospy.base.errors import BagFormatError

__all__ = ["Ros1Channel", "ros1_channel"]

_CONVERTER = "minirospy.ros2.bag_channels"
"""The module that defines ``ros1_channel``."""


class Ros1Channel(Protocol):
    """A channel converted to ROS 1: its type, md5sum and definition, and the function that converts a message's bytes."""

    @property
    def type(self) -> str:
        """The ROS 1 type."""

    @property
    def md5sum(self) -> str:
        """The ROS 1 type's md5sum."""

    @property
    def definition(self) -> str:
        """The ROS 1 type's definition, with those of all types that it uses."""

    def to_ros1(self, data: bytes | memoryview, /) -> bytes:
        """Convert a serialized message. Raise DeserializationError if it does not match its definition."""


def ros1_channel(type_: str, schema_encoding: str, schema: bytes, message_encoding: str) -> Ros1Channel:
    """Return a channel's conversion to ROS 1. Raise MinirospyError, with the reason, if it cannot be converted."""
    try:
        module = importlib.import_module(_CONVERTER)
    except ModuleNotFoundError as error:
        if error.name is None or not _CONVERTER.startswith(error.name):
            raise
        raise BagFormatError(f"its messages have the encoding '{message_encoding[:20]}'") from None
    try:
        found: Ros1Channel = module.ros1_channel(type_, schema_encoding, schema, message_encoding)
    except RecursionError:
        raise BagFormatError("its definition is nested too deeply") from None
    return found
