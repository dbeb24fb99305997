"""Bad peers: after each of them the node serves a well-behaved one."""

import socket
import struct
import xmlrpc.client

import rospy
from referee import outcome
from std_msgs.msg import String

rospy.init_node("case", argv=[])
publisher = rospy.Publisher("/topic", String, queue_size=1, latch=True)
publisher.publish("x")
node = xmlrpc.client.ServerProxy(rospy.get_node_uri())
_, _, (_, host, port) = node.requestTopic("/me", "/topic", [["TCPROS"]])


def field(text):
    return struct.pack("<I", len(text)) + text


def good():
    """Return the messages that a well-behaved subscriber receives."""
    with socket.create_connection((host, port), 10) as sock:
        body = b"".join(
            field(t) for t in (b"topic=/topic", b"md5sum=" + String._md5sum.encode(), b"callerid=/raw")
        )
        sock.sendall(field(body))
        stream = sock.makefile("rb")
        stream.read(struct.unpack("<I", stream.read(4))[0])
        return stream.read(struct.unpack("<I", stream.read(4))[0])


bad = {
    "nothing": b"",
    "half a length": b"\x01\x00",
    "half a header": struct.pack("<I", 100) + b"topic",
    "no fields": struct.pack("<I", 0),
    "a request for a page": b"GET / HTTP/1.1\r\n\r\n",
    "a field that is longer than the header": struct.pack("<II", 8, 1000) + b"abcd",
    "a field without =": field(field(b"topic")),
    "a field without a name": field(field(b"=x")),
    "bytes of no text": field(field(b"\xff\xfe=\xff")),
    "random bytes": bytes(range(255, 0, -1)) * 10,
}
for label, data in bad.items():
    sock = socket.create_connection((host, port), 10)
    if data:
        sock.sendall(data)
    sock.close()
    outcome(label, good)
for label, body in {
    "no XML": b"garbage",
    "half a call": b"<?xml version='1.0'?><methodCall><methodName>getPid</methodName>",
    "no method": b"<?xml version='1.0'?><methodCall></methodCall>",
}.items():
    with socket.create_connection(
        (
            rospy.get_node_uri().split("/")[2].split(":")[0],
            int(rospy.get_node_uri().split(":")[2].strip("/")),
        ),
        10,
    ) as sock:
        sock.sendall(
            b"POST / HTTP/1.1\r\nContent-Length: %d\r\nContent-Type: text/xml\r\n\r\n" % len(body) + body
        )
    outcome(label, lambda: node.getName("/me"))
