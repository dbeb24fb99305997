"""The connection plan of one subscribed topic: which publishers to connect or disconnect, and when to retry.

Pure: events in, actions out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count, islice

__all__ = ["MAX_PUBLISHERS", "Connect", "Disconnect", "SubscriptionPlan"]

MAX_PUBLISHERS = 1000  # publishers of one topic that a node connects to

# New publishers to connect together, and the seconds between groups, so that not all refusals come together
_CONNECTS_AT_ONCE, _CONNECT_PAUSE = 100, 0.01

_FIRST_DELAY = 0.1
_MAX_DELAY = 8.0


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
    """The publishers in the master's list, and the number of failures of each.

    A link that closes while the master still lists its publisher is retried, with pauses that double: the master reports
    unregistered publishers, but not broken cables. A publisher that refused is called again at the next update of the
    topic, since it may publish another type by then.
    """

    def __init__(self) -> None:
        self._failures: dict[str, int] = {}  # keys are the URIs of the master's last list, in its order
        self._refusals: set[str] = set()

    def publishers_changed(self, uris: Iterable[str], *, keep: bool = False) -> list[Connect | Disconnect]:
        """Apply the master's list: the complete one, or with ``keep`` one that lacks some existing publishers.

        Publishers beyond MAX_PUBLISHERS are ignored, since any process may send a list.
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
        """Return the number of consecutive failures of the link to ``uri``."""
        return self._failures.get(uri, 0)

    def worked(self, uri: str) -> None:
        """Record that the link to ``uri`` works: its next failure counts as the first."""
        if uri in self._failures:
            self._failures[uri] = 0

    def refused(self, uri: str) -> None:
        """Record that the publisher at ``uri`` refuses this subscriber; a retry would get the same answer."""
        if uri in self._failures:
            self._refusals.add(uri)

    def lost(self, uri: str) -> Connect | None:
        """Return the next attempt at ``uri``, whose link failed or closed; None if its publisher has left."""
        if uri not in self._failures:
            return None
        failures = self._failures[uri]
        self._failures[uri] = failures + 1
        return Connect(uri, min(_FIRST_DELAY * 2**failures, _MAX_DELAY))
