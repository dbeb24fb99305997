"""serialize and deserialize for random types, compared with a slow, readable implementation of the wire format."""

from __future__ import annotations

import math
import struct
import tracemalloc
from collections.abc import Iterator
from io import BytesIO
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from minirospy.base.errors import DeserializationError
from minirospy.base.times import Duration, Time
from minirospy.core.idl.load import class_from_text, specs_of_text
from minirospy.core.wire.framing import SplitFrame

SEPARATOR = "=" * 80
NUMBERS = {
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
    "float32": "f", "float64": "d", "byte": "b", "char": "B",
}  # fmt: skip
SCALARS = [*NUMBERS, "bool", "string", "time", "duration"]


# --- random types: a tree of messages, each of the packages own or other


@st.composite
def full_texts(draw: st.DrawFn) -> str:
    """Return the full text of a type ``p/M0``, which may contain p/M1, p/M2; those may contain each later one."""
    count = draw(st.integers(1, 3))
    texts = []
    for number in range(count):
        kinds = SCALARS + [f"p/M{inner}" for inner in range(number + 1, count)]
        fields = draw(
            st.lists(
                st.tuples(st.sampled_from(kinds), st.sampled_from(["", "[]", "[0]", "[1]", "[3]"])),
                max_size=5,
            )
        )
        texts.append("".join(f"{base}{array} f{index}\n" for index, (base, array) in enumerate(fields)))
    return f"\n{SEPARATOR}\n".join([texts[0], *(f"MSG: p/M{n}\n{text}" for n, text in enumerate(texts) if n)])


def single(base: str) -> st.SearchStrategy[Any]:
    if base == "bool":
        return st.booleans()
    if base == "string":
        return st.text(max_size=6)
    if base == "time":
        return st.builds(Time, st.integers(0, 2**32 - 1), st.integers(0, 10**9 - 1))
    if base == "duration":
        return st.builds(Duration, st.integers(-(2**31), 2**31 - 1), st.integers(0, 10**9 - 1))
    if base.startswith("float"):
        return st.floats(width=int(base[5:]), allow_nan=False)
    letter = NUMBERS[base]
    bits = 8 * struct.calcsize(letter)
    return (
        st.integers(0, 2**bits - 1)
        if letter.isupper()
        else st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )


def fill(draw: Any, message: Any, make: Any) -> Any:
    for name, type_ in zip(message.__slots__, message._slot_types, strict=True):
        base, bracket, length = type_.partition("[")

        def value(base: str = base) -> Any:
            return draw(single(base)) if base in SCALARS else fill(draw, make(base), make)

        if not bracket:
            setattr(message, name, value())
            continue
        count = int(length[:-1]) if length != "]" else draw(st.integers(0, 3))
        values = [value() for _ in range(count)]
        setattr(message, name, bytes(values) if base in ("uint8", "char") else values)
    return message


@st.composite
def messages(draw: st.DrawFn) -> Any:
    """Return a message of a random type, with random values."""
    text = draw(full_texts())
    top = class_from_text("p/M0", text)
    parts = text.split(f"\n{SEPARATOR}\n")

    def make(base: str) -> Any:
        # Create an inner type's class from its own part of the text, followed by all other parts.
        own = next(part for part in parts if part.startswith(f"MSG: {base}\n"))
        rest = [part for part in parts if part.startswith("MSG:")]
        return class_from_text(base, f"\n{SEPARATOR}\n".join([own.partition("\n")[2], *rest]))()

    return fill(draw, top(), make)


# --- the oracle


def wire(message: Any) -> bytes:
    """Return the bytes of a message, field by field as http://wiki.ros.org/msg specifies."""
    return b"".join(
        wire_field(getattr(message, name), type_)
        for name, type_ in zip(message.__slots__, message._slot_types, strict=True)
    )


def wire_field(value: Any, type_: str) -> bytes:
    base, bracket, length = type_.partition("[")
    if not bracket:
        return wire_single(value, base)
    data = b"".join(wire_single(each, base) for each in value)
    return data if length != "]" else struct.pack("<I", len(value)) + data


def wire_single(value: Any, base: str) -> bytes:
    if base == "string":
        data = value.encode()
        return struct.pack("<I", len(data)) + data
    if base == "bool":
        return b"\x01" if value else b"\x00"
    if base in ("time", "duration"):
        return struct.pack("<II" if base == "time" else "<ii", value.secs, value.nsecs)
    if base in NUMBERS:
        return struct.pack("<" + NUMBERS[base], value)
    return wire(value)


def serialized(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def same(a: Any, b: Any) -> bool:
    """Return whether two values are equal; a tuple equals a list of the same values."""
    if hasattr(a, "_slot_types"):
        return all(same(getattr(a, name), getattr(b, name)) for name in a.__slots__)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b) and type(a) is type(b)


@settings(max_examples=200)
@given(messages())
def test_bytes_are_those_of_the_rules_and_come_back(message: Any) -> None:
    data = serialized(message)
    assert data == wire(message)
    for source in (data, bytearray(data), memoryview(data)):
        again = type(message)().deserialize(source)
        assert same(message, again)
        assert serialized(again) == data


def leaves(message: Any) -> Iterator[tuple[str, Any]]:
    """Yield the type and value of each field, with the fields of nested messages in their place."""
    for name, type_ in zip(message.__slots__, message._slot_types, strict=True):
        value = getattr(message, name)
        if hasattr(value, "_slot_types"):
            yield from leaves(value)
        else:
            yield type_, value


def last_array(message: Any) -> tuple[bytes, int] | None:
    """Return a message's last byte array and the number of bytes after it.

    Return None if a string or another array, except bytes of a fixed number, comes later.
    """
    after = 0
    for type_, value in reversed(list(leaves(message))):
        base, bracket, length = type_.partition("[")
        if type_ in ("uint8[]", "char[]"):
            return value, after
        if type_ == "string" or (bracket and (base not in ("uint8", "char") or length == "0]")):
            return None
        after += len(wire_field(value, type_))
    return None


@settings(max_examples=300)
@given(messages())
def test_a_class_declares_where_its_messages_may_be_split_and_reads_split_ones(message: Any) -> None:
    data = serialized(message)
    ending = last_array(message)
    assert getattr(type(message), "_bytes_after_array", None) == (ending and ending[1])
    if ending:
        array, after = ending
        end = len(data) - after
        frame = SplitFrame(data[: end - len(array)], array, data[end:])
        assert same(message, type(message)().deserialize(frame))


@settings(max_examples=100)
@given(messages(), st.data())
def test_bytes_that_end_too_early_are_refused(message: Any, data: st.DataObject) -> None:
    whole = serialized(message)
    if not whole:
        return
    cut = data.draw(st.integers(0, len(whole) - 1))
    with pytest.raises(DeserializationError):
        type(message)().deserialize(whole[:cut])


@settings(max_examples=200)
@given(full_texts(), st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(text: str, data: bytes) -> None:
    data_class = class_from_text("p/M0", text)
    try:
        message = data_class().deserialize(data)
    except DeserializationError:
        return
    # The message is not larger than the input.
    assert len(wire(message)) <= len(data) + data.count(0xEF) * 3 + 3 * len(data)


@pytest.mark.parametrize("text", ["int8[] a\nint8 b\n", "string a\nint8 b\n", "string[] a\nint8 b\n"])
@pytest.mark.parametrize("length", [2**31 - 1, 2**31, 2**32 - 1])
def test_lengths_that_32_bits_do_not_hold_are_refused(text: str, length: int) -> None:
    data = length.to_bytes(4, "little")
    with pytest.raises(DeserializationError):
        class_from_text("p/M1", text)().deserialize(data * 2 if "[] a" in text else data)


@pytest.mark.parametrize(
    "element",
    [
        pytest.param("p/M2[3] b\n", id="messages"),
        pytest.param("time[3] b\n", id="times"),
        pytest.param("p/M2[2] b\nduration[1] c\n", id="both"),
    ],
)
def test_elements_that_only_slices_read_are_not_made_without_bytes(element: str) -> None:
    """A slice beyond the end is empty, so four bytes could request millions of elements, which used to fill the memory."""
    text = f"\n{SEPARATOR}\n".join(["p/M1[] a\n", f"MSG: p/M1\n{element}", "MSG: p/M2\nint8 d\n"])
    length = 5_000_000
    tracemalloc.start()
    try:
        with pytest.raises(DeserializationError):
            class_from_text("p/M0", text)().deserialize(length.to_bytes(4, "little"))
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


@given(full_texts())
def test_the_default_message_is_all_zeros(text: str) -> None:
    assert not any(serialized(class_from_text("p/M0", text)()))
    assert "p/M0" in specs_of_text("p/M0", text)


# --- golden bytes


def golden(text: str, **values: Any) -> str:
    return serialized(class_from_text("p/M", text)(**values)).hex(" ")


def test_golden_bytes() -> None:
    assert golden("bool data", data=True) == "01"
    assert golden("string s\nuint16 n", s="hé", n=258) == "03 00 00 00 68 c3 a9 02 01"
    assert (
        golden("time t\nduration d", t=Time(1, 2), d=Duration(-1, 0))
        == "01 00 00 00 02 00 00 00 ff ff ff ff 00 00 00 00"
    )
    assert golden("int8[] a\nint8[2] b", a=[-1], b=[1, 2]) == "01 00 00 00 ff 01 02"
    assert (
        golden("float32 x\nfloat64[] y", x=-0.0, y=[math.inf])
        == "00 00 00 80 01 00 00 00 00 00 00 00 00 00 f0 7f"
    )
    assert golden("string[] s", s=["a", ""]) == "02 00 00 00 01 00 00 00 61 00 00 00 00"


def test_arrays_of_numbers_are_read_when_they_are_used() -> None:
    data_class = class_from_text("p/M", "float32[] a\nint16[] b\nuint8[] c")
    message = data_class().deserialize(serialized(data_class(a=[1, 2], b=[3], c=b"4")))
    assert set(message._raw) == {"a", "b"}
    assert (message.a, message.b, message.c) == ((1.0, 2.0), (3,), b"4")
    with pytest.raises(AttributeError, match="'_p__M' object has no attribute 'd'"):
        _ = message.d


def test_a_message_that_is_read_into_twice_has_the_second_values() -> None:
    data_class = class_from_text("p/M", "float32[] a\nstring[] s")
    message = data_class()
    for values in ((1.0, 2.0), (3.0,)):
        message.deserialize(serialized(data_class(a=values, s=["x"])))
        assert (message.a, message.s) == (values, ["x"])


def test_bytes_that_are_no_utf_8_are_replaced() -> None:
    assert class_from_text("p/M", "string s")().deserialize(b"\x02\0\0\0a\xff").s == "a\ufffd"


def test_a_buffer_is_not_held() -> None:
    """A message must not keep a view of the buffer from which it was read: the buffer is reused for the next one."""
    data_class = class_from_text("p/M", "uint8[] c\nint32[] a")
    buffer = bytearray(serialized(data_class(c=b"12", a=[5])))
    message = data_class().deserialize(memoryview(buffer))
    buffer[:] = bytes(len(buffer))
    assert (message.c, message.a) == (b"12", (5,))


def test_lists_and_tuples_of_equal_items_are_equal() -> None:
    """genpy reads arrays of numbers as tuples, and compares them with lists that a program assigned."""
    message_class = class_from_text("p/Numbers", "float64[] position\nstring[] names\n")
    written = message_class(position=[1.0, 2.0], names=["a"])
    buffer = BytesIO()
    written.serialize(buffer)
    read = message_class().deserialize(buffer.getvalue())

    assert written == read
    assert read == written
    assert message_class(position=(1.0,)) == message_class(position=[1.0])
    assert message_class(position=(1.0,)) != message_class(position=[2.0])
    assert message_class(names="a") != message_class(names=["a"])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("float32 x", 1e39),
        ("float32[] x", [1.0, 1e39]),
        ("float32[] x", (-1e39,)),
        ("float32[2] x", [1.0, 1e39]),
        ("int32 count\nfloat32 x", 3.5e38),
    ],
)
def test_number_beyond_32_bits_is_an_error_as_in_genpy(text: str, value: object) -> None:
    message = class_from_text("test_msgs/Large", text)()
    message.x = value
    with pytest.raises(OverflowError, match=r"^float too large to pack with f format$") as error:
        message.serialize(BytesIO())

    assert type(error.value) is OverflowError
    message.x = math.inf if isinstance(value, float) else [math.inf] * len(value)  # type: ignore[arg-type]
    message.serialize(BytesIO())
