"""Clients and servers of ROS 2 services with rclpy, which has no API for serialized requests.

A request or response is an object of the class that ROS 2 has generated for its type. rclpy's serialization converts it
from and to CDR. Everything runs in the executor's thread, except for methods whose docstrings say otherwise.
"""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable, Coroutine, Generator, Sequence
from concurrent.futures import CancelledError, Future, InvalidStateError
from types import TracebackType
from typing import Protocol, TypeVar

from minirospy.base.errors import BridgeError, MinirospyError
from minirospy.ros2.parameter_values import ParameterService

__all__ = [
    "Calls",
    "Client",
    "Executor",
    "Message",
    "MessageClass",
    "NotAnsweredError",
    "ParameterProbe",
    "RclpyFuture",
    "RclpySubscription",
    "Server",
    "ServiceClass",
    "ServiceNode",
]

_REASONS = ("message", "status_message", "error_message", "error_string", "error", "reason")
"""Names of response fields that may state the reason for a failure."""

_DEPTH = 1000  # maximum number of queued requests or responses of the bridge

_GUID_PREFIX = 12

_T = TypeVar("_T")


# --- interfaces of the parts of rclpy that are used


class Message(Protocol):
    """A message, request or response object."""

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]: ...


class MessageClass(Protocol):
    """The interface of a generated class for messages, requests or responses."""

    def __call__(self) -> Message: ...

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]: ...


class ServiceClass(Protocol):
    """The interface of a generated ROS 2 service class."""

    Request: MessageClass
    Response: MessageClass


class RclpyFuture(Protocol):
    """The interface of an rclpy future."""

    def result(self) -> object: ...

    def set_result(self, result: object, /) -> None: ...

    def add_done_callback(self, callback: Callable[[RclpyFuture], None], /) -> None: ...

    def __await__(self) -> Generator[None, None, object]: ...


class RclpyHandle(Protocol):
    """The interface of an rclpy subscription's handle, which must be used as a context manager."""

    def __enter__(self) -> object: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def take_message(self, class_: MessageClass, raw: bool, /) -> tuple[bytes, object] | None: ...


class RclpySubscription(Protocol):
    """The interface of an rclpy subscription."""

    handle: RclpyHandle


class Executor(Protocol):
    """The interface of an rclpy executor."""

    def create_task(self, callback: Callable[..., object], *args: object) -> object: ...

    def wake(self) -> None: ...


class _RclpyClient(Protocol):
    def call_async(self, request: Message) -> RclpyFuture: ...

    def remove_pending_request(self, future: RclpyFuture) -> None: ...

    def service_is_ready(self) -> bool: ...


class _EndpointInfo(Protocol):
    node_name: str
    node_namespace: str
    endpoint_gid: Sequence[int]


class _Logger(Protocol):
    def error(self, text: str) -> object: ...


class ServiceNode(Protocol):
    """The interface of an rclpy node."""

    def create_client(
        self, class_: ServiceClass, name: str, *, qos_profile: object, callback_group: object
    ) -> _RclpyClient: ...

    def create_service(
        self,
        class_: ServiceClass,
        name: str,
        callback: Callable[[Message, Message], Coroutine[object, None, Message]],
        *,
        qos_profile: object,
        callback_group: object,
    ) -> object: ...

    def create_subscription(
        self, class_: MessageClass, topic: str, callback: Callable[[bytes], None], depth: int, /, *, raw: bool
    ) -> RclpySubscription: ...

    def destroy_subscription(self, subscription: RclpySubscription, /) -> bool: ...

    def destroy_client(self, client: _RclpyClient) -> bool: ...

    def destroy_service(self, service: object) -> bool: ...

    def get_logger(self) -> _Logger: ...

    def get_publishers_info_by_topic(self, topic: str, *, no_mangle: bool) -> Sequence[_EndpointInfo]: ...


# --- clients and servers


class NotAnsweredError(Exception):
    """Raised to leave a request without a response, because ROS 2 services have no error responses."""


class Calls:
    """Creates clients and servers on the bridge's ROS 2 node."""

    def __init__(self, node: ServiceNode, executor: Executor) -> None:
        self.node = node
        self.executor = executor
        serialization = importlib.import_module("rclpy.serialization")
        self.serialize: Callable[[object], bytes] = serialization.serialize_message
        self.deserialize: Callable[[bytes, MessageClass], Message] = serialization.deserialize_message
        self._future: Callable[..., RclpyFuture] = importlib.import_module("rclpy.task").Future
        # rmw_zenoh sends a response on its request's route, so no responses are lost.
        rmw = str(importlib.import_module("rclpy.utilities").get_rmw_implementation_identifier())
        self._loses_responses = not rmw.startswith("rmw_zenoh")
        # Reentrant, because a request that waits for its response must not block other requests.
        self.options: dict[str, object] = {
            "callback_group": importlib.import_module("rclpy.callback_groups").ReentrantCallbackGroup(),
            # The default QoS of services, but with a longer queue.
            "qos_profile": importlib.import_module("rclpy.qos").QoSProfile(depth=_DEPTH),
        }

    def client(self, name: str, class_: ServiceClass) -> Client:
        """Return a client for a service."""
        return Client(self, name, class_)

    def server(self, name: str, class_: ServiceClass, answer: Callable[[bytes], Future[bytes]]) -> Server:
        """Offer a service."""
        return Server(self, name, class_, answer)

    def servers(self, service: str) -> frozenset[bytes] | None:
        """Return the IDs of a service's servers, or None with rmw_zenoh, which loses no response.

        May be called from any thread.
        """
        if not self._loses_responses:
            return None
        return frozenset(bytes(info.endpoint_gid) for info in self._writers(service))

    def parameter_probe(self, service: str) -> ParameterProbe | None:
        """Return a probe for the nodes that offer a service, or None if a node is unknown or offers no parameter services.

        May be called from any thread.
        """
        names = set()
        for server in self._writers(service):
            name = f"{server.node_namespace.rstrip('/')}/{server.node_name}/{ParameterService.GET.service}"
            # A node with the same name in another process might respond, which would not prove that this node was reached.
            if {_process(each) for each in self._writers(name)} != {_process(server)}:
                return None
            names.add(name)
        if not names:
            return None
        class_ = importlib.import_module("rcl_interfaces.srv").GetParameters
        return ParameterProbe([self.client(name, class_) for name in sorted(names)])

    def _writers(self, service: str) -> Sequence[_EndpointInfo]:
        """Return the publishers of the DDS topic that carries a service's responses."""
        return self.node.get_publishers_info_by_topic(f"rr{service}Reply", no_mangle=True)

    def end(self, destroy: Callable[[], object]) -> None:
        """Destroy an object in the executor's thread: otherwise, the executor might be about to wait on the object.

        May be called from any thread. rclpy's executor fails if an object is destroyed while the executor builds its wait set.
        """
        self.executor.create_task(destroy)

    async def result(self, future: Future[_T], *, after_tasks: bool = False) -> _T:
        """Wait, in a coroutine of the executor, for a future that another thread completes; return its result.

        If ``after_tasks``, return it only after the tasks that the other thread has already submitted to the executor.
        """
        waiting = self._future(executor=self.executor)

        def finish() -> None:
            waiting.set_result(None)
            # Wake the executor, which resumes a waiting coroutine only in its next iteration.
            self.executor.wake()

        def done(_: object) -> None:
            if after_tasks:
                self.executor.create_task(finish)
            else:
                finish()

        future.add_done_callback(done)
        await waiting
        return future.result()


class Client:
    """A client for a ROS 2 service."""

    def __init__(self, calls: Calls, name: str, class_: ServiceClass) -> None:
        self._calls = calls
        self._name = name
        self._class = class_
        self._client = calls.node.create_client(class_, name, **calls.options)

    @property
    def is_ready(self) -> bool:
        """Return whether a server is connected. May be called from any thread."""
        return bool(self._client.service_is_ready())

    @property
    def servers(self) -> frozenset[bytes] | None:
        """Return the IDs of the servers, or None with rmw_zenoh, which loses no response. May be called from any thread."""
        return self._calls.servers(self._name)

    def probe(self) -> ParameterProbe | None:
        """Return a probe that requests an empty list of parameters from the servers' nodes."""
        return self._calls.parameter_probe(self._name)

    def call(self, request: bytes) -> Future[bytes]:
        """Send a request as CDR; return a future for the response as CDR. May be called from any thread."""
        answered: Future[bytes] = Future()
        # Send in the executor's thread, so that the request is recorded before the response can arrive.
        self._calls.executor.create_task(self._send, request, answered)
        return answered

    def call_empty(self) -> Future[bytes]:
        """Send a request with default values; return a future for the response. May be called from any thread."""
        return self.call(self._calls.serialize(self._class.Request()))

    def close(self) -> None:
        """Close the client."""
        self._calls.end(lambda: self._calls.node.destroy_client(self._client))

    def _send(self, data: bytes, answered: Future[bytes]) -> None:
        if answered.cancelled():
            return
        try:
            pending = self._client.call_async(self._calls.deserialize(data, self._class.Request))
        except Exception as error:  # noqa: BLE001 - rclpy may raise any error
            _fail(answered, BridgeError(f"ROS 2 does not send the request: {_line(error)}"))
            return

        def arrived(done: RclpyFuture) -> None:
            try:
                data = self._calls.serialize(done.result())
            except Exception as error:  # noqa: BLE001 - rclpy may raise any error
                _fail(answered, BridgeError(f"the response of ROS 2 cannot be read: {_line(error)}"))
                return
            with contextlib.suppress(InvalidStateError):
                answered.set_result(data)

        def forget(_: object) -> None:
            if answered.cancelled():
                self._calls.executor.create_task(self._client.remove_pending_request, pending)

        pending.add_done_callback(arrived)
        answered.add_done_callback(forget)


class ParameterProbe:
    """Probes nodes by requesting an empty list from their parameter services; such a request has no effect."""

    def __init__(self, clients: Sequence[Client]) -> None:
        self._clients = clients

    @property
    def is_ready(self) -> bool:
        """Return whether all nodes are connected. May be called from any thread."""
        return all(client.is_ready for client in self._clients)

    def reach(self) -> Future[None]:
        """Send a request to each node; return a future that completes with the last response. May be called from any thread."""
        reached: Future[None] = Future()
        sent = [client.call_empty() for client in self._clients]

        def answered(_: object) -> None:
            try:
                if all(each.done() and each.result() for each in sent):
                    reached.set_result(None)
            except InvalidStateError:
                return
            except (CancelledError, BridgeError) as error:
                _fail(reached, BridgeError(_line(error)))

        def forget(_: object) -> None:
            for each in sent:
                each.cancel()

        for each in sent:
            each.add_done_callback(answered)
        reached.add_done_callback(forget)
        return reached

    def close(self) -> None:
        """Close the clients."""
        for client in self._clients:
            client.close()


class Server:
    """A service that the bridge offers in ROS 2.

    ``answer`` takes a request's CDR and returns a future for the response's CDR. If the future raises MinirospyError, the
    call fails. The reason is logged, and sent in the response if the response has a field for it.
    """

    def __init__(
        self, calls: Calls, name: str, class_: ServiceClass, answer: Callable[[bytes], Future[bytes]]
    ) -> None:
        self._calls = calls
        self._name = name
        self._class = class_
        self._answer = answer
        self._service = calls.node.create_service(class_, name, self._arrived, **calls.options)

    def close(self) -> None:
        """Close the service."""
        self._calls.end(lambda: self._calls.node.destroy_service(self._service))

    async def _arrived(self, request: Message, response: Message) -> Message:
        try:
            data = await self._calls.result(self._answer(self._calls.serialize(request)))
        except MinirospyError as error:
            return self._refusal(response, _line(error))
        except (CancelledError, RuntimeError) as error:
            # The bridge is shutting down.
            raise NotAnsweredError from error
        return self._calls.deserialize(data, self._class.Response)

    def _refusal(self, response: Message, reason: str) -> Message:
        self._calls.node.get_logger().error(f"service [{self._name}] of ROS 1: {reason}")
        fields = response.get_fields_and_field_types()
        text = next((name for name in _REASONS if fields.get(name) == "string"), "")
        if fields.get("success") != "boolean" or not text:
            # Send no response, because a response of zeros would look valid.
            raise NotAnsweredError
        setattr(response, text, reason)
        return response


def _process(info: _EndpointInfo) -> bytes:
    """Return the part of an endpoint's ID that all endpoints of its process share. Source: RTPS 2.5, 9.3.1."""
    return bytes(info.endpoint_gid)[:_GUID_PREFIX]


def _fail(future: Future[bytes] | Future[None], error: Exception) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_exception(error)


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())
