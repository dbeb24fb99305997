"""Opens and closes services between the two sides, and handles calls."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING

from minirospy.aio.raw import RawService, call_raw, service_header
from minirospy.aio.tasks import ErrorReporter
from minirospy.base.errors import (
    BridgeError,
    DefinitionError,
    DeserializationError,
    MinirospyError,
    NotFoundError,
    ROSException,
    ServiceException,
    WireError,
)
from minirospy.core.idl.cdr import CDR_HEADER, Transcoder
from minirospy.core.idl.digest import service_md5
from minirospy.core.idl.load import Catalogue
from minirospy.core.idl.spec import MessageSpec, ServiceSpec
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.node_queries import NodeQueries
from minirospy.ros2.layouts import TypesDiffer, ros2_spec, transcoder
from minirospy.ros2.link_table import LinkTable, Pair, pairs
from minirospy.ros2.links import Direction, is_bridge
from minirospy.ros2.reach import Reach
from minirospy.ros2.rules import Rules
from minirospy.ros2.service_links import ServiceLink, service_links

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.base.name_filter import NameFilter
    from minirospy.ros2.interface import Ros2Client, Ros2Handle, Ros2Side

__all__ = ["ServiceBridge", "ServiceCodec"]

QUERY_SECONDS = 1.0
"""Timeout in seconds for querying types, after which only services with known types are bridged."""
_LOOK_SECONDS = 0.5
_ABSENT_LOOKS = 3
_MAX_CALLS = 1_000
"""Maximum number of concurrent calls from ROS 2 to a ROS 1 service; further calls fail with an error."""
_MAX_UNDER_WAY = 8
"""Maximum number of concurrent requests to a ROS 2 server, which queues only 10 and would lose further ones."""


@dataclass(frozen=True)
class ServiceCodec:
    """Converts the requests and responses of a service. ``type`` is the ROS 1 type."""

    type: InterfaceType
    request: Transcoder
    response: Transcoder


class _Types:
    """Creates and caches the codecs of services, keyed by the ROS 1 and ROS 2 types."""

    def __init__(self, side: Ros2Side, rules: Rules, catalogue: Catalogue) -> None:
        self._side = side
        self._rules = rules
        self._catalogue = catalogue
        self._codecs: dict[tuple[str, str], ServiceCodec] = {}

    def partner(self, type_: str, direction: Direction) -> str:
        """Return a service's type on the client's side, given its type on the server's side."""
        if direction is Direction.TO_ROS1:
            names = self._rules.ros2_services(type_)
            return next((name for name in names if self._is_in_ros2(name)), names[0])
        names = self._rules.ros1_services(type_) or (type_,)
        return next((name for name in names if self._is_in_ros1(name)), names[0])

    def codec(self, ros1_type: str, ros2_type: str) -> ServiceCodec:
        """Return the codec for a service. Raise TypesDiffer if its types cannot be converted."""
        key = (ros1_type, ros2_type)
        if key not in self._codecs:
            self._codecs[key] = self._made(ros1_type, ros2_type)
        return self._codecs[key]

    def _made(self, ros1_type: str, ros2_type: str) -> ServiceCodec:
        spec = self._spec(ros1_type)
        request_fields, response_fields = self._side.service_fields(ros2_type)
        lookup = self._catalogue.message

        def half(ros1: MessageSpec, fields: dict[str, str]) -> Transcoder:
            other = ros2_spec(ros2_type, fields)
            return transcoder(ros1, lookup, other, self._ros2_spec, self._rules)

        try:
            type_ = InterfaceType(ros1_type, service_md5(spec, lookup))
        except (DefinitionError, NotFoundError) as error:
            raise TypesDiffer(str(error)) from error
        return ServiceCodec(type_, half(spec.request, request_fields), half(spec.response, response_fields))

    def _ros2_spec(self, name: str) -> MessageSpec:
        return ros2_spec(name, self._side.fields(name))

    def _spec(self, name: str) -> ServiceSpec:
        try:
            return self._catalogue.service(name)
        except (KeyError, NotFoundError, DefinitionError) as error:
            why = "" if isinstance(error, KeyError) else f" ({error})"
            raise TypesDiffer(
                f"the service type [{name}] is not defined here: put its package on ROS_PACKAGE_PATH{why}"
            ) from error

    def _is_in_ros1(self, name: str) -> bool:
        with contextlib.suppress(TypesDiffer):
            return bool(self._spec(name))
        return False

    def _is_in_ros2(self, name: str) -> bool:
        with contextlib.suppress(TypesDiffer):
            return bool(self._side.service_fields(name))
        return False


class ServiceBridge:
    """Makes each side's services available on the other side. Runs on the node's loop."""

    def __init__(
        self,
        node: Node,
        side: Ros2Side,
        services: NameFilter,
        rules: Rules,
        catalogue: Catalogue,
        call_seconds: float,
    ) -> None:
        self._node = node
        self._side = side
        self._services = services
        self._types = _Types(side, rules, catalogue)
        self._call_seconds = call_seconds
        self._headers = NodeQueries(self._header, ErrorReporter(node.log, "the query for a service's type"))
        self._table: LinkTable[ServiceLink, _InRos1 | _InRos2] = LinkTable(node.log, self._make)

    async def close(self) -> None:
        """Close all services. Idempotent."""
        await self._table.close()
        await self._headers.close()

    async def pairs(self, ros1: Mapping[str, tuple[str, ...]]) -> list[Pair]:
        """Return the services to bridge, each with the reason if that is impossible. ``ros1`` maps ROS 1 services to nodes."""
        return pairs(await self._wanted(ros1), self._codec)

    async def look(self, ros1: Mapping[str, tuple[str, ...]]) -> bool:
        """Open and close services to match both graphs. Return whether any service was opened or closed."""
        return await self._table.update(await self._wanted(ros1))

    async def _wanted(self, ros1: Mapping[str, tuple[str, ...]]) -> list[ServiceLink]:
        ros1 = {name: nodes for name, nodes in ros1.items() if self._services(name)}
        foreign = {name: [node for node in nodes if not is_bridge(node)] for name, nodes in ros1.items()}
        ros2 = {name: type_ for name, type_ in self._side.services().items() if self._services(name)}
        await self._headers.look(
            [(name, nodes[0]) for name, nodes in foreign.items() if nodes], QUERY_SECONDS
        )
        types = {service: header["type"] for (service, _), header in self._headers.found.items()}
        return service_links(ros1, types, ros2, self._types.partner)

    async def _header(self, key: tuple[str, str]) -> Header:
        """Query a server for its connection header, because the master does not know service types."""
        header = await service_header(self._node, key[0])
        if "type" not in header:
            raise WireError(f"service [{key[0]}] names no type")
        return header

    def _codec(self, link: ServiceLink) -> ServiceCodec:
        codec = self._types.codec(link.ros1_type, link.ros2_type)
        if link.direction is Direction.TO_ROS1:
            headers = self._headers.found.items()
            md5sum = next((each.get("md5sum", "") for (name, _), each in headers if name == link.service), "")
            if md5sum != codec.type.md5sum:
                raise TypesDiffer(
                    f"its md5sum in ROS 1 is [{md5sum}], that of [{link.ros1_type}] here [{codec.type.md5sum}]: "
                    "use the package that the server was built with"
                )
        return codec

    def _make(self, link: ServiceLink) -> _InRos1 | _InRos2:
        made = _InRos1 if link.direction is Direction.TO_ROS2 else _InRos2
        return made(self._node, self._side, link, self._codec(link), self._call_seconds)


class _InRos1:
    """A ROS 2 service, offered in ROS 1 by the bridge."""

    def __init__(
        self, node: Node, side: Ros2Side, link: ServiceLink, codec: ServiceCodec, call_seconds: float
    ) -> None:
        self._link = link
        self._codec = codec
        self._call_seconds = call_seconds
        self._ended = asyncio.Event()
        self._turns = asyncio.Semaphore(_MAX_UNDER_WAY)
        self._client: Ros2Client = side.client(link.service, link.ros2_type)
        self._reach = Reach(self._client)
        self._server = RawService(node, link.service, codec.type, self._answer)

    async def open(self) -> None:
        self._reach.start()
        await self._server

    async def close(self) -> None:
        # Make the calls in progress fail with an error.
        self._ended.set()
        await self._reach.close()
        await self._server.close()
        self._client.close()

    async def _answer(self, body: bytes, _: Header) -> bytes:
        name = self._link.service
        try:
            request = self._codec.request.to_cdr(body, CDR_HEADER)
            async with self._turns:
                return self._codec.response.to_ros1(await self._call(request))
        except DeserializationError as error:
            raise ServiceException(
                f"the bridge cannot convert a message of service [{name}]: {error}"
            ) from error
        except BridgeError as error:
            raise ServiceException(str(error)) from error

    async def _call(self, request: bytes) -> bytes:
        loop = asyncio.get_running_loop()
        end = loop.time() + self._call_seconds
        name = self._link.service
        if not await self._becomes_ready():
            raise BridgeError(f"service [{name}] has no server in ROS 2 any more")
        await self._reach.wait(end - loop.time())
        if self._ended.is_set():
            raise BridgeError(f"service [{name}] has no server in ROS 2 any more")

        answered = asyncio.wrap_future(self._client.call(request))
        ended: asyncio.Future[bool] = asyncio.ensure_future(self._ended.wait())
        awaited: list[asyncio.Future[bytes] | asyncio.Future[bool]] = [answered, ended]
        absent = 0
        try:
            while not answered.done():
                limit = min(_LOOK_SECONDS, max(0.0, end - loop.time()))
                await asyncio.wait(awaited, timeout=limit, return_when=asyncio.FIRST_COMPLETED)
                if answered.done():
                    break
                if loop.time() >= end:
                    raise BridgeError(
                        f"service [{name}] of ROS 2 has not answered within {self._call_seconds:g} s"
                    )
                absent = 0 if self._client.is_ready else absent + 1
                if ended.done() or absent >= _ABSENT_LOOKS:
                    raise BridgeError(f"the server of service [{name}] in ROS 2 has ended during the call")
        finally:
            answered.cancel()
            ended.cancel()
        return answered.result()

    async def _becomes_ready(self) -> bool:
        """Wait briefly for the server; return whether it is connected.

        This may take a moment for a service that was just discovered.
        """
        loop = asyncio.get_running_loop()
        end = loop.time() + _ABSENT_LOOKS * _LOOK_SECONDS
        while not self._client.is_ready:
            if loop.time() >= end:
                return False
            await asyncio.sleep(0.02)
        return True


class _InRos2:
    """A ROS 1 service, offered in ROS 2 by the bridge."""

    def __init__(
        self, node: Node, side: Ros2Side, link: ServiceLink, codec: ServiceCodec, call_seconds: float
    ) -> None:
        self._node = node
        self._link = link
        self._codec = codec
        self._call_seconds = call_seconds
        self._loop = asyncio.get_running_loop()
        self._calls: set[asyncio.Task[None]] = set()
        self._side = side
        self._server: Ros2Handle | None = None
        self._is_closed = False

    async def open(self) -> None:
        self._server = self._side.serve(self._link.service, self._link.ros2_type, self._arrived)

    async def close(self) -> None:
        self._is_closed = True
        if self._server:
            self._server.close()
        for task in self._calls:
            task.cancel()
        await asyncio.gather(*self._calls, return_exceptions=True)

    def _arrived(self, request: bytes) -> Future[bytes]:
        """Start a call. Runs in the executor's thread."""
        answered: Future[bytes] = Future()
        self._loop.call_soon_threadsafe(self._start, request, answered)
        return answered

    def _start(self, request: bytes, answered: Future[bytes]) -> None:
        if self._is_closed:
            answered.set_exception(BridgeError("it is not bridged any more"))
            return
        if len(self._calls) >= _MAX_CALLS:
            answered.set_exception(BridgeError(f"the bridge passes on {_MAX_CALLS} calls already"))
            return
        task = asyncio.ensure_future(self._pass_on(request, answered))
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)
        # The task may be cancelled before it starts; cancel the future in that case, too.
        task.add_done_callback(lambda _: answered.cancel())

    async def _pass_on(self, request: bytes, answered: Future[bytes]) -> None:
        """Forward a request. Set the result or exception of ``answered``, a future that belongs to another thread."""
        try:
            result = await self._answer(request)
        except (MinirospyError, ROSException, ServiceException) as error:
            answered.set_exception(BridgeError(str(error)))
        except Exception as error:  # noqa: BLE001 - the client needs a response, even after an error
            answered.set_exception(BridgeError(f"{type(error).__name__}: {error}"))
        else:
            answered.set_result(result)

    async def _answer(self, request: bytes) -> bytes:
        codec = self._codec
        try:
            body = await asyncio.wait_for(
                call_raw(self._node, self._link.service, codec.type.md5sum, codec.request.to_ros1(request)),
                self._call_seconds,
            )
            return codec.response.to_cdr(body, CDR_HEADER)
        except asyncio.TimeoutError:
            raise BridgeError(f"it has not answered within {self._call_seconds:g} s") from None
