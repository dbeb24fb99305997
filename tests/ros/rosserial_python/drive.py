"""A simulated microcontroller on a pseudo-terminal and a node that communicate; prints the messages on both sides.

`drive.py PROGRAM...` starts serial_node of either stack on the terminal. drive.txt is the output for the real one (rosserial
0.9.2, which Debian does not have).
"""

from __future__ import annotations

import os
import pty
import queue
import signal
import struct
import subprocess
import sys
import threading
import time
import tty
from io import BytesIO

import rospy
from rosgraph_msgs.msg import Log as Line
from rosserial_msgs.msg import Log, TopicInfo
from rosserial_msgs.srv import RequestParamRequest, RequestParamResponse
from std_msgs.msg import Bool, String, Time
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerRequest, TriggerResponse

SECONDS = 100
CHATTER, LAMP, SERVER_OUT, SERVER_IN, CLIENT_OUT, CLIENT_IN = range(100, 106)


class Device:
    """The microcontroller's end of the serial line."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.packets: queue.Queue[tuple[int, bytes]] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            data += os.read(self.master, count - len(data))
        return data

    def _read(self) -> None:
        while True:
            try:
                head = self._exactly(7)
                assert head[:2] == b"\xff\xfe", head
                length, topic = struct.unpack("<H", head[2:4])[0], struct.unpack("<H", head[5:7])[0]
                assert sum(head[2:5]) % 256 == 255
                data = self._exactly(length)
                assert (sum(head[5:7] + data) + self._exactly(1)[0]) % 256 == 255
            except OSError:
                return
            self.packets.put((topic, data))

    def raw(self, data: bytes) -> None:
        os.write(self.master, data)

    def send(self, topic: int, message: object = None) -> None:
        self.raw(packet(topic, as_bytes(message) if message is not None else b""))

    def describe(
        self, endpoint: int, topic: int, name: str, cls: object, kind: str = "", size: int = 512
    ) -> None:
        self.send(endpoint, TopicInfo(topic, name, kind or cls._type, cls._md5sum, size))

    def receive(self, what: str, cls: object = None) -> None:
        """Print the next packet."""
        try:
            topic, data = self.packets.get(timeout=SECONDS)
        except queue.Empty:
            print("device:", what, "nothing")
            return
        text: object = data
        if cls is not None:
            message = cls()
            message.deserialize(data)
            text = "a time" if cls is Time else str(message).replace("\n", "; ")
        print("device:", what, topic, text, flush=True)


def packet(topic: int, data: bytes) -> bytes:
    length, number = struct.pack("<H", len(data)), struct.pack("<H", topic)
    ends = [bytes((255 - sum(part) % 256,)) for part in (length, number + data)]
    return b"\xff\xfe" + length + ends[0] + number + data + ends[1]


def as_bytes(message: object) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def topics(
    device: Device, chatter_subscriber: rospy.Subscriber, chatter: queue.Queue[str], lamp: rospy.Publisher
) -> None:
    device.receive("is asked for its topics")
    device.describe(0, CHATTER, "chatter", String)
    device.describe(1, LAMP, "lamp", Bool, size=280)
    while not chatter_subscriber.get_num_connections():
        rospy.sleep(0.02)
    device.send(CHATTER, String("hello"))
    print("node: chatter", chatter.get(timeout=SECONDS), flush=True)
    while not lamp.get_num_connections():
        rospy.sleep(0.02)
    lamp.publish(True)
    device.receive("lamp", Bool)
    # Do the same again, as after a reset: nothing changes.
    device.describe(1, LAMP, "lamp", Bool, size=280)
    device.send(CHATTER, String("again"))
    print("node: chatter", chatter.get(timeout=SECONDS), flush=True)
    lamp.publish(False)
    device.receive("lamp", Bool)


def services(device: Device) -> None:
    device.describe(2, SERVER_OUT, "switch", SetBoolResponse, "std_srvs/SetBool")
    device.describe(3, SERVER_IN, "switch", SetBoolRequest, "std_srvs/SetBool")
    rospy.wait_for_service("switch", SECONDS)
    found: queue.Queue[object] = queue.Queue()
    proxy = rospy.ServiceProxy("switch", SetBool)

    def call() -> None:
        # serial_node learns the request id shortly after it offers the service, and refuses calls until then.
        rospy.sleep(0.5)
        while True:
            try:
                found.put(proxy(True))
                return
            except rospy.ServiceException:
                rospy.sleep(0.05)

    threading.Thread(target=call, daemon=True).start()
    device.receive("call", SetBoolRequest)
    device.send(SERVER_OUT, SetBoolResponse(True, "on"))
    print("node: response", str(found.get(timeout=SECONDS)).replace("\n", "; "), flush=True)

    service = rospy.Service("ready", Trigger, lambda _request: TriggerResponse(True, "yes"))
    device.describe(4, CLIENT_OUT, "ready", TriggerRequest, "std_srvs/Trigger")
    device.describe(5, CLIENT_IN, "ready", TriggerResponse, "std_srvs/Trigger")
    device.send(CLIENT_OUT, TriggerRequest())
    device.receive("response", TriggerResponse)
    service.shutdown("done")


def requests(device: Device) -> None:
    device.send(TopicInfo.ID_TIME)
    device.receive("time", Time)
    for name in ("whole", "real", "text", "texts", "truth", "truths"):
        device.send(TopicInfo.ID_PARAMETER_REQUEST, RequestParamRequest(f"/device/{name}"))
        device.receive(name, RequestParamResponse)
    for name in ("missing", "tree", "mixed"):
        device.send(TopicInfo.ID_PARAMETER_REQUEST, RequestParamRequest(f"/device/{name}"))
    for level in range(5):
        device.send(TopicInfo.ID_LOG, Log(level, f"line of level {level}"))


def faults(device: Device, chatter: queue.Queue[str], lamp: rospy.Publisher) -> None:
    good = packet(CHATTER, as_bytes(String("good")))
    for broken in (
        b"garbage\x00",
        b"\xff\xff",
        b"\xff\x41",
        good[:2] + b"\x09\x00\x00",
        good[:-1] + bytes(((good[-1] + 1) % 256,)),
    ):
        device.raw(broken + good)
        print("node: chatter", chatter.get(timeout=SECONDS), flush=True)
    device.send(0, TopicInfo(110, "wrong", "std_msgs/String", "0" * 32, 512))
    device.send(0, TopicInfo(111, "unknown", "no_such_msgs/Thing", "0" * 32, 512))
    device.send(1, TopicInfo(112, "unknown", "std_msgs/NoSuch", "0" * 32, 512))
    device.send(3, TopicInfo(113, "switch", "std_srvs/SetBool", "0" * 32, 512))
    device.send(999, String("of an unknown topic"))
    device.receive("is asked for its topics")
    device.describe(1, 120, "words", String, size=280)
    words = rospy.Publisher("words", String, queue_size=5)
    while not words.get_num_connections():
        rospy.sleep(0.02)
    words.publish("short")
    device.receive("words", String)
    # Send the packet in two pieces.
    for at in range(len(good)):
        device.raw(good[at : at + 1])
    print("node: chatter", chatter.get(timeout=SECONDS), flush=True)


def main(program: list[str]) -> None:
    rospy.init_node("driver", disable_signals=True)
    rospy.set_param(
        "/device",
        {
            "whole": 5,
            "real": 0.5,
            "text": "a",
            "texts": ["a", "b"],
            "truth": True,
            "truths": [1, 2],
            "tree": {"a": 1},
        },
    )
    rospy.set_param("/device/mixed", [1, "a"])
    lines: list[str] = []
    rospy.Subscriber(
        "/rosout",
        Line,
        lambda line: lines.append(f"{line.level} {line.msg}") if "serial" in line.name else None,
    )
    chatter: queue.Queue[str] = queue.Queue()
    subscriber = rospy.Subscriber("chatter", String, lambda message: chatter.put(message.data))
    lamp = rospy.Publisher("lamp", Bool, queue_size=5)

    device = Device()
    process = subprocess.Popen(
        [*program, os.ttyname(device.slave), "__name:=serial"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        # Answer once /rosout is connected. It is latched: only the last of the earlier lines is certain to arrive.
        while not lines:
            rospy.sleep(0.02)
        topics(device, subscriber, chatter, lamp)
        services(device)
        requests(device)
        faults(device, chatter, lamp)
        process.send_signal(signal.SIGINT)
        device.receive("is asked to stop")
        process.wait(SECONDS)
        # Its last lines may not have arrived yet.
        end = time.monotonic() + SECONDS
        while not any("shutdown hook" in line for line in lines) and time.monotonic() < end:
            time.sleep(0.02)
    finally:
        process.kill()
        process.wait()
    for line in lines:
        print("log:", line.replace(os.ttyname(device.slave), "PORT").partition("\n")[0])


if __name__ == "__main__":
    main(sys.argv[1:])
