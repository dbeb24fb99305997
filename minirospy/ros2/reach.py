"""Wait until servers of ROS 2 have found the bridge's client: before, their responses may be lost. On the node's loop.

A server finds the ends of a client later than the client finds the server. Until then rmw_fastrtps and rmw_cyclonedds keep a
response for 100 ms, and drop it. A client is not notified of what a server has found, but a response shows it: a request
without effect is sent until it is answered. A process announces its ends in the order in which they were made, so the answer to a
client that was made later shows that those before were found, too.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from minirospy.base.errors import BridgeError

if TYPE_CHECKING:
    from minirospy.ros2.interface import Ros2Probe

__all__ = ["Reach", "Reachable"]

_LOOK_SECONDS = 0.02
_AGAIN_SECONDS, _SLOWEST_SECONDS = 0.5, 8.0
_NO_PROBE_SECONDS = 1.0
"""The wait for servers that have nothing to be reached by."""
_MAX_SECONDS = 10.0
"""A server that is busy may not have answered yet: it gets the requests all the same."""


class Reachable(Protocol):
    """A client of a service or an action; its methods may be called from any thread."""

    @property
    def is_ready(self) -> bool:
        """Whether a server is connected."""

    @property
    def servers(self) -> frozenset[bytes] | None:
        """The ids of the servers that are there; None if no response can be lost."""

    def probe(self) -> Ros2Probe | None:
        """Return what sends requests without effect to the servers; None if they have nothing for it."""


class Reach:
    """Knows which servers have found a client."""

    def __init__(self, client: Reachable) -> None:
        self._client = client
        self._reached: frozenset[bytes] | None = None
        self._wanted: frozenset[bytes] = frozenset()
        self._reaching: asyncio.Task[None] | None = None
        self._ready_at: float | None = None
        self._is_closed = False

    def start(self) -> None:
        """Reach the servers that are there, so that later requests need not wait."""
        if not self._is_closed and (self._reaching is None or self._reaching.done()):
            self._ready_at = None
            self._reaching = asyncio.ensure_future(self._reach())

    async def wait(self, seconds: float = math.inf) -> None:
        """Return once the responses of the servers of this moment arrive, or after so many seconds.

        That is after ten seconds at most: servers that have not answered by then do not hold up each request.
        """
        servers = self._client.servers
        if servers is None or (self._reached is not None and servers <= self._reached):
            return
        self.start()
        # Calls that were queued go on while what they belong to is being closed.
        if self._is_closed or self._reaching is None:
            return
        seconds = min(seconds, _MAX_SECONDS)
        if self._ready_at is not None and self._wanted <= servers:
            spent = asyncio.get_running_loop().time() - self._ready_at
            seconds = min(seconds, _MAX_SECONDS - spent)
        await asyncio.wait([self._reaching], timeout=max(0.0, seconds))

    async def close(self) -> None:
        """End it; what waits returns. Idempotent."""
        self._is_closed = True
        if self._reaching:
            self._reaching.cancel()
            await asyncio.gather(self._reaching, return_exceptions=True)

    async def _reach(self) -> None:
        while True:
            while not self._client.is_ready:
                await asyncio.sleep(_LOOK_SECONDS)
            servers = self._client.servers
            if servers is None or await self._has_reached(servers):
                self._reached = servers
                return

    async def _has_reached(self, servers: frozenset[bytes]) -> bool:
        """Wait until servers are reached, as far as they can be; return False if one has left before."""
        self._wanted = servers
        probe = await self._probe()
        if probe is None:
            return True
        try:
            return await _answered(probe, lambda: servers <= (self._client.servers or frozenset()))
        finally:
            probe.close()

    async def _probe(self) -> Ros2Probe | None:
        loop = asyncio.get_running_loop()
        self._ready_at = loop.time()
        while loop.time() < self._ready_at + _NO_PROBE_SECONDS:
            probe = self._client.probe()
            if probe:
                return probe
            # Which node a server belongs to may become known later than the server.
            await asyncio.sleep(_LOOK_SECONDS)
        return None


async def _answered(probe: Ros2Probe, is_current: Callable[[], bool]) -> bool:
    pause = _AGAIN_SECONDS
    # The services of a node that has left are never connected again: without this it would be waited for without an end.
    while is_current():
        if not probe.is_ready:
            await asyncio.sleep(_LOOK_SECONDS)
            continue
        try:
            await asyncio.wait_for(asyncio.wrap_future(probe.reach()), pause)
        except asyncio.TimeoutError:
            pass
        except BridgeError:
            # The requests that follow will have the same reason.
            await asyncio.sleep(pause)
        else:
            return True
        pause = min(2 * pause, _SLOWEST_SECONDS)
    return False
