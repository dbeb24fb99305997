"""ROS 2 parameters with rclpy: offers ROS 1 parameters as services of the bridge's node, and accesses other nodes' parameters."""

from __future__ import annotations

import asyncio
import functools
import importlib
import time
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from typing import Protocol, TypeVar, cast

from minirospy.base.errors import BridgeError, MinirospyError
from minirospy.ros2.parameter_values import FIELDS, ParameterService, Value, listed
from minirospy.ros2.rclpy_calls import Calls, Client, Message, NotAnsweredError, ServiceClass

__all__ = ["NodeParameters", "ParameterServer", "ParameterStore"]

_SECONDS = 5.0
AGAIN_SECONDS = 0.5
_T = TypeVar("_T")
_Handler = Callable[[Message, Message], Coroutine[object, None, None]]


class ParameterStore(Protocol):
    """Access to the ROS 1 parameters, under ROS 2 names and with ROS 2 values.

    Runs on the node's loop; all methods raise MinirospyError if a call to the master fails.
    """

    async def names(self) -> list[str]: ...

    async def get(self, names: Sequence[str]) -> list[Value]:
        """Return the values of parameters. The type is 0 if a parameter is not set, or if its name is a namespace."""

    async def set(self, values: Sequence[tuple[str, Value]], *, atomically: bool) -> list[str]:
        """Set or delete parameters; return a string for each parameter: an error message, or "" on success."""


class ParameterServer:
    """The parameter services of the bridge's ROS 2 node."""

    def __init__(
        self, calls: Calls, node: str, store: ParameterStore, loop: asyncio.AbstractEventLoop
    ) -> None:
        self._calls = calls
        self._store = store
        self._loop = loop
        self._messages = importlib.import_module("rcl_interfaces.msg")
        classes = importlib.import_module("rcl_interfaces.srv")
        handlers: dict[ParameterService, _Handler] = {
            ParameterService.LIST: self._list,
            ParameterService.GET: self._get,
            ParameterService.TYPES: self._types,
            ParameterService.DESCRIBE: self._describe,
            ParameterService.SET: self._set,
            ParameterService.SET_ATOMICALLY: self._set_atomically,
        }
        self._services = [
            calls.node.create_service(
                getattr(classes, each.type),
                f"/{node}/{each.service}",
                self._guarded(handler),
                **calls.options,
            )
            for each, handler in handlers.items()
        ]

    def close(self) -> None:
        """Close the services."""
        for service in self._services:
            self._calls.end(functools.partial(self._calls.node.destroy_service, service))

    def _guarded(self, handler: _Handler) -> Callable[[Message, Message], Coroutine[object, None, Message]]:
        async def guarded(request: Message, response: Message) -> Message:
            try:
                await handler(request, response)
            except (MinirospyError, RuntimeError) as error:
                self._calls.node.get_logger().error(f"parameters of ROS 1: {' '.join(str(error).split())}")
                raise NotAnsweredError from error
            return response

        return guarded

    async def _on_loop(self, work: Coroutine[object, None, _T]) -> _T:
        return await self._calls.result(asyncio.run_coroutine_threadsafe(work, self._loop))

    async def _list(self, request: Message, response: Message) -> None:
        names = sorted(await self._on_loop(self._store.names()))
        prefixes, depth = _texts(request, "prefixes"), cast("int", _field(request, "depth"))
        found, above = listed(names, prefixes, depth)
        result = _field(response, "result")
        _set(result, "names", found)
        _set(result, "prefixes", above)

    async def _get(self, request: Message, response: Message) -> None:
        values = await self._on_loop(self._store.get(_texts(request, "names")))
        _set(response, "values", [_made(self._messages.ParameterValue, value) for value in values])

    async def _types(self, request: Message, response: Message) -> None:
        values = await self._on_loop(self._store.get(_texts(request, "names")))
        _set(response, "types", [value.type for value in values])

    async def _describe(self, request: Message, response: Message) -> None:
        names = _texts(request, "names")
        values = await self._on_loop(self._store.get(names))
        described = []
        for name, value in zip(names, values, strict=True):
            descriptor = self._messages.ParameterDescriptor(name=name, type=value.type)
            descriptor.description = "a parameter of ROS 1"
            descriptor.dynamic_typing = True
            described.append(descriptor)
        _set(response, "descriptors", described)

    async def _set(self, request: Message, response: Message) -> None:
        reasons = await self._on_loop(self._store.set(_values(request), atomically=False))
        _set(response, "results", [self._result(reason) for reason in reasons])

    async def _set_atomically(self, request: Message, response: Message) -> None:
        reasons = await self._on_loop(self._store.set(_values(request), atomically=True))
        _set(response, "result", self._result("; ".join(filter(None, reasons))))

    def _result(self, reason: str) -> object:
        return self._messages.SetParametersResult(successful=not reason, reason=reason)


class NodeParameters:
    """Parameters of other ROS 2 nodes. All methods block, so call them in a worker thread.

    All methods raise BridgeError if the call fails.
    """

    def __init__(self, calls: Calls) -> None:
        self._calls = calls

    def names(self, node: str) -> list[str]:
        """Return the names of a node's parameters."""
        response = self._call(node, ParameterService.LIST, {})
        return _texts(_field(response, "result"), "names")

    def get(self, node: str, name: str) -> Value:
        """Return the value of a parameter; its type is 0 if the parameter is not set."""
        response = self._call(node, ParameterService.GET, {"names": [name]})
        found = cast("list[object]", _field(response, "values"))
        return _read(found[0]) if found else Value(0)

    def set(self, node: str, name: str, value: Value) -> None:
        """Set a parameter."""
        messages = importlib.import_module("rcl_interfaces.msg")
        parameter = messages.Parameter(name=name, value=_made(messages.ParameterValue, value))
        response = self._call(node, ParameterService.SET, {"parameters": [parameter]})
        for result in cast("list[object]", _field(response, "results")):
            if not _field(result, "successful"):
                raise BridgeError(
                    f"[{node}] refuses [{name}]: {_field(result, 'reason') or 'without a reason'}"
                )

    def _call(self, node: str, service: ParameterService, fields: dict[str, object]) -> object:
        type_ = cast("ServiceClass", getattr(importlib.import_module("rcl_interfaces.srv"), service.type))
        client: Client = self._calls.client(f"{node}/{service.service}", type_)
        try:
            end = time.monotonic() + _SECONDS
            while not client.is_ready:
                if time.monotonic() >= end:
                    raise BridgeError(f"the node [{node}] of ROS 2 has no parameters, or is not there")
                time.sleep(0.02)
            end = time.monotonic() + _SECONDS
            request = type_.Request()
            empty = self._calls.serialize(request)
            try:
                # Repeat the request, because responses are lost until the node has discovered the client (see reach.py).
                data = _first(lambda: client.call(empty), end)
                if fields:
                    for name, value in fields.items():
                        _set(request, name, value)
                    data = _result(client.call(self._calls.serialize(request)), end)
            except FutureTimeoutError:
                raise BridgeError(f"the node [{node}] of ROS 2 does not answer") from None
            return self._calls.deserialize(data, type_.Response)
        finally:
            client.close()


def _first(call: Callable[[], Future[bytes]], end: float) -> bytes:
    """Repeat a call until it gets a response; return the response. Raise TimeoutError at time ``end``."""
    pause = AGAIN_SECONDS
    while True:
        try:
            return _result(call(), min(end, time.monotonic() + pause))
        except FutureTimeoutError:
            if time.monotonic() >= end:
                raise
        pause *= 2


def _result(future: Future[bytes], end: float) -> bytes:
    try:
        return future.result(max(0.0, end - time.monotonic()))
    finally:
        future.cancel()


# --- conversion of ROS 2 objects (untyped, because rclpy may not be installed)


def _field(message: object, name: str) -> object:
    return getattr(message, name)


def _texts(message: object, name: str) -> list[str]:
    return [str(each) for each in cast("Sequence[object]", _field(message, name))]


def _set(message: object, name: str, value: object) -> None:
    setattr(message, name, value)


def _values(request: Message) -> list[tuple[str, Value]]:
    parameters = cast("list[object]", _field(request, "parameters"))
    return [(str(_field(each, "name")), _read(_field(each, "value"))) for each in parameters]


def _read(value: object) -> Value:
    type_ = cast("int", _field(value, "type"))
    if not 0 < type_ < len(FIELDS):
        return Value(0)
    found = _field(value, FIELDS[type_])
    return Value(type_, list(cast("Sequence[object]", found)) if type_ > 4 else found)


def _made(class_: Callable[..., object], value: Value) -> object:
    return class_(type=value.type, **({FIELDS[value.type]: value.value} if value.type else {}))
