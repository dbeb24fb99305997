"""HTTP/1.1 for XML-RPC: POST requests and their responses, with keep-alive.

Pure: parses bytes into messages, and serializes messages. Source: RFC 9112.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Generator
from functools import lru_cache
from typing import NamedTuple

from minirospy.base.errors import RpcProtocolError

__all__ = [
    "MAX_BODY",
    "Body",
    "HttpHead",
    "HttpMessage",
    "HttpReader",
    "serialize_error",
    "serialize_request",
    "serialize_request_head",
    "serialize_response",
    "serialize_response_head",
]

MAX_BODY = 64 * 1024 * 1024  # maximum bytes in a body; a parameter may contain a whole robot description

_MAX_HEAD = 64 * 1024
_SHORT_HEAD = 512
_CONTINUE = b"HTTP/1.1 100 Continue\r\n\r\n"
_REASONS = {
    400: "Bad Request",
    405: "Method Not Allowed",
    413: "Content Too Large",
    500: "Internal Server Error",
    503: "Service Unavailable",
}


# a message's body; a long one is the bytearray in which it was collected, not a copy
Body = bytes | bytearray


class HttpHead(NamedTuple):
    """A message's first line and headers; ``headers`` have lower-case names."""

    start: str
    headers: dict[str, str]
    method: str  # the method of a request
    keep_alive: bool  # True if the connection can be used for another request after this one
    # the body's length if Content-Length is the only header that specifies it, else -1
    plain_length: int


class HttpMessage(NamedTuple):
    """A request or a response."""

    head: HttpHead
    body: Body

    @property
    def start(self) -> str:
        """The message's first line."""
        return self.head.start

    @property
    def keep_alive(self) -> bool:
        """Return whether the connection can be used for another request after this one."""
        return self.head.keep_alive

    @property
    def method(self) -> str:
        """The request's method."""
        return self.head.method

    @property
    def status(self) -> int:
        """The response's status code, or 0 if there is none."""
        parts = self.head.start.split(" ", 2)
        return int(parts[1]) if len(parts) > 1 and re.fullmatch(r"[0-9]{3}", parts[1]) else 0


class HttpReader:
    """A parser that splits received bytes into complete messages. Several messages may be pipelined.

    Optimized for the usual case: a single message in one piece, or its head and then its body.
    """

    __slots__ = (
        "_buffer",
        "_chunked",
        "_ended",
        "_has_more",
        "_head",
        "_in_body",
        "_max_body",
        "_parser",
        "wants_continue",
    )

    def __init__(self, max_body: int = MAX_BODY) -> None:
        self._max_body = max_body
        # The head of the next message, if its body may arrive in one piece.
        self._head: HttpHead | None = None
        self._parser: Generator[HttpMessage | None, None, None] | None = None
        self._buffer = bytearray()
        self._ended = False
        self._in_body = False
        # True if the bytes received so far may contain another message.
        self._has_more = False
        # The part of a chunked body received so far; it is no longer in the buffer.
        self._chunked: bytearray | None = None
        # True if the peer sends its body only after :meth:`continue_line`
        self.wants_continue = False

    @property
    def is_idle(self) -> bool:
        """Return whether no message has started."""
        return self._head is None and not self._buffer and not self._in_body

    @property
    def in_chunks(self) -> bool:
        """Return whether the current message has a chunked body. Even a few bytes may then contain many chunks."""
        return self._chunked is not None

    @property
    def held(self) -> int:
        """The number of bytes in an incomplete message."""
        return len(self._buffer) + len(self._chunked or b"")

    def feed(self, data: bytes) -> list[HttpMessage]:
        """Return the messages that ``data`` completes; b"" means that the peer has closed.

        Raise RpcProtocolError if the data is not HTTP.
        """
        messages: list[HttpMessage] = []
        message = self.feed_one(data)
        while message is not None:
            messages.append(message)
            message = self.next_message()
        return messages

    def feed_one(self, data: bytes) -> HttpMessage | None:
        """Return the first message that ``data`` completes, and leave the others to :meth:`next_message`.

        Return None if the first message is incomplete. Raise RpcProtocolError if the data is not HTTP.
        """
        head = self._head
        if head is not None:
            self._head = None
            if len(data) == head.plain_length:
                return HttpMessage(head, data)
        elif self.is_idle:
            end = data.find(b"\r\n\r\n")
            if 0 < end <= _MAX_HEAD:
                first = _parse_head(data[:end])
                if first.plain_length >= 0:
                    self._check(first.plain_length)
                    length = len(data) - end - 4
                    if length == first.plain_length:
                        return HttpMessage(first, data[end + 4 :])
                    if not length:
                        self._head = first
                        return None

        if data:
            self._buffer += data
        else:
            self._ended = True
        if self._parser is None or head is not None:
            self._parser = self._parse(head)
        self._has_more = True
        return self.next_message()

    def next_message(self) -> HttpMessage | None:
        """Return the next complete message in the bytes fed so far. Raise RpcProtocolError if the bytes are not HTTP."""
        if not self._has_more:
            return None
        assert self._parser
        message = next(self._parser)
        self._has_more = message is not None
        return message

    def close(self) -> None:
        """Release the data of an incomplete message. Idempotent."""
        self._head = self._parser = None
        self._has_more = False
        self._buffer = bytearray()
        self._chunked = None
        self._in_body = False

    def continue_line(self) -> bytes:
        """Return the response that a peer awaits after sending ``Expect: 100-continue``."""
        self.wants_continue = False
        return _CONTINUE

    def _parse(self, head: HttpHead | None) -> Generator[HttpMessage | None, None, None]:
        """Yield the messages in the buffer, and None when more bytes are needed. ``head``, if given, has already been removed."""
        while True:
            if head is None:
                head = _parse_head((yield from self._until(_end_of_head)))
            self.wants_continue = head.headers.get("expect", "").lower() == "100-continue"
            # Do not use a variable here, which would keep the body in memory until the next message.
            yield HttpMessage(head, (yield from self._whole_body(head)))
            head = None

    def _whole_body(self, head: HttpHead) -> Generator[None, None, Body]:
        self._in_body = True
        body = yield from self._body(head)
        self._in_body = self.wants_continue = False
        return body

    def _body(self, head: HttpHead) -> Generator[None, None, Body]:
        if "chunked" in head.headers.get("transfer-encoding", "").lower():
            return (yield from self._chunks())
        length = head.headers.get("content-length")
        if length is None:
            if head.start.startswith("HTTP/"):
                # A response without a length extends to the end of the connection.
                while not self._ended:
                    self._check(len(self._buffer))
                    yield None
                return self._take(len(self._buffer))
            return b""
        count = _length(length)
        self._check(count)
        return (yield from self._exactly(count))

    def _chunks(self) -> Generator[None, None, bytearray]:
        body = self._chunked = bytearray()
        while True:
            line = (yield from self._until(_end_of_line)).partition(b";")[0].strip()
            if not re.fullmatch(rb"[0-9A-Fa-f]{1,12}", line):
                raise RpcProtocolError(f"bad chunk size {bytes(line[:20])!r}")
            left = int(line, 16)
            self._check(len(body) + left)
            if not left:
                while (yield from self._until(_end_of_line)):
                    pass
                self._chunked = None
                return body

            # Move a large chunk in pieces, because moving it in one step would block the loop for too long.
            while left:
                if not self._buffer:
                    yield from self._more()
                piece = self._take(min(left, len(self._buffer)))
                body += piece
                left -= len(piece)
            if (yield from self._until(_end_of_line)):
                raise RpcProtocolError("a chunk is longer than its size")

    def _until(self, find: Callable[[bytearray, int], tuple[int, int]]) -> Generator[None, None, bytes]:
        looked = 0
        while (span := find(self._buffer, max(0, looked - 3)))[0] < 0:
            looked = len(self._buffer)
            if looked > _MAX_HEAD:
                raise RpcProtocolError("HTTP header too long")
            if self._ended and self._buffer:
                raise RpcProtocolError("the peer ended inside a message")
            yield None
        at, end = span
        data = self._take(at)
        del self._buffer[: end - at]
        return data

    def _exactly(self, count: int) -> Generator[None, None, Body]:
        while len(self._buffer) < count:
            yield from self._more()
        if len(self._buffer) > 2 * count:
            return self._take(count)
        # Most of the buffer belongs to the body: copy the rest out of the buffer, and return the buffer itself.
        rest = self._buffer[count:]
        del self._buffer[count:]
        whole, self._buffer = self._buffer, rest
        return whole

    def _more(self) -> Generator[None, None, None]:
        """Yield until more data is in the buffer."""
        if self._ended:
            raise RpcProtocolError("the peer ended inside a message")
        yield None

    def _take(self, count: int) -> bytes:
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        return data

    def _check(self, size: int) -> None:
        if size > self._max_body:
            raise RpcProtocolError(
                f"an HTTP body of {size} bytes is over the limit of {self._max_body}", status=413
            )


def _end_of_line(data: bytearray, start: int) -> tuple[int, int]:
    """Return the end of the line at ``start``, and the start of the next line. The end is -1 if the line is incomplete.

    A line feed alone also ends a line, for requests written by hand.
    """
    at = data.find(b"\n", start)
    return _before_return(data, at), at + 1


def _end_of_head(data: bytearray, start: int) -> tuple[int, int]:
    """Return the end of the line before the first empty line, and the position after both; -1 if there is none."""
    # Do not use a regular expression, which would be slow for many short lines.
    found = [(at, len(mark)) for mark in (b"\n\r\n", b"\n\n") if (at := data.find(mark, start)) >= 0]
    if not found:
        return -1, -1
    at, length = min(found)
    return _before_return(data, at), at + length


def _before_return(data: bytearray, at: int) -> int:
    return at - 1 if at > 0 and data[at - 1] == 13 else at


def serialize_request(host: str, path: str, body: bytes) -> bytes:
    """Serialize a POST request with ``body``."""
    return serialize_request_head(host, path, len(body)) + body


def serialize_request_head(host: str, path: str, length: int) -> bytes:
    """Serialize the part of a POST request that precedes its body."""
    head = (
        f"POST {path or '/'} HTTP/1.1\r\nHost: {host}\r\nUser-Agent: minirospy\r\n"
        f"Content-Type: text/xml\r\nContent-Length: {length}\r\n\r\n"
    )
    return head.encode("latin-1", "replace")


def serialize_response(body: bytes, *, keep_alive: bool = True) -> bytes:
    """Serialize a successful response with ``body``."""
    return serialize_response_head(len(body), keep_alive=keep_alive) + body


def serialize_response_head(length: int, *, keep_alive: bool = True) -> bytes:
    """Serialize the part of a successful response that precedes its body of ``length`` bytes."""
    connection = "" if keep_alive else "Connection: close\r\n"
    return (
        f"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n{connection}Content-Length: {length}\r\n\r\n".encode()
    )


def serialize_error(status: int, text: str) -> bytes:
    """Serialize an error response, after which the connection is closed."""
    body = (text + "\n").encode()
    return (
        f"HTTP/1.1 {status} {_REASONS[status]}\r\nContent-Type: text/plain; charset=utf-8\r\n"
        f"Connection: close\r\nContent-Length: {len(body)}\r\n\r\n"
    ).encode() + body


def _parse_head(data: bytes) -> HttpHead:
    # Cache short heads: the heads sent to one server differ only in the length.
    return short_head(data) if len(data) <= _SHORT_HEAD else _read_head(data)


@lru_cache(maxsize=256)
def short_head(data: bytes) -> HttpHead:
    return _read_head(data)


def _read_head(data: bytes) -> HttpHead:
    start, *lines = data.decode("latin-1").replace("\r\n", "\n").split("\n")
    if not _is_start_line(start):
        raise RpcProtocolError(f"not HTTP: {start[:60]!r}")

    headers: dict[str, str] = {}
    for line in lines:
        name, separator, value = line.partition(":")
        # Reject spaces before the colon: a proxy that reads them differently would see another request (request smuggling).
        if not separator or not name or name[-1] in " \t" or name[0] in " \t":
            raise RpcProtocolError(f"not an HTTP header: {line[:60]!r}")
        name, value = name.lower(), value.strip()
        if name == "content-length" and headers.get(name, value) != value:
            raise RpcProtocolError("two Content-Lengths")
        headers[name] = value

    connection = headers.get("connection", "").lower()
    keep_alive = "keep-alive" in connection if "HTTP/1.0" in start else "close" not in connection
    length = headers.get("content-length")
    plain_length = -1
    if length is not None and "transfer-encoding" not in headers and "expect" not in headers:
        plain_length = _length(length)
    return HttpHead(start, headers, start.partition(" ")[0], keep_alive, plain_length)


def _length(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise RpcProtocolError(f"bad Content-Length {text[:20]!r}")
    return int(text)


def _is_start_line(line: str) -> bool:
    if line.startswith("HTTP/"):
        return True
    words = line.split(" ")
    return len(words) == 3 and words[2].startswith("HTTP/1.")
