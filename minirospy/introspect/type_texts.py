"""Full definitions and md5sums of topic and service types, from installed packages or else from publishers."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from minirospy.base.errors import MinirospyError, NotFoundError, RpcError, WireError
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType, check_publisher, subscriber_header
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.transport import tcp

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["ServiceInfo", "TypeTexts", "described", "installed_type", "type_of_text"]

MAX_NAMES = 2_000
"""Maximum number of cached types, including types that are not installed: peers can send any number of names."""
_MAX_CONCURRENT = 32  # maximum number of publishers to query concurrently


def installed_type(name: str) -> InterfaceType | None:
    """Return an installed message type, or None if it is not installed or its module cannot be loaded."""
    from minirospy.core.idl.load import get_message_class

    try:
        found = get_message_class(name)
    except (MinirospyError, ImportError, SyntaxError):
        return None
    return InterfaceType.of(found) if found is not None else None


def type_of_text(name: str, text: str) -> InterfaceType | None:
    """Return the type that a full definition describes, or None if the definition cannot be parsed.

    Generates no class, because that would take a second.
    """
    from minirospy.core.idl.load import checked_text

    try:
        return InterfaceType(name, checked_text(name, text)[1], text)
    except (MinirospyError, UnicodeEncodeError):
        return None


class TypeTexts:
    """Determines the types of topics. Imports each type's module only once, in a worker, because an import takes milliseconds."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._installed: dict[str, InterfaceType | None] = {}
        self._rpc = AsyncRpcClient()

    async def of_publishers(
        self, topics: Mapping[str, tuple[str, ...]], seconds: float
    ) -> dict[str, InterfaceType]:
        """Query publishers for the types of their topics.

        Return the types that arrive within ``seconds``, because a publisher may stall.
        """
        if not topics:
            return {}
        limit = asyncio.Semaphore(_MAX_CONCURRENT)

        async def look(topic: str, publishers: tuple[str, ...]) -> InterfaceType | None:
            async with limit:
                return await self._from_publishers(topic, publishers)

        tasks = {topic: asyncio.ensure_future(look(topic, nodes)) for topic, nodes in topics.items()}
        try:
            await asyncio.wait(tasks.values(), timeout=seconds)
            done = {topic: task.result() for topic, task in tasks.items() if task.done()}
        finally:
            for task in tasks.values():
                task.cancel()
            await asyncio.gather(*tasks.values(), return_exceptions=True)
        return {topic: found for topic, found in done.items() if found}

    async def installed(self, name: str) -> InterfaceType | None:
        """Return the message type ``name``, or None if it is not installed."""
        if name in self._installed:
            return self._installed[name]

        loop = asyncio.get_running_loop()
        found = await loop.run_in_executor(None, installed_type, name)
        while len(self._installed) >= MAX_NAMES:
            # The oldest entry is the first one, because dictionaries preserve insertion order.
            del self._installed[next(iter(self._installed))]
        self._installed[name] = found
        return found

    async def _from_publishers(self, topic: str, publishers: tuple[str, ...]) -> InterfaceType | None:
        for publisher in publishers:
            with contextlib.suppress(MinirospyError, OSError, asyncio.TimeoutError, ValueError):
                header = await self.header_of(topic, publisher)
                text = header.get("message_definition", "")
                # An empty definition is valid only for a message without fields, which always has this md5sum.
                if text or header["md5sum"] == "d41d8cd98f00b204e9800998ecf8427e":
                    return InterfaceType(header["type"], header["md5sum"], text)
        return None

    async def header_of(self, topic: str, publisher: str) -> Header:
        """Return a publisher's connection header, by connecting as a subscriber and disconnecting again."""
        uri = await self._node.call_master("lookupNode", publisher)
        answer = await self._rpc.call(uri, "requestTopic", self._node.name, topic, [["TCPROS"]])
        match answer:
            case [1, _, ["TCPROS", str(host), int(port), *_]]:
                sock = await tcp.connect(host, port)
            case _:
                raise WireError(f"{uri} answered requestTopic for {topic} with {answer!r}")
        try:
            await tcp.send_header(sock, subscriber_header(topic, InterfaceType(ANY, ANY), self._node.name))
            header = await tcp.receive_header(sock)
            check_publisher(header, topic, InterfaceType(ANY, ANY))
        finally:
            sock.close()
        return header

    async def close(self) -> None:
        """Close the connections to the nodes."""
        with contextlib.suppress(RpcError):
            await self._rpc.close()


@dataclass(frozen=True)
class ServiceInfo:
    """A service's type, and the full definitions of its request and response."""

    name: str
    type: str
    md5sum: str
    request: InterfaceType
    response: InterfaceType


def described(name: str, header: Mapping[str, str]) -> ServiceInfo:
    """Return the service type that a connection header names. Raise NotFoundError unless it is installed, with this md5sum."""
    from minirospy.core.idl.load import get_service_class

    type_ = header.get("type", "")
    try:
        found = get_service_class(type_)
    except (ImportError, SyntaxError) as error:
        raise NotFoundError("service type", type_) from error
    if found is None or header.get("md5sum") not in (ANY, found._md5sum):
        raise NotFoundError("service type", type_)
    return ServiceInfo(
        name,
        type_,
        found._md5sum,
        InterfaceType.of(found._request_class),
        InterfaceType.of(found._response_class),
    )
