"""One connection from a browser or program: an HTTP request, followed by a response, a stream or a WebSocket.

This module handles the transport: it feeds the protocol (:mod:`minirospy.web.server.websocket`) in the client's turn
(:mod:`minirospy.web.server.turns`), calls the session or the page, queues their output
(:mod:`minirospy.web.server.output`), and counts the memory that the client uses (:mod:`minirospy.web.server.account`). Source:
RFC 6455, RFC 9112.
"""

from __future__ import annotations

import asyncio
import http
import logging
import time
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Protocol

from websockets.exceptions import NegotiationError
from websockets.frames import CloseCode, Frame

from minirospy.base.escape import escaped
from minirospy.web.access import Credentials, Grant, Refusal
from minirospy.web.json_text import size_in_memory
from minirospy.web.server.account import Account
from minirospy.web.server.admission import Rank
from minirospy.web.server.client import (
    Endpoint,
    Exchange,
    HttpHandler,
    HttpRequest,
    Limits,
    Session,
    WebClient,
    frame_head,
)
from minirospy.web.server.files import FileAnswer
from minirospy.web.server.jobs import Jobs
from minirospy.web.server.liveness import Liveness, Verdict
from minirospy.web.server.output import Output
from minirospy.web.server.pipe import LARGE_READ, SMALL_READ
from minirospy.web.server.queue import Piece, SendQueue
from minirospy.web.server.request import RequestHead, read_head, refusal_response
from minirospy.web.server.turns import FairTurns
from minirospy.web.server.websocket import Message, Ping, WebSocket

if TYPE_CHECKING:
    from websockets.http11 import Request

    from minirospy.web.server.pipe import Endpoints, Pipe

__all__ = ["Connection", "Site", "Traffic"]

_log = logging.getLogger(__name__)

_PONG = 0x8A  # first byte of a pong frame, and the key of a queued pong
_WEIGHTS = {Grant.READ: 1.0, Grant.WRITE: 4.0, Grant.OWN: 64.0}
"""Weights with which clients share the loop's time, by their rights.

On loopback any program may write; the dashboard's page has the owner's token.
"""
# weight until the request has arrived; low, so that 250 handshakes do not delay established clients
_NEW_WEIGHT = 0.25


@dataclass
class Traffic:
    """Counts a client's messages and bytes, and how often reading from it was suspended."""

    received: int = 0
    received_bytes: int = 0
    held_back: int = 0
    since: float = field(default_factory=time.monotonic)


class Site(Protocol):
    """The pages and endpoints of a listener, and its clients' limits and rights."""

    @property
    def limits(self) -> Limits: ...

    @property
    def endpoints(self) -> Sequence[Endpoint]: ...

    @property
    def turns(self) -> FairTurns: ...

    def check(self, credentials: Credentials, *, is_page: bool) -> Grant | Refusal: ...

    def page(self, path: str) -> HttpHandler | None: ...

    def admit(self, connection: Connection, grant: Grant) -> Refusal | None: ...

    @property
    def account(self) -> Account: ...

    def left(self, connection: Connection) -> None: ...


class _Phase(IntEnum):
    """The phases in the life of a connection."""

    OPEN = 0
    CLOSING = 1
    """Nothing more is handled or queued, but queued data may still be sent."""
    ENDED = 2
    """The pipe is closed."""


class Connection:
    """The state of a connection, which receives the events of its pipe."""

    def __init__(self, site: Site, pipe: Pipe, peer: str, loop: asyncio.AbstractEventLoop) -> None:
        limits = site.limits
        now = loop.time()
        self.peer = peer  # the client's address
        self.share = site.account.open(peer, self._shed)  # counts the server's memory for the client
        self.traffic = Traffic()  # traffic counters, for display
        self.session: Session | None = None  # set from the WebSocket handshake until the connection closes
        self.client: WebClient | None = None  # set when the WebSocket handshake is complete
        self.exchange: Exchange | None = None  # set from the request for a page until the connection closes
        # rank of the client's rights, set by the listener when it admits the request
        self.rank = Rank.SILENT
        self.active = now  # when the connection was opened, or last sent or received a message
        # size in bytes of incomplete messages, and of the message that the session is processing
        self.unfinished = 0
        self.site = site  # the listener
        self._limits = limits  # the listener's limits
        self._pipe = pipe  # the transport
        self.loop = loop
        self._websocket = WebSocket(self._select, limits.message, limits.messages_a_second)
        self._output = Output(pipe, SendQueue(limits.queue, share=self.share), self.share, loop, self._count)
        # queued work for the client, except responses to its messages
        self._jobs = Jobs(limits.queue, self.share)
        self.liveness = Liveness(limits.silent_seconds, now)
        self.turn = site.turns.join(self._work)  # the client's share of the loop's time
        self.turn.weight = _NEW_WEIGHT
        self._endpoint: Endpoint | None = None  # set by the handshake, when the sub-protocol is chosen
        self._phase = _Phase.OPEN
        self._is_held_back = False  # whether the client has used up its frame quota for the current second
        self._is_paused = False  # whether the session is processing a message; see hold()
        self._worked_on = 0  # size in bytes of the message that the session is processing
        self._are_jobs_held = False  # whether a job continues in a thread; see hold_jobs()
        self._held = 0  # bytes of memory that the session uses for the client; see session_holds()
        self._is_in_turn = False  # whether _work() is running
        # The timer first calls _handshake_late, later the periodic check of the open connection or, while closing, _abort.
        self._timer = loop.call_later(limits.handshake_seconds, self._handshake_late)

    @property
    def queue(self) -> SendQueue:
        """Return the queue of output for the client."""
        return self._output.queue

    @property
    def is_open(self) -> bool:
        """Return whether more data may be queued for sending."""
        return self._phase is _Phase.OPEN

    @property
    def is_silent(self) -> bool:
        """Return whether the client has not sent a request yet."""
        return self.is_open and not (self.client or self.exchange)

    @property
    def endpoints(self) -> Endpoints:
        """Return the client's port, the server's port, and the server's address."""
        return self._pipe.endpoints

    # --- called by the connection's pipe

    def received(self, data: bytes) -> None:
        """Process bytes that the client has sent."""
        if not self.is_open:
            return
        self.liveness.heard(self.loop.time())
        self.traffic.received_bytes += len(data)
        if self.exchange:
            return  # each connection has only one request
        self._websocket.feed(data)
        # Read a large message in large pieces, if no other client is waiting for its turn.
        is_alone = len(data) >= SMALL_READ and not self.site.turns.is_busy
        self._pipe.read_bytes = LARGE_READ if is_alone else SMALL_READ
        if self._is_held_back or self._is_paused or self.site.turns.start(self.turn):
            self._pipe.pause()
        self._count_unfinished()

    def writable(self) -> None:
        """Send more of the queued data."""
        self._output.pump()

    def ended(self) -> None:
        """Release all resources, because the pipe has closed."""
        if self._phase is _Phase.ENDED:
            return
        self._phase = _Phase.ENDED
        self._timer.cancel()
        self.site.turns.leave(self.turn)
        self._discard_unfinished()
        try:
            if self.session:
                self.session.ended()
            if self.exchange:
                self.exchange.on_end()
        except Exception:  # noqa: BLE001 a fault of one session is not that of others
            _log.exception("the end of a client's session")
        self.session = self.exchange = None
        # Release memory now: the connection is in reference cycles, so the garbage collector would release it only later.
        self._jobs.clear()
        self._output.end()
        self.site.account.close(self.share)
        self.site.left(self)

    # --- output

    def answer(self, pieces: tuple[Piece, ...]) -> None:
        """Send to the client a message that must not be dropped."""
        if not self.is_open:
            return
        # Check the limit before appending: a single response, such as a mesh, may exceed it.
        if self.queue.is_overrun:
            _log.warning("%s reads no answers: disconnected", self.peer)
            self._abort()
            return
        self.queue.put_answer(pieces)
        self._count()
        self._output.schedule()

    def answer_file(self, answer: FileAnswer) -> None:
        """Send to the client a file that must not be dropped."""
        if self.is_open:
            self.queue.put_file(answer)
            self._count()
            self._output.schedule()

    def stream(self, key: Hashable, pieces: tuple[Piece, ...], *, newest_only: bool) -> None:
        """Send to the client a message that may be dropped."""
        if self.is_open:
            self.queue.put(key, pieces, newest_only=newest_only)
            if self._output.is_full:
                self._count()
            else:
                self.active = self.loop.time()
            self._output.schedule()

    def close_when_sent(self) -> None:
        """Send all queued data, then close the connection."""
        self._close()
        self._output.close_when_sent()
        self._timer.cancel()
        self._timer = self.loop.call_later(self._limits.handshake_seconds, self._abort)

    def close_websocket(self, code: int, reason: str) -> None:
        """Send all queued data and a close frame, then close the connection."""
        if not self.is_open or not self._websocket.is_open:
            return
        self._websocket.close(code, reason)
        self._answer_protocol()
        self.close_when_sent()

    def give_way(self) -> None:
        """Close the connection to make room for another client."""
        self.close_websocket(CloseCode.TRY_AGAIN_LATER, "another client needs the place")
        if self.is_open or self._output.is_full:
            self._abort()

    def abort(self) -> None:
        """Close the connection immediately."""
        self._abort()

    # --- called by the client's session

    def hold(self, *, is_held: bool) -> None:
        """If ``is_held``, stop handling frames, because the session is processing a message; otherwise continue handling them."""
        self._is_paused = is_held
        if is_held:
            self._pipe.pause()
            return
        self._worked_on = 0
        self._count_unfinished()
        if self._phase is not _Phase.ENDED and not self._is_held_back:
            self.site.turns.start(self.turn)

    def in_turn(self, work: Callable[[], None], message: Piece) -> None:
        """Run ``work`` when it is the client's turn, which may be now.

        ``work`` uses ``message``, whose bytes are counted until then. If the queued work exceeds the queue's limit, the
        oldest is dropped.
        """
        if self._is_in_turn and not self._are_jobs_held:
            work()
            return
        if not self.is_open:
            return
        self.queue.dropped += self._jobs.add(work, message)
        self.site.turns.start(self.turn)
        if self._jobs:
            self._count()

    def hold_jobs(self, *, are_held: bool) -> None:
        """If ``are_held``, stop running queued work for the client while its last job runs in a thread; otherwise continue."""
        self._are_jobs_held = are_held
        if not are_held and self._jobs:
            self.site.turns.start(self.turn)

    def session_holds(self, count: int) -> None:
        """Record how many bytes of memory the session uses for the client's messages."""
        self._held = count
        if self._phase is not _Phase.ENDED:
            self._count()

    # --- handling input from the client

    def _work(self, end: float) -> bool:
        """Do work for the client until the time ``end``. Return True if there is more."""
        self._is_in_turn = True
        try:
            return self._do_jobs(end) or self._handle_frames(end)
        finally:
            self._is_in_turn = False

    def _do_jobs(self, end: float) -> bool:
        if not self._jobs:
            return False
        is_left = self._do_some_jobs(end)
        self._count()
        return is_left

    def _do_some_jobs(self, end: float) -> bool:
        while self._jobs and self.is_open and not self._are_jobs_held:
            work = self._jobs.pop()
            try:
                work()
            except Exception:  # noqa: BLE001 whatever a session raises ends this client alone
                _log.exception("a message for %s could not be sent", self.peer)
                self.close_websocket(CloseCode.INTERNAL_ERROR, "the bridge failed on a message")
            if self.loop.time() >= end and self.is_open:
                return bool((self._jobs and not self._are_jobs_held) or self._websocket.has_unread)
        return False

    def _handle_frames(self, end: float) -> bool:
        """Handle frames from the client until the time ``end``.

        Return True if frames remain that the client's quota for this second still allows.
        """
        if self.client is None:
            self._parse_head()
        websocket, rate, time_of = self._websocket, self._websocket.rate, self.loop.time
        now = time_of()
        rate.update(now)
        while self.client and self.is_open and not (self._is_paused or self._is_held_back):
            if rate.is_used_up:
                self._hold_back(rate.seconds_left(now))
                break
            frame = websocket.next_frame()
            if frame is None:
                break
            self.framed(frame)
            if time_of() >= end and websocket.has_unread and self.is_open:
                return True
        if self.client and self._phase is not _Phase.ENDED:
            self._answer_protocol()
            if websocket.is_closed:
                self.close_when_sent()
        self._count_unfinished()
        if not self._is_held_back and not self._is_paused and self._phase is not _Phase.ENDED:
            self._pipe.resume()
        return False

    def framed(self, frame: Frame) -> None:
        event = self._websocket.event_of(frame)
        if isinstance(event, Ping):
            # Queue at most one pong, even if the client does not read: only the newest ping needs one (RFC 6455, 5.5.3).
            self.stream(_PONG, (frame_head(_PONG, len(event.data)), event.data), newest_only=True)
        elif event:
            self._deliver(event)

    def _deliver(self, message: Message) -> None:
        assert self.session
        data = message.data
        self.traffic.received += 1
        self.active = self.loop.time()
        try:
            if not message.is_text:
                self.session.received_binary(data)
            elif size_in_memory(data) > self._limits.message:
                self.close_websocket(CloseCode.MESSAGE_TOO_BIG, "its wide characters take too much memory")
            else:
                self.session.received_text(data.decode())
        except UnicodeDecodeError:
            self.close_websocket(CloseCode.INVALID_DATA, "text that is not UTF-8")
        except Exception:  # noqa: BLE001 whatever a session raises ends this client alone
            _log.exception("a message of %s could not be handled", self.peer)
            self.close_websocket(CloseCode.INTERNAL_ERROR, "the bridge failed on this message")
        if self._is_paused:
            self._worked_on = len(data)

    def _hold_back(self, seconds: float) -> None:
        """Stop reading from the client until the next second, because its frame quota is used up."""
        self._is_held_back = True
        self.traffic.held_back += 1
        self._pipe.pause()
        self.loop.call_later(seconds, self.go_on)

    def go_on(self) -> None:
        self._is_held_back = False
        if not self._is_paused:
            self.site.turns.start(self.turn)

    def _answer_protocol(self) -> None:
        data = self._websocket.data_to_send()
        if data:
            self.answer(data)

    # --- request

    def _parse_head(self) -> None:
        try:
            request = self._websocket.next_request()
            # A ValueError (invalid target or Origin, or a query with a thousand fields) must not leave the client connected.
            found = self._admitted(read_head(request)) if request else None
        except ValueError as error:
            found = Refusal(400, f"not a request for this server: {escaped(str(error))[:200]}")
        if found is None:
            return
        if isinstance(found, Refusal):
            self._refuse(found)
            return
        seen, grant, is_page = found
        if is_page:
            self._serve_page(seen, grant)
        else:
            assert request
            self._open_websocket(request, seen, grant)

    def _admitted(self, head: RequestHead) -> tuple[HttpRequest, Grant, bool] | Refusal:
        """Return (request, rights, whether it is for a page), or the reason for refusing the request.

        Raise ValueError if the request is invalid.
        """
        grant = self.site.check(head.credentials, is_page=head.is_page)
        refusal = grant if isinstance(grant, Refusal) else self.site.admit(self, grant)
        if refusal:
            return refusal
        assert isinstance(grant, Grant)
        return head.parsed(self.peer, self._pipe.endpoints), grant, head.is_page

    def _open_websocket(self, request: Request, seen: HttpRequest, grant: Grant) -> None:
        response = self._websocket.response_to(request)
        if response.status_code != http.HTTPStatus.SWITCHING_PROTOCOLS or self._endpoint is None:
            text = bytes(response.body or b"").decode(errors="replace").strip().partition(": ")[2]
            self._refuse(Refusal(response.status_code, text or "not a WebSocket request"))
            return
        self._websocket.accept(response)
        self._answer_protocol()
        self.client = WebClient(self, seen, grant, self._websocket.subprotocol)
        self.share.is_owner = self.client.is_owner
        self.turn.weight = _WEIGHTS[grant]
        if not self.client.may_write:
            self._websocket.restrict(min(self._limits.message, self._limits.read_only_message))
        self._watch(self.ping)
        self.session = self._endpoint.open(self.client)

    def _select(self, offered: Sequence[str]) -> str | None:
        """Choose the endpoint; return its sub-protocol. Raise NegotiationError if the client fits no endpoint."""
        why = "nothing is served here"
        for endpoint in self.site.endpoints:
            try:
                chosen = endpoint.select(offered)
            except LookupError as error:
                why = str(error.args[0])
                continue
            self._endpoint = endpoint
            return chosen
        raise NegotiationError(why)

    def _serve_page(self, request: HttpRequest, grant: Grant) -> None:
        handler = self.site.page(request.path)
        if handler is None:
            self._refuse(Refusal(404, "there is no such page; WebSocket clients are served here"))
            return
        self.exchange = Exchange(self, request, grant)
        self._output.progressed = self.loop.time()
        self._watch(self._watch_progress)
        try:
            handler(self.exchange)
        except Exception:  # noqa: BLE001 whatever the page's handler raises
            _log.exception("a page could not be served")
            self._abort()

    def _refuse(self, refusal: Refusal) -> None:
        _log.info("refused %s: %d %s", self.peer, refusal.status, escaped(refusal.text))
        self.answer(refusal_response(refusal))
        self.close_when_sent()

    # --- memory

    def _count_unfinished(self) -> None:
        self.unfinished = self._websocket.unfinished + self._worked_on
        self._count()

    def _count(self) -> None:
        """Update the memory that only this client uses. This may make clients, even this one, release memory."""
        self.share.set(self.unfinished + self._held + self._jobs.size + self._output.size)

    def _shed(self) -> None:
        """Release memory: drop queued messages. If there are none, or if unfinished input takes more, close the connection."""
        if self.unfinished > self.queue.size + self.queue.answers + self._jobs.size and not self._held:
            self._refuse_unfinished()
            return
        if self.queue.size or self._jobs:
            self.queue.drop_messages()
            self.queue.dropped += self._jobs.clear()
            self._count()
            return
        _log.warning("%s: the server holds too much memory for it: disconnected", self.peer)
        self._discard_unfinished()
        self._abort()
        self.queue.clear()
        self._held = 0
        self._count()

    def _refuse_unfinished(self) -> None:
        _log.warning("%s: unfinished messages take too much memory: disconnected", self.peer)
        self.close_websocket(CloseCode.TRY_AGAIN_LATER, "too many unfinished messages")
        self._discard_unfinished()

    def _discard_unfinished(self) -> None:
        self._websocket.discard_unfinished()
        self._worked_on = 0
        self._count_unfinished()

    # --- time

    def _watch(self, check: Callable[[], None]) -> None:
        """Call ``check`` after the ping interval, in place of the previous check."""
        self._timer.cancel()
        self._timer = self.loop.call_later(self._limits.ping_seconds, check)

    def ping(self) -> None:
        """Ping the client, or disconnect it if it has stopped responding."""
        output = self._output
        verdict = self.liveness.check(self.loop.time(), output.progressed, is_full=output.is_full)
        if verdict in (Verdict.STUCK, Verdict.SILENT):
            why = "reads nothing" if verdict is Verdict.STUCK else "does not answer"
            _log.info("%s %s: disconnected", self.peer, why)
            self._abort()
            return
        if verdict is Verdict.PING:
            self._websocket.ping(b"minirospy")
            self._answer_protocol()
        self._watch(self.ping)

    def _watch_progress(self) -> None:
        """Disconnect a page's client if it does not read."""
        output = self._output
        if self.liveness.is_stuck(self.loop.time(), output.progressed, is_full=output.is_full):
            self._abort()
            return
        self._watch(self._watch_progress)

    def _handshake_late(self) -> None:
        _log.info("%s sent no request in time", self.peer)
        self._abort()

    def _close(self) -> None:
        if self._phase is _Phase.OPEN:
            self._phase = _Phase.CLOSING

    def _abort(self) -> None:
        self._close()
        self._output.abort()
