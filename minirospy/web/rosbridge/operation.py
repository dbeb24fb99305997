"""Common parts of the handlers for clients' operations: results, limits and errors to report."""

from __future__ import annotations

from collections.abc import Coroutine

from minirospy.base.errors import (
    BridgeError,
    MessageException,
    MinirospyError,
    ROSSerializationException,
    ServiceException,
)
from minirospy.introspect.graph import why_illegal

__all__ = ["MAX_TOPICS", "MAX_WAITING_BYTES", "REFUSALS", "Work", "check_name", "type_conflict"]

MAX_TOPICS = 1000  # maximum topics that one client publishes, and maximum topics that it subscribes to
# Per client: maximum bytes of operations queued behind a blocked one, and also of latched messages
MAX_WAITING_BYTES = 64_000_000

REFUSALS = (MinirospyError, ServiceException, ROSSerializationException, MessageException)
"""Exceptions in an operation that are reported to the client."""

Work = Coroutine[object, object, None]
"""The rest of an operation that must wait for something."""


def check_name(kind: str, name: str) -> None:
    """Raise BridgeError if a name of this kind is not legal."""
    why = why_illegal(name)
    if why:
        raise BridgeError(f"{kind} [{name[:200]}]: {why}")


def type_conflict(topic: str, wanted: str, known: str) -> BridgeError:
    """Return the error for a topic that has another type in the graph, with rosbridge's message."""
    return BridgeError(
        f"Tried to register topic {topic} with type {wanted} but it is already established with type {known}"
    )
