"""Topics and services of any type, as bytes, for programs that forward them, such as bridges and relays."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, cast

from minirospy.aio.handle import Handle, registered
from minirospy.base.errors import (
    CallFailed,
    HandshakeRefused,
    MasterUnreachableError,
    RpcError,
    RpcRefused,
    ServiceException,
    WireError,
)
from minirospy.core.idl.protocols import Message
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import ANY, InterfaceType
from minirospy.runtime.node.services import AsyncHandler, AsyncServiceClient, LoopServiceServer
from minirospy.runtime.transport.sockets import HANDSHAKE_SECONDS

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.aio.topics import SubscribedTopic

__all__ = ["RawService", "RawSubscription", "call_raw", "raw_class", "service_header"]

PROBE_SECONDS = 5.0


class RawSubscription(Handle):
    """A subscription that delivers messages as bytes. Created by :meth:`Node.subscribe_raw`, closed by :meth:`close`."""

    def __init__(
        self,
        state: SubscribedTopic,
        deliver: Callable[[Frame, Header], object],
        on_change: Callable[[], object] | None = None,
    ) -> None:
        self.topic = state.topic
        self._deliver = deliver
        self._state = state
        self._on_change = on_change
        if on_change is not None:
            state.subscription.on_connected.append(on_change)
        self._registration = state.join(self)

    @property
    def headers(self) -> list[Header]:
        """The connection headers of the connected publishers. The same objects are passed to ``deliver``."""
        return [link.header for link in self._state.subscription.links]

    async def close(self) -> None:
        """Unsubscribe. Idempotent."""
        callback, self._on_change = self._on_change, None
        if callback is not None:
            self._state.subscription.on_connected.remove(callback)
        await self._state.leave(self)

    def _put(self, frame: bytes | memoryview, header: Header) -> None:
        self._deliver(frame, header)

    def _end(self) -> None:
        """Do nothing, because no task waits for the messages of a raw subscription."""


class RawService(Handle):
    """A service that works on bytes: ``handler(request_bytes, connection_header)`` returns the response bytes.

    If the handler raises ServiceException, the client's call fails with its message. ``await`` waits until the service is
    registered with the master.
    """

    def __init__(self, node: Node, name: str, type_: InterfaceType, handler: AsyncHandler) -> None:
        self.name = node.resolve(name)
        self._node = node
        runtime = node._node
        self._server = LoopServiceServer(
            self.name,
            type_,
            node.name,
            handler,
            request_type=f"{type_.name}Request",
            response_type=f"{type_.name}Response",
            workers=runtime.workers,
        )
        self._registration = node._spawn(
            registered(runtime.serve, self._server, f"service [{self.name}]", node.registration_faults)
        )

    async def close(self) -> None:
        """Stop offering the service; calls in progress still get their responses. Idempotent."""
        await asyncio.wait([self._registration])
        with contextlib.suppress(MasterUnreachableError, RpcError):
            await self._node._node.unserve(self._server)


def raw_class(type_: InterfaceType) -> type[Message]:
    """Return a message class without fields, which only carries a topic's type for ``advertise`` and ``publish_raw``."""
    fields = {
        "_type": type_.name,
        "_md5sum": type_.md5sum,
        "_full_text": type_.definition,
        "_has_header": False,
        "__slots__": (),
    }
    return cast("type[Message]", type("RawMessage", (), fields))


ANY_CLASS = raw_class(InterfaceType(ANY, ANY))


async def call_raw(node: Node, service: str, md5sum: str, request: bytes) -> bytes:
    """Call a service with a serialized request; return the serialized response. Raise ServiceException if the call fails."""
    client = await _connect(node, service, md5sum)
    try:
        return await client.call(request)
    except CallFailed as error:
        raise ServiceException(f"service [{service}] responded with an error: {error}") from error
    except (OSError, WireError) as error:
        raise ServiceException(
            f"service [{service}] ended the connection during the call: {error}"
        ) from error
    finally:
        client.close()


async def service_header(node: Node, service: str) -> Header:
    """Return a service's connection header, which includes its type.

    Raise ServiceException if the service cannot be reached.
    """
    client = await _connect(node, service, ANY, probe=True)
    client.close()
    return client.header


async def _connect(node: Node, service: str, md5sum: str, *, probe: bool = False) -> AsyncServiceClient:
    try:
        uri = await node._node.master("lookupService", service)
    except RpcRefused:
        raise ServiceException(f"service [{service}] unavailable") from None
    except (MasterUnreachableError, RpcError) as error:
        raise ServiceException(f"unable to contact master: {error}") from error

    try:
        return await AsyncServiceClient.connect(
            uri,
            service,
            md5sum,
            node.name,
            probe=probe,
            timeout=PROBE_SECONDS if probe else HANDSHAKE_SECONDS,
            same_host=node._node.environment.same_host,
        )
    except HandshakeRefused as error:
        raise ServiceException(f"service [{service}] refused the connection: {error}") from error
    except (OSError, WireError, asyncio.TimeoutError) as error:
        raise ServiceException(f"service [{service}] at {uri} cannot be reached: {error}") from error
