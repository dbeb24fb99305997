"""Bridges parameters in both directions.

Offers ROS 1 parameters as parameters of the bridge's ROS 2 node, and ROS 2 nodes' parameters through ROS 1 services.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import struct
from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

from minirospy.aio.raw import RawService
from minirospy.base.errors import BridgeError, MinirospyError, ServiceException
from minirospy.core.idl.digest import service_md5
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros2.parameter_values import Value, leaves, ros1_name, ros1_value, ros2_name, ros2_value

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.core.idl.load import Catalogue
    from minirospy.ros2.interface import Ros2Handle, Ros2Side

__all__ = ["ParameterBridge", "Ros1Parameters"]

_T = TypeVar("_T")
_LENGTH = struct.Struct("<I")


class Ros1Parameters:
    """Gives ROS 2 access to the master's parameters, under ROS 2 names and with ROS 2 values.

    Runs on the node's loop; all methods raise MinirospyError if a call to the master fails.
    """

    def __init__(self, node: Node) -> None:
        self._node = node

    async def names(self) -> list[str]:
        """Return the names of all parameters."""
        return [ros2_name(name) for name in leaves(await self._node.get_param("/", {}))]

    async def get(self, names: Sequence[str]) -> list[Value]:
        """Return the values of parameters. The type is 0 if a parameter is not set, or if its name is a namespace."""
        found = []
        for name in names:
            value = await self._node.get_param(ros1_name(name), None)
            found.append(Value(0) if value is None or isinstance(value, dict) else ros2_value(value))
        return found

    async def set(self, values: Sequence[tuple[str, Value]], *, atomically: bool) -> list[str]:
        """Set or delete parameters; return a string for each parameter: an error message, or "" on success.

        If ``atomically``, change no parameter if any of them is rejected.
        """
        reasons = [_refusal(name, value) for name, value in values]
        if atomically and any(reasons):
            return reasons
        for number, (name, value) in enumerate(values):
            if reasons[number]:
                continue
            if value.type:
                await self._node.set_param(ros1_name(name), ros1_value(value))
            else:
                with contextlib.suppress(KeyError):
                    await self._node.delete_param(ros1_name(name))
        return reasons


def _refusal(name: str, value: Value) -> str:
    if not name.strip("./"):
        return "a parameter needs a name"
    try:
        if value.type:
            ros1_value(value)
    except BridgeError as error:
        return str(error)
    return ""


class ParameterBridge:
    """Makes each side's parameters available on the other side.

    In ROS 1 the services are ``~get_param``, ``~set_param`` and ``~get_param_names``.
    """

    def __init__(self, node: Node, side: Ros2Side, catalogue: Catalogue) -> None:
        self._node = node
        self._side = side
        self._catalogue = catalogue
        self._server: Ros2Handle | None = None
        self._services: list[RawService] = []

    async def start(self) -> None:
        """Offer the parameters on both sides."""
        self._server = self._side.serve_parameters(Ros1Parameters(self._node), asyncio.get_running_loop())
        handlers: dict[str, tuple[str, Callable[[list[str]], Awaitable[bytes]]]] = {
            "get_param": ("rosapi/GetParam", self._get),
            "set_param": ("rosapi/SetParam", self._set),
            "get_param_names": ("rosapi/GetParamNames", self._names),
        }
        for name, (type_, handler) in handlers.items():
            spec = self._catalogue.service(type_)
            interface = InterfaceType(type_, service_md5(spec, self._catalogue.message))
            answer = functools.partial(self._answered, handler)
            self._services.append(RawService(self._node, f"~{name}", interface, answer))
        for service in self._services:
            await service

    async def close(self) -> None:
        """Close the services. Idempotent."""
        if self._server:
            self._server.close()
            self._server = None
        services, self._services = self._services, []
        for service in services:
            await service.close()

    async def _answered(
        self, handler: Callable[[list[str]], Awaitable[bytes]], request: bytes, _: Header
    ) -> bytes:
        try:
            return await handler(_texts(request))
        except (MinirospyError, ValueError) as error:
            raise ServiceException(str(error)) from error

    async def _get(self, texts: list[str]) -> bytes:
        node, name = _parts(_two(texts)[0])
        value = await self._waited(lambda: self._side.node_parameters().get(node, name))
        if not value.type:
            if not texts[1]:
                raise BridgeError(f"the node [{node}] of ROS 2 has no parameter [{name}]")
            return _text(texts[1])
        found = ros1_value(value)
        return _text(json.dumps(found, default=lambda each: list(each.data)))

    async def _set(self, texts: list[str]) -> bytes:
        node, name = _parts(_two(texts)[0])
        try:
            value = json.loads(texts[1])
            made = Value(0) if value is None else ros2_value(value)
        except (ValueError, RecursionError) as error:
            raise BridgeError(f"the value of [{name}] is not JSON: {error}") from error
        except OverflowError as error:
            raise BridgeError(f"the value of [{name}] does not fit into ROS 2: {error}") from error
        numbers = made.value if isinstance(made.value, list) else [made.value]
        if any(isinstance(each, int) and not -(2**63) <= each < 2**63 for each in numbers):
            raise BridgeError(f"the value of [{name}] does not fit into the 64 bits of an integer in ROS 2")
        await self._waited(lambda: self._side.node_parameters().set(node, name, made))
        return b""

    async def _names(self, _: list[str]) -> bytes:
        found: list[str] = []
        for name, namespace in self._side.nodes():
            node = f"{namespace.rstrip('/')}/{name}"
            # Skip a node that has no parameter services, or has just exited.
            with contextlib.suppress(BridgeError):
                names = await self._waited(functools.partial(self._side.node_parameters().names, node))
                found += [f"{node}:{each}" for each in names]
        return _LENGTH.pack(len(found)) + b"".join(map(_text, found))

    @staticmethod
    async def _waited(work: Callable[[], _T]) -> _T:
        return await asyncio.get_running_loop().run_in_executor(None, work)


def _parts(name: str) -> tuple[str, str]:
    node, colon, parameter = name.partition(":")
    if not colon or not node.strip("/") or not parameter:
        raise BridgeError(f"[{name}] is not a node and its parameter: write /node:parameter")
    return f"/{node.strip('/')}", parameter


def _text(text: str) -> bytes:
    data = text.encode("utf-8", "surrogateescape")
    return _LENGTH.pack(len(data)) + data


def _two(texts: list[str]) -> list[str]:
    """Return the two strings of a request. Raise ValueError if there are fewer."""
    if len(texts) < 2:
        raise ValueError("the request ends too early")
    return texts


def _texts(data: bytes) -> list[str]:
    """Parse a request that consists of strings. Raise ValueError if it is invalid."""
    found, end = [], 0
    while end < len(data):
        if end + 4 > len(data):
            raise ValueError("the request ends too early")
        (length,) = _LENGTH.unpack_from(data, end)
        start, end = end + 4, end + 4 + length
        if end > len(data):
            raise ValueError("the request ends too early")
        found.append(data[start:end].decode("utf-8", "surrogateescape"))
    return found
