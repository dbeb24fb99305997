"""Clients and servers of ROS 2 services over Zenoh. A request is a query; its response is the query's reply.

Callbacks from Zenoh, and therefore the futures' callbacks, run in Zenoh's threads.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import logging
import struct
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, InvalidStateError
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError, DeserializationError, MinirospyError
from minirospy.base.escape import escaped
from minirospy.core.idl.cdr import CDR_HEADER
from minirospy.core.idl.type_hash import Fields
from minirospy.ros2.zenoh_keys import Kind, reply_attachment
from minirospy.ros2.zenoh_node import Handle, ZenohNode

if TYPE_CHECKING:
    from minirospy.ros2.zenoh_keys import Entity
    from minirospy.zenoh.library import Query, Reply

__all__ = ["MAX_UNDER_WAY", "ZenohClient", "ZenohServer"]

_log = logging.getLogger(__name__)

MAX_BYTES = 64 << 20
# maximum number of pending requests to a service, including those whose response has not been written yet
MAX_UNDER_WAY = 200
_MAX_OF_ACTION = 2_000
"""Maximum number of pending requests to an action.

This limit exceeds the number of goals, because a request for a result waits until its goal has ended.
"""
_MAX_SECONDS = 10_000_000
"""Timeout in seconds, practically unlimited: the bridge has its own timeouts, and Zenoh must not time out long goals."""


class ZenohClient:
    """A client for a service. Methods may be called from any thread."""

    def __init__(self, node: ZenohNode, end: Entity) -> None:
        self._node = node
        self._end = end
        # Send requests in a thread, because sending may block for seconds on a slow network and must not block the loop.
        self._requests = concurrent.futures.ThreadPoolExecutor(1, "zenoh-requests")
        self._handle = Handle(node, end)

    @property
    def is_ready(self) -> bool:
        """Return whether there is a server."""
        servers = self._node.graph.of_name(self._end.name, Kind.SERVICE)
        return any(each.key == self._end.key for each in servers)

    @property
    def servers(self) -> None:
        """Return None, because no response can be lost.

        A response takes the same route as its request, and the tokens prove that the route exists.
        """

    def probe(self) -> None:
        """Return None, because no response can be lost, so no probe is needed."""

    def call(self, request: bytes) -> Future[bytes]:
        """Send a request as CDR; return a future for the response as CDR. The future may fail with BridgeError."""
        answered: Future[bytes] = Future()
        name = self._end.name

        def arrived(reply: Reply) -> None:
            if reply.ok is not None and len(reply.ok.payload) <= MAX_BYTES:
                with contextlib.suppress(InvalidStateError):
                    answered.set_result(reply.ok.payload.to_bytes())
            elif reply.err is not None:
                text = escaped(reply.err.payload.to_bytes()[:500].decode(errors="replace"))
                _fail(answered, f"service [{name}] of ROS 2: {text}")
            else:
                _fail(answered, f"the response of service [{name}] has more than {MAX_BYTES} bytes")

        def ended() -> None:
            _fail(answered, f"service [{name}] of ROS 2 has ended without a response")

        library = self._node.zenoh
        attachment = self._handle.attachment()

        def send() -> None:
            if answered.cancelled():
                return
            try:
                self._node.session.get(
                    self._end.key,
                    self._node.handler(arrived, ended),
                    payload=request,
                    attachment=attachment,
                    target=library.QueryTarget.ALL_COMPLETE,
                    consolidation=library.ConsolidationMode.NONE,
                    timeout=_MAX_SECONDS,
                )
            except library.ZError as error:
                _fail(answered, f"service [{name}] of ROS 2: {escaped(str(error))}")

        try:
            self._requests.submit(send)
        except RuntimeError:
            _fail(answered, f"the bridge no longer calls service [{name}] of ROS 2")
        return answered

    def close(self) -> None:
        """Close the client. Idempotent."""
        self._handle.close()
        self._requests.shutdown(wait=False)


class ZenohServer:
    """A service that the bridge offers in ROS 2.

    ``answer`` takes a request's CDR and returns a future for the response's CDR. If the future raises MinirospyError, the
    call fails. The reason is sent in the response if the response has a field for it, otherwise as the query's error,
    which rmw_zenoh logs. ``thread`` is the executor that sends replies, by default a separate one.
    """

    def __init__(
        self,
        node: ZenohNode,
        end: Entity,
        response: Fields,
        answer: Callable[[bytes], Future[bytes]],
        thread: concurrent.futures.ThreadPoolExecutor | None = None,
    ) -> None:
        self._node = node
        self._end = end
        self._response = list(response.values())
        self._answer = answer
        self._under_way = 0
        self._lock = threading.Lock()
        self._most = MAX_UNDER_WAY if thread is None else _MAX_OF_ACTION
        # Send replies in a thread, because sending may block on a slow network.
        self._replies = thread or concurrent.futures.ThreadPoolExecutor(1, "zenoh-replies")
        self._own = None if thread else self._replies
        handler = node.handler(self._arrived)
        queryable = node.session.declare_queryable(end.key, handler, complete=True)
        self._handle = Handle(node, end, queryable)

    def close(self) -> None:
        """Close the service. Idempotent."""
        self._handle.close()
        if self._own:
            self._own.shutdown(wait=False)

    def _arrived(self, query: Query) -> None:
        with self._lock:
            has_room = self._under_way < self._most
            self._under_way += has_room
        if not has_room:
            self._refuse(query, f"the bridge is answering {self._most} other requests")
        elif self._own:
            self._take(query)
        else:
            try:
                self._replies.submit(self._take, query)
            except RuntimeError:
                self._done()
                query.drop()  # the action is closed

    def _take(self, query: Query) -> None:
        try:
            if query.payload is None or query.attachment is None or len(query.payload) > MAX_BYTES:
                raise ValueError("this is not a request of rmw_zenoh, or too large")
            back = reply_attachment(query.attachment.to_bytes(), time.time_ns())
            answered = self._answer(query.payload.to_bytes())
        except (DeserializationError, ValueError, RuntimeError) as error:
            self._done()
            # RuntimeError: the loop has been closed.
            self._refuse(query, "the bridge has ended" if isinstance(error, RuntimeError) else str(error))
            return

        def finished(_: object) -> None:
            try:
                self._replies.submit(self._finish, query, back, answered)
            except RuntimeError:
                self._done()
                query.drop()  # the service is closed

        answered.add_done_callback(finished)

    def _finish(self, query: Query, back: bytes, answered: Future[bytes]) -> None:
        # Count a request until its response has been written: responses waiting for a slow network take memory.
        try:
            self._reply(query, back, answered)
        finally:
            self._done()

    def _reply(self, query: Query, back: bytes, answered: Future[bytes]) -> None:
        try:
            data = answered.result()
        except (MinirospyError, DeserializationError) as error:
            reason = " ".join(str(error).split())
            _log.error("service [%s] of ROS 1: %s", self._end.name, reason)
            if self._response != ["bool", "string"]:
                # Send an error, because a response of zeros would look valid.
                self._refuse(query, reason)
                return
            # The response is a bool and a string, as in SetBool and Trigger: send False, then the reason as the string.
            text = reason.encode() + b"\0"
            data = CDR_HEADER + bytes(4) + struct.pack("<I", len(text)) + text
        except concurrent.futures.CancelledError:
            self._refuse(query, "the bridge has ended")
            return
        with contextlib.suppress(self._node.zenoh.ZError):
            query.reply(self._end.key, data, attachment=back)
        query.drop()

    def _refuse(self, query: Query, reason: str) -> None:
        with contextlib.suppress(self._node.zenoh.ZError):
            query.reply_err(reason.encode())
        query.drop()

    def _done(self) -> None:
        with self._lock:
            self._under_way -= 1


def _fail(future: Future[bytes], reason: str) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_exception(BridgeError(reason))
