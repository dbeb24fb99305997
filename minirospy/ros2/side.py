"""The ROS 2 backend based on rclpy, with publishers and subscriptions for serialized messages.

Only this module and rclpy_*.py use rclpy. Callbacks run in the executor's thread.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import importlib.util
import logging
import os
import re
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Protocol, cast

from minirospy.base.errors import BridgeError
from minirospy.ros2.action_links import send_goal_service
from minirospy.ros2.interface import (
    Accept,
    Ros2ActionClient,
    Ros2Client,
    Ros2Handle,
    Ros2Parameters,
    Ros2Publisher,
)
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.links import BRIDGE_PREFIX, Ros2End, Ros2Topic, parse_domain
from minirospy.ros2.rclpy_actions import ActionClass, ActionClient, ActionServer
from minirospy.ros2.rclpy_calls import Calls, MessageClass, NotAnsweredError, RclpySubscription, ServiceClass
from minirospy.ros2.rclpy_parameters import NodeParameters, ParameterServer, ParameterStore

__all__ = ["RclpySide", "large_message_settings", "require_rclpy"]

_log = logging.getLogger(__name__)
_DRAINED = 200
"""Maximum number of messages to read per executor callback; a callback costs more time than reading a message."""


# --- interfaces of the parts of rclpy that are used (untyped, because rclpy may not be installed)


class _Profile(Protocol):
    reliability: object
    durability: object


class _Info(Protocol):
    node_name: str
    topic_type: str
    qos_profile: _Profile


class _RclpyPublisher(Protocol):
    def publish(self, data: bytes) -> None: ...

    def get_subscription_count(self) -> int: ...


class _Node(Protocol):
    def create_publisher(self, class_: MessageClass, topic: str, profile: _Profile) -> _RclpyPublisher: ...

    def create_subscription(
        self,
        class_: MessageClass,
        topic: str,
        callback: Callable[[bytes], None],
        profile: _Profile,
        *,
        raw: bool,
    ) -> RclpySubscription: ...

    def destroy_publisher(self, publisher: _RclpyPublisher) -> bool: ...

    def destroy_subscription(self, subscription: RclpySubscription) -> bool: ...


# --- the backend


def require_rclpy() -> None:
    """Raise BridgeError with instructions if rclpy cannot be imported."""
    try:
        importlib.import_module("rclpy")
    except ImportError as error:
        raise BridgeError(
            f"ROS 2 cannot be imported ({' '.join(str(error).split())}): source its setup file first, "
            "as /opt/ros/jazzy/setup.bash, and run minirospy with the Python for which ROS 2 was built"
        ) from error


_PROFILES = ("FASTDDS_DEFAULT_PROFILES_FILE", "FASTRTPS_DEFAULT_PROFILES_FILE")
"""Environment variables that name the settings file of Fast DDS.

Fast DDS 2 and older, used by the _OLD_DISTRIBUTIONS, reads the second one.
"""
_OLD_DISTRIBUTIONS = ("humble", "iron", "jazzy")
_PACKAGE = re.compile(r"[a-z](_?[a-z0-9]+)*")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_OTHER_SETTINGS = ("FASTDDS_BUILTIN_TRANSPORTS", "ROS_LOCALHOST_ONLY")


def large_message_settings(environment: Mapping[str, str]) -> dict[str, str]:
    """Return environment variables that enlarge Fast DDS's buffers for large messages.

    Return {} if the user has configured Fast DDS.
    """
    if any(environment.get(name) for name in (*_PROFILES, *_OTHER_SETTINGS)):
        return {}
    if not environment.get("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp").startswith("rmw_fastrtps"):
        return {}
    is_old = environment.get("ROS_DISTRO") in _OLD_DISTRIBUTIONS
    return {_PROFILES[is_old]: str(Path(__file__).with_name("fastdds.xml"))}


class RclpySide:
    """The rclpy backend: one node, with one executor in one thread."""

    def __init__(self, name: str) -> None:
        """Start the node. Raise BridgeError if ROS 2 reports an error."""
        require_rclpy()
        os.environ.update(large_message_settings(os.environ))
        rclpy = importlib.import_module("rclpy")
        self._qos = importlib.import_module("rclpy.qos")
        executors = importlib.import_module("rclpy.executors")
        self._shutdown_error: type[Exception] = executors.ExternalShutdownException
        self._context = importlib.import_module("rclpy.context").Context()
        no_signals = importlib.import_module("rclpy.signals").SignalHandlerOptions.NO
        try:
            # Do not let rclpy handle Ctrl-C, because the bridge does.
            rclpy.init(args=[], context=self._context, signal_handler_options=no_signals)
            self._node = rclpy.create_node(
                name,
                context=self._context,
                use_global_arguments=False,
                start_parameter_services=False,
            )
        except Exception as error:  # rclpy's errors have no common base class
            with contextlib.suppress(Exception):
                self._context.try_shutdown()
            raise BridgeError(f"ROS 2 does not start: {' '.join(str(error).split())}") from error
        self._executor = executors.SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._calls = Calls(self._node, self._executor)
        self._thread = threading.Thread(target=self._spin, name="ros2-executor", daemon=True)
        self._is_closed = False
        self._served: list[str] = []
        self._thread.start()

    @property
    def domain(self) -> str:
        """Return the ROS 2 domain's number."""
        return parse_domain(os.environ.get("ROS_DOMAIN_ID", ""))

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        """Return the names of all topics, with their types."""
        found = self._node.get_topic_names_and_types()
        return {str(name): tuple(_short(type_) for type_ in types) for name, types in found}

    def ends(self, topic: str) -> Ros2Topic:
        """Return the publishers and subscribers of a topic."""
        return Ros2Topic(
            tuple(self._end(each) for each in self._node.get_publishers_info_by_topic(topic)),
            tuple(self._end(each) for each in self._node.get_subscriptions_info_by_topic(topic)),
        )

    def fields(self, type_: str) -> dict[str, str]:
        """Return the fields of a message type. Raise TypesDiffer if the type is not installed, as for an incompatible type."""
        return dict(self.message_class(type_).get_fields_and_field_types())

    def publisher(self, topic: str, type_: str, *, depth: int, is_latched: bool) -> Ros2Publisher:
        """Return a reliable publisher, which best-effort subscribers accept, too.

        Raise TypesDiffer if the type is not installed, as for an incompatible type.
        """
        profile = self._profile(depth, is_reliable=True, is_latched=is_latched)
        publisher = self._node.create_publisher(self.message_class(type_), topic, profile)
        return TopicPublisher(self._calls, self._node, publisher)

    def subscribe(
        self,
        topic: str,
        type_: str,
        deliver: Callable[[bytes], None],
        *,
        depth: int,
        is_reliable: bool,
        is_latched: bool,
    ) -> Ros2Handle:
        """Subscribe to a topic; call ``deliver`` for each serialized message, in the executor's thread.

        Raise TypesDiffer if the type is not installed, as for an incompatible type.
        """
        profile = self._profile(depth, is_reliable=is_reliable, is_latched=is_latched)
        return TopicSubscription(self._calls, self._node, self.message_class(type_), topic, deliver, profile)

    def nodes(self) -> list[tuple[str, str]]:
        """Return the (name, namespace) of all nodes except bridges."""
        found = self._node.get_node_names_and_namespaces()
        return [(str(name), str(space)) for name, space in found if not name.startswith(BRIDGE_PREFIX)]

    def services(self) -> Mapping[str, str]:
        """Return the services of all nodes except this bridge, as a dict from name to type."""
        # This list also contains services that have only clients.
        named = {str(name): _short(types[0]) for name, types in self._node.get_service_names_and_types()}
        if hasattr(self._node, "count_services"):
            own = tuple(self._served)
            return {
                name: type_
                for name, type_ in named.items()
                if self._node.count_services(name) > own.count(name)
            }
        # Before ROS 2 Jazzy, every node must be queried for its services.
        offered: dict[str, str] = {}
        for name, namespace in self.nodes():
            # Ignore a node that has just exited.
            with contextlib.suppress(RuntimeError):
                found = self._node.get_service_names_and_types_by_node(name, namespace)
                offered.update((str(service), _short(types[0])) for service, types in found)
        return offered

    def service_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str]]:
        """Return the fields of a service's request and response. Raise TypesDiffer like :meth:`fields`."""
        class_ = self.service_class(type_)
        return (
            dict(class_.Request.get_fields_and_field_types()),
            dict(class_.Response.get_fields_and_field_types()),
        )

    def client(self, service: str, type_: str) -> Ros2Client:
        """Return a client for a service. Raise TypesDiffer like :meth:`fields`."""
        return self._calls.client(service, self.service_class(type_))

    def serve(self, service: str, type_: str, answer: Callable[[bytes], Future[bytes]]) -> Ros2Handle:
        """Offer a service. Raise TypesDiffer like :meth:`fields`."""
        server = self._calls.server(service, self.service_class(type_), answer)
        self._served.append(service)
        return _Served(self._calls, server, lambda: self._served.remove(service))

    def action_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
        """Return the fields of an action's goal, result and feedback. Raise TypesDiffer like :meth:`fields`."""
        class_ = self.action_class(type_)
        goal, result, feedback = (
            dict(each.get_fields_and_field_types()) for each in (class_.Goal, class_.Result, class_.Feedback)
        )
        return goal, result, feedback

    def action_client(self, action: str, type_: str) -> Ros2ActionClient:
        """Return a client for an action. Raise TypesDiffer like :meth:`fields`."""
        return ActionClient(self._calls, action, self.action_class(type_))

    def action_server(self, action: str, type_: str, accept: Accept) -> Ros2Handle:
        """Offer an action. Raise TypesDiffer like :meth:`fields`."""
        service = send_goal_service(action)
        server = ActionServer(self._calls, action, self.action_class(type_), accept)
        self._served.append(service)
        return _Served(self._calls, server, lambda: self._served.remove(service))

    def serve_parameters(self, store: ParameterStore, loop: asyncio.AbstractEventLoop) -> Ros2Handle:
        """Offer the ROS 1 parameters as parameters of this node."""
        return ParameterServer(self._calls, str(self._node.get_name()), store, loop)

    def node_parameters(self) -> Ros2Parameters:
        """Return an object that accesses the parameters of other nodes."""
        return NodeParameters(self._calls)

    def close(self) -> None:
        """Stop the node and its thread. Idempotent."""
        if self._is_closed:
            return
        self._is_closed = True
        self._executor.shutdown()
        self._thread.join()
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        while not self._is_closed:
            try:
                self._executor.spin()
            except self._shutdown_error:
                return
            except NotAnsweredError:
                continue
            except Exception:  # noqa: BLE001 - rclpy may raise any error
                # Only this callback has failed, so continue with the other callbacks.
                _log.exception("a message of ROS 2 could not be passed on")

    def _end(self, info: _Info) -> Ros2End:
        profile = info.qos_profile
        return Ros2End(
            str(info.node_name),
            _short(str(info.topic_type)),
            profile.reliability == self._qos.ReliabilityPolicy.RELIABLE,
            profile.durability == self._qos.DurabilityPolicy.TRANSIENT_LOCAL,
        )

    def _profile(self, depth: int, *, is_reliable: bool, is_latched: bool) -> _Profile:
        qos = self._qos
        profile: _Profile = qos.QoSProfile(
            depth=depth,
            reliability=qos.ReliabilityPolicy.RELIABLE if is_reliable else qos.ReliabilityPolicy.BEST_EFFORT,
            durability=qos.DurabilityPolicy.TRANSIENT_LOCAL if is_latched else qos.DurabilityPolicy.VOLATILE,
        )
        return profile

    @staticmethod
    def message_class(type_: str) -> MessageClass:
        found = _imported(type_, "msg")
        # The class may be a ROS 1 class from one of minirospy's packages; those classes do not have this method.
        if not hasattr(found, "get_fields_and_field_types"):
            raise TypesDiffer(f"[{type_}] is not installed in ROS 2")
        return cast("MessageClass", found)

    @staticmethod
    def service_class(type_: str) -> ServiceClass:
        found = _imported(type_, "srv")
        if not hasattr(getattr(found, "Request", None), "get_fields_and_field_types"):
            raise TypesDiffer(f"the service type [{type_}] is not installed in ROS 2")
        return cast("ServiceClass", found)

    @staticmethod
    def action_class(type_: str) -> ActionClass:
        found = _imported(type_, "action")
        if not hasattr(getattr(found, "Goal", None), "get_fields_and_field_types"):
            raise TypesDiffer(f"the action type [{type_}] is not installed in ROS 2")
        return cast("ActionClass", found)


class _Served:
    """A service that the bridge offers. Until closed, it is not listed among the services of other nodes."""

    def __init__(self, calls: Calls, server: Ros2Handle, on_close: Callable[[], None]) -> None:
        self._calls = calls
        self._server = server
        self._on_close = on_close

    def close(self) -> None:
        self._server.close()
        self._calls.end(self._on_close)


class TopicPublisher:
    def __init__(self, calls: Calls, node: _Node, publisher: _RclpyPublisher) -> None:
        self._calls = calls
        self._node = node
        self._publisher = publisher

    @property
    def subscribers(self) -> int:
        return int(self._publisher.get_subscription_count())

    def publish(self, data: bytes) -> None:
        self._publisher.publish(data)

    def close(self) -> None:
        self._calls.end(lambda: self._node.destroy_publisher(self._publisher))


class TopicSubscription:
    def __init__(
        self,
        calls: Calls,
        node: _Node,
        class_: MessageClass,
        topic: str,
        deliver: Callable[[bytes], None],
        profile: _Profile,
    ) -> None:
        self._calls = calls
        self._node = node
        self.message_class = class_
        self._deliver = deliver
        self._is_closed = False
        handles = importlib.import_module("rclpy.impl.implementation_singleton")
        self._invalid_handle: type[Exception] = handles.rclpy_implementation.InvalidHandle
        self._subscription = node.create_subscription(class_, topic, self._arrived, profile, raw=True)

    def close(self) -> None:
        self._is_closed = True
        self._calls.end(lambda: self._node.destroy_subscription(self._subscription))

    def _arrived(self, data: bytes) -> None:
        """Deliver a message and those queued behind it, because the executor delivers only one per iteration, which is slow."""
        handle = self._subscription.handle
        for _ in range(_DRAINED):
            if self._is_closed:
                return
            self._deliver(data)
            try:
                with handle:
                    taken = handle.take_message(self.message_class, True)
            except self._invalid_handle:
                return  # the loop's thread has closed the subscription
            if taken is None:
                return
            data = taken[0]
        self._deliver(data)


def _imported(type_: str, kind: str) -> object:
    package, _, name = type_.partition("/")
    # Check the name, which comes from a remote node: importing an arbitrary module would execute it.
    if not (_PACKAGE.fullmatch(package) and _NAME.fullmatch(name) and _is_interface_package(package)):
        return None
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), name, None)
    except ImportError:
        return None


def _is_interface_package(package: str) -> bool:
    """Return whether a package contains rosidl's generated type support library. Does not import the package."""
    if package in sys.stdlib_module_names:
        return False
    try:
        found = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        # ValueError: a program has put a module without a spec into sys.modules.
        return False
    folders = found.submodule_search_locations if found else None
    return any(any(Path(folder).glob(f"{package}_s__rosidl_typesupport_*")) for folder in folders or ())


def _short(type_: str) -> str:
    """Return ``pkg/Name`` for a type written as ``pkg/msg/Name``."""
    package, _, rest = type_.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"
