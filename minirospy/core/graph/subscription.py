"""The connection plan for one subscribed topic: which publishers to connect or disconnect, and when to retry.

Pure: methods take events and return actions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count, islice

__all__ = ["MAX_PUBLISHERS", "Connect", "Disconnect", "SubscriptionPlan"]

MAX_PUBLISHERS = 1000  # maximum publishers of one topic that a node connects to

# Connect to new publishers in groups of this size, with this pause in seconds, so that any refusals are spread out
_CONNECTS_AT_ONCE, _CONNECT_PAUSE = 100, 0.01

FIRST_DELAY = 0.1
_MAX_DELAY = 8.0


@dataclass(frozen=True)
class Connect:
    """An instruction to connect, after ``delay`` seconds, to the publisher whose Slave API is at ``uri``."""

    uri: str
    delay: float = 0.0


@dataclass(frozen=True)
class Disconnect:
    """An instruction to drop the connection to the publisher at ``uri``."""

    uri: str


class SubscriptionPlan:
    """The publishers in the master's list, each with its number of failures.

    If a link closes while the master still lists the publisher, the node reconnects, with pauses that double: the master
    reports unregistered publishers, but not broken cables. A publisher that refused the connection is called again when the
    topic's publishers next change, because it may publish another type by then.
    """

    def __init__(self) -> None:
        # keyed by URI, in the order of the master's last list
        self._failures: dict[str, int] = {}
        self._refusals: set[str] = set()

    def publishers_changed(self, uris: Iterable[str], *, keep: bool = False) -> list[Connect | Disconnect]:
        """Apply the master's list of publishers. If ``keep`` is set, keep connections to publishers that the list lacks.

        Publishers beyond MAX_PUBLISHERS are ignored, because any process may send a list.
        """
        wanted = dict.fromkeys(islice(uris, MAX_PUBLISHERS))
        if keep:
            wanted.update(dict.fromkeys(self._failures))
        gone = [uri for uri in self._failures if uri not in wanted]
        new = [uri for uri in wanted if uri not in self._failures or uri in self._refusals]
        self._refusals.clear()
        self._failures = {uri: self._failures.get(uri, 0) for uri in wanted}
        delays = (number // _CONNECTS_AT_ONCE * _CONNECT_PAUSE for number in count())
        return [*map(Disconnect, gone), *map(Connect, new, delays)]

    def failures(self, uri: str) -> int:
        """Return how many times in a row the link to ``uri`` has failed."""
        return self._failures.get(uri, 0)

    def worked(self, uri: str) -> None:
        """Record that the link to ``uri`` works, so that its next failure counts as the first."""
        if uri in self._failures:
            self._failures[uri] = 0

    def refused(self, uri: str) -> None:
        """Record that the publisher at ``uri`` refused this subscriber, and that retrying would not help."""
        if uri in self._failures:
            self._refusals.add(uri)

    def lost(self, uri: str) -> Connect | None:
        """Return the next attempt to connect to ``uri``, whose link has closed, or None if the publisher is no longer listed."""
        if uri not in self._failures:
            return None
        failures = self._failures[uri]
        self._failures[uri] = failures + 1
        return Connect(uri, min(FIRST_DELAY * 2**failures, _MAX_DELAY))
