"""wire/xmlrpc against the standard library's, both ways; and what is refused."""

from __future__ import annotations

import xmlrpc.client
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.errors import RpcFault, RpcProtocolError
from minirospy.wire.xmlrpc import (
    Call,
    parse_call,
    parse_response,
    serialize_call,
    serialize_fault,
    serialize_response,
)

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
