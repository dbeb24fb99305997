"""core/wire/http: complete messages from bytes in pieces of any size, and refused messages."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import RpcProtocolError
from minirospy.core.wire.http import (
    MAX_BODY,
    HttpHead,
    HttpMessage,
    HttpReader,
    serialize_error,
    serialize_request,
    serialize_response,
    short_head,
)
from tests.core.wire.memory import Allocations


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
    """Python's clients send them this way. Some pieces are split further or joined with the next one."""
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


def test_pipelined_messages_are_parsed_one_at_a_time() -> None:
    reader = HttpReader()
    good, bad = serialize_request("h", "/", b"a") * 2, b"nonsense\r\n\r\n"
    first = reader.feed_one(good + bad)
    assert first
    assert first.body == b"a"
    assert not reader.is_idle
    assert reader.held == len(good) // 2 + len(bad)
    second = reader.next_message()
    assert second
    assert second.body == b"a"
    # The error is raised only when the invalid message's turn comes.
    with pytest.raises(RpcProtocolError):
        reader.next_message()


def test_next_message_needs_bytes() -> None:
    reader = HttpReader()
    assert reader.next_message() is None
    assert reader.feed_one(b"POST / HTTP/1.1\r\nContent-Length: 3\r\n\r\na") is None
    assert reader.next_message() is None
    message = reader.feed_one(b"bc")
    assert message
    assert message.body == b"abc"
    assert reader.next_message() is None
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


def test_peer_that_expects_continue_receives_it() -> None:
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


# --- what goes out, byte for byte


def test_request_bytes() -> None:
    assert serialize_request("robot:11311", "/RPC2", b"<x/>") == (
        b"POST /RPC2 HTTP/1.1\r\nHost: robot:11311\r\nUser-Agent: minirospy\r\nContent-Type: text/xml\r\n"
        b"Content-Length: 4\r\n\r\n<x/>"
    )
    assert serialize_request("robot", "", b"").startswith(b"POST / HTTP/1.1\r\n")
    # No header can contain this host name. The host is not found, but there must be no traceback.
    assert b"Host: r?bot\r\n" in serialize_request("r\u0151bot", "/", b"")


def test_response_bytes() -> None:
    assert serialize_response(b"<x/>") == (
        b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nContent-Length: 4\r\n\r\n<x/>"
    )
    assert serialize_response(b"", keep_alive=False) == (
        b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
    )


@pytest.mark.parametrize(
    ("status", "reason"),
    [
        (400, b"Bad Request"),
        (405, b"Method Not Allowed"),
        (413, b"Content Too Large"),
        (500, b"Internal Server Error"),
        (503, b"Service Unavailable"),
    ],
)
def test_error_bytes(status: int, reason: bytes) -> None:
    assert serialize_error(status, "wh\u00e4t") == (
        b"HTTP/1.1 %d %s\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n"
        b"Content-Length: 6\r\n\r\nwh\xc3\xa4t\n" % (status, reason)
    )


# --- what comes in


def head_of(data: bytes) -> HttpHead:
    (message,) = feed(data, 1 << 20)
    return message.head


def test_head_fields() -> None:
    head = head_of(b"POST /x HTTP/1.1\r\nA-B:  c: d \r\nContent-Length: 0\r\n\r\n")
    assert head.start == "POST /x HTTP/1.1"
    assert head.headers == {"a-b": "c: d", "content-length": "0"}
    assert (head.method, head.keep_alive, head.plain_length) == ("POST", True, 0)
    (message,) = feed(b"GET / HTTP/1.1\r\nContent-Length: 2\r\n\r\nab", 1 << 20)
    assert (message.start, message.method, message.keep_alive, message.status) == (
        "GET / HTTP/1.1",
        "GET",
        True,
        0,
    )


@pytest.mark.parametrize(
    ("start", "status"),
    [
        ("HTTP/1.1 200 OK", 200),
        ("HTTP/1.1 404", 404),
        ("HTTP/1.1 2000 OK", 0),
        ("HTTP/1.1 ok 200", 0),
        ("HTTP/1.1", 0),
        ("HTTP/1.0 503 Service 100", 503),
    ],
)
def test_status(start: str, status: int) -> None:
    (message,) = feed(f"{start}\r\nContent-Length: 0\r\n\r\n".encode(), 1 << 20)
    assert message.status == status


@pytest.mark.parametrize(
    ("version", "connection", "keeps"),
    [
        ("1.1", None, True),
        ("1.1", "Close", False),
        ("1.1", "keep-alive", True),
        ("1.0", None, False),
        ("1.0", "Keep-Alive", True),
        ("1.0", "close", False),
    ],
)
def test_connection_is_kept(version: str, connection: str | None, keeps: bool) -> None:
    field = f"Connection: {connection}\r\n" if connection else ""
    assert head_of(f"POST / HTTP/{version}\r\n{field}Content-Length: 0\r\n\r\n".encode()).keep_alive == keeps


@pytest.mark.parametrize("field", ["Transfer-Encoding: chunked", "Transfer-Encoding: x, CHUNKED"])
def test_chunked_body_goes_before_a_length(field: str) -> None:
    data = f"POST / HTTP/1.1\r\n{field}\r\nContent-Length: 3\r\n\r\n2\r\nab\r\n0\r\n\r\n".encode()
    (message,) = feed(data, 1 << 20)
    assert (message.body, message.head.plain_length) == (b"ab", -1)


def test_plain_length_is_not_that_of_a_peer_that_waits() -> None:
    (message,) = feed(b"POST / HTTP/1.1\r\nExpect: x\r\nContent-Length: 2\r\n\r\nab", 1 << 20)
    assert (message.body, message.head.plain_length) == (b"ab", -1)


def test_request_without_a_length_has_no_body() -> None:
    found = feed(b"GET / HTTP/1.1\r\n\r\nGET /2 HTTP/1.1\r\n\r\n", 1 << 20)
    assert [(message.start, message.body, message.head.plain_length) for message in found] == [
        ("GET / HTTP/1.1", b"", -1),
        ("GET /2 HTTP/1.1", b"", -1),
    ]


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"POST / HTTP/2.0\r\n\r\n", "not HTTP: 'POST / HTTP/2.0'"),
        (b"POST /HTTP/1.1\r\n\r\n", "not HTTP"),
        (b"POST / x HTTP/1.1\r\n\r\n", "not HTTP"),
        (b"\r\n\r\n", "not HTTP"),
        (b"POST / HTTP/1.1\r\n: x\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\nX : y\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\nX\t: y\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\n X: y\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\n\tX: y\r\n\r\n", "not an HTTP header"),
        (b"POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n", "two Content-Lengths"),
        (b"POST / HTTP/1.1\r\nContent-Length: 1234567890123456789\r\n\r\n", "bad Content-Length"),
        (b"POST / HTTP/1.1\r\nContent-Length: +1\r\n\r\n", "bad Content-Length"),
        (
            b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n1\r\nab\r\n",
            "a chunk is longer than its size",
        ),
        (b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n1234567890123\r\n", "bad chunk size"),
    ],
)
@pytest.mark.parametrize("step", [3, 1 << 20])
def test_request_that_could_be_read_in_two_ways_is_refused(data: bytes, why: str, step: int) -> None:
    with pytest.raises(RpcProtocolError, match=why):
        feed(data, step)


def test_same_length_twice_is_read() -> None:
    found = feed(b"POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 1\r\n\r\na", 1 << 20)
    assert [message.body for message in found] == [b"a"]


def test_body_at_the_limit_is_read_and_one_beyond_it_refused() -> None:
    assert MAX_BODY == 64 * 2**20
    for head, body in [
        (b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n", b"x" * 1000),
        (b"HTTP/1.1 200 OK\r\n\r\n", b"x" * 1000),
    ]:
        whole = head % len(body) if b"%d" in head else head
        reader = HttpReader(max_body=1000)
        found = feed(whole + body, 100, reader) or reader.feed(b"")
        assert [message.body for message in found] == [body]
        too_long = head % 1001 if b"%d" in head else head
        with pytest.raises(
            RpcProtocolError, match="an HTTP body of 1001 bytes is over the limit of 1000"
        ) as refused:
            feed(too_long + body + b"x", 100, HttpReader(max_body=1000)) or HttpReader(max_body=1000).feed(
                b""
            )
        assert refused.value.status == 413


def test_chunks_at_the_limit_are_read_and_one_beyond_it_refused() -> None:
    head, chunk = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", b"1f4\r\n" + b"x" * 500 + b"\r\n"
    (message,) = feed(head + 2 * chunk + b"0\r\n\r\n", 1 << 20, HttpReader(max_body=1000))
    assert message.body == b"x" * 1000
    with pytest.raises(RpcProtocolError, match="an HTTP body of 1001 bytes is over the limit"):
        feed(head + 2 * chunk + b"1\r\nx", 1 << 20, HttpReader(max_body=1000))


@pytest.mark.parametrize("size", [600, 60_000])
def test_long_head_is_read(size: int) -> None:
    """Heads of up to 512 bytes are cached, and heads of up to 64 KiB are read."""
    for step in (1000, 1 << 20):
        (message,) = feed(b"POST / HTTP/1.1\r\nContent-Length: 1\r\nX: " + b"y" * size + b"\r\n\r\na", step)
        assert (len(message.head.headers["x"]), message.body) == (size, b"a")


def test_head_of_more_than_64_kib_is_refused() -> None:
    reader = HttpReader()
    assert feed(b"x" * 65536, 1000, reader) == []
    with pytest.raises(RpcProtocolError, match="HTTP header too long"):
        reader.feed(b"x")


def test_reader_counts_what_it_holds() -> None:
    reader = HttpReader()
    assert (reader.is_idle, reader.held) == (True, 0)
    reader.feed(b"POST / HTTP/1.1\r\n")

    assert (reader.is_idle, reader.held) == (False, 17)
    reader.feed(b"Content-Length: 10\r\n\r\n")
    reader.feed(b"abc")

    assert (reader.is_idle, reader.held) == (False, 3)
    assert len(reader.feed(b"defghij")) == 1
    assert (reader.is_idle, reader.held) == (True, 0)

    # A connection that has sent only a head is not idle.
    reader.feed(b"POST / HTTP/1.1\r\nContent-Length: 10\r\n\r\n")
    assert not reader.is_idle
    chunked = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    reader = HttpReader()
    reader.feed(chunked + b"3\r\nabc\r\n2\r\nd")

    assert (reader.is_idle, reader.held) == (False, 4)
    reader.feed(b"e\r\n0\r\n")
    assert reader.held == 5
    assert len(reader.feed(b"\r\n")) == 1
    assert (reader.is_idle, reader.held) == (True, 0)


def test_close_forgets_an_incomplete_message() -> None:
    reader = HttpReader()
    reader.feed(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n2\r\nd")
    reader.close()
    assert (reader.is_idle, reader.held) == (True, 0)
    reader.feed(b"POST / HTTP/1.1\r\nContent-Length: 9\r\n\r\nabc")
    reader.close()
    assert (reader.is_idle, reader.held) == (True, 0)
    assert [message.body for message in feed(serialize_request("h", "/", b"next"), 5, reader)] == [b"next"]


@pytest.mark.parametrize("step", [5, 1 << 20])
def test_peer_waits_until_its_body_has_come(step: int) -> None:
    reader = HttpReader()
    assert not reader.wants_continue
    feed(b"POST / HTTP/1.1\r\nExpect: 100-Continue\r\nContent-Length: 2\r\n\r\n", step, reader)
    assert reader.wants_continue
    assert len(reader.feed(b"ab")) == 1
    assert not reader.wants_continue
    feed(b"POST / HTTP/1.1\r\nExpect: 100-continue\r\nContent-Length: 2\r\n\r\n", step, reader)
    reader.continue_line()
    assert not reader.wants_continue
    feed(b"POST / HTTP/1.1\r\nExpect: something\r\nContent-Length: 2\r\n\r\n", step, HttpReader())


@pytest.mark.parametrize(
    "data",
    [
        b"POST / HT",
        b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nab",
    ],
)
def test_peer_that_ends_too_early(data: bytes) -> None:
    reader = HttpReader()
    reader.feed(data)
    with pytest.raises(RpcProtocolError, match="the peer ended inside a message"):
        reader.feed(b"")


def test_peer_that_ends_between_two_messages() -> None:
    reader = HttpReader()
    assert len(reader.feed(serialize_request("h", "/", b"x"))) == 1
    assert reader.feed(b"") == []


def test_answer_that_goes_on_until_the_end_comes_in_parts() -> None:
    reader = HttpReader()
    for data in (b"HTTP/1.1 200 OK\r\n\r\n", b"ab", b"cd"):
        assert reader.feed(data) == []
    (message,) = reader.feed(b"")
    assert message.body == b"abcd"


@pytest.mark.parametrize(
    ("head", "tail"),
    [
        (b"Content-Length: 4000000\r\n\r\n", b""),
        (b"Content-Length: 4000000\r\n\r\n", b"POST"),
        (b"Transfer-Encoding: chunked\r\n\r\n3d0900\r\n", b"\r\n0\r\n\r\nPOST"),
    ],
)
def test_long_body_is_not_copied_when_it_is_whole(head: bytes, tail: bytes) -> None:
    # Copying the longest one would take some 50 ms.
    reader = HttpReader()
    body = b"x" * 4_000_000
    request, end = b"POST / HTTP/1.1\r\n" + head + body[:-1], body[-1:] + tail
    with Allocations() as memory:
        assert not feed(request, 4096, reader)
        memory.mark()
        (message,) = reader.feed(end)
        assert memory.peak() < 1_000_000
    assert message.body == body


def test_reader_knows_a_body_in_chunks() -> None:
    reader = HttpReader()
    reader.feed(b"POST / HTTP/1.1\r\nContent-Length: 10\r\n\r\nabc")
    assert not reader.in_chunks
    reader = HttpReader()
    reader.feed(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n3\r")
    assert reader.in_chunks
    reader.feed(b"\nabc\r\n0\r\n\r\n")
    assert not reader.in_chunks


@pytest.mark.parametrize("step", [7, 1 << 20])
def test_length_over_the_limit_is_refused_before_the_body_comes(step: int) -> None:
    reader = HttpReader(100)
    with pytest.raises(RpcProtocolError, match="101 bytes is over the limit of 100") as caught:
        feed(b"POST / HTTP/1.1\r\nContent-Length: 101\r\n\r\n", step, reader)
    assert caught.value.status == 413


def test_line_feed_alone_in_front_of_a_carriage_return() -> None:
    # The last byte differs from the last byte of the first one.
    reader = HttpReader()
    reader.feed(b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n")
    assert len(reader.feed(b"\n\r")) == 1


def test_only_short_heads_are_kept() -> None:
    # Caching long heads would fill the memory.
    for size, keeps in ((300, True), (30_000, False)):
        before = short_head.cache_info().misses
        head_of(b"POST / HTTP/1.1\r\nContent-Length: 0\r\nX: %s\r\n\r\n" % (b"x" * size))
        assert (short_head.cache_info().misses > before) is keeps


def test_limit_of_a_body_is_as_documented() -> None:
    assert MAX_BODY == 64 * 1024 * 1024
