"""SerialClient: makes a device on a serial port or TCP connection part of this node.

The device describes its topics and services; afterwards messages pass in both directions. The device can request the time
and parameters, and its log messages appear as the node's log messages. Source:
http://wiki.ros.org/rosserial/Overview/Protocol, http://wiki.ros.org/rosserial_python.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosserial_msgs.msg import Log, TopicInfo
from rosserial_msgs.srv import RequestParamRequest, RequestParamResponse
from std_msgs.msg import Time

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.errors import MinirospyError
from minirospy.ros.rosserial_python.devices.endpoints import (
    EndpointError,
    Publisher,
    ServiceClient,
    ServiceServer,
    Subscriber,
    to_bytes,
)
from minirospy.ros.rosserial_python.devices.packets import (
    MAX_MESSAGE_LENGTH,
    Decoder,
    Fault,
    Packet,
    WrongVersion,
    encode,
)
from minirospy.ros.rosserial_python.devices.ports import File, FilePort, Port, PortError, SerialPort

__all__ = [
    "ERROR_MISMATCHED_PROTOCOL",
    "ERROR_NO_SYNC",
    "ERROR_PACKET_FAILED",
    "SerialClient",
]

ERROR_MISMATCHED_PROTOCOL = "Mismatched protocol version in packet: " + (
    "lost sync or rosserial_python is from different ros release than the rosserial client"
)
ERROR_NO_SYNC = "no sync with device"
ERROR_PACKET_FAILED = "Packet Failed : Failed to read msg data"

_Service = TypeVar("_Service", ServiceServer, ServiceClient)

_VERSIONS = {
    0xFF: "Rev 0 (rosserial 0.4 and earlier)",
    0xFE: "Rev 1 (rosserial 0.5+)",
    0xFD: "Some future rosserial version",
}
_OPEN_SECONDS = 3.0
_READY_SECONDS = 0.1
_BOOT_SECONDS = 2.0  # seconds for a device to boot: an Arduino restarts when its port is opened


class SerialClient:
    """Connects a device on a port to ROS. ``port`` is a name, or an object with ``read``, ``write`` and ``inWaiting``."""

    header = b"\xff"
    protocol_ver1 = b"\xff"
    protocol_ver2 = b"\xfe"
    protocol_ver = protocol_ver2

    def __init__(
        self,
        port: str | Port | File | None = None,
        baud: int = 57600,
        timeout: float = 5.0,
        fix_pyserial_for_test: bool = False,
    ) -> None:
        """Open the port, retrying on failure, and request the device's topics. ``timeout`` is in seconds per packet."""
        self.timeout = timeout
        self.synced = False
        self.publishers: dict[int, Publisher] = {}
        self.subscribers: dict[str, Subscriber] = {}
        self.services: dict[str, ServiceServer | ServiceClient] = {}
        self.buffer_in = self.buffer_out = -1
        self.lastsync = self.lastsync_lost = rospy.Time()
        self.pub_diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self.callbacks: dict[int, Callable[[bytes], object]] = {
            TopicInfo.ID_PUBLISHER: self.setupPublisher,
            TopicInfo.ID_SUBSCRIBER: self.setupSubscriber,
            # A service has two entries, one for requests and one for responses.
            TopicInfo.ID_SERVICE_SERVER + TopicInfo.ID_PUBLISHER: self.setupServiceServerPublisher,
            TopicInfo.ID_SERVICE_SERVER + TopicInfo.ID_SUBSCRIBER: self.setupServiceServerSubscriber,
            TopicInfo.ID_SERVICE_CLIENT + TopicInfo.ID_PUBLISHER: self.setupServiceClientPublisher,
            TopicInfo.ID_SERVICE_CLIENT + TopicInfo.ID_SUBSCRIBER: self.setupServiceClientSubscriber,
            TopicInfo.ID_PARAMETER_REQUEST: self.handleParameterRequest,
            TopicInfo.ID_LOG: self.handleLoggingRequest,
            TopicInfo.ID_TIME: self.handleTimeRequest,
        }
        self._decoder = Decoder()
        self._to_write: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._writer: threading.Thread | None = None
        self._write_error: PortError | None = None
        self._ended = SignalSafeEvent()
        self._synced_at = time.monotonic()
        rospy.on_shutdown(self._shut_down)

        self.port: Port | None = self._opened(port, baud, fix_pyserial_for_test)
        if self.port is None:
            return
        self._ended.wait(_READY_SECONDS + _BOOT_SECONDS)
        self.requestTopics()
        self._synced_at = time.monotonic()

    def _opened(self, port: str | Port | File | None, baud: int, uses_handshake: bool) -> Port | None:
        if port is None or (isinstance(port, str) and rospy.is_shutdown()):
            return None
        if not isinstance(port, str):
            return FilePort(port) if isinstance(port, File) else port
        while not self._ended.is_set():
            try:
                return SerialPort(port, baud, uses_handshake=uses_handshake)
            except PortError as error:
                rospy.logerr("Error opening serial: %s", error)
                self._ended.wait(_OPEN_SECONDS)
        return None

    def _shut_down(self) -> None:
        self.txStopRequest()
        rospy.loginfo("shutdown hook activated")
        self._ended.set()

    # --- serial connection

    def run(self) -> None:
        """Forward messages until the node shuts down. Raise PortError if the connection is lost."""
        if self.port is None:
            return
        self._writer = threading.Thread(target=self._write_all, args=(self.port,), daemon=True)
        self._writer.start()
        last_read = time.monotonic()
        while not rospy.is_shutdown():
            if self._write_error is not None:
                raise self._write_error
            self._watch_sync()
            data = self.port.read()
            now = time.monotonic()
            if data:
                last_read = now
                self._take(data)
            elif self._decoder.received and now - last_read > self.timeout:
                self._give_up_packet()
        self._to_write.put(None)
        self._writer.join(self.timeout)

    def close(self) -> None:
        """Unregister the device's topics and services and close the port."""
        self._to_write.put(None)
        for each in (*self.publishers.values(), *self.subscribers.values(), *self.services.values()):
            each.unregister()
        if self.port is not None:
            self.port.close()

    def _write_all(self, port: Port) -> None:
        try:
            while (data := self._to_write.get()) is not None:
                port.write(data)
        except PortError as error:
            self._write_error = error

    def send(self, topic: int, msg: bytes) -> None:
        """Send a message to the device, on the topic with this id."""
        if 0 < self.buffer_in < len(msg) or len(msg) > MAX_MESSAGE_LENGTH:
            text = "Message from ROS network dropped: message larger than buffer (%d of %d bytes)."
            rospy.logerr(text, len(msg), self.buffer_in if self.buffer_in > 0 else MAX_MESSAGE_LENGTH)
            return
        self._to_write.put(encode(topic, msg))

    def requestTopics(self) -> None:
        """Request the device's topics and services."""
        rospy.loginfo("Requesting topics...")
        self._flush()
        self._to_write.put(encode(TopicInfo.ID_PUBLISHER, b""))

    def txStopRequest(self) -> None:
        """Ask the device to stop sending."""
        self._to_write.put(encode(TopicInfo.ID_TX_STOP, b""))
        rospy.loginfo("Sending tx stop request")

    def _flush(self) -> None:
        self._decoder.reset()
        if self.port is not None:
            self.port.flush_input()

    def _watch_sync(self) -> None:
        now = time.monotonic()
        if now - self._synced_at <= self.timeout * 3:
            return
        if self.synced:
            rospy.logerr("Lost sync with device, restarting...")
        else:
            rospy.logerr(
                "Unable to sync with device; possible link problem or link software version mismatch such as hydro "
                "rosserial_python with groovy Arduino"
            )
        self.lastsync_lost = rospy.Time.now()
        self.sendDiagnostics(DiagnosticStatus.ERROR, ERROR_NO_SYNC)
        self.requestTopics()
        self._synced_at = now

    def _give_up_packet(self) -> None:
        decoder = self._decoder
        if decoder.step.startswith("data"):
            self.sendDiagnostics(DiagnosticStatus.ERROR, ERROR_PACKET_FAILED)
        rospy.logwarn("Last read step: %s", decoder.step)
        rospy.logwarn(
            "Run loop error: Serial Port read failure: Returned short (expected %d bytes, received %d instead).",
            decoder.received + decoder.missing,
            decoder.received,
        )
        self.requestTopics()

    def _take(self, data: bytes) -> None:
        for found in self._decoder.feed(data):
            if isinstance(found, Packet):
                self.synced = True
                self._handle(found)
            elif isinstance(found, Fault):
                rospy.loginfo("%s", found.text)
            else:
                self._refuse(found)

    def _refuse(self, found: WrongVersion) -> None:
        self.sendDiagnostics(DiagnosticStatus.ERROR, ERROR_MISMATCHED_PROTOCOL)
        rospy.logerr(ERROR_MISMATCHED_PROTOCOL.replace("packet:", "packet (%r):"), bytes((found.byte,)))
        version = _VERSIONS.get(found.byte)
        text = (
            f"Protocol version of client is {version}"
            if version
            else "Protocol version of client is unrecognized"
        )
        rospy.loginfo("%s, expected %s", text, _VERSIONS[0xFE])

    def _handle(self, packet: Packet) -> None:
        callback = self.callbacks.get(packet.topic_id)
        if callback is None:
            rospy.logerr("Tried to publish before configured, topic id %d", packet.topic_id)
            self._to_write.put(encode(TopicInfo.ID_PUBLISHER, b""))
            rospy.loginfo("Requesting topics...")
            return
        try:
            callback(packet.data)
        except (rospy.ROSException, MinirospyError, ValueError, KeyError, TypeError) as error:
            rospy.logerr("A message of topic id %d is dropped: %s", packet.topic_id, error)

    # --- messages from the device

    def setPublishSize(self, size: int) -> None:
        """Set the size of the device's output buffer; only the first call has an effect."""
        if self.buffer_out < 0:
            self.buffer_out = size
            rospy.loginfo("Note: publish buffer size is %d bytes", size)

    def setSubscribeSize(self, size: int) -> None:
        """Set the size of the device's input buffer; only the first call has an effect."""
        if self.buffer_in < 0:
            self.buffer_in = size
            rospy.loginfo("Note: subscribe buffer size is %d bytes", size)

    def setupPublisher(self, data: bytes) -> None:
        """Advertise a topic that the device publishes."""
        with _Creation("publisher"):
            info = _info(data)
            known = self.publishers.pop(info.topic_id, None)
            if known is not None:
                known.unregister()
            publisher = Publisher(info)
            self.publishers[info.topic_id] = publisher
            self.callbacks[info.topic_id] = publisher.handle
            self.setPublishSize(info.buffer_size)
            rospy.loginfo("Setup publisher on %s [%s]", info.topic_name, info.message_type)

    def setupSubscriber(self, data: bytes) -> None:
        """Subscribe to a topic that the device receives."""
        with _Creation("subscriber"):
            info = _info(data)
            known = self.subscribers.get(info.topic_name)
            if known is None:
                # Set the size before the first message can arrive.
                self.setSubscribeSize(info.buffer_size)
                self.subscribers[info.topic_name] = Subscriber(info, self.send)
                rospy.loginfo("Setup subscriber on %s [%s]", info.topic_name, info.message_type)
            elif known.message._type != info.message_type:
                known.unregister()
                del self.subscribers[info.topic_name]
                self.subscribers[info.topic_name] = Subscriber(info, self.send)
                self.setSubscribeSize(info.buffer_size)
                rospy.loginfo(
                    "Change the message type of subscriber on %s from [%s] to [%s]",
                    info.topic_name,
                    known.message._type,
                    info.message_type,
                )
            else:
                # A device may number its topics differently after a restart.
                known.id = info.topic_id

    def setupServiceServerPublisher(self, data: bytes) -> None:
        """Register the topic on which the device sends responses from its service."""
        self._set_up_half(data, ServiceServer, "server", from_device=True)

    def setupServiceServerSubscriber(self, data: bytes) -> None:
        """Register the topic on which the device receives requests to its service."""
        self._set_up_half(data, ServiceServer, "server", from_device=False)

    def setupServiceClientPublisher(self, data: bytes) -> None:
        """Register the topic on which the device sends requests when it calls a service."""
        self._set_up_half(data, ServiceClient, "client", from_device=True)

    def setupServiceClientSubscriber(self, data: bytes) -> None:
        """Register the topic on which the device receives responses when it calls a service."""
        self._set_up_half(data, ServiceClient, "client", from_device=False)

    def _set_up_half(self, data: bytes, kind: type[_Service], name: str, *, from_device: bool) -> None:
        """Register one direction of a service: messages from or to the device."""
        with _Creation(f"service {name}"):
            info = _info(data)
            (self.setPublishSize if from_device else self.setSubscribeSize)(info.buffer_size)
            service = self._service(info, kind, name)
            if from_device == (kind is ServiceServer):
                service.check_response(info)
            else:
                service.check_request(info)
            if from_device:
                self.callbacks[info.topic_id] = service.handle
            else:
                service.id = info.topic_id

    def _service(self, info: TopicInfo, kind: type[_Service], name: str) -> _Service:
        known = self.services.get(info.topic_name)
        if not isinstance(known, kind):
            if known is not None:
                known.unregister()
            known = self.services[info.topic_name] = kind(info, self.send)
            rospy.loginfo("Setup service %s on %s [%s]", name, info.topic_name, info.message_type)
        return known

    def handleTimeRequest(self, data: bytes) -> None:
        """Send the time to the device. The device's requests for the time also serve as a heartbeat."""
        self.send(TopicInfo.ID_TIME, to_bytes(Time(rospy.Time.now())))
        self.lastsync = rospy.Time.now()
        self._synced_at = time.monotonic()

    def handleParameterRequest(self, data: bytes) -> None:
        """Send a parameter to the device: numbers or strings, all of the same type."""
        request = RequestParamRequest()
        request.deserialize(data)
        value = rospy.get_param(request.name, None)
        if value is None:
            rospy.logerr("Parameter %s does not exist", request.name)
            return
        if isinstance(value, dict):
            rospy.logerr("Cannot send param %s because it is a dictionary", request.name)
            return
        values = value if isinstance(value, list) else [value]
        if len({type(each) for each in values}) > 1:
            rospy.logerr("All Paramers in the list %s must be of the same type", request.name)
            return
        response = RequestParamResponse()
        first = values[0] if values else None
        if isinstance(first, int):
            response.ints = values
        elif isinstance(first, float):
            response.floats = values
        elif isinstance(first, str):
            response.strings = values
        self.send(TopicInfo.ID_PARAMETER_REQUEST, to_bytes(response))

    def handleLoggingRequest(self, data: bytes) -> None:
        """Log a message from the device."""
        line = Log()
        line.deserialize(data)
        log = {
            Log.ROSDEBUG: rospy.logdebug,
            Log.INFO: rospy.loginfo,
            Log.WARN: rospy.logwarn,
            Log.ERROR: rospy.logerr,
            Log.FATAL: rospy.logfatal,
        }.get(line.level)
        if log is not None:
            log("%s", line.msg)

    def sendDiagnostics(self, level: int, msg_text: str) -> None:
        """Publish the connection's state on /diagnostics."""
        last = time.ctime(self.lastsync.to_sec()) if self.lastsync else "never"
        values = [
            KeyValue("last sync", last),
            KeyValue("last sync lost", time.ctime(self.lastsync_lost.to_sec())),
        ]
        array = DiagnosticArray(
            status=[DiagnosticStatus(level=level, name="rosserial_python", message=msg_text, values=values)]
        )
        array.header.stamp = rospy.Time.now()
        self.pub_diagnostics.publish(array)


def _info(data: bytes) -> TopicInfo:
    info = TopicInfo()
    info.deserialize(data)
    return info


class _Creation:
    """A context manager that logs and suppresses errors when creating a topic or service."""

    def __init__(self, what: str) -> None:
        self._what = what

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        if not isinstance(error, EndpointError | rospy.ROSException | MinirospyError | ValueError):
            return False
        rospy.logerr("Creation of %s failed: %s", self._what, error)
        return True
