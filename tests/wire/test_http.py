"""wire/http: whole messages out of bytes in any pieces; and what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.errors import RpcProtocolError
from minirospy.wire.http import HttpMessage, HttpReader, serialize_request, serialize_response


def feed(data: bytes, step: int, reader: HttpReader | None = None) -> list[HttpMessage]:
    reader = reader or HttpReader()
    found: list[HttpMessage] = []
    for at in range(0, len(data), step):
        found += reader.feed(data[at : at + step])
    return found


@given(st.lists(st.binary(max_size=300), max_size=4), st.integers(1, 400))
def test_requests_come_out_whole_in_any_pieces(bodies: list[bytes], step: int) -> None:
    data = b"".join(serialize_request("localhost:11311", "/RPC2", body) for body in bodies)
    messages = feed(data, step)
    assert [message.body for message in messages] == bodies
    assert all(message.method == "POST" and message.keep_alive for message in messages)


@given(st.lists(st.binary(max_size=30), min_size=1, max_size=3), st.data())
def test_heads_and_bodies_may_come_one_by_one(bodies: list[bytes], data: st.DataObject) -> None:
    """As Python's clients send them; some pieces are split once more, or come with the next."""
    pieces = []
    for body in bodies:
        request = serialize_request("localhost:11311", "/RPC2", body)
        at = data.draw(st.sampled_from([0, 5, len(request) - len(body), len(request) - len(body) // 2]))
        pieces += [request[:at], request[at:]] if data.draw(st.booleans()) else [request]
    if len(pieces) > 1 and data.draw(st.booleans()):
        at = data.draw(st.integers(1, len(pieces) - 1))
        pieces[at - 1 : at + 1] = [pieces[at - 1] + pieces[at]]
    reader = HttpReader()
    found = [message.body for piece in pieces if piece for message in reader.feed(piece)]
    assert found == bodies
    assert reader.is_idle


@pytest.mark.parametrize("step", [1, 7, 1000])
def test_chunked_bodies(step: int) -> None:
    data = (
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"
        b"4\r\nWiki\r\n6;x=y\r\npedia \r\n0\r\nTrailer: z\r\n\r\n"
    )
    assert [message.body for message in feed(data * 2, step)] == [b"Wikipedia "] * 2


@pytest.mark.parametrize("step", [1, 7, 1000])
def test_a_line_feed_alone_ends_a_line_of_a_request_written_by_hand(step: int) -> None:
    plain = b"POST / HTTP/1.1\nContent-Length: 4\n\na\r\nb"
    chunked = b"POST / HTTP/1.1\nTransfer-Encoding: chunked\n\n4\na\r\nb\n0\n\n"
    assert [message.body for message in feed(plain + chunked + plain, step)] == [b"a\r\nb"] * 3


def test_an_answer_without_a_length_ends_with_the_connection() -> None:
    reader = HttpReader()
    assert feed(b"HTTP/1.0 200 OK\r\n\r\nabc", 5, reader) == []
    (message,) = reader.feed(b"")
    assert (message.status, message.body, message.keep_alive) == (200, b"abc", False)


def test_who_keeps_the_connection() -> None:
    assert feed(serialize_response(b"x"), 99)[0].keep_alive
    assert not feed(serialize_response(b"x", keep_alive=False), 99)[0].keep_alive


def test_a_peer_that_waits_before_its_body_is_told_to_go_on() -> None:
    reader = HttpReader()
    head = b"POST / HTTP/1.1\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n"
    assert reader.feed(head) == []
    assert reader.wants_continue
    assert reader.continue_line() == b"HTTP/1.1 100 Continue\r\n\r\n"
    assert [message.body for message in reader.feed(b"ab")] == [b"ab"]


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"garbage\r\n\r\n", "not HTTP"),
        (b"POST / HTTP/1.1\r\nno colon\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", "bad Content-Length"),
        (b"POST / HTTP/1.1\r\nContent-Length: 2000\r\n\r\n", "over the limit"),
        (b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nxyz\r\n", "bad chunk size"),
        (b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\nfffff\r\n", "over the limit"),
        (b"POST / HTTP/1.1\r\nX: " + b"y" * 70_000, "header too long"),
    ],
)
def test_bad_requests_are_refused(data: bytes, why: str) -> None:
    with pytest.raises(RpcProtocolError, match=why):
        feed(data, 1 << 20, HttpReader(max_body=1000))


def test_a_peer_that_ends_inside_a_message() -> None:
    reader = HttpReader()
    reader.feed(b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nab")
    assert not reader.is_idle
    with pytest.raises(RpcProtocolError, match="ended inside"):
        reader.feed(b"")
