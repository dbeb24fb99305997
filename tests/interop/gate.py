"""A TCP port that forwards to a bridge, which may be replaced while its clients reconnect to the same address."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from typing import Any

from minirospy import Node
from minirospy.web.bridge import Bridge, BridgeOptions

__all__ = ["Gate", "serving"]


class Gate:
    """A port that stays open. ``target`` is the server's port, or None while there is no server. Use it with ``async with``."""

    def __init__(self) -> None:
        self.port = 0
        self.target: int | None = None
        self._server: asyncio.Server | None = None
        self._connections: set[asyncio.Task[None]] = set()

    async def __aenter__(self) -> Gate:
        self._server = await asyncio.start_server(self._connected, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]
        return self

    async def __aexit__(self, *_: object) -> None:
        assert self._server
        self._server.close()
        for task in self._connections:
            task.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task
        self._connections.add(task)
        try:
            with contextlib.suppress(OSError, asyncio.CancelledError):
                if self.target is not None:
                    await _join(reader, writer, self.target)
        finally:
            self._connections.discard(task)
            writer.close()


@contextlib.asynccontextmanager
async def serving(gate: Gate, endpoint: str, **options: Any) -> AsyncIterator[Bridge]:
    """Run a bridge whose ``endpoint`` is behind the gate."""
    async with Node("bridge", rosout=False) as node:
        bridge = Bridge(node, BridgeOptions(foxglove_port=0, rosbridge_port=0, diagnostics=False, **options))
        try:
            await bridge.start()
            gate.target = bridge.listeners[endpoint].port
            yield bridge
        finally:
            gate.target = None
            await bridge.close()


async def _join(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
    """Forward bytes in both directions until one connection is closed."""
    inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", port)
    ways = [
        asyncio.ensure_future(_pass(reader, inner_writer)),
        asyncio.ensure_future(_pass(inner_reader, writer)),
    ]
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
        inner_writer.close()


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(1 << 16):
        writer.write(data)
        await writer.drain()
