"""MCAP files of ROS 2, written by the library rosbags, are read as bags of ROS 1."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sensor_msgs.msg import JointState

from minirospy.base.errors import BagError, BagFormatError, MinirospyError
from minirospy.introspect.bag_convert import convert
from minirospy.introspect.bag_series import bag_span, field_path, points
from minirospy.introspect.bags import left_out, open_reader
from minirospy.ros2.bag_channels import ros1_channel

SECOND = 10**9
STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(get_types_from_msg("float64 x\nstring<=10 s\n", "my_msgs/msg/Foo"))
TYPES = STORE.types


def joints(second: int) -> Any:
    header = TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](second, 5), "base")
    empty = np.array([])
    return TYPES["sensor_msgs/msg/JointState"](
        header, ["elbow", "wrist"], np.array([second + 0.5, 2.0]), empty, empty
    )


def write(folder: Path, messages: dict[str, list[Any]]) -> str:
    """Write messages by topic, one per second, with rosbags; return the path of the MCAP file."""
    with Writer(folder / "ros2", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, found in messages.items():
            connection = writer.add_connection(topic, found[0].__msgtype__, typestore=STORE)
            for second, message in enumerate(found):
                data = STORE.serialize_cdr(message, message.__msgtype__)
                writer.write(connection, (1000 + second) * SECOND, data)
    [path] = (folder / "ros2").glob("*.mcap")
    return str(path)


def test_messages_are_those_of_ros1(tmp_path: Path) -> None:
    path = write(
        tmp_path, {"/joint_states": [joints(0), joints(1)], "/chatter": [TYPES["std_msgs/msg/String"]("hi")]}
    )
    with open_reader(path) as reader:
        assert (reader.version_name, left_out(reader), bag_span(reader)) == (
            "MCAP 0 of ROS 2",
            "",
            (1000 * SECOND, 1001 * SECOND),
        )
        by_topic = {each.topic: each for each in reader.connections.values()}
        connection = by_topic["/joint_states"]
        assert (connection.type, connection.md5sum) == (JointState._type, JointState._md5sum)
        assert connection.definition == JointState._full_text
        bodies = [each.body for each in reader.messages([connection.id])]
        message = JointState()
        message.deserialize(bodies[1])
        assert (message.header.stamp.secs, message.header.stamp.nsecs, message.header.frame_id) == (
            1,
            5,
            "base",
        )
        assert (list(message.name), list(message.position)) == (["elbow", "wrist"], [1.5, 2.0])
        found = points(reader, [field_path("/joint_states/position[elbow]", by_topic)])
        assert [point.value for _, point in found] == [0.5, 1.5]


def test_unknown_type_is_left_out_with_the_reason_and_the_others_are_converted(tmp_path: Path) -> None:
    foo = TYPES["my_msgs/msg/Foo"](1.0, "a")
    path = write(tmp_path, {"/foo": [foo], "/chatter": [TYPES["std_msgs/msg/String"]("hi")]})
    with open_reader(path) as reader:
        assert left_out(reader).startswith("/foo: [my_msgs/msg/Foo] ")
        assert [each.connection.topic for each in reader.messages()] == ["/chatter"]
        assert sum(sum(chunk.counts.values()) for chunk in reader.chunks) == 1
    target = tmp_path / "a.bag"
    with pytest.raises(BagError, match="/foo"):
        convert(path, str(target), compression="none", force=False, step=lambda done: None)
    with open_reader(str(target)) as reader:
        [message] = reader.messages()
        assert message.body == struct.pack("<I", 2) + b"hi"
        assert reader.version_name == "2.0"


def test_damaged_message_is_an_error_of_the_file(tmp_path: Path) -> None:
    path = Path(write(tmp_path, {"/chatter": [TYPES["std_msgs/msg/String"]("hi there")]}))
    data = path.read_bytes()
    # The string's length, behind CDR's header.
    at = data.index(b"\0\1\0\0\x09\0\0\0hi there")
    path.write_bytes(data[: at + 4] + b"\xff\xff\xff\x7f" + data[at + 8 :])
    with open_reader(str(path)) as reader, pytest.raises(BagFormatError):
        list(reader.messages())


def test_without_the_room_for_ros2_the_topics_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "minirospy.ros2.bag_channels", None)
    with open_reader(write(tmp_path, {"/chatter": [TYPES["std_msgs/msg/String"]("hi")]})) as reader:
        assert left_out(reader) == "/chatter: [std_msgs/msg/String] its messages have the encoding 'cdr'"
        assert (reader.version_name, list(reader.messages())) == ("MCAP 0", [])


STRING = b"string data\n"


def many_channels(path: Path, schema: bytes) -> str:
    """Write an MCAP file of three channels with this schema; return its path."""
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start("ros2", "test")
        number = writer.register_schema("std_msgs/msg/String", "ros2msg", schema)
        for topic in ("/a", "/b", "/c"):
            writer.register_channel(topic, "cdr", number)
        writer.finish()
    return str(path)


def test_schema_of_many_channels_is_parsed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parsed: list[str] = []

    def counted(type_: str, *rest: Any) -> Any:
        parsed.append(type_)
        return ros1_channel(type_, *rest)

    monkeypatch.setattr("minirospy.ros2.bag_channels.ros1_channel", counted)
    with open_reader(many_channels(tmp_path / "a.mcap", STRING)) as reader:
        assert sorted(each.topic for each in reader.connections.values()) == ["/a", "/b", "/c"]
    assert parsed == ["std_msgs/msg/String"]
    with open_reader(many_channels(tmp_path / "b.mcap", b"string[ data\n")) as reader:
        assert left_out(reader).count("is not a field") == 3
    assert len(parsed) == 2


def test_long_schema_is_refused(tmp_path: Path) -> None:
    schema = STRING + b"#" * 1_048_576
    with open_reader(many_channels(tmp_path / "a.mcap", schema)) as reader:
        assert left_out(reader).startswith(
            "/a: [std_msgs/msg/String] its definition has more than 1,048,576 characters"
        )


@pytest.mark.parametrize(
    ("type_", "encoding", "schema", "message_encoding", "why"),
    [
        ("std_msgs/msg/String", "ros2msg", STRING, "json", "encoding 'json', not cdr"),
        ("std_msgs/msg/String", "ros2idl", STRING, "cdr", "encoding 'ros2idl', not ros2msg"),
        ("std_msgs/msg/String", "ros2msg", b"string data[\n", "cdr", "is not a field"),
        ("std_msgs/msg/String", "ros2msg", b"string[x] data\n", "cdr", "is not a field"),
        ("std_msgs/msg/String", "ros2msg", b"int32 data\n", "cdr", "data"),
        ("std_msgs/msg/String", "ros2msg", b"wstring data\n", "cdr", "wstring"),
        ("std_msgs/msg/Header", "ros2msg", b"Missing stamp\nstring frame_id\n", "cdr", "Missing"),
        (
            "std_msgs/msg/String",
            "ros2msg",
            STRING + b"=" * 80 + b"\nnonsense",
            "cdr",
            "not the name of a definition",
        ),
        ("other_msgs/msg/None", "ros2msg", STRING, "cdr", "other_msgs/None"),
        ("", "ros2msg", STRING, "cdr", ""),
        ("\xff", "ros2msg", b"\xff\xfe", "cdr", ""),
    ],
)
def test_what_cannot_be_converted_has_a_reason(
    type_: str, encoding: str, schema: bytes, message_encoding: str, why: str
) -> None:
    with pytest.raises(MinirospyError) as caught:
        ros1_channel(type_, encoding, schema, message_encoding)
    assert why in str(caught.value)


def test_constants_defaults_comments_and_bounds_are_read() -> None:
    schema = b'# a comment\nstring X="a # b"\nint32 Y = 3\nstring<=20 data "hi"  # a default\n'
    channel = ros1_channel("std_msgs/msg/String", "ros2msg", schema, "cdr")
    assert channel.type == "std_msgs/String"
    assert channel.to_ros1(b"\0\1\0\0\x03\0\0\0hi\0") == struct.pack("<I", 2) + b"hi"
