"""The topics and services that a device describes. Each becomes a publisher, subscriber, service or proxy in the node."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from io import BytesIO
from typing import Any

from rosserial_msgs.msg import TopicInfo

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError
from minirospy.core.idl.load import get_message_class, get_service_class
from minirospy.core.idl.protocols import Message

__all__ = ["EndpointError", "Publisher", "ServiceClient", "ServiceServer", "Subscriber", "to_bytes"]

Send = Callable[[int, bytes], object]

_LOOK_SECONDS = 0.2


class EndpointError(MinirospyError):
    """Raised if a topic or service cannot be created as the device describes it."""


def to_bytes(message: Message) -> bytes:
    """Serialize a message for the device."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _message_class(info: TopicInfo) -> type[Message]:
    found = get_message_class(info.message_type)
    if found is None:
        raise EndpointError(
            f"Cannot import package of message type [{info.message_type}]: build or install it on this side, too"
        )
    _compare(found._md5sum, info.md5sum)
    return found


def _compare(ours: str, theirs: str) -> None:
    if ours != theirs:
        raise EndpointError(f"Checksum does not match: {ours},{theirs}")


class Publisher:
    """Forwards messages from the device to ROS.

    Raise EndpointError if the type is not installed, or its md5sum differs from the device's.
    """

    def __init__(self, info: TopicInfo) -> None:
        self.topic = info.topic_name
        self.message = _message_class(info)
        self.publisher: rospy.Publisher[Message] = rospy.Publisher(self.topic, self.message, queue_size=10)

    def handle(self, data: bytes) -> None:
        """Publish a message."""
        message = self.message()
        message.deserialize(data)
        self.publisher.publish(message)

    def unregister(self) -> None:
        """Stop publishing."""
        self.publisher.unregister()


class Subscriber:
    """Forwards messages from ROS to the device.

    Raise EndpointError if the type is not installed, or its md5sum differs from the device's.
    """

    def __init__(self, info: TopicInfo, send: Send) -> None:
        self.topic = info.topic_name
        self.id = info.topic_id
        self.message = _message_class(info)
        self._send = send
        self._subscriber: rospy.Subscriber[Message] = rospy.Subscriber(
            self.topic, self.message, self._receive
        )

    def _receive(self, message: Message) -> None:
        self._send(self.id, to_bytes(message))

    def unregister(self) -> None:
        """Stop subscribing."""
        rospy.loginfo("Removing subscriber: %s", self.topic)
        self._subscriber.unregister()


class _Service:
    """Base class of services. Holds the message classes, and the id of the topic that carries the device's part of a call.

    Raise EndpointError if the service type is not installed.
    """

    def __init__(self, info: TopicInfo, send: Send) -> None:
        self.topic = info.topic_name
        self.id = -1
        self._send = send
        found = get_service_class(info.message_type)
        if found is None:
            raise EndpointError(
                f"Cannot import package of service type [{info.message_type}]: build or install it on this side, too"
            )
        self.service_class: Any = found
        self.request: type[Message] = self.service_class._request_class
        self.response: type[Message] = self.service_class._response_class

    def check_request(self, info: TopicInfo) -> None:
        """Raise EndpointError if the device's request type differs from the installed one."""
        _compare(self.request._md5sum, info.md5sum)

    def check_response(self, info: TopicInfo) -> None:
        """Raise EndpointError if the device's response type differs from the installed one."""
        _compare(self.response._md5sum, info.md5sum)


class ServiceServer(_Service):
    """A service provided by the device. Handles one call at a time."""

    def __init__(self, info: TopicInfo, send: Send) -> None:
        super().__init__(info, send)
        self._responses: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._turn = threading.Lock()
        self._is_closed = False
        self._service = rospy.Service(self.topic, self.service_class, self._call)

    def _call(self, request: Message) -> Message:
        with self._turn:
            if self.id < 0:
                raise rospy.ServiceException("the device has not finished to describe this service")
            while not self._responses.empty():
                # Discard a late response to a call that timed out.
                self._responses.get_nowait()
            self._send(self.id, to_bytes(request))
            while not self._is_closed and not rospy.is_shutdown():
                try:
                    return self._responses.get(timeout=_LOOK_SECONDS)
                except queue.Empty:
                    continue
        raise rospy.ServiceException("the device is disconnected")

    def handle(self, data: bytes) -> None:
        """Pass the device's response to the caller."""
        response = self.response()
        response.deserialize(data)
        self._responses.put(response)

    def unregister(self) -> None:
        """Stop the service."""
        rospy.loginfo("Removing service: %s", self.topic)
        self._is_closed = True
        self._service.shutdown()


class ServiceClient(_Service):
    """Calls a service for the device, in a thread, so that the device's other topics are not blocked."""

    def __init__(self, info: TopicInfo, send: Send) -> None:
        super().__init__(info, send)
        self._requests: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        rospy.loginfo("Starting service client, waiting for service '%s'", self.topic)
        threading.Thread(target=self._run, daemon=True).start()

    def handle(self, data: bytes) -> None:
        """Call the service with the device's request."""
        request = self.request()
        request.deserialize(data)
        self._requests.put(request)

    def _run(self) -> None:
        proxy: Any = rospy.ServiceProxy(self.topic, self.service_class)
        while (request := self._requests.get()) is not None:
            try:
                rospy.wait_for_service(self.topic)
                self._send(self.id, to_bytes(proxy(request)))
            except rospy.ROSInterruptException:
                return
            except rospy.ROSException as error:
                # Send no response: the device has its own timeout.
                rospy.logerr("Call of service %s by the device failed: %s", self.topic, error)
            except rospy.ServiceException as error:
                rospy.logerr("Call of service %s by the device failed: %s", self.topic, error)

    def unregister(self) -> None:
        """Stop the thread."""
        self._requests.put(None)
