"""One connection of a browser or program: HTTP request in, then an answer, a stream, or a WebSocket.

The WebSocket's bytes are parsed by the library ``websockets`` (its part without sockets), one frame at a time, in the client's
turn (:mod:`minirospy.web.server.turns`). Frames are written here, so that a message goes into the socket without being copied for
each client. Source: RFC 6455, RFC 9112.
"""

from __future__ import annotations

import asyncio
import http
import logging
import time
from collections import deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, unquote, urlsplit

from websockets.exceptions import NegotiationError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State

from minirospy.base.escape import escaped
from minirospy.web.access import TOKEN_PROTOCOL, Credentials, Grant, Refusal, header_items
from minirospy.web.json_text import size_in_memory
from minirospy.web.server.admission import Rank
from minirospy.web.server.client import (
    PLAIN_HEADERS,
    Endpoint,
    Exchange,
    HttpHandler,
    HttpRequest,
    Limits,
    Session,
    Site,
    WebClient,
    frame_head,
    response_head,
)
from minirospy.web.server.files import FileAnswer, FileSender
from minirospy.web.server.frames import FrameByFrame
from minirospy.web.server.pipe import LARGE_READ, SMALL_READ
from minirospy.web.server.queue import Piece, SendQueue

if TYPE_CHECKING:
    from websockets.typing import Subprotocol

    from minirospy.web.server.pipe import Endpoints, Pipe

__all__ = [
    "Connection",
    "Endpoint",
    "Exchange",
    "HttpHandler",
    "HttpRequest",
    "Limits",
    "Session",
    "Site",
    "WebClient",
]

_log = logging.getLogger(__name__)

_BATCH_BYTES = 256 * 1024
_BATCH_PIECES = 128
_PUMP_BYTES = 1024 * 1024  # written to a client that reads at once, before the loop's next iteration
_PONG = 0x8A
_MAX_JOBS = 1000  # of a client, each of which keeps a message that is not encoded yet
_WEIGHTS = {Grant.READ: 1.0, Grant.WRITE: 4.0, Grant.OWN: 64.0}
"""Of clients when the loop's time is shared. On loopback any program may write; the page of the dashboard has the token."""


@dataclass
class Traffic:
    """The traffic of a client, and how often its reading was held back."""

    received: int = 0
    received_bytes: int = 0
    held_back: int = 0
    since: float = field(default_factory=time.monotonic)


class Connection:
    """The state of one connection; the events of its pipe come in here."""

    def __init__(self, site: Site, pipe: Pipe, peer: str, loop: asyncio.AbstractEventLoop) -> None:
        self.peer = peer
        self.share = site.account.open(peer, self._shed)
        self.queue = SendQueue(site.limits.queue, share=self.share)
        self.traffic = Traffic()
        self.session: Session | None = None
        self.client: WebClient | None = None
        self.exchange: Exchange | None = None
        self.rank = Rank.SILENT
        """The rights, once the request is known."""
        self.active = loop.time()
        """When the connection was opened, or a message was received or taken."""
        self.unfinished = 0
        """Bytes of a message that has not arrived whole."""
        self._site = site
        self._pipe = pipe
        self._loop = loop
        self._protocol = FrameByFrame(
            select_subprotocol=lambda _, offered: self._select(offered),
            max_size=site.limits.message,
            logger=_QUIET,
        )
        self._turn = site.turns.join(self._work)
        self._endpoint: Endpoint | None = None
        self._fragments = bytearray()
        self._is_held_back = False
        # The client has sent as many frames as it may in this second.
        self._is_paused = False
        # Its session works on what came before,
        self._worked_on = 0
        # a message of so many bytes.
        self._jobs: deque[tuple[Callable[[], None], int]] = deque()
        # Work for the client that is not about what it sent, and the bytes that each keeps.
        self._jobs_size = 0
        self._is_in_turn = False
        self._opcode = Opcode.BINARY
        self._is_scheduled = False
        self._is_closing = False
        self._is_over = False
        self._file: FileSender | None = None
        """The file that is being sent."""
        self._writing: list[Piece] = []
        """Pieces that the pipe has not written yet, while their large ones are counted."""
        self._held = 0
        """Bytes that the session keeps of the client."""
        self._second = 0.0
        self._in_second = 0
        self._received = loop.time()
        # Since bytes of the client have come.
        self._is_pinged = False
        self._progressed = loop.time()
        self._timer = loop.call_later(site.limits.handshake_seconds, self._handshake_late)
        self._limits = site.limits

    @property
    def is_open(self) -> bool:
        """Return whether more may be sent."""
        return not self._is_closing

    @property
    def is_silent(self) -> bool:
        """Return whether no request has come."""
        return not (self.client or self.exchange or self._is_closing)

    # --- from the pipe

    def received(self, data: bytes) -> None:
        """Take over bytes of the client."""
        if self._is_closing:
            return
        self._received = self._loop.time()
        self._is_pinged = False
        self.traffic.received_bytes += len(data)
        if self.exchange:
            return  # one request a connection
        self._protocol.feed(data)
        # A large message is read in large pieces, unless other clients wait for their turns.
        is_alone = len(data) >= SMALL_READ and not self._site.turns.is_busy
        self._pipe.read_bytes = LARGE_READ if is_alone else SMALL_READ
        if self._is_held_back or self._is_paused or self._site.turns.start(self._turn):
            self._pipe.pause()
        self._count_unfinished()

    def writable(self) -> None:
        """Send more."""
        self._pump()

    def ended(self) -> None:
        """Forget the connection."""
        if self._is_over:
            return
        self._is_over = self._is_closing = True
        self._timer.cancel()
        self._site.turns.leave(self._turn)
        self._discard_unfinished()
        try:
            if self.session:
                self.session.ended()
            if self.exchange:
                self.exchange.on_end()
        except Exception:  # noqa: BLE001 a fault of one session is not that of others
            _log.exception("the end of a client's session")
        self.session = self.exchange = None
        # The connection is part of reference cycles: what waited is freed now, not when they are collected.
        self.queue.clear()
        self._jobs.clear()
        if self._file:
            self._file.close()
        self._wrote()
        self._site.account.close(self.share)
        self._site.left(self)

    # --- to the pipe

    def answer(self, pieces: tuple[Piece, ...]) -> None:
        """Send what is never dropped."""
        if self._is_closing:
            return
        # Looked at before: a single answer, such as a mesh, may be larger than what may wait.
        if self.queue.is_overrun:
            _log.warning("%s reads no answers: disconnected", self.peer)
            self._abort()
            return
        self.queue.put_answer(pieces)
        self._count()
        self._schedule()

    def answer_file(self, answer: FileAnswer) -> None:
        """Send a file, which is never dropped."""
        if not self._is_closing:
            self.queue.put_file(answer)
            self._count()
            self._schedule()

    def stream(self, key: Hashable, pieces: tuple[Piece, ...], *, newest_only: bool) -> None:
        """Send what may be dropped."""
        if not self._is_closing:
            self.queue.put(key, pieces, newest_only=newest_only)
            if self._pipe.is_full:
                self._count()
            else:
                self.active = self._loop.time()
            self._schedule()

    def close_when_sent(self) -> None:
        """End the connection after what waits."""
        self._is_closing = True
        self._schedule()
        self._timer.cancel()
        self._timer = self._loop.call_later(self._limits.handshake_seconds, self._abort)

    def close_websocket(self, code: int, reason: str) -> None:
        """Say why, and end the connection after what waits."""
        if self._is_closing or self._protocol.state is not State.OPEN:
            return
        self._protocol.send_close(code, _cut(reason))
        self._answer_protocol()
        self.close_when_sent()

    def refuse_unfinished(self) -> None:
        """End the connection, and free the part of a message that has arrived."""
        _log.warning("%s: unfinished messages take too much memory: disconnected", self.peer)
        self.close_websocket(CloseCode.TRY_AGAIN_LATER, "too many unfinished messages")
        self._discard_unfinished()

    def hold(self, *, is_held: bool) -> None:
        """Handle no more frames while the session is busy with one; the client's bytes stay in its socket."""
        self._is_paused = is_held
        if is_held:
            self._pipe.pause()
            return
        self._worked_on = 0
        self._count_unfinished()
        if not self._is_over and not self._is_held_back:
            self._site.turns.start(self._turn)

    def in_turn(self, work: Callable[[], None], size: int) -> None:
        """Do some work for the client in its turn, immediately if that is now; ``size``: bytes that it keeps until then.

        The oldest work is dropped where more waits than may be sent.
        """
        if self._is_in_turn:
            work()
            return
        self._jobs.append((work, size))
        self._jobs_size += size
        while len(self._jobs) > 1 and (self._jobs_size > self._limits.queue or len(self._jobs) > _MAX_JOBS):
            self._jobs_size -= self._jobs.popleft()[1]
            self.queue.dropped += 1
        self._site.turns.start(self._turn)

    def session_holds(self, count: int) -> None:
        """Count what the session keeps of the client."""
        self._held = count
        if not self._is_over:
            self._count()

    def give_way(self) -> None:
        """End the connection, since another client needs its place."""
        self.close_websocket(CloseCode.TRY_AGAIN_LATER, "another client needs the place")
        if not self._is_closing or self._pipe.is_full:
            self._abort()

    @property
    def endpoints(self) -> Endpoints:
        """The ports of both ends, and the address of this one."""
        return self._pipe.endpoints

    def abort(self) -> None:
        """End the connection now."""
        self._abort()

    # --- within

    def _work(self, end: float) -> bool:
        """Work for the client up to a time; return whether more is left."""
        self._is_in_turn = True
        try:
            return self._do_jobs(end) or self._handle_frames(end)
        finally:
            self._is_in_turn = False

    def _do_jobs(self, end: float) -> bool:
        while self._jobs and not self._is_closing:
            work, size = self._jobs.popleft()
            self._jobs_size -= size
            try:
                work()
            except Exception:  # noqa: BLE001 whatever a session raises ends this client alone
                _log.exception("a message for %s could not be sent", self.peer)
                self.close_websocket(CloseCode.INTERNAL_ERROR, "the bridge failed on a message")
            if self._loop.time() >= end and not self._is_closing:
                return bool(self._jobs or self._protocol.reader.buffer)
        return False

    def _handle_frames(self, end: float) -> bool:
        """Handle frames up to a time; return whether more are left, of what the client may send in this second."""
        if self.client is None:
            self._parse_head()
        protocol, time_of = self._protocol, self._loop.time
        now, most = time_of(), self._limits.messages_a_second
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        while self.client and not (self._is_closing or self._is_paused or self._is_held_back):
            if self._in_second >= most:
                self._hold_back(self._second + 1.0 - now)
                break
            frame = protocol.next_frame()
            if frame is None:
                break
            self._in_second += 1
            self._framed(frame)
            if time_of() >= end and protocol.reader.buffer and not self._is_closing:
                return True
        if self.client and not self._is_over:
            self._answer_protocol()
            if self._protocol.state in (State.CLOSING, State.CLOSED):
                self.close_when_sent()
        self._count_unfinished()
        if not self._is_held_back and not self._is_paused and not self._is_over:
            self._pipe.resume()
        return False

    def _parse_head(self) -> None:
        request = self._protocol.next_request()
        if request:
            self._requested(request)
        elif self._protocol.handshake_exc:
            why = self._protocol.handshake_exc.__cause__ or self._protocol.handshake_exc
            self._refuse(Refusal(400, f"not a request for this server: {escaped(str(why))[:200]}"))

    def _answer_protocol(self) -> None:
        data = tuple(piece for piece in self._protocol.data_to_send() if piece)
        if data:
            self.answer(data)

    def _requested(self, request: Request) -> None:
        try:
            # The target and Origin may be no URLs, with a thousand fields: neither is a reason to leave the client connected.
            found = self._admitted(request)
        except ValueError as error:
            found = Refusal(400, f"not a request for this server: {escaped(str(error))[:200]}")
        if isinstance(found, Refusal):
            self._refuse(found)
            return
        seen, grant, is_page = found
        if is_page:
            self._serve_page(seen, grant)
            return

        response = self._protocol.accept(request)
        if response.status_code != http.HTTPStatus.SWITCHING_PROTOCOLS or self._endpoint is None:
            text = bytes(response.body or b"").decode(errors="replace").strip().partition(": ")[2]
            self._refuse(Refusal(response.status_code, text or "not a WebSocket request"))
            return
        self._protocol.send_response(response)
        self._answer_protocol()
        self.client = WebClient(self, seen, grant, self._protocol.subprotocol)
        self.share.is_owner = self.client.is_owner
        self._turn.weight = _WEIGHTS[grant]
        if not self.client.may_write:
            self._protocol.limit(min(self._limits.message, self._limits.read_only_message))
        self._watch(self._ping)
        self.session = self._endpoint.open(self.client)

    def _admitted(self, request: Request) -> tuple[HttpRequest, Grant, bool] | Refusal:
        """Return a request, its rights and whether it is for a page, or why it is refused. Raise ValueError."""
        headers = {name.lower(): value for name, value in request.headers.raw_items()}
        credentials = Credentials(
            headers.get("host", ""),
            _origin(headers),
            headers.get("authorization", ""),
            header_items(headers, "sec-websocket-protocol"),
            request.path,
        )
        is_page = headers.get("upgrade", "").lower() != "websocket"
        grant = self._site.check(credentials, is_page=is_page)
        refusal = grant if isinstance(grant, Refusal) else self._site.admit(self, grant)
        if refusal:
            return refusal
        assert isinstance(grant, Grant)
        parts = urlsplit(request.path)
        query = {name: values[-1] for name, values in parse_qs(parts.query, keep_blank_values=True).items()}
        seen = HttpRequest(unquote(parts.path), query, headers, self.peer, *self._pipe.endpoints)
        return seen, grant, is_page

    def _watch(self, check: Callable[[], None]) -> None:
        """Call ``check`` from now on in place of what watched the connection until now."""
        self._timer.cancel()
        self._timer = self._loop.call_later(self._limits.ping_seconds, check)

    def _select(self, offered: Sequence[Subprotocol]) -> Subprotocol | None:
        names = [name for name in offered if not name.startswith(TOKEN_PROTOCOL)]
        why = "nothing is served here"
        for endpoint in self._site.endpoints:
            try:
                chosen = endpoint.select(names)
            except LookupError as error:
                why = str(error.args[0])
                continue
            self._endpoint = endpoint
            return chosen  # type: ignore[return-value]
        raise NegotiationError(why)

    def _serve_page(self, request: HttpRequest, grant: Grant) -> None:
        handler = self._site.page(request.path)
        if handler is None:
            self._refuse(Refusal(404, "there is no such page; WebSocket clients are served here"))
            return
        self.exchange = Exchange(self, request, grant)
        self._progressed = self._loop.time()
        self._watch(self._watch_progress)
        try:
            handler(self.exchange)
        except Exception:  # noqa: BLE001 whatever the page's handler raises
            _log.exception("a page could not be served")
            self._abort()

    def _refuse(self, refusal: Refusal) -> None:
        _log.info("refused %s: %d %s", self.peer, refusal.status, escaped(refusal.text))
        body = (refusal.text + "\n").encode()
        extra = {401: {"WWW-Authenticate": "Bearer"}, 503: {"Retry-After": "5"}}.get(refusal.status, {})
        self.answer(
            (
                response_head(
                    refusal.status,
                    {
                        **PLAIN_HEADERS,
                        "Content-Type": "text/plain; charset=utf-8",
                        "Content-Length": str(len(body)),
                        **extra,
                    },
                ),
                body,
            )
        )
        self.close_when_sent()

    def _framed(self, frame: Frame) -> None:
        if frame.opcode in (Opcode.TEXT, Opcode.BINARY):
            self._opcode = frame.opcode
        elif frame.opcode is Opcode.PING:
            # Only the newest ping needs an answer (RFC 6455, 5.5.3): a client that reads nothing leaves one waiting.
            self.stream(_PONG, (frame_head(_PONG, len(frame.data)), frame.data), newest_only=True)
            return
        elif frame.opcode is not Opcode.CONT:
            return
        if frame.fin and not self._fragments:
            self._delivered(bytes(frame.data))
            return
        self._fragments += frame.data
        if frame.fin:
            data = bytes(self._fragments)
            self._fragments.clear()
            self._delivered(data)

    def _delivered(self, data: bytes) -> None:
        assert self.session
        self.traffic.received += 1
        self.active = self._loop.time()
        try:
            if self._opcode is Opcode.BINARY:
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

    def _count_unfinished(self) -> None:
        self.unfinished = len(self._protocol.reader.buffer) + len(self._fragments) + self._worked_on
        self._count()

    def _count(self) -> None:
        """Count in the account what the client holds alone; this may make clients give up memory, this one too."""
        queue = self.queue
        size = self.unfinished + self._held + queue.size + queue.answers - queue.large
        if self._pipe.is_full:
            size += max(0, self._pipe.unsent - sum(map(len, self._writing)))
        self.share.set(size)

    def _shed(self) -> None:
        """Give up memory: messages that may be dropped, else the connection."""
        if self.unfinished > self.queue.size + self.queue.answers and not self._held:
            self.refuse_unfinished()
            return
        if self.queue.size:
            self.queue.drop_messages()
            self._count()
            return
        _log.warning("%s: the server holds too much memory for it: disconnected", self.peer)
        self._discard_unfinished()
        self._abort()
        self.queue.clear()
        self._held = 0
        self._count()

    def _wrote(self) -> None:
        """Count the pieces that were with the pipe no more."""
        if self._writing:
            self.share.release(self._writing)
            self._writing = []

    def _discard_unfinished(self) -> None:
        self._protocol.reader.buffer.clear()
        self._fragments.clear()
        self._worked_on = 0
        self._count_unfinished()

    def _hold_back(self, seconds: float) -> None:
        """Read a client that has sent what it may in this second again in the next one."""
        self._is_held_back = True
        self.traffic.held_back += 1
        self._pipe.pause()
        self._loop.call_later(seconds, self._go_on)

    def _go_on(self) -> None:
        self._is_held_back = False
        if not self._is_paused:
            self._site.turns.start(self._turn)

    def _schedule(self) -> None:
        # What arrives in the same turn of the loop goes out with one call.
        if not self._is_scheduled and not self._pipe.is_full:
            self._is_scheduled = True
            self._loop.call_soon(self._pump)

    def _pump(self) -> None:
        self._is_scheduled = False
        if self._is_over:
            return
        if not self._pipe.is_full:
            self._wrote()
        self._write()
        if self.share.size and not self._is_over:
            self._count()

    def _write(self) -> None:
        """Write what waits, as much of it as the pipe takes and as fits into one iteration of the loop."""
        written = 0
        while not self._pipe.is_full:
            if written >= _PUMP_BYTES:
                self._schedule()
                return
            batch: list[Piece] = []
            size = 0
            while size < _BATCH_BYTES and len(batch) < _BATCH_PIECES and not self._file:
                pieces = self.queue.pop()
                if pieces is None:
                    break
                if isinstance(pieces, FileAnswer):
                    self._file = FileSender(pieces, self._loop, self._pump)
                    break
                batch += pieces
                size += sum(map(len, pieces))
            if not batch and self._file:
                piece = self._file.take()
                if piece is None:
                    if self._file.has_failed:
                        self._abort()  # its size has been sent: what follows would be taken for the file
                    return
                batch.append(piece)
                if self._file.is_done:
                    self._file = None
            if not batch:
                if self._is_closing:
                    self._pipe.close()
                return
            self._progressed = self._loop.time()
            written += sum(map(len, batch))
            self._pipe.write(batch)
            if self._is_over:
                return
            if self._pipe.is_full and not self._pipe.copies:
                self._writing = batch
                self.share.hold(batch)

    def _ping(self) -> None:
        """See whether the client is there: it answers a ping, or takes what is sent."""
        now = self._loop.time()
        stuck = self._pipe.is_full and now - self._progressed > self._limits.silent_seconds
        # After a suspend the last bytes are old, and the client has not been pinged since.
        silent = self._is_pinged and now - self._received > self._limits.silent_seconds
        if stuck or silent:
            _log.info("%s %s: disconnected", self.peer, "reads nothing" if stuck else "does not answer")
            self._abort()
            return
        if not self._pipe.is_full:
            self._is_pinged = True
            self._protocol.send_ping(b"minirospy")
            self._answer_protocol()
        self._watch(self._ping)

    def _watch_progress(self) -> None:
        now = self._loop.time()
        if self._pipe.is_full and now - self._progressed > self._limits.silent_seconds:
            self._abort()
            return
        self._watch(self._watch_progress)

    def _handshake_late(self) -> None:
        _log.info("%s sent no request in time", self.peer)
        self._abort()

    def _abort(self) -> None:
        self._is_closing = True
        self._pipe.close(flush=False)


def _origin(headers: Mapping[str, str]) -> str | None:
    """Return the site of the page that sends a request; None if it is not one.

    A browser names it in Origin, but not for an image or a frame: there it says that the page is of another site, and
    may name that in Referer. Source: https://www.w3.org/TR/fetch-metadata/.
    """
    origin = headers.get("origin")
    is_embedded = (
        headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") != "document"
    )
    if origin is None and is_embedded:
        page = urlsplit(headers.get("referer", ""))
        return f"{page.scheme}://{page.netloc}" if page.netloc else "null"
    return origin


def _cut(reason: str) -> str:
    return reason.encode()[:123].decode(errors="ignore")


_QUIET = logging.getLogger("minirospy.web.websockets")
# It logs each frame at DEBUG, tokens in headers among them.
_QUIET.addHandler(logging.NullHandler())
_QUIET.propagate = False
_QUIET.setLevel(logging.CRITICAL)
