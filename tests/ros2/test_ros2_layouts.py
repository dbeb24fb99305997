"""ROS 1 messages converted to CDR and back, compared with rosbags, an independent implementation."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from minirospy.base.errors import DeserializationError
from minirospy.core.idl.cdr import CDR_HEADER, Transcoder, make_transcoder
from minirospy.core.idl.load import class_from_text, classes_from_text, message_class, specs_of_text
from minirospy.core.idl.spec import FieldType, MessageSpec
from minirospy.ros2.layouts import TypesDiffer, layout_of, ros2_field_type, ros2_spec, transcoder
from minirospy.ros2.rules import BUILT_IN
from tests.core.idl.test_codec import fill, full_texts, messages, serialized
from tests.ros2.ros2_definitions import catalogue, ros2_lookup, typestore

# These types are tested separately below, because rosbags does not convert them, or ROS 2 lacks them.
SPECIAL = {"std_msgs/Time", "std_msgs/Duration", "sensor_msgs/BatteryState", "sensor_msgs/Range"}
USUAL = (
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "nav_msgs",
    "diagnostic_msgs",
    "trajectory_msgs",
    "tf2_msgs",
)
OF_THE_USUAL_PACKAGES = sorted(
    spec.full_name
    for package in USUAL
    for spec in catalogue().messages(package)
    if spec.full_name not in SPECIAL and spec.full_name.replace("/", "/msg/") in typestore().fielddefs
)


def transcoder_of(name: str) -> Transcoder:
    ros1 = catalogue().message(name)
    ros2 = ros2_lookup(BUILT_IN.ros2_messages(name)[0])
    return transcoder(ros1, catalogue().message, ros2, ros2_lookup, BUILT_IN)


@st.composite
def messages_of(draw: st.DrawFn, name: str) -> Any:
    """Return a message of an installed type with random values."""

    def make(base: str) -> Any:
        return message_class(base)()

    return fill(draw, make(name), make)


@pytest.mark.parametrize("name", OF_THE_USUAL_PACKAGES)
def test_bytes_are_those_that_rosbags_makes(name: str) -> None:
    made = transcoder_of(name)
    # Add ROS 1's definitions to those of ROS 2, which have the same fields except for the header.
    store = get_typestore(Stores.ROS2_JAZZY)
    ros2_name = name.replace("/", "/msg/")

    @settings(max_examples=6)
    @given(messages_of(name))
    def compare(message: Any) -> None:
        data = serialized(message)
        cdr = made.to_cdr(data, CDR_HEADER)
        expected = bytes(store.ros1_to_cdr(data, ros2_name))
        assert cdr == expected
        back = made.to_ros1(cdr)
        assert back == bytes(store.cdr_to_ros1(cdr, ros2_name))
        if name not in ("std_msgs/Header",) and not _has_header(name):
            assert back == data

    compare()


def _has_header(name: str) -> bool:
    spec = catalogue().message(name)
    return any(
        each.type.base == "std_msgs/Header" or (not each.type.is_primitive and _has_header(each.type.base))
        for each in spec.fields
    )


# --- types of any fields


def as_ros2(specs: dict[str, MessageSpec]) -> dict[str, MessageSpec]:
    """Return the specs with ROS 2's names and fields."""
    times = {
        name: ros2_spec(name, {"sec": "int32", "nanosec": "uint32"})
        for name in ("builtin_interfaces/Time", "builtin_interfaces/Duration")
    }
    bases = {"time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration", "char": "uint8"}

    def renamed(type_: FieldType) -> FieldType:
        return type_._replace(base=bases.get(type_.base, type_.base))

    return times | {
        name: spec._replace(fields=tuple(each._replace(type=renamed(each.type)) for each in spec.fields))
        for name, spec in specs.items()
    }


def transcoder_of_text(text: str) -> Transcoder:
    specs = specs_of_text("p/M0", text)
    ros2 = as_ros2(specs)
    return transcoder(specs["p/M0"], specs.__getitem__, ros2["p/M0"], ros2.__getitem__, BUILT_IN)


def cdr_of(message: Any, order: str) -> bytes:
    """Return a message as CDR, field by field, as a slow but readable reference."""
    out = bytearray()

    def number(letter: str, value: Any) -> None:
        out.extend(bytes(-len(out) % struct.calcsize(letter)))
        out.extend(struct.pack(order + letter, value))

    def single(value: Any, base: str) -> None:
        if base == "string":
            data = value.encode()
            number("I", len(data) + 1)
            out.extend(data + b"\0")
        elif base in ("time", "duration"):
            number("I" if base == "time" else "i", value.secs)
            number("I", value.nsecs)
        elif base == "bool":
            number("B", int(value))
        elif base in LETTERS:
            number(LETTERS[base], value)
        else:
            fields(value)

    def fields(message: Any) -> None:
        if not message.__slots__:
            number("B", 0)
        for name, type_ in zip(message.__slots__, message._slot_types, strict=True):
            base, bracket, length = type_.partition("[")
            value = getattr(message, name)
            if not bracket:
                single(value, base)
                continue
            if length == "]":
                number("I", len(value))
            for each in value:
                single(each, base)

    fields(message)
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + out


LETTERS = {
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
    "float32": "f", "float64": "d", "byte": "b", "char": "B",
}  # fmt: skip


@settings(max_examples=15)
@given(messages())
def test_any_type_goes_to_cdr_and_back(message: Any) -> None:
    made = transcoder_of_text(message._full_text)
    data = serialized(message)
    cdr = made.to_cdr(data, CDR_HEADER)
    assert cdr == cdr_of(message, "<")
    assert made.to_cdr(memoryview(data), CDR_HEADER) == cdr
    assert made.to_ros1(cdr) == data
    assert made.to_ros1(memoryview(cdr)) == data


@settings(max_examples=20)
@given(messages())
def test_big_endian_cdr_is_read(message: Any) -> None:
    made = transcoder_of_text(message._full_text)
    assert made.to_ros1(cdr_of(message, ">")) == serialized(message)


@settings(max_examples=20)
@given(full_texts(), st.binary(max_size=60), st.sampled_from([b"\0\1\0\0", b"\0\0\0\0"]))
def test_any_bytes_are_accepted_or_refused(text: str, data: bytes, header: bytes) -> None:
    made = transcoder_of_text(text)
    for convert in (lambda: made.to_cdr(data, CDR_HEADER), lambda: made.to_ros1(header + data)):
        try:
            assert isinstance(convert(), bytes)
        except DeserializationError:
            pass


@settings(max_examples=15)
@given(messages(), st.data())
def test_bytes_that_end_too_early_are_refused(message: Any, data: st.DataObject) -> None:
    made = transcoder_of_text(message._full_text)
    whole = serialized(message)
    if whole:
        cut = data.draw(st.integers(0, len(whole) - 1))
        with pytest.raises(DeserializationError):
            made.to_cdr(whole[:cut], CDR_HEADER)


def test_a_length_beyond_the_message_is_refused_before_the_loop() -> None:
    made = transcoder_of_text("p/M1[] f0\n" + "\n" + "=" * 80 + "\nMSG: p/M1\n")
    with pytest.raises(DeserializationError, match="longer than the message"):
        made.to_cdr(b"\xff\xff\xff\xff", CDR_HEADER)
    with pytest.raises(DeserializationError, match="longer than the message"):
        made.to_ros1(CDR_HEADER + b"\xff\xff\xff\xff")


def test_other_encodings_are_refused() -> None:
    with pytest.raises(DeserializationError, match="not plain CDR version 1: they start with 00070000"):
        transcoder_of("std_msgs/String").to_ros1(b"\0\7\0\0\0\0\0\0")


def test_options_of_the_header_are_written_and_ignored() -> None:
    made = transcoder_of("std_msgs/Int8")
    assert made.to_cdr(b"\5", b"\0\1\x4d\x52") == b"\0\1\x4d\x52\5"
    assert made.to_ros1(b"\0\1\x4d\x52\5") == b"\5"


def test_a_large_message_is_copied_once() -> None:
    # The result joins one slice of the source, not a copy of it, with the data before it.
    made = transcoder_of("sensor_msgs/Image")
    image = message_class("sensor_msgs/Image")(
        height=480, width=640, encoding="bgr8", step=1920, data=bytes(921_600)
    )
    buffer = BytesIO()
    image.serialize(buffer)
    cdr = made.to_cdr(buffer.getvalue(), CDR_HEADER)
    assert len(cdr) == 921_600 + 4 + 12 + 8 + 13 + 3 + 4 + 4
    assert len(made.to_ros1(cdr)) == len(buffer.getvalue())


# --- rules of the usual packages


def test_header_loses_its_number() -> None:
    made = transcoder_of("std_msgs/Header")
    data = serialized(message_class("std_msgs/Header")(seq=7, frame_id="map"))
    back = made.to_ros1(made.to_cdr(data, CDR_HEADER))
    assert back == data.replace(b"\7\0\0\0", b"\0\0\0\0", 1)


@pytest.mark.parametrize(("name", "number"), [("std_msgs/Time", 3), ("std_msgs/Duration", -3)])
def test_time_and_duration_become_messages(name: str, number: int) -> None:
    data = struct.pack("<iI", number, 5)
    made = transcoder_of(name)
    assert made.to_cdr(data, CDR_HEADER) == CDR_HEADER + data
    assert made.to_ros1(CDR_HEADER + data) == data


@pytest.mark.parametrize(("ros1", "ros2"), [(1, 10), (2, 20), (4, 30), (8, 40), (16, 50), (99, 99)])
def test_log_becomes_that_of_rcl(ros1: int, ros2: int) -> None:
    log = message_class("rosgraph_msgs/Log")(
        level=ros1, name="/n", msg="text", file="f.py", function="g", line=3, topics=["/a", "/b"]
    )
    log.header.stamp.secs = 9
    made = transcoder_of("rosgraph_msgs/Log")
    cdr = made.to_cdr(serialized(log), CDR_HEADER)
    assert cdr[:13] == CDR_HEADER + struct.pack("<IIB", 9, 0, ros2)
    found = message_class("rosgraph_msgs/Log")().deserialize(made.to_ros1(cdr))
    log.topics = []
    assert found == log


@pytest.mark.parametrize(
    "name", ["sensor_msgs/BatteryState", "sensor_msgs/Range", "visualization_msgs/Marker"]
)
def test_fields_that_ros2_added_are_zero_and_dropped(name: str) -> None:
    message = message_class(name)()
    data = serialized(message)
    assert transcoder_of(name).to_ros1(transcoder_of(name).to_cdr(data, CDR_HEADER)) == data


def test_tf_message_of_the_old_package_maps() -> None:
    assert layout_of(
        catalogue().message("tf/tfMessage"),
        catalogue().message,
        ros2_lookup("tf2_msgs/TFMessage"),
        ros2_lookup,
        BUILT_IN,
    ) == layout_of(
        catalogue().message("tf2_msgs/TFMessage"),
        catalogue().message,
        ros2_lookup("tf2_msgs/TFMessage"),
        ros2_lookup,
        BUILT_IN,
    )


# --- why a type does not map


def differs(ros1_text: str, ros2_fields: dict[str, str]) -> str:
    specs = specs_of_text("p/M0", ros1_text)
    try:
        spec = ros2_spec("p/M0", ros2_fields)
        layout_of(specs["p/M0"], specs.__getitem__, spec, {}.__getitem__, BUILT_IN)
    except TypesDiffer as error:
        return str(error)
    return ""


def test_reasons_name_the_field() -> None:
    assert differs("int32 a\nint32 b\n", {"a": "int32"}) == "[p/M0] lacks the field [b] in ROS 2"
    assert differs("int32 a\n", {"a": "int32", "b": "int32"}) == "[p/M0] lacks the field [b] in ROS 1"
    assert differs("int32 a\n", {"a": "int64"}) == "[a] of [p/M0] is a [int32], in ROS 2 a [int64]"
    assert differs("int32[] a\n", {"a": "int32[3]"}) == "[a] of [p/M0] is a [int32[]], in ROS 2 a [int32[3]]"
    assert differs("string a\n", {"a": "wstring"}) == "ROS 1 has no type like [wstring]"
    assert differs("float64 a\n", {"a": "long double"}) == "ROS 1 has no type like [long double]"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("boolean", FieldType("bool")),
        ("octet", FieldType("byte")),
        ("string<10>", FieldType("string")),
        ("sequence<double>", FieldType("float64", True)),
        ("sequence<uint8, 16>", FieldType("uint8", True)),
        ("sequence<string<5>, 3>", FieldType("string", True)),
        ("double[36]", FieldType("float64", True, 36)),
        ("geometry_msgs/Point", FieldType("geometry_msgs/Point")),
        ("sequence<geometry_msgs/Point>", FieldType("geometry_msgs/Point", True)),
    ],
)
def test_field_types_of_rclpy_are_read(text: str, expected: FieldType) -> None:
    assert ros2_field_type(text) == expected


def test_a_type_that_unfolds_to_too_much_is_refused() -> None:
    separator = "\n" + "=" * 80 + "\n"
    parts = [f"MSG: p/M{n}\n" + "".join(f"p/M{n + 1} f{k}\n" for k in range(10)) for n in range(1, 6)]
    text = separator.join(["p/M1 f\n", *parts, "MSG: p/M6\nint32 a\n"])
    with pytest.raises(TypesDiffer):
        transcoder_of_text(text)


def test_generated_functions_are_named_in_tracebacks() -> None:
    made = make_transcoder("p/Name", ())
    assert made.to_cdr.__code__.co_filename == "<generated p/Name to CDR>"
    assert class_from_text("p/Empty", "") is not None


@pytest.mark.parametrize("array", ["float64[0]", "p/M1[0]"])
def test_an_array_without_elements_is_not_aligned(array: str) -> None:
    made = transcoder_of_text(f"uint8 a\n{array} b\nuint8 c\n" + "\n" + "=" * 80 + "\nMSG: p/M1\nfloat64 d\n")
    assert made.to_cdr(b"\1\2", CDR_HEADER) == CDR_HEADER + b"\1\2"
    assert made.to_ros1(CDR_HEADER + b"\1\2") == b"\1\2"


# --- fields in another order

ORDERS = """Header header
string name
Inner[] inner
int32[2] pair
time[] stamps
bool flag
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: p/Inner
float64 x
string word
Empty[] nothing
int8 y
================================================================================
MSG: p/Empty
"""


def reversed_spec(spec: MessageSpec) -> MessageSpec:
    return spec._replace(fields=tuple(reversed(spec.fields)))


def test_fields_are_mapped_by_name_whatever_their_order() -> None:
    specs = specs_of_text("p/M0", ORDERS)
    plain = as_ros2(specs)
    header = plain["std_msgs/Header"]
    plain["std_msgs/Header"] = header._replace(fields=header.fields[1:])
    mixed = {
        name: reversed_spec(spec) if name.startswith(("p/", "std_msgs/")) else spec
        for name, spec in plain.items()
    }
    mixed_ros1 = {name: reversed_spec(spec) for name, spec in specs.items()}
    lookup = specs.__getitem__
    made = transcoder(specs["p/M0"], lookup, mixed["p/M0"], mixed.__getitem__, BUILT_IN)
    # The ROS 2 bytes must equal those of a ROS 1 message whose fields are in that order.
    oracle = transcoder(
        mixed_ros1["p/M0"], mixed_ros1.__getitem__, mixed["p/M0"], mixed.__getitem__, BUILT_IN
    )
    for count in (0, 1, 3):
        one, two = filled(ORDERS, count), filled(reversed_text(ORDERS), count)
        cdr = made.to_cdr(one, CDR_HEADER)
        assert cdr == oracle.to_cdr(two, CDR_HEADER)
        assert made.to_ros1(cdr) == one
        for end in range(len(one)):
            with pytest.raises(DeserializationError):
                made.to_cdr(one[:end], CDR_HEADER)


def test_a_length_beyond_the_message_is_refused_before_its_elements_are_counted() -> None:
    specs = specs_of_text("p/M0", "Empty[] nothing\nint8 y\n" + "=" * 80 + "\nMSG: p/Empty\n")
    ros2 = as_ros2(specs)
    ros2["p/M0"] = reversed_spec(ros2["p/M0"])
    made = transcoder(specs["p/M0"], specs.__getitem__, ros2["p/M0"], ros2.__getitem__, BUILT_IN)
    with pytest.raises(DeserializationError, match="a length is longer than the message"):
        made.to_cdr(b"\xff\xff\xff\xff\x00", CDR_HEADER)


def filled(text: str, count: int) -> bytes:
    """Return a message with the fields in ORDERS, and with arrays of ``count`` elements."""
    classes: Any = classes_from_text("p/M0", text)
    made = classes["p/M0"]()
    made.header.frame_id, made.header.stamp.secs = "map", 7
    made.name, made.pair, made.flag = "n" * count, [count, -1], True
    made.stamps = [type(made.header.stamp)(number, 1) for number in range(count)]
    for number in range(count):
        each = classes["p/Inner"]()
        each.nothing = [classes["p/Empty"]()] * number
        each.x, each.word, each.y = number / 3, "w" * number, -number
        made.inner.append(each)
    return serialized(made)


def reversed_text(text: str) -> str:
    """Return a full definition text in which each message has its fields in reverse order."""
    parts = []
    for part in text.split("=" * 80 + "\n"):
        lines = part.splitlines()
        head = [each for each in lines if each.startswith("MSG:")]
        parts.append("\n".join([*head, *reversed([each for each in lines if each not in head])]) + "\n")
    return ("=" * 80 + "\n").join(parts)
