"""ROS 2 parameters over Zenoh: offers ROS 1 parameters as services of the bridge's node, and accesses other nodes' parameters."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import TYPE_CHECKING, cast

from minirospy.base.errors import BridgeError, DeserializationError, MinirospyError
from minirospy.core.idl.type_hash import Fields
from minirospy.ros2.cdr_values import decode, encode
from minirospy.ros2.parameter_values import FIELDS, ParameterService, Value, listed

if TYPE_CHECKING:
    from minirospy.ros2.interface import Ros2Side
    from minirospy.ros2.rclpy_parameters import ParameterStore

__all__ = ["ZenohNodeParameters", "ZenohParameterServer"]

_PACKAGE = "rcl_interfaces"
ANSWER_SECONDS = 5.0
_BYTES = 5
_Values = Mapping[str, object]


class ZenohParameterServer:
    """The parameter services of the bridge's node. ``fields`` returns the fields of a type, like ``Definitions.fields``."""

    def __init__(
        self,
        side: Ros2Side,
        node: str,
        fields: Callable[[str], Fields],
        store: ParameterStore,
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        self._store = store
        self._loop = loop
        self._fields = fields
        handlers: dict[ParameterService, Callable[[_Values], Awaitable[_Values]]] = {
            ParameterService.LIST: self._list,
            ParameterService.GET: self._get,
            ParameterService.TYPES: self._types,
            ParameterService.DESCRIBE: self._describe,
            ParameterService.SET: self._set,
            ParameterService.SET_ATOMICALLY: self._set_atomically,
        }
        self._services = [
            side.serve(f"/{node}/{each.service}", f"{_PACKAGE}/{each.type}", self._answer(each.type, handler))
            for each, handler in handlers.items()
        ]

    def close(self) -> None:
        """Close the services."""
        for service in self._services:
            service.close()

    def _answer(
        self, type_: str, handler: Callable[[_Values], Awaitable[_Values]]
    ) -> Callable[[bytes], Future[bytes]]:
        whole = f"{_PACKAGE}/srv/{type_}"

        async def answered(request: bytes) -> bytes:
            try:
                response = await handler(decode(f"{whole}_Request", self._fields, request))
                return encode(f"{whole}_Response", self._fields, response)
            except (MinirospyError, DeserializationError):
                raise
            except Exception as error:  # the client waits for a response, whatever the error
                raise BridgeError(f"parameters of ROS 1: {' '.join(str(error).split())}") from error

        return lambda request: asyncio.run_coroutine_threadsafe(answered(request), self._loop)

    async def _list(self, request: _Values) -> _Values:
        names = sorted(await self._store.names())
        found, above = listed(names, _texts(request["prefixes"]), cast("int", request["depth"]))
        return {"result": {"names": found, "prefixes": above}}

    async def _get(self, request: _Values) -> _Values:
        return {"values": [_written(value) for value in await self._store.get(_texts(request["names"]))]}

    async def _types(self, request: _Values) -> _Values:
        values = await self._store.get(_texts(request["names"]))
        return {"types": bytes(value.type for value in values)}

    async def _describe(self, request: _Values) -> _Values:
        names = _texts(request["names"])
        fixed = {"description": "a parameter of ROS 1", "dynamic_typing": True}
        values = await self._store.get(names)
        return {
            "descriptors": [
                {"name": name, "type": value.type, **fixed} for name, value in zip(names, values, strict=True)
            ]
        }

    async def _set(self, request: _Values) -> _Values:
        reasons = await self._store.set(_parameters(request), atomically=False)
        return {"results": [_result(reason) for reason in reasons]}

    async def _set_atomically(self, request: _Values) -> _Values:
        reasons = await self._store.set(_parameters(request), atomically=True)
        return {"result": _result("; ".join(filter(None, reasons)))}


class ZenohNodeParameters:
    """Parameters of other ROS 2 nodes. All methods block, so call them in a worker thread.

    All methods raise BridgeError if the call fails.
    """

    def __init__(self, side: Ros2Side, fields: Callable[[str], Fields]) -> None:
        self._side = side
        self._fields = fields

    def names(self, node: str) -> list[str]:
        """Return the names of a node's parameters."""
        result = self._call(node, ParameterService.LIST, {})["result"]
        return _texts(cast("_Values", result)["names"])

    def get(self, node: str, name: str) -> Value:
        """Return the value of a parameter; its type is 0 if the parameter is not set."""
        found = self._call(node, ParameterService.GET, {"names": [name]})["values"]
        values = cast("list[_Values]", found)
        return _read(values[0]) if values else Value(0)

    def set(self, node: str, name: str, value: Value) -> None:
        """Set a parameter."""
        parameter = {"name": name, "value": _written(value)}
        response = self._call(node, ParameterService.SET, {"parameters": [parameter]})
        for result in cast("list[_Values]", response["results"]):
            if not result["successful"]:
                raise BridgeError(f"[{node}] refuses [{name}]: {result['reason'] or 'without a reason'}")

    def _call(self, node: str, service: ParameterService, values: _Values) -> _Values:
        whole = f"{_PACKAGE}/srv/{service.type}"
        client = self._side.client(f"{node}/{service.service}", f"{_PACKAGE}/{service.type}")
        try:
            end = time.monotonic() + ANSWER_SECONDS
            while not client.is_ready:
                if time.monotonic() >= end:
                    raise BridgeError(f"the node [{node}] of ROS 2 has no parameters, or is not there")
                time.sleep(0.02)
            try:
                called = client.call(encode(f"{whole}_Request", self._fields, values))
                return decode(f"{whole}_Response", self._fields, called.result(ANSWER_SECONDS))
            except FutureTimeoutError:
                raise BridgeError(f"the node [{node}] of ROS 2 does not answer") from None
            except DeserializationError as error:
                raise BridgeError(f"the response of [{node}] of ROS 2 cannot be read: {error}") from error
        finally:
            client.close()


def _texts(value: object) -> list[str]:
    return cast("list[str]", value)


def _result(reason: str) -> _Values:
    return {"successful": not reason, "reason": reason}


def _parameters(request: _Values) -> list[tuple[str, Value]]:
    parameters = cast("list[_Values]", request["parameters"])
    return [(cast("str", each["name"]), _read(cast("_Values", each["value"]))) for each in parameters]


def _read(value: _Values) -> Value:
    type_ = cast("int", value["type"])
    return Value(type_, value[FIELDS[type_]]) if 0 < type_ < len(FIELDS) else Value(0)


def _written(value: Value) -> _Values:
    if not value.type:
        return {}
    found = value.value
    if value.type == _BYTES and not isinstance(found, bytes):
        found = b"".join(cast("list[bytes]", found))
    return {"type": value.type, FIELDS[value.type]: found}
