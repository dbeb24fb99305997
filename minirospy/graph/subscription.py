"""The connection plan of one subscribed topic: which publishers to connect, which to leave, when to retry.

Pure: what happened goes in, what to do comes out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

__all__ = ["Connect", "Disconnect", "SubscriptionPlan"]

_FIRST_DELAY = 0.1
_LONGEST_DELAY = 8.0


@dataclass(frozen=True)
class Connect:
    """Connect to the publisher at ``uri`` (its Slave API) after ``delay`` seconds."""

    uri: str
    delay: float = 0.0


@dataclass(frozen=True)
class Disconnect:
    """Drop the connection to ``uri``."""

    uri: str


class SubscriptionPlan:
    """The publishers that the master named, and how often each has failed.

    A link that ends while the master still names its publisher is tried again, with pauses that double:
    the master tells of a publisher that left, not of a cable that was pulled.
    """

    def __init__(self) -> None:
        self._failures: dict[str, int] = {}

    @property
    def publishers(self) -> tuple[str, ...]:
        """The URIs that the master named last, in its order."""
        return tuple(self._failures)

    def publishers_changed(self, uris: Iterable[str]) -> list[Connect | Disconnect]:
        """The master's full list has come."""
        wanted = dict.fromkeys(uris)
        gone = [uri for uri in self._failures if uri not in wanted]
        new = [uri for uri in wanted if uri not in self._failures]
        self._failures = {uri: self._failures.get(uri, 0) for uri in wanted}
        return [*map(Disconnect, gone), *map(Connect, new)]

    def connected(self, uri: str) -> None:
        """The link to ``uri`` is up: the next failure counts as its first."""
        if uri in self._failures:
            self._failures[uri] = 0

    def lost(self, uri: str) -> Connect | None:
        """The link to ``uri`` could not be made, or ended; None where its publisher has left."""
        if uri not in self._failures:
            return None
        failures = self._failures[uri]
        self._failures[uri] = failures + 1
        return Connect(uri, min(_FIRST_DELAY * 2**failures, _LONGEST_DELAY))
