"""Opens channels of MCAP files that are not of ROS 1. Only this module knows their converter, and imports it when needed."""

from __future__ import annotations

import importlib
from typing import Protocol

from minirospy.base.errors import BagFormatError

__all__ = ["Ros1Channel", "ros1_channel"]

_CONVERTER = "minirospy.ros2.bag_channels"
"""A module with ``ros1_channel``."""


class Ros1Channel(Protocol):
    """A channel as in ROS 1: type, md5sum, definition, and the function that converts a message's bytes."""

    @property
    def type(self) -> str:
        """The ROS 1 type."""

    @property
    def md5sum(self) -> str:
        """The ROS 1 type's md5sum."""

    @property
    def definition(self) -> str:
        """The ROS 1 type's full text."""

    def to_ros1(self, data: bytes | memoryview, /) -> bytes:
        """Convert a message. Raise DeserializationError if it does not match its definition."""


def ros1_channel(type_: str, schema_encoding: str, schema: bytes, message_encoding: str) -> Ros1Channel:
    """Return the conversion of a channel to ROS 1. Raise MinirospyError with the reason if there is none."""
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
