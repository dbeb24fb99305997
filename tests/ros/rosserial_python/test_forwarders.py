"""rosserial_python's Publisher, Subscriber, ServiceServer and ServiceClient, with a program's own device."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import queue

import rospy
from rosserial_msgs.msg import TopicInfo
from rosserial_python import Publisher, ServiceClient, ServiceServer, Subscriber, load_message, load_service
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse


class Device:
    def __init__(self):
        self.sent = queue.Queue()

    def send(self, topic, data):
        self.sent.put((topic, data))


rospy.init_node("forwards")
device = Device()
info = TopicInfo(7, "chatter", "std_msgs/String", String._md5sum, 512)
publisher, subscriber = Publisher(info), Subscriber(info, device)
publisher.publisher.wait_for_subscribers()
publisher.handlePacket(b"\\2\\0\\0\\0hi")
print(device.sent.get(timeout=20), subscriber.parent is device)
subscriber.unregister()

server = ServiceServer(TopicInfo(8, "ask", "std_srvs/Trigger", "", 512), device)
server.id = 9
device.send = lambda topic, data: server.handlePacket(b"\\1\\3\\0\\0\\0yes")
print(rospy.ServiceProxy("ask", Trigger)())

device.send = lambda topic, data: device.sent.put((topic, data))
rospy.Service("told", Trigger, lambda request: TriggerResponse(True, "no"))
client = ServiceClient(TopicInfo(8, "told", "std_srvs/Trigger", "", 512), device)
client.id = 10
client.handlePacket(b"")
print(device.sent.get(timeout=20))

print(load_message("std_msgs", "String") is String, load_service("std_srvs", "Trigger")[1] is TriggerRequest)
try:
    Publisher(TopicInfo(7, "other", "std_msgs/String", "0", 512))
except Exception as error:
    print(error)
try:
    load_message("no_such_msgs", "A")
except AttributeError as error:
    print(error)
"""


def test_a_program_forwards_for_its_own_device(master: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert [line for line in done.stdout.splitlines() if not line.startswith("[INFO]")] == [
        r"(7, b'\x02\x00\x00\x00hi') True",
        "success: True",
        'message: "yes"',
        r"(10, b'\x01\x02\x00\x00\x00no')",
        "True True",
        "Checksum does not match: 992ce8a1687cec8c8bd883ec73ca41d1,0",
        "'NoneType' object has no attribute 'msg'",
    ]
