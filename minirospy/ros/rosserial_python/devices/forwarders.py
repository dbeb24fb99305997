"""rosserial_python's classes for a device's topics and services, for programs that read its bytes themselves.

The classes have the constructors and methods of ROS's classes: ``parent`` is an object with ``send(topic_id, data)``, such as
a SerialClient. A SerialClient itself uses the classes in minirospy.ros.rosserial_python.devices.endpoints. Source:
http://wiki.ros.org/rosserial_python.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any, Protocol

from rosserial_msgs.msg import TopicInfo

from minirospy import client as rospy
from minirospy.core.idl.protocols import Message
from minirospy.ros.rosserial_python.devices import endpoints
from minirospy.ros.rosserial_python.devices.endpoints import to_bytes

__all__ = [
    "Publisher",
    "ServiceClient",
    "ServiceServer",
    "Subscriber",
    "load_message",
    "load_pkg_module",
    "load_service",
]


class Parent(Protocol):
    """An object that sends bytes to a device."""

    def send(self, topic: int, msg: bytes) -> object:
        """Send a message on the topic with this id."""


def load_pkg_module(package: str, directory: str) -> ModuleType | None:
    """Import a package's module ``directory`` (msg or srv) and return the package.

    If that fails, log the reason and return None.
    """
    try:
        import_module(f"{package}.{directory}")
    except ImportError:
        rospy.logerr(f"Cannot import package : {package}")
        rospy.logerr("sys.path was " + str(sys.path))
        return None
    return sys.modules[package]


def load_message(package: str, message: str) -> type[Message]:
    """Return a message class. Raise AttributeError if it does not exist."""
    found: type[Message] = getattr(_module(package, "msg"), message)
    return found


def _module(package: str, directory: str) -> Any:
    return getattr(load_pkg_module(package, directory), directory)


def load_service(package: str, service: str) -> tuple[Any, type[Message], type[Message]]:
    """Return a service's class, request class and response class. Raise AttributeError if the service does not exist."""
    module = _module(package, "srv")
    return (
        getattr(module, service),
        getattr(module, f"{service}Request"),
        getattr(module, f"{service}Response"),
    )


class Publisher(endpoints.Publisher):
    """Forwards messages from the device to ROS.

    Raise EndpointError if the type is not installed, or its md5sum differs from the device's.
    """

    def handlePacket(self, data: bytes) -> None:
        """Publish a message."""
        self.handle(data)


class Subscriber(endpoints.Subscriber):
    """Forwards messages from ROS to the device.

    Raise EndpointError if the type is not installed, or its md5sum differs from the device's.
    """

    def __init__(self, topic_info: TopicInfo, parent: Parent) -> None:
        self.parent = parent
        super().__init__(topic_info, self._to_parent)
        self.subscriber = self._subscriber

    def _to_parent(self, topic: int, data: bytes) -> None:
        self.parent.send(topic, data)

    def callback(self, msg: Message) -> None:
        """Send a message to the device."""
        self.parent.send(self.id, to_bytes(msg))

    def _receive(self, message: Message) -> None:
        self.callback(message)


class ServiceServer(endpoints.ServiceServer):
    """A service provided by the device.

    ``id`` is the id of the topic on which the device receives requests; set it before use.
    """

    def __init__(self, topic_info: TopicInfo, parent: Parent) -> None:
        self.parent = parent
        super().__init__(topic_info, self._to_parent)
        self.mreq, self.mres = self.request, self.response
        self.service = self._service

    def _to_parent(self, topic: int, data: bytes) -> None:
        self.parent.send(topic, data)

    def callback(self, req: Message) -> Message:
        """Send a request to the device; return its response."""
        return super()._call(req)

    def _call(self, request: Message) -> Message:
        return self.callback(request)

    def handlePacket(self, data: bytes) -> None:
        """Pass the device's response to the caller."""
        self.handle(data)


class ServiceClient:
    """Calls a service for the device.

    ``id`` is the id of the topic on which the device receives responses; set it before use.
    """

    def __init__(self, topic_info: TopicInfo, parent: Parent) -> None:
        """Wait for the service. Raise AttributeError if the service's type is not installed."""
        self.topic: str = topic_info.topic_name
        self.id = -1
        self.parent = parent
        service, self.mreq, self.mres = load_service(*topic_info.message_type.split("/"))
        rospy.loginfo("Starting service client, waiting for service '" + self.topic + "'")
        rospy.wait_for_service(self.topic)
        self.proxy: Any = rospy.ServiceProxy(self.topic, service)

    def handlePacket(self, data: bytes) -> None:
        """Call the service with the device's request and send the response."""
        request = self.mreq()
        request.deserialize(data)
        self.parent.send(self.id, to_bytes(self.proxy(request)))
