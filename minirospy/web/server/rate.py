"""Limit the number of new connections from each address, with a token bucket per address. Pure."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

__all__ = ["MAX_ADDRESSES", "ConnectionRate"]

MAX_ADDRESSES = 1000
"""Maximum number of stored addresses; above it, the address that has not connected for the longest time is forgotten."""


class _Bucket(NamedTuple):
    tokens: float
    since: float


class ConnectionRate:
    """Limits the rate of new connections from each address."""

    def __init__(self, a_second: float, burst: int, clock: Callable[[], float]) -> None:
        """Create the limiter. It admits ``a_second`` connections per second and address, after an initial burst.

        ``burst``: number of connections that an address may open at the same time; ``clock`` returns seconds.
        """
        self._a_second = a_second
        self._burst = burst
        self._clock = clock
        self._buckets: OrderedDict[str, _Bucket] = OrderedDict()

    def __len__(self) -> int:
        """Return the number of stored addresses."""
        return len(self._buckets)

    def admits(self, address: str) -> bool:
        """Count a connection from an address; return whether it is allowed now."""
        now = self._clock()
        tokens, since = self._buckets.pop(address, _Bucket(self._burst, now))
        tokens = min(self._burst, tokens + (now - since) * self._a_second)
        is_admitted = tokens >= 1
        self._buckets[address] = _Bucket(tokens - is_admitted, now)

        if len(self._buckets) > MAX_ADDRESSES:
            self._buckets.popitem(last=False)
        return is_admitted
