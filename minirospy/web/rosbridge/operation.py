"""Common parts of the handlers for clients' operations: their view of the session, results, limits, and the errors to report."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from minirospy.base.errors import (
    BridgeError,
    MessageException,
    MinirospyError,
    ROSSerializationException,
    ServiceException,
)
from minirospy.introspect.graph import why_illegal

if TYPE_CHECKING:
    from minirospy.web.graph import SharedGraph
    from minirospy.web.rosbridge.protocol import StatusLevel
    from minirospy.web.rosbridge.shared import RosbridgeShared
    from minirospy.web.rosbridge.subscription import Budget
    from minirospy.web.server.client import WebClient

__all__ = [
    "MAX_TOPICS",
    "MAX_WAITING_BYTES",
    "REFUSALS",
    "OperationSession",
    "Work",
    "check_name",
    "type_conflict",
]

# maximum number of topics that a client may publish, and of topics that it may subscribe to
MAX_TOPICS = 1000
# maximum size in bytes, per client, of operations queued behind a blocked one, and of latched messages
MAX_WAITING_BYTES = 64_000_000

REFUSALS = (MinirospyError, ServiceException, ROSSerializationException, MessageException)
"""Exceptions that are reported to the client if an operation raises them."""

Work = Coroutine[object, object, None]
"""The remaining work of an operation that must wait, for example for the graph."""


class OperationSession(Protocol):
    """The interface of a client's session that the handlers of its operations use."""

    @property
    def client(self) -> WebClient: ...

    @property
    def shared(self) -> RosbridgeShared: ...

    @property
    def graph(self) -> SharedGraph: ...

    @property
    def budget(self) -> Budget:
        """Return the byte budget for topics whose message rate the client limits."""

    @property
    def operation_size(self) -> int:
        """Return the memory that the current operation uses, in bytes."""

    @property
    def is_large(self) -> bool:
        """Return whether the current operation is so large that its ROS message must be created in a thread."""

    def send(self, fields: Mapping[str, object]) -> None:
        """Send a message that is not about a topic."""

    def send_encoded(self, messages: Sequence[str | bytes]) -> None:
        """Send messages that are already encoded as JSON or CBOR."""

    def status(self, level: StatusLevel, text: str, id_: object = None) -> None:
        """Send a status message if the client has requested messages of this level."""

    def count(self) -> None:
        """Count this client's memory towards the server's budget."""

    def spawn(self, work: Work) -> asyncio.Task[None]:
        """Start a task that is cancelled when the session ends."""

    async def type_of(self, topic: str) -> str:
        """Return the type of a topic in the graph. Raise BridgeError if the topic has no type."""

    def is_allowed(self, kind: str, name: str, what: str) -> bool:
        """Return whether the globs allow a name; if not, send rosbridge's warning."""

    def require_write(self, what: str) -> None:
        """Raise BridgeError if the token is read-only. ``what`` describes the refused operation."""


def check_name(kind: str, name: str) -> None:
    """Raise BridgeError if ``name`` is not a legal name of this kind."""
    why = why_illegal(name)
    if why:
        raise BridgeError(f"{kind} [{name[:200]}]: {why}")


def type_conflict(topic: str, wanted: str, known: str) -> BridgeError:
    """Return the error, in rosbridge's words, for a topic that has another type in the graph."""
    return BridgeError(
        f"Tried to register topic {topic} with type {wanted} but it is already established with type {known}"
    )
