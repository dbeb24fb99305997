"""The WebSocket protocol of one client, its liveness and deferred work: bytes, times and calls in, without sockets."""

from __future__ import annotations

import logging

import pytest
from websockets.exceptions import NegotiationError
from websockets.frames import Opcode

from minirospy.web.access import Refusal
from minirospy.web.server.account import LARGE_PIECE, Account
from minirospy.web.server.jobs import Jobs
from minirospy.web.server.liveness import Liveness, Verdict
from minirospy.web.server.pipe import Endpoints
from minirospy.web.server.request import RequestHead, read_head, refusal_response
from minirospy.web.server.websocket import FrameRate, Message, Ping, WebSocket

HANDSHAKE = (
    b"GET /a%20b?token=x&id=1&id=2 HTTP/1.1\r\nHost: localhost\r\nUpgrade: WebSocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
    b"Sec-WebSocket-Protocol: minirospy.token.x, a.v1, b.v1\r\n\r\n"
)


def frame(opcode: int, data: bytes, *, is_final: bool = True) -> bytes:
    """Return a client's frame of up to 125 bytes, masked with zeros."""
    return bytes((opcode | (0x80 if is_final else 0), 0x80 | len(data), 0, 0, 0, 0)) + data


def opened(max_size: int = 1000, max_frames: int = 100) -> WebSocket:
    websocket = WebSocket(lambda offered: offered[-1] if offered else None, max_size, max_frames)
    websocket.feed(HANDSHAKE)
    request = websocket.next_request()
    assert request
    websocket.accept(websocket.response_to(request))
    (response,) = websocket.data_to_send()
    assert response.startswith(b"HTTP/1.1 101 ")
    return websocket


def events(websocket: WebSocket, data: bytes) -> list[Message | Ping]:
    websocket.feed(data)
    found = []
    while (each := websocket.next_frame()) is not None:
        if event := websocket.event_of(each):
            found.append(event)
    return found


def test_handshake_offers_the_sub_protocols_without_the_token() -> None:
    websocket = opened()
    assert websocket.subprotocol == "b.v1"
    assert websocket.is_open
    assert not websocket.is_closed


def test_request_that_arrives_in_parts_is_read_when_it_is_complete() -> None:
    websocket = WebSocket(lambda _: None, 1000, 100)
    for byte in HANDSHAKE[:-1]:
        websocket.feed(bytes((byte,)))
        assert websocket.next_request() is None
    websocket.feed(HANDSHAKE[-1:])
    request = websocket.next_request()
    assert request
    head = read_head(request)
    assert not head.is_page
    parsed = head.parsed("1.2.3.4", Endpoints(5, "6.7.8.9", 10))
    assert (parsed.path, parsed.query, parsed.peer) == ("/a b", {"token": "x", "id": "2"}, "1.2.3.4")
    assert (parsed.peer_port, parsed.address, parsed.port) == (5, "6.7.8.9", 10)


def test_requests_and_frames_are_not_logged(caplog: pytest.LogCaptureFixture) -> None:
    """A request contains a token."""
    caplog.set_level(logging.DEBUG)
    websocket = opened()
    assert events(websocket, frame(1, b"a")) == [Message(True, b"a")]
    assert not websocket._frames.debug
    assert not caplog.records


def test_bytes_that_are_no_request_raise_value_error() -> None:
    websocket = WebSocket(lambda _: None, 1000, 100)
    websocket.feed(b"SSH-2.0\r\n\r\n")
    with pytest.raises(ValueError, match="SSH-2"):
        websocket.next_request()


def test_refused_sub_protocols_answer_400() -> None:
    def refuse(_: object) -> str:
        raise NegotiationError("a.v1 is required")

    websocket = WebSocket(refuse, 1000, 100)
    websocket.feed(HANDSHAKE)
    request = websocket.next_request()
    assert request
    response = websocket.response_to(request)
    assert response.status_code == 400
    assert b"a.v1 is required" in bytes(response.body or b"")


def test_messages_are_joined_from_their_fragments_around_pings() -> None:
    websocket = opened()
    assert events(websocket, frame(1, b"a", is_final=False)) == []
    assert websocket.unfinished == 1
    assert events(websocket, frame(9, b"p") + frame(0, b"b", is_final=False)) == [Ping(b"p")]
    # The connection responds to pings, not the library.
    assert websocket.data_to_send() == ()
    assert events(websocket, frame(0, b"c") + frame(2, b"d") + frame(10, b"")) == [
        Message(True, b"abc"),
        Message(False, b"d"),
    ]
    assert websocket.unfinished == 0


def test_frames_are_counted_in_each_second() -> None:
    websocket = opened(max_frames=3)
    rate = websocket.rate
    rate.update(10.0)
    events(websocket, frame(9, b"") * 2)
    assert not rate.is_used_up
    events(websocket, frame(0x1, b"", is_final=False))
    assert rate.is_used_up
    rate.update(10.75)
    assert rate.is_used_up
    assert rate.seconds_left(10.75) == 0.25
    rate.update(11.0)
    assert not rate.is_used_up


def test_first_second_allows_all_frames() -> None:
    rate = FrameRate(1)
    assert not rate.is_used_up
    assert rate.seconds_left(0.25) == 0.75


def test_ping_is_a_frame_with_its_data() -> None:
    websocket = opened()
    websocket.ping(b"abc")
    assert websocket.data_to_send() == (bytes((0x80 | Opcode.PING, 3)) + b"abc",)


def test_message_over_the_limit_closes_the_websocket() -> None:
    websocket = opened()
    websocket.restrict(2)
    assert events(websocket, frame(1, b"abc")) == []
    assert websocket.is_closed
    assert b"".join(websocket.data_to_send())[2:4] == (1009).to_bytes(2, "big")


def test_close_frame_has_a_reason_of_123_bytes_at_most() -> None:
    websocket = opened()
    websocket.close(1013, "ü" * 100)
    assert not websocket.is_open
    (data,) = websocket.data_to_send()
    assert data == bytes((0x80 | Opcode.CLOSE, 124)) + (1013).to_bytes(2, "big") + ("ü" * 61).encode()
    assert websocket.data_to_send() == ()


def test_unfinished_parts_can_be_discarded() -> None:
    websocket = opened()
    events(websocket, frame(1, b"abc", is_final=False) + frame(0, b"def")[:-1])
    assert websocket.has_unread
    assert websocket.unfinished > 3
    websocket.discard_unfinished()
    assert websocket.unfinished == 0
    assert not websocket.has_unread


@pytest.mark.parametrize(
    ("headers", "origin"),
    [
        ({"origin": "http://a"}, "http://a"),
        ({}, None),
        ({"sec-fetch-site": "cross-site", "sec-fetch-dest": "image"}, "null"),
        ({"sec-fetch-site": "cross-site", "referer": "http://a:1/b"}, "http://a:1"),
        ({"sec-fetch-site": "cross-site", "sec-fetch-dest": "document"}, None),
        ({"sec-fetch-site": "same-origin"}, None),
    ],
)
def test_origin_is_that_of_the_embedding_page(headers: dict[str, str], origin: str | None) -> None:
    assert RequestHead("/", headers).credentials.origin == origin


def test_refusal_is_a_response_with_the_headers_of_its_status() -> None:
    head, body = refusal_response(Refusal(401, "a token is required"))
    assert head.startswith(b"HTTP/1.1 401 Unauthorized\r\n")
    assert b"\r\nWWW-Authenticate: Bearer\r\n" in head
    assert b"\r\nContent-Length: 20\r\n" in head
    assert body == b"a token is required\n"
    assert b"Retry-After" not in head
    assert b"\r\nRetry-After: 5\r\n" in refusal_response(Refusal(503, ""))[0]


def test_client_is_pinged_then_disconnected_if_it_does_not_answer() -> None:
    liveness = Liveness(60.0, 0.0)
    assert liveness.check(1000.0, 0.0, is_full=False) is Verdict.PING
    assert liveness.check(1000.0, 0.0, is_full=False) is Verdict.SILENT
    liveness.heard(1001.0)
    assert liveness.check(1061.0, 0.0, is_full=False) is Verdict.PING
    assert liveness.check(1061.0, 0.0, is_full=False) is Verdict.PING
    assert liveness.check(1061.1, 0.0, is_full=False) is Verdict.SILENT
    # All pings have been answered before the machine is suspended.
    liveness.heard(1062.0)
    assert liveness.check(2000.0, 0.0, is_full=False) is Verdict.PING


def test_client_that_reads_nothing_is_not_pinged_and_then_disconnected() -> None:
    liveness = Liveness(60.0, 0.0)
    assert liveness.check(60.0, 0.0, is_full=True) is Verdict.WAIT
    assert liveness.check(60.1, 0.0, is_full=True) is Verdict.STUCK
    assert liveness.check(100.0, 40.0, is_full=True) is Verdict.WAIT
    assert liveness.check(100.1, 40.0, is_full=True) is Verdict.STUCK
    assert liveness.check(60.1, 0.0, is_full=False) is Verdict.PING


def test_oldest_work_is_dropped_beyond_the_bounds() -> None:
    account = Account()
    jobs = Jobs(1000, account.open("a", lambda: None))
    done: list[int] = []
    dropped = [jobs.add(lambda number=number: done.append(number), bytes(400)) for number in range(4)]  # type: ignore[misc]
    assert dropped == [0, 0, 1, 1]
    # A single job may be larger than the limit.
    assert jobs.add(lambda: done.append(9), bytes(50_000)) == 2
    jobs.pop()()
    assert done == [9]
    assert not jobs
    assert sum(jobs.add(lambda: None, b"") for _ in range(1001)) == 1
    assert jobs.size == 1000 * 500
    assert jobs.clear() == 1000
    assert not jobs
    assert jobs.size == account.total == 0


def test_messages_may_fill_the_bound_exactly() -> None:
    jobs = Jobs(1000, Account().open("a", lambda: None))
    assert [jobs.add(lambda: None, bytes(500)) for _ in range(3)] == [0, 0, 1]


def test_message_is_large_from_exactly_that_size() -> None:
    account = Account()
    jobs = Jobs(10_000_000, account.open("a", lambda: None))
    jobs.add(lambda: None, bytes(LARGE_PIECE))
    assert (jobs.size, account.total) == (500, LARGE_PIECE)
    jobs.add(lambda: None, bytes(LARGE_PIECE - 1))
    assert (jobs.size, account.total) == (1000 + LARGE_PIECE - 1, LARGE_PIECE)


def test_large_message_that_waits_for_the_turns_of_several_clients_counts_once() -> None:
    account = Account()
    shares = [account.open("a", lambda: None) for _ in range(3)]
    clients = [Jobs(10_000_000, share) for share in shares]
    image = bytes(1_000_000)
    for jobs in clients:
        jobs.add(lambda: None, image)
        jobs.add(lambda: None, bytes(1000))
    assert account.total == 1_000_000
    assert [share.large for share in shares] == [1_000_000] * 3
    assert [jobs.size for jobs in clients] == [2000] * 3
    for jobs in clients:
        assert account.total == 1_000_000
        jobs.clear()
    assert account.total == 0
