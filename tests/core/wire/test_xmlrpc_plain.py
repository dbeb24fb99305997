"""core/wire/xmlrpc_plain reads the same values as the parser, or leaves the message to the parser."""

from __future__ import annotations

import time
import xmlrpc.client
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import RpcProtocolError
from minirospy.core.wire.xmlrpc import serialize_call, serialize_response
from minirospy.core.wire.xmlrpc_plain import read_plain
from minirospy.core.wire.xmlrpc_reader import read_document

TEXT = st.text(st.characters(min_codepoint=32, max_codepoint=126) | st.sampled_from("\t\n/ab"), max_size=8)
VALUES = st.recursive(
    st.integers(-(2**31), 2**31 - 1)
    | st.booleans()
    | TEXT
    | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=8,
)
PIECES = [
    b"<value>", b"</value>", b"<string>", b"</string>", b"<int>", b"</int>", b"<i4>", b"</i4>", b"<double>",
    b"</double>", b"<boolean>", b"</boolean>", b"<array>", b"</array>", b"<data>", b"</data>", b"<struct>",
    b"</struct>", b"<member>", b"</member>", b"<name>", b"</name>", b"<param>", b"</param>", b"</params>",
    b"</methodCall>", b"<value><string>a</string></value>", b"<value>b</value>", b"<value><int>1</int></value>",
    b"<value><array><data>", b"</data></array></value>", b"<value><struct>", b"</struct></value>",
    b"<member><name>x</name>", b"\r\n", b" ", b"1", b"-2.5e3", b"x", b"]]>", b"&amp;", b"\xc3\xa4", b"\x01", b"<", b">",
]  # fmt: skip


def check(body: bytes) -> bool:
    """Return whether ``body`` was read; assert that the parser reads the same values."""
    found = read_plain(body)
    if found is None:
        return False
    reader = read_document(body)
    assert (reader.root, reader.method) == (
        "methodCall" if found[0] is not None else "methodResponse",
        found[0],
    )
    assert repr(reader.params) == repr(found[1])
    assert not reader.is_fault
    return True


@given(
    st.lists(VALUES, max_size=3),
    st.lists(st.tuples(st.integers(0, 10**6), st.sampled_from(PIECES)), max_size=2),
)
def test_whatever_is_put_into_a_document(args: list[Any], insertions: list[tuple[int, bytes]]) -> None:
    for body in (serialize_call("x", args), xmlrpc.client.dumps(tuple(args), "x").encode()):
        changed = body
        for number, piece in insertions:
            at = number % len(changed)
            changed = changed[:at] + piece + changed[at:]
        check(changed)


def test_a_tag_inside_a_tag() -> None:
    body = serialize_call("x", [0])
    assert check(body)
    assert not check(body.replace(b"</param>", b"</pa<value>ram>"))
    assert not check(body.replace(b"</param>", b"</param"))


@given(VALUES, st.integers(0, 10**6), st.integers(1, 60))
def test_whatever_is_cut_out_of_a_document(value: Any, at: int, count: int) -> None:
    body = serialize_response(value)
    at %= len(body)
    check(body[:at] + body[at + count :])


@given(st.lists(st.sampled_from(PIECES), max_size=8).map(b"".join))
def test_any_pieces(pieces: bytes) -> None:
    check(b"<methodCall><methodName>x</methodName><params>" + pieces + b"</params></methodCall>")


def test_messages_of_ros_are_plain() -> None:
    """Includes calls and responses from rosmaster, rospy, roscpp and minirospy."""
    for args in (
        ("/node", "/topic", "std_msgs/String", "http://here:1/"),
        ("/node", "key", -5),
        ("/node", "key", {"a": {"b": [1, 2.5, True, "x"], "c": {}}, "d": []}),
        (1, "", [["/rosout", ["/a", "/b"]], []]),
    ):
        for body in (serialize_call("setParam", args), xmlrpc.client.dumps(args, "setParam").encode()):
            assert check(body), body
        for body in (serialize_response(args), xmlrpc.client.dumps((args,), methodresponse=True).encode()):
            assert check(body), body
    assert check(
        b'<?xml version="1.0"?>\r\n<methodCall><methodName>a</methodName>\r\n<params><param><value>/x</value>'
        b"</param><param><value><i4>3</i4></value></param><param><value><array><data><value>TCPROS</value></data>"
        b"</array></value></param></params></methodCall>\r\n"
    )


@pytest.mark.parametrize(
    "value",
    ["<", "&", "ä", "\r", 1e400, b"x"],
)
def test_other_messages_are_left_to_the_parser(value: Any) -> None:
    assert read_plain(serialize_response([value])) is None


def test_deep_or_long_values_are_left_to_the_parser() -> None:
    value: Any = "x"
    for _ in range(61):
        value = [value]
    assert read_plain(serialize_response(value)) is None
    assert check(serialize_response(value[0][0]))
    nested = b"<param>" * 300 + b"</param>" * 300
    assert not check(b"<methodResponse><params>" + nested + b"</params></methodResponse>")
    with pytest.raises(RpcProtocolError, match="elements"):
        read_document(serialize_response([""] * 500_001))
    assert read_plain(serialize_response([""] * 500_001)) is None


def test_a_long_document_takes_a_time_that_grows_with_its_length() -> None:
    for piece in (
        b"<value>",
        b"<param>",
        b"<member><name>",
        b" ",
        b"<value><string>x",
        b"</data>",
        b"x" * 100,
    ):
        body = b"<methodResponse><params>" + piece * 20_000 + b"</params></methodResponse>"
        start_time = time.thread_time()
        assert read_plain(body) is None or piece == b" "
        assert time.thread_time() - start_time < 1.0
