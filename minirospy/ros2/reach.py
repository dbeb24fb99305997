"""Waits until ROS 2 servers have discovered the bridge's client. Responses may be lost before that. Runs on the node's loop.

A client may discover a server before the server discovers the client's endpoints. Until it does, rmw_fastrtps and
rmw_cyclonedds buffer a response for 100 ms and then drop it. A client is not notified of its discovery, but a response
proves it, so a no-op request is repeated until a response arrives. A process announces its endpoints in the order of
their creation, so the response to a client that was created later shows that earlier endpoints have also been discovered.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.base.errors import BridgeError

if TYPE_CHECKING:
    from minirospy.ros2.interface import Reachable, Ros2Probe

__all__ = ["Reach"]

_LOOK_SECONDS = 0.02
AGAIN_SECONDS, _SLOWEST_SECONDS = 0.5, 8.0
_NO_PROBE_SECONDS = 1.0  # seconds to wait if the servers cannot be probed
MAX_SECONDS = 10.0
"""Maximum seconds to wait for responses to a probe; after that, requests are sent anyway."""


class Reach:
    """Determines which servers have discovered a client and can therefore send it responses."""

    def __init__(self, client: Reachable) -> None:
        self._client = client
        self._reached: frozenset[bytes] | None = None
        self._wanted: frozenset[bytes] = frozenset()
        self._reaching: asyncio.Task[None] | None = None
        self._ready_at: float | None = None
        self._is_closed = False

    def start(self) -> None:
        """Start to probe the existing servers, so that later requests need not wait."""
        if not self._is_closed and (self._reaching is None or self._reaching.done()):
            self._ready_at = None
            self._reaching = asyncio.ensure_future(self._reach())

    async def wait(self, seconds: float = math.inf) -> None:
        """Wait for at most ``seconds`` until the current servers can send responses.

        Wait for ten seconds at most, so that unresponsive servers do not delay every request.
        """
        servers = self._client.servers
        if servers is None or (self._reached is not None and servers <= self._reached):
            return
        self.start()
        # Do not delay queued calls while their link is being closed.
        if self._is_closed or self._reaching is None:
            return
        seconds = min(seconds, MAX_SECONDS)
        if self._ready_at is not None and self._wanted <= servers:
            spent = asyncio.get_running_loop().time() - self._ready_at
            seconds = min(seconds, MAX_SECONDS - spent)
        await asyncio.wait([self._reaching], timeout=max(0.0, seconds))

    async def close(self) -> None:
        """Stop probing, so that pending waits return. Idempotent."""
        self._is_closed = True
        if self._reaching:
            self._reaching.cancel()
            await asyncio.gather(self._reaching, return_exceptions=True)

    async def _reach(self) -> None:
        while True:
            while not self._client.is_ready:
                await asyncio.sleep(_LOOK_SECONDS)
            servers = self._client.servers
            if servers is None or await self._wait_for_servers(servers):
                self._reached = servers
                return

    async def _wait_for_servers(self, servers: frozenset[bytes]) -> bool:
        """Wait until the servers respond to a probe, or for a second if they cannot be probed; then return True.

        Return False if a server disappears first.
        """
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
            # A server may be discovered before its node, so try again.
            await asyncio.sleep(_LOOK_SECONDS)
        return None


async def _answered(probe: Ros2Probe, is_current: Callable[[], bool]) -> bool:
    pause = AGAIN_SECONDS
    # Stop if a server's node has exited, because its services will never become ready.
    while is_current():
        if not probe.is_ready:
            await asyncio.sleep(_LOOK_SECONDS)
            continue
        try:
            await asyncio.wait_for(asyncio.wrap_future(probe.reach()), pause)
        except asyncio.TimeoutError:
            pass
        except BridgeError:
            # Ignore the error: the actual requests will fail with the same error, and report it.
            await asyncio.sleep(pause)
        else:
            return True
        pause = min(2 * pause, _SLOWEST_SECONDS)
    return False
