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

# maximum number of topics that one client may publish, and maximum number that it may subscribe to
MAX_TOPICS = 1000
# Maximum per client: bytes of operations queued behind a blocked one, and bytes of latched messages
MAX_WAITING_BYTES = 64_000_000

REFUSALS = (MinirospyError, ServiceException, ROSSerializationException, MessageException)
"""Exceptions raised by an operation that are reported to the client."""

Work = Coroutine[object, object, None]
"""The remaining work of an operation that must wait, for example for the graph."""


class OperationSession(Protocol):
    """The session of the client whose operation is being executed, as the handlers see it."""

    @property
    def client(self) -> WebClient: ...

    @property
    def shared(self) -> RosbridgeShared: ...

    @property
    def graph(self) -> SharedGraph: ...

    @property
    def budget(self) -> Budget:
        """Return the byte budget for messages on topics whose rate the client limits."""

    @property
    def operation_size(self) -> int:
        """Return the memory, in bytes, used by the current operation."""

    @property
    def is_large(self) -> bool:
        """Return whether the current operation's message is large enough to create the ROS message in a thread."""

    def send(self, fields: Mapping[str, object]) -> None:
        """Send a message that does not belong to a topic."""

    def send_encoded(self, messages: Sequence[str | bytes]) -> None:
        """Send messages that are already JSON or CBOR."""

    def status(self, level: StatusLevel, text: str, id_: object = None) -> None:
        """Send a status message, if the client has requested this level."""

    def count(self) -> None:
        """Charge this client's memory use to the server's budget."""

    def spawn(self, work: Work) -> asyncio.Task[None]:
        """Start a task; it is cancelled when the session ends."""

    async def type_of(self, topic: str) -> str:
        """Return a topic's type in the graph. Raise BridgeError if it has none."""

    def is_allowed(self, kind: str, name: str, what: str) -> bool:
        """Return whether a name matches the globs; if not, send a warning with rosbridge's message."""

    def require_write(self, what: str) -> None:
        """Raise BridgeError if the client's token is read-only."""


def check_name(kind: str, name: str) -> None:
    """Raise BridgeError if ``name`` is not a legal name of this kind."""
    why = why_illegal(name)
    if why:
        raise BridgeError(f"{kind} [{name[:200]}]: {why}")


def type_conflict(topic: str, wanted: str, known: str) -> BridgeError:
    """Return the error for a topic that has another type in the graph, with rosbridge's message."""
    return BridgeError(
        f"Tried to register topic {topic} with type {wanted} but it is already established with type {known}"
    )
