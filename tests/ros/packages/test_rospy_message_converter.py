"""rospy_message_converter: every message converts to a dict and back; wrong values are rejected."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import PoseArray
from rospy_message_converter.json_message_converter import (
    convert_json_to_ros_message,
    convert_ros_message_to_json,
)
from rospy_message_converter.message_converter import (
    convert_dictionary_to_ros_message,
    convert_ros_message_to_dictionary,
)
from sensor_msgs.msg import CompressedImage, JointState
from std_msgs.msg import Header

from minirospy.base.errors import NotFoundError
from minirospy.core.idl.load import Catalogue, message_class

MSGS = Path(__file__).parents[3] / "msgs"


def wire(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_every_type_goes_to_json_and_back() -> None:
    catalogue = Catalogue.below(MSGS)
    names = [spec.full_name for package in catalogue.packages for spec in catalogue.messages(package)]
    assert len(names) > 200
    for name in names:
        # Fill the message with zeros, ones and twos.
        message = message_class(name)().deserialize(wire(message_class(name)()))
        for as_bytes in (True, False):
            text = convert_ros_message_to_json(message, as_bytes)
            assert wire(convert_json_to_ros_message(name, text, check_missing_fields=True)) == wire(
                message
            ), name


def test_values_of_a_message() -> None:
    dictionary = {
        "header": {"seq": 1, "stamp": {"secs": 5, "nsecs": 6}, "frame_id": "arm"},
        "name": ["a", "b"],
        "position": [1.5, 2],
        "velocity": [],
        "effort": [0.0],
    }
    message = convert_dictionary_to_ros_message("sensor_msgs/JointState", dictionary)
    assert isinstance(message, JointState)
    assert message.header.stamp.to_nsec() == 5_000_000_006
    assert convert_ros_message_to_dictionary(message) == dictionary
    poses = convert_dictionary_to_ros_message("geometry_msgs/PoseArray", {"poses": [{"position": {"x": 3}}]})
    assert isinstance(poses, PoseArray)
    assert (len(poses.poses), poses.poses[0].position.x) == (1, 3)


def test_bytes_are_base64_or_numbers() -> None:
    message = CompressedImage(data=b"\0\xff")
    assert convert_ros_message_to_dictionary(message)["data"] == "AP8="
    assert convert_ros_message_to_dictionary(message, False)["data"] == [0, 255]
    for data in ("AP8=", [0, 255], b"\0\xff", bytearray(b"\0\xff")):
        made = convert_dictionary_to_ros_message("sensor_msgs/CompressedImage", {"data": data})
        assert made.data == b"\0\xff"
    for data in ("A", "ä", [256]):
        with pytest.raises(ValueError, match="Field 'data' is not an array of bytes"):
            convert_dictionary_to_ros_message("sensor_msgs/CompressedImage", {"data": data})


def test_requests_and_responses() -> None:
    request = convert_dictionary_to_ros_message("std_srvs/SetBool", {"data": True}, "request")
    response = convert_dictionary_to_ros_message(
        "std_srvs/SetBool", {"success": True, "message": "m"}, "response"
    )
    assert (request.data, response.success, response.message) == (True, True, "m")
    with pytest.raises(ValueError, match='Unknown kind "question"'):
        convert_dictionary_to_ros_message("std_srvs/SetBool", {}, "question")


@pytest.mark.parametrize(
    ("type_", "dictionary", "error", "text"),
    [
        ("std_msgs/String", {"text": "x"}, ValueError, 'type "std_msgs/String" has no field named "text"'),
        ("std_msgs/String", {"data": 5}, TypeError, "Field 'data' has wrong type <class 'int'>"),
        ("std_msgs/Int8", {"data": True}, TypeError, "Field 'data' has wrong type <class 'bool'>"),
        ("std_msgs/Int8", {"data": 1.5}, TypeError, "valid types: int"),
        ("sensor_msgs/JointState", {"name": "arm"}, TypeError, "Field 'name' has wrong type <class 'str'>"),
        ("sensor_msgs/JointState", {"header": 5}, TypeError, "valid types: dict"),
        ("std_msgs/Header", {"stamp": 5}, TypeError, "Field 'stamp' has wrong type"),
        ("std_msgs/Strong", {}, NotFoundError, "std_msgs/Strong"),
    ],
)
def test_wrong_values_are_refused(
    type_: str, dictionary: dict[str, Any], error: type[Exception], text: str
) -> None:
    with pytest.raises(error) as caught:
        convert_dictionary_to_ros_message(type_, dictionary)
    assert text in str(caught.value)


def test_checks_can_be_left_out_or_added() -> None:
    header = {"seq": 1, "colour": "red"}
    assert convert_dictionary_to_ros_message("std_msgs/Header", header, strict_mode=False) == Header(seq=1)
    assert convert_dictionary_to_ros_message("std_msgs/String", {"data": 5}, check_types=False).data == 5
    with pytest.raises(ValueError, match="lacks a value of: stamp, frame_id"):
        convert_json_to_ros_message("std_msgs/Header", json.dumps({"seq": 1}), check_missing_fields=True)
