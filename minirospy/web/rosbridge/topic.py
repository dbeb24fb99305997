"""A topic that a rosbridge client subscribes to: merges the subscriptions, and sends messages at the requested rate."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError
from minirospy.core.idl.protocols import Message
from minirospy.web.graph import Arrival
from minirospy.web.rosbridge import protocol
from minirospy.web.rosbridge.protocol import StatusLevel
from minirospy.web.rosbridge.subscription import Merged, Pacer, merge

if TYPE_CHECKING:
    from minirospy.web.rosbridge.operation import OperationSession
    from minirospy.web.rosbridge.shared import RosbridgeShared

__all__ = ["MAX_IDS", "ClientTopic"]

MAX_IDS = 100
"""Maximum number of a client's subscriptions to a topic, and of its advertisements of a topic."""


class ClientTopic:
    """A client's single subscription in the graph, which serves all of its subscriptions to a topic."""

    def __init__(self, session: OperationSession, shared: RosbridgeShared, name: str) -> None:
        self.name = name
        self._session = session
        self._shared = shared
        self._topic = shared.graph.node.resolve(name)
        self._subscriptions: dict[object, protocol.Subscribe] = {}
        self._merged: Merged | None = None
        self._pacer: Pacer[Arrival] = Pacer(session.budget, lambda arrival: len(arrival.body))
        self._timer: asyncio.TimerHandle | None = None
        self._reported: set[str] = set()
        self._is_closed = False

    @property
    def is_wanted(self) -> bool:
        """Return whether there are any subscriptions."""
        return bool(self._subscriptions)

    def add(self, event: protocol.Subscribe) -> None:
        """Add a subscription, or replace one with the same id."""
        is_first = not self._subscriptions
        if event.id not in self._subscriptions and len(self._subscriptions) >= MAX_IDS:
            raise BridgeError(f"a client may subscribe to a topic {MAX_IDS} times")
        self._subscriptions[event.id] = event
        self._update()
        self._shared.graph.subscribe(self._topic, self._arrived)
        if not is_first:
            # Subscribing again has delivered the latched messages; keep only the first subscription.
            self._shared.graph.unsubscribe(self._topic, self._arrived)

    def remove(self, id_: object) -> None:
        """Remove a subscription, or all subscriptions if ``id_`` is None."""
        if id_ is None:
            self._subscriptions.clear()
        else:
            self._subscriptions.pop(id_, None)
        if self._subscriptions:
            self._update()

    def close(self) -> None:
        """Unsubscribe from the topic."""
        self._is_closed = True
        self._shared.graph.unsubscribe(self._topic, self._arrived)
        self._shared.forget_topic(self.name)
        self._session.client.discard(self.name)
        self._pacer.clear()
        if self._timer:
            self._timer.cancel()

    def _update(self) -> None:
        self._merged = merge(self._subscriptions.values())
        self._pacer.set(self._merged.throttle, self._merged.queue_length)

    def _arrived(self, arrival: Arrival) -> None:
        now = asyncio.get_running_loop().time()
        if self._pacer.arrived(arrival, now):
            self._send(arrival)
            return
        self._session.count()
        if self._timer is None:
            self._wait()

    def _wait(self) -> None:
        due = self._pacer.due
        loop = asyncio.get_running_loop()
        self._timer = loop.call_at(due, self._is_due) if due is not None else None

    def _is_due(self) -> None:
        arrival = self._pacer.next(asyncio.get_running_loop().time())
        if arrival:
            self._session.count()
            self._send(arrival)
        self._wait()

    def _send(self, arrival: Arrival) -> None:
        # Encode only in the client's turn, because a large message takes milliseconds to encode and fragment.
        self._session.client.in_turn(lambda: self._send_now(arrival), arrival.body)

    def _send_now(self, arrival: Arrival) -> None:
        if not self._subscriptions or self._is_closed:
            return
        assert self._merged
        compression = self._merged.compression
        try:
            class_ = None if compression == "cbor-raw" else self._shared.class_of(arrival)
            if not self._shared.is_quick(arrival.body, compression, class_._type if class_ else ""):
                self._session.client.hold_work(is_held=True)
                self._session.spawn(self._send_large(arrival, class_, self._merged))
                return
            data = self._shared.encoded(self.name, class_, arrival, compression)
        except BridgeError as error:
            self._report(error)
            return
        size = self._fragment_size(self._merged, data)
        self._queue(data, self._fragments(data, size, arrival) if size else None, self._merged)

    async def _send_large(self, arrival: Arrival, class_: type[Message] | None, merged: Merged) -> None:
        """Send a message that is slow to encode. The session's other messages wait until it has been sent."""
        try:
            data = await self._shared.encoded_large(self.name, class_, arrival, merged.compression)
            size = self._fragment_size(merged, data)
            texts = await self._shared.encode(lambda: self._fragments(data, size, arrival)) if size else None
            if not self._is_closed:
                self._queue(data, texts, merged)
        except BridgeError as error:
            self._report(error)
        finally:
            self._session.client.hold_work(is_held=False)

    def _fragment_size(self, merged: Merged, data: bytes) -> int | None:
        """Return the fragment size in characters for a message, or None to send it whole."""
        size = merged.fragment_size or self._shared.options.fragment_size
        is_cut = size and len(data) > size and not merged.compression.startswith("cbor")
        return size if is_cut else None

    def _fragments(self, data: bytes, size: int, arrival: Arrival) -> list[str]:
        return protocol.fragments(data.decode(), size, f"publish:{self.name}:{arrival.nanoseconds}")

    def _queue(self, data: bytes, texts: list[str] | None, merged: Merged) -> None:
        client, newest_only = self._session.client, merged.queue_length == 1
        if merged.compression.startswith("cbor"):
            client.send_message(self.name, b"", data, newest_only=newest_only)
        elif texts is not None:
            client.send_texts(self.name, texts, newest_only=newest_only)
        else:
            client.send_text_message(self.name, data, newest_only=newest_only)

    def _report(self, error: BridgeError) -> None:
        if str(error) not in self._reported and len(self._reported) < 10:
            self._reported.add(str(error))
            self._session.status(StatusLevel.ERROR, f"subscribe: {error}")
