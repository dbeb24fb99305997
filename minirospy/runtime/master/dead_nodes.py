"""Find the dead nodes, whose ports refuse connections, when a master is nearly full."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Mapping

from minirospy.base.errors import RpcError, RpcUnreachable
from minirospy.core.graph.shares import holder_of
from minirospy.runtime.rpc.async_client import AsyncRpcClient

__all__ = ["find_dead"]

_MAX_CONCURRENT = 50
SILENCE_SECONDS = 3.0


async def find_dead(rpc: AsyncRpcClient, nodes: Mapping[str, str]) -> AsyncIterator[tuple[str, str]]:
    """Yield (name, URI) of each node in ``nodes`` (a dict from name to URI) that refuses connections.

    Connect to each host and port once. A node that does not respond is not reported, because it may be slow, or its network
    may be down.
    """
    names: dict[str, list[str]] = {}
    for name, uri in nodes.items():
        names.setdefault(holder_of(uri), []).append(name)

    holders = list(names)
    for at in range(0, len(holders), _MAX_CONCURRENT):
        some = holders[at : at + _MAX_CONCURRENT]
        found = await asyncio.gather(*(_is_dead(rpc, nodes[names[holder][0]]) for holder in some))
        for holder, is_dead in zip(some, found, strict=True):
            for name in names[holder] if is_dead else ():
                yield name, nodes[name]


async def _is_dead(rpc: AsyncRpcClient, uri: str) -> bool:
    try:
        await rpc.call(uri, "getPid", "/master", timeout=SILENCE_SECONDS)
    except RpcUnreachable as error:
        return isinstance(error.__cause__, ConnectionRefusedError)
    except RpcError:
        pass
    return False
