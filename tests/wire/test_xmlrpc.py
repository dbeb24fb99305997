"""wire/xmlrpc against the standard library's, both ways; and what is refused."""

from __future__ import annotations

import sys
import xmlrpc.client
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.steps import finish
from minirospy.wire import xmlrpc_reader
from minirospy.wire.http import MAX_BODY
from minirospy.wire.xmlrpc import (
    Call,
    DateTime,
    parse_call,
    parse_call_in_steps,
    parse_response,
    serialize_call,
    serialize_call_in_steps,
    serialize_fault,
    serialize_response,
    serialize_response_in_steps,
)
from minirospy.wire.xmlrpc_reader import Reader
from tests.wire.memory import Allocations

# What XML 1.0 can hold: no control characters but tab and line feed, no surrogates.
TEXT = st.text(
    st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff")
    | st.sampled_from("\t\n]>&<")
)
SCALARS = (
    st.integers(-(2**31), 2**31 - 1) | st.booleans() | TEXT | st.floats(allow_nan=False, allow_infinity=False)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXT, inner, max_size=4),
    max_leaves=12,
)


@given(VALUES)
def test_we_read_what_the_standard_library_writes(value: Any) -> None:
    body = xmlrpc.client.dumps((value,), methodresponse=True).encode()
    assert parse_response(body) == value


@given(VALUES)
def test_the_standard_library_reads_what_we_write(value: Any) -> None:
    assert xmlrpc.client.loads(serialize_response(value)) == ((value,), None)


@given(st.lists(VALUES, max_size=4))
def test_calls(args: list[Any]) -> None:
    assert parse_call(serialize_call("system.multicall", args)) == Call("system.multicall", args)


def test_bytes_travel_as_base64() -> None:
    assert parse_response(serialize_response(b"\x00\xff")) == b"\x00\xff"
    (read,), _ = xmlrpc.client.loads(serialize_response(b"\x00\xff"))
    assert isinstance(read, xmlrpc.client.Binary)
    assert read.data == b"\x00\xff"


def test_a_value_without_a_type_is_a_string() -> None:
    body = b"<methodResponse><params><param><value> a &lt; b </value></param></params></methodResponse>"
    assert parse_response(body) == " a < b "


def test_a_fault_is_raised() -> None:
    with pytest.raises(RpcFault, match="no <such> thing") as raised:
        parse_response(serialize_fault(7, "no <such> thing"))
    assert raised.value.code == 7


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1, None, object(), {1: 2}])
def test_values_without_an_xmlrpc_type_are_refused(value: object) -> None:
    with pytest.raises(RpcProtocolError):
        serialize_response(value)


def wrapped(value: bytes) -> bytes:
    return b"<methodResponse><params><param>" + value + b"</param></params></methodResponse>"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"not XML",
        b"<a/>",
        b"<methodResponse/>",
        wrapped(b"<value><int>x</int></value>"),
        wrapped(b"<value><boolean>2</boolean></value>"),
        wrapped(b"<value><nil/></value>"),
        wrapped(b"<value><value>1</value></value>"),
        wrapped(b"<value><struct><member><value>1</value></member></struct></value>"),
        b'<!DOCTYPE a [<!ENTITY b "c">]>' + wrapped(b"<value>&b;</value>"),
        wrapped(b"<value><array><data>" * 100 + b"</data></array></value>" * 100),
        serialize_response(1)[:-20],
    ],
)
def test_what_is_no_answer_is_refused(body: bytes) -> None:
    with pytest.raises(RpcProtocolError):
        parse_response(body)


@given(
    st.binary()
    | st.lists(st.sampled_from([b"<value>", b"</value>", b"<int>", b"</int>", b"1", b"<struct>"])).map(
        b"".join
    )
)
def test_any_bytes_are_read_or_refused(body: bytes) -> None:
    for text in (body, wrapped(body)):
        try:
            parse_response(text)
        except (RpcProtocolError, RpcFault):
            pass


def test_dates_in_any_form() -> None:
    for text in ("20200102T03:04:05", "2020-01-02T03:04:05Z", "some day"):
        body = wrapped(b"<value><dateTime.iso8601>" + text.encode() + b"</dateTime.iso8601></value>")
        assert text.encode() in serialize_response(parse_response(body))


# --- in steps


LARGE = [
    [list(range(20_000)), {"a": 1.5, "b": [True, "x" * 200]}],
    ["<&>\r" * 100_000],
    ["\U0001f600" + "x" * 300_000],
    [{f"k{number}": [number] for number in range(5_000)}],
    [b"\x00\xff" * 200_000],
    [{"<key>" * 30_000: DateTime("some day")}],
]


@pytest.mark.parametrize("args", LARGE)
def test_a_large_call_is_written_and_read_in_steps_as_in_one(args: list[Any]) -> None:
    pieces = finish(serialize_call_in_steps("method", args, MAX_BODY))
    assert b"".join(pieces) == serialize_call("method", args)
    assert len(pieces) > 2
    assert finish(parse_call_in_steps(b"".join(pieces))) == ("method", args)
    pieces = finish(serialize_response_in_steps(args, MAX_BODY))
    assert b"".join(pieces) == serialize_response(args)


@given(st.lists(VALUES, max_size=3))
def test_any_call_is_written_and_read_in_steps_as_in_one(args: list[Any]) -> None:
    body = b"".join(finish(serialize_call_in_steps("m", args, MAX_BODY)))
    assert body == serialize_call("m", args)
    reader = Reader()
    for at in range(0, len(body), 7):
        reader.feed(body[at : at + 7])
    reader.feed(b"", is_last=True)
    reader.close()
    assert repr(reader.params) == repr(parse_call(body).args)


def test_long_base64_is_decoded_as_it_comes() -> None:
    data = bytes(range(256)) * 2_000
    body = xmlrpc.client.dumps((xmlrpc.client.Binary(data), "after"), "m").encode()
    assert finish(parse_call_in_steps(body)).args == [data, "after"]


@pytest.mark.parametrize("kind", ["value", "string", "base64", "name", "methodName"])
def test_long_text_is_not_copied_when_it_is_whole(kind: str) -> None:
    # To join 60 MiB at their end would take 50 ms.
    if sys.gettrace():
        pytest.skip("Python copies more where it is traced")
    text = "QUJD" * 1_000_000
    body = {
        "value": f"<value>{text}</value>",
        "string": f"<value><string>{text}</string></value>",
        "base64": f"<value><base64>{text}</base64></value>",
        "name": f"<value><struct><member><name>{text}</name><value>1</value></member></struct></value>",
        "methodName": f"<methodName>{text}</methodName>",
    }[kind].encode()
    data = b"<methodCall>" + body + b"</methodCall>"
    end = data.index(b"<", 1_000_000)
    reader = Reader()
    with Allocations() as memory:
        for at in range(0, end, 8192):
            reader.feed(data[at : min(at + 8192, end)])
        memory.mark()
        reader.feed(data[end:], is_last=True)
        assert memory.peak() < 1_000_000
    reader.close()
    value: Any = reader.params[0] if reader.params else reader.method
    assert value == {"base64": b"ABC" * 1_000_000, "name": {text: "1"}}.get(kind, text)


def test_memory_of_a_text_is_that_of_its_widest_character() -> None:
    # 20 MiB of ASCII are within the limit; with one character that needs four bytes they are not.
    text = b"<methodCall><value>" + b"x" * 20 * 1024 * 1024
    for wide, is_refused in ((b"", False), ("\u20ac".encode(), False), ("\U0001f600".encode(), True)):
        steps = parse_call_in_steps(text + wide + b"</value><methodName>m</methodName></methodCall>")
        if is_refused:
            with pytest.raises(RpcProtocolError, match="more than 64 MiB in memory"):
                finish(steps)
        else:
            assert len(finish(steps).args[0]) >= 20 * 1024 * 1024


def test_each_step_is_short() -> None:
    body = serialize_call("m", [list(range(20_000))])
    assert sum(1 for _ in parse_call_in_steps(body)) > len(body) // 10_000
    steps = serialize_response_in_steps(list(range(20_000)), MAX_BODY)
    assert sum(1 for _ in steps) > 50


@pytest.mark.parametrize(
    ("body", "why", "status"),
    [
        (b"<methodCall><" + b"x" * 200_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall><a b='" + b"x" * 200_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall><!--" + b"> " * 100_000, "a tag or comment of more than 65536 bytes", 400),
        (b"<methodCall>" + b"<a>" * 20_000, "nested deeper", 400),
        (
            b"<methodCall><value><int>" + b"9" * 100_000 + b"</int></value></methodCall>",
            "int has more than 2048",
            400,
        ),
        (
            b"<methodCall><value><double>" + b"9" * 100_000 + b"</double></value></methodCall>",
            "double has more than 2048",
            400,
        ),
        (
            b"<methodCall><value>" + b"\xf0\x9f\x98\x80" + b"x" * 500_000,
            "more than 1 MiB in memory",
            413,
        ),
    ],
)
def test_what_would_take_too_much_is_refused_before_its_end(
    body: bytes, why: str, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(xmlrpc_reader, "_MAX_MEMORY", 1024 * 1024)
    with pytest.raises(RpcProtocolError, match=why) as caught:
        finish(parse_call_in_steps(body))
    assert caught.value.status == status


def test_an_answer_that_is_too_large_is_refused_while_it_is_written() -> None:
    with pytest.raises(RpcProtocolError, match="more than 100000 bytes"):
        finish(serialize_response_in_steps([list(range(1000))] * 10**6, 100_000))
