"""A fleet router: a Zenoh session that forwards traffic until Ctrl-C or SIGTERM."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable

from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.fleet.network import FleetNetwork, NetworkOptions
from minirospy.runtime.transport.loop import new_event_loop

__all__ = ["run_router"]

_TICK_SECONDS = 0.5


def run_router(options: NetworkOptions, report: Callable[[str], object]) -> int:
    """Run a router; return its exit status. Call ``report`` with a line that lists its endpoints.

    Raise BridgeError if the router cannot listen.
    """
    loop = new_event_loop()
    try:
        return loop.run_until_complete(_run(options, report))
    finally:
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()


async def _run(options: NetworkOptions, report: Callable[[str], object]) -> int:
    loop = asyncio.get_running_loop()
    ended = asyncio.Event()
    before = {
        number: signal.signal(number, lambda *_: loop.call_soon_threadsafe(ended.set))
        for number in (*interrupt_signals(), signal.SIGTERM)
    }
    try:
        network = await FleetNetwork.open(options)
        report(f"router of the fleet at {', '.join(options.listen) or options.config}")
        # On Windows, Python handles signals only when the loop wakes up, so wake it periodically.
        while not ended.is_set():
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(ended.wait(), _TICK_SECONDS)
        await network.close()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return 0
