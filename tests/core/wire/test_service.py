"""core/wire/service: the bytes of requests and responses, as real rospy sends them (http://wiki.ros.org/ROS/TCPROS)."""

from __future__ import annotations

import pytest

from minirospy.base.errors import ServiceException, WireError
from minirospy.core.wire.framing import MAX_FRAME
from minirospy.core.wire.service import (
    REQUEST_HEAD,
    RESPONSE_HEAD,
    parse_request_head,
    parse_response_head,
    serialize_failure,
    serialize_request,
    serialize_response,
)

OVER = (MAX_FRAME + 1).to_bytes(4, "little")


def test_request_is_a_length_and_a_body() -> None:
    data = serialize_request(b"\1")
    assert data == b"\1\0\0\0\1"
    assert parse_request_head(data[:REQUEST_HEAD]) == 1


def test_response_has_a_byte_for_success_in_front() -> None:
    data = serialize_response(b"abc")
    assert data == b"\1\3\0\0\0abc"
    assert parse_response_head(data[:RESPONSE_HEAD]) == (True, 3)


def test_empty_bodies_have_a_length_too() -> None:
    assert serialize_request(b"") == b"\0\0\0\0"
    assert serialize_response(b"") == b"\1\0\0\0\0"


def test_failure_carries_the_text_of_the_error_in_utf8() -> None:
    data = serialize_failure(ServiceException("k\u00f6nnte"))
    assert data == b"\0\7\0\0\0k\xc3\xb6nnte"
    assert parse_response_head(data[:RESPONSE_HEAD]) == (False, 7)


def test_lengths_over_the_limit_are_refused() -> None:
    assert parse_request_head(MAX_FRAME.to_bytes(4, "little")) == MAX_FRAME
    assert parse_response_head(b"\0" + MAX_FRAME.to_bytes(4, "little")) == (False, MAX_FRAME)
    for parse in (lambda: parse_request_head(OVER), lambda: parse_response_head(b"\1" + OVER)):
        with pytest.raises(
            WireError, match=f"a body of {MAX_FRAME + 1} bytes is over the limit of {MAX_FRAME}"
        ):
            parse()
