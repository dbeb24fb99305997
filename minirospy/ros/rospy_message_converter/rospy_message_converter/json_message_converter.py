"""rospy_message_converter.json_message_converter: converts messages to JSON, and back."""

from __future__ import annotations

import json

from minirospy.core.idl.protocols import Message
from minirospy.ros.rospy_message_converter.rospy_message_converter.message_converter import (
    convert_dictionary_to_ros_message,
    convert_ros_message_to_dictionary,
)

__all__ = ["convert_json_to_ros_message", "convert_ros_message_to_json"]


def convert_json_to_ros_message(
    message_type: str,
    json_message: str,
    strict_mode: bool = True,
    check_missing_fields: bool = False,
    check_types: bool = True,
    log_level: str = "error",
) -> object:
    """Convert a JSON object to a message of the given type.

    Raise ValueError or TypeError if the object does not match the type, NotFoundError if the type is unknown.
    """
    return convert_dictionary_to_ros_message(
        message_type,
        json.loads(json_message),
        strict_mode=strict_mode,
        check_missing_fields=check_missing_fields,
        check_types=check_types,
        log_level=log_level,
    )


def convert_ros_message_to_json(message: Message, binary_array_as_bytes: bool = True) -> str:
    """Convert a message to a JSON object."""
    return json.dumps(convert_ros_message_to_dictionary(message, binary_array_as_bytes))
