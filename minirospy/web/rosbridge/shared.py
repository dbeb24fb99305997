"""The state shared by all clients of the rosbridge server: the services that they offer, encoded messages, and threads."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from minirospy.base.errors import BridgeError
from minirospy.core.idl.protocols import Message
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger
from minirospy.web.graph import Arrival, Publication, SharedGraph
from minirospy.web.json_text import dump_json, dump_json_in_pieces
from minirospy.web.rosbridge import conversion, png
from minirospy.web.rosbridge.cbor import encode_cbor
from minirospy.web.rosbridge.services import ClientService
from minirospy.web.rosbridge.types import ArrivingTypes

__all__ = ["RosbridgeOptions", "RosbridgeShared", "encode_arrival"]

_LOG_LINES = 20

# maximum size in bytes of a message that is encoded on the loop: 8,000 numbers take 8 ms
_MAX_QUICK_BODY = 64 * 1024
# maximum size in bytes of an image that is encoded on the loop: base64 takes 3 ms
_MAX_QUICK_IMAGE = 1024 * 1024
_IMAGES = {
    "sensor_msgs/Image",
    "sensor_msgs/CompressedImage",
}  # types whose only array is ``data``, which is sent as base64 or as a typed array

_T = TypeVar("_T")


@dataclass(frozen=True)
class RosbridgeOptions:
    """Options of the rosbridge server. ``fragment_timeout`` and ``unregister_timeout`` are in seconds.

    ``fragment_size`` is the maximum number of characters in a message to clients; None disables fragments.
    """

    fragment_timeout: float = 600.0
    unregister_timeout: float = 10.0
    fragment_size: int | None = None
    authenticate: bool = False


class _LargeWork:
    """Processes large messages in a single thread, one at a time."""

    def __init__(self, name: str) -> None:
        self._name = name  # name of the thread
        self._thread: ThreadPoolExecutor | None = None  # created when it is first needed
        self._is_busy = asyncio.Lock()
        self._is_closed = False

    async def __call__(self, work: Callable[[], _T]) -> _T:
        """Run ``work`` in the thread; return its result."""
        # Wait here, not in the executor's queue, so that the work's message is freed at once if the client leaves.
        async with self._is_busy:
            if self._is_closed:
                raise asyncio.CancelledError
            if self._thread is None:
                self._thread = ThreadPoolExecutor(1, self._name)
            return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    def close(self) -> None:
        """Stop the thread after the work in progress, and cancel waiting work. Idempotent."""
        self._is_closed = True
        if self._thread:
            self._thread.shutdown(wait=False, cancel_futures=True)
            self._thread = None


class RosbridgeShared:
    """The state shared by the sessions of all clients. Used on the loop."""

    def __init__(self, graph: SharedGraph, options: RosbridgeOptions | None = None) -> None:
        self.graph = graph
        self.options = options or RosbridgeOptions()
        self.services: dict[str, ClientService] = {}
        """The services that clients offer, keyed by name."""
        self.log = RateLimitedLogger(logging.getLogger(graph.node.log.name), _LOG_LINES)

        self.in_thread = _LargeWork("rosbridge-large")
        """Runs work on large messages from clients, one at a time."""
        self.encode = _LargeWork("rosbridge-encode")
        """Runs work on large messages to clients."""
        self._closing: dict[str, asyncio.Task[None]] = {}
        self._types = ArrivingTypes()
        self._encoded: dict[str, tuple[Arrival, dict[str, bytes]]] = {}

    def close(self) -> None:
        """Stop the threads after the work in progress. Idempotent."""
        self.in_thread.close()
        self.encode.close()

    def forget_messages(self) -> None:
        """Discard the cached encodings of all topics."""
        self._encoded.clear()

    def release(self, publication: Publication) -> None:
        """Release a publication after a delay, so that clients can advertise its topic again in the meantime."""
        asyncio.get_running_loop().call_later(self.options.unregister_timeout, publication.close)

    def close_service(self, service: ClientService, why: str) -> asyncio.Task[None]:
        """Start to close a client's service; return the task that closes it."""
        name = service.name
        del self.services[name]
        task = self._closing[name] = self.graph.spawn(service.close(why))
        task.add_done_callback(lambda _: self._closing.pop(name))
        return task

    async def free_service(self, name: str, why: str) -> None:
        """Close the service that a client offers under this name; wait until the name is free."""
        while name in self.services or name in self._closing:
            if name in self.services:
                self.close_service(self.services[name], why)
            await asyncio.wait([self._closing[name]])

    def forget_topic(self, topic: str) -> None:
        """Discard the cached encodings of a topic's last message."""
        self._encoded.pop(topic, None)

    def class_of(self, arrival: Arrival) -> type[Message] | None:
        """Return the class of a received message, or None if its definition is not known."""
        return self._types.of(arrival.header)

    @staticmethod
    def is_quick(body: bytes | memoryview, compression: str = "none", type_: str = "") -> bool:
        """Return whether encoding a message takes only a few milliseconds."""
        if type_ in _IMAGES and compression != "png":
            return len(body) <= _MAX_QUICK_IMAGE
        return len(body) <= _MAX_QUICK_BODY or compression == "cbor-raw"

    def encoded(self, topic: str, class_: type[Message] | None, arrival: Arrival, compression: str) -> bytes:
        """Return a message encoded for clients.

        Each message is encoded once for all of them. Raise BridgeError if it cannot be encoded.
        """
        found = self._encodings(topic, arrival)
        made = found.get(compression)
        if made is None:
            made = found[compression] = encode_arrival(topic, class_, arrival, compression, dump_json)
        return made

    async def encoded_large(
        self, topic: str, class_: type[Message] | None, arrival: Arrival, compression: str
    ) -> bytes:
        """Return an encoded message like :meth:`encoded`, but encode it in a thread, so that only its receivers wait."""
        found = self._encodings(topic, arrival)

        def encode() -> bytes:
            # The message may have been encoded for another client meanwhile.
            return found.get(compression) or encode_arrival(
                topic, class_, arrival, compression, dump_json_in_pieces
            )

        if compression not in found:
            found[compression] = await self.encode(encode)
        return found[compression]

    def _encodings(self, topic: str, arrival: Arrival) -> dict[str, bytes]:
        """Return the cached encodings of a message, keyed by compression."""
        known = self._encoded.get(topic)
        if known is None or known[0] is not arrival:
            known = self._encoded[topic] = arrival, {}
        return known[1]


def encode_arrival(
    topic: str,
    class_: type[Message] | None,
    arrival: Arrival,
    compression: str,
    dump: Callable[[object], str],
) -> bytes:
    """Encode a message for clients. ``dump`` encodes JSON. Raise BridgeError if the message cannot be encoded."""
    if compression == "cbor-raw":
        secs, nsecs = divmod(arrival.nanoseconds, 1_000_000_000)
        raw = {"secs": secs, "nsecs": nsecs, "bytes": bytes(arrival.body)}
        return encode_cbor({"op": "publish", "topic": topic, "msg": raw})

    message = _message(topic, class_, arrival)
    if compression == "cbor":
        return encode_cbor({"op": "publish", "topic": topic, "msg": conversion.cbor_values(message)})
    fields = {"op": "publish", "topic": topic, "msg": conversion.values(message)}
    text = dump(fields)
    if compression == "png":
        text = dump({"op": "png", "data": png.encode(text)})
    return text.encode()


def _message(topic: str, class_: type[Message] | None, arrival: Arrival) -> Message:
    if class_ is None:
        raise BridgeError(
            f"messages of [{topic}] are of type [{arrival.header.get('type')}], which is not installed here"
        )
    message = class_()
    try:
        message.deserialize(bytes(arrival.body))
    except Exception as error:  # third-party message classes may raise any exception on invalid bytes
        raise BridgeError(f"a message of [{topic}] does not fit [{message._type}]: {error}") from error
    return message
