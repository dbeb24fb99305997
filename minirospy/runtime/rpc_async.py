"""An XML-RPC client on the event loop."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections import defaultdict
from typing import Any

from minirospy.errors import RpcProtocolError, RpcUnreachable
from minirospy.runtime.rpc_client import parse_http_uri
from minirospy.wire.http import HttpMessage, HttpReader, serialize_request
from minirospy.wire.xmlrpc import parse_response, serialize_call

__all__ = ["AsyncRpcClient"]

_RECEIVE = 65536
_KEEP_PER_SERVER = 2


class AsyncRpcClient:
    """Calls methods of any server; a few connections to each are kept and reused."""

    def __init__(self) -> None:
        self._idle: dict[tuple[str, int], list[socket.socket]] = defaultdict(list)
        self._closed = False

    async def call(self, uri: str, method: str, *args: Any, timeout: float = 5.0) -> Any:
        """The value that ``method`` at ``uri`` answers, within ``timeout`` seconds.

        Raises RpcUnreachable, RpcFault, or RpcProtocolError.
        """
        host, port, path = parse_http_uri(uri)
        request = serialize_request(f"{host}:{port}", path, serialize_call(method, args))
        try:
            message = await asyncio.wait_for(self._exchange((host, port), request), timeout)
        except asyncio.TimeoutError as error:
            raise RpcUnreachable(uri, f"timed out after {timeout:g} s") from error
        except (OSError, EOFError) as error:
            raise RpcUnreachable(uri, str(error) or "the connection was closed") from error
        if message.status != 200:
            raise RpcProtocolError(f"{uri} answered {message.start}")
        return parse_response(message.body)

    async def close(self) -> None:
        """Close the kept connections. Idempotent."""
        self._closed = True
        for socks in self._idle.values():
            for sock in socks:
                sock.close()
        self._idle.clear()

    async def _exchange(self, address: tuple[str, int], request: bytes) -> HttpMessage:
        kept = self._idle[address]
        if kept:
            # A kept connection may have been closed by the peer meanwhile: then once more on a new one.
            with contextlib.suppress(OSError, EOFError):
                return await self._ask(kept.pop(), address, request)
        return await self._ask(await _connect(address), address, request)

    async def _ask(self, sock: socket.socket, address: tuple[str, int], request: bytes) -> HttpMessage:
        loop = asyncio.get_running_loop()
        reader = HttpReader()
        try:
            await loop.sock_sendall(sock, request)
            while True:
                data = await loop.sock_recv(sock, _RECEIVE)
                if not data and reader.is_idle:
                    raise EOFError("the connection was closed without an answer")
                messages = reader.feed(data)
                if messages:
                    break
        except BaseException:
            sock.close()
            raise
        kept = self._idle[address]
        if messages[0].keep_alive and len(kept) < _KEEP_PER_SERVER and not self._closed:
            kept.append(sock)
        else:
            sock.close()
        return messages[0]


async def _connect(address: tuple[str, int]) -> socket.socket:
    from minirospy.runtime import tcp

    sock = await tcp.connect(*address)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock
