"""Connection headers: the publisher's in a callback, the header sent to a peer, the responses to raw subscribers."""

import os
import socket
import struct
import threading
import xmlrpc.client
from xmlrpc.server import SimpleXMLRPCServer

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import Bool, String


def field(text):
    return struct.pack("<I", len(text)) + text


def header(**fields):
    body = b"".join(field(f"{name}={value}".encode()) for name, value in fields.items())
    return struct.pack("<I", len(body)) + body


def receive(sock, count):
    data = b""
    while len(data) < count:
        more = sock.recv(count - len(data))
        if not more:
            raise EOFError(f"end after {len(data)} bytes")
        data += more
    return data


def answer(sock):
    """Return the fields of a received header."""
    body = receive(sock, struct.unpack("<I", receive(sock, 4))[0])
    fields = {}
    while body:
        (length,) = struct.unpack_from("<I", body)
        name, _, value = body[4 : 4 + length].decode().partition("=")
        fields[name] = value
        body = body[4 + length :]
    return fields


# For minirospy: use only ROS 1's transport.
os.environ["MINIROSPY_TRANSPORT"] = "tcp"
rospy.init_node("case", argv=[])
got = []
arrived = threading.Event()
publisher = rospy.Publisher(
    "/topic", String, queue_size=1, latch=True, headers={"extra": "5", "topic": "mine"}
)
publisher.publish("x")
rospy.Subscriber("/topic", String, lambda message: (got.append(message), arrived.set()))
arrived.wait(60)
for name, value in sorted(got[0]._connection_header.items()):
    show("header", name, repr(value))

node = xmlrpc.client.ServerProxy(rospy.get_node_uri())
code, text, (protocol, host, port) = node.requestTopic("/me", "/topic", [["TCPROS"]])
show("requestTopic", code, text, protocol, host)
for label, args in {
    "an unknown topic": ("/me", "/nobody", [["TCPROS"]]),
    "an unknown protocol": ("/me", "/topic", [["CARRIER_PIGEON"]]),
    "UDPROS first": ("/me", "/topic", [["CARRIER_PIGEON"], ["TCPROS"]]),
    "no protocol": ("/me", "/topic", []),
    "a number as topic": ("/me", 5, [["TCPROS"]]),
    "too few arguments": ("/me", "/topic"),
    "a string as protocols": ("/me", "/topic", "TCPROS"),
}.items():
    outcome(f"requestTopic with {label}", lambda args=args: node.requestTopic(*args))

MD5, OTHER = String._md5sum, Bool._md5sum
usual = {"topic": "/topic", "md5sum": MD5, "type": "std_msgs/String", "callerid": "/raw"}
for label, changes in {
    "as it should be": {},
    "any type": {"md5sum": "*", "type": "*"},
    "any md5sum": {"md5sum": "*"},
    "no type": {"type": None},
    "no callerid": {"callerid": None},
    "no md5sum": {"md5sum": None},
    "no topic": {"topic": None},
    "another topic": {"topic": "/nobody"},
    "another md5sum": {"md5sum": OTHER},
    "another type": {"md5sum": OTHER, "type": "std_msgs/Bool"},
    "another type with the same md5sum": {"type": "std_msgs/Bool"},
    "tcp_nodelay": {"tcp_nodelay": "1"},
    "a field of ours": {"my_field": "x=y"},
}.items():
    fields = {name: value for name, value in {**usual, **changes}.items() if value is not None}
    sock = socket.create_connection((host, port), 10)
    sock.sendall(header(**fields))
    try:
        reply = answer(sock)
        reply.pop("message_definition", None)
        show(label, "|", *(f"{name}={value}" for name, value in sorted(reply.items())))
        if "error" in reply:
            show(label, "then", sock.recv(1))
        else:
            show(label, "then", receive(sock, struct.unpack("<I", receive(sock, 4))[0]))
    except (EOFError, OSError) as error:
        show(label, "ends with", type(error).__name__, error)
    sock.close()

# The header that a Subscriber sends first, received by a socket in place of a publisher.
server = socket.create_server(("127.0.0.1", 0))
slave = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
asked = []


def request_topic(*args):
    asked.append(args)
    return [1, "ready", ["TCPROS", "127.0.0.1", server.getsockname()[1]]]


slave.register_function(request_topic, "requestTopic")
threading.Thread(target=slave.serve_forever, daemon=True).start()
xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"]).registerPublisher(
    "/foreign", "/from_outside", "std_msgs/String", f"http://127.0.0.1:{slave.server_address[1]}/"
)
heard = []
for nodelay in (False, True):
    subscriber = rospy.Subscriber("/from_outside", String, heard.append, tcp_nodelay=nodelay)
    server.settimeout(10)
    sock, _ = server.accept()
    reply = answer(sock)
    show(
        "a Subscriber sends",
        sorted(reply),
        reply["tcp_nodelay"],
        reply["topic"],
        reply["type"],
        reply["callerid"],
    )
    show("its definition", repr(reply["message_definition"]))
    show("it asked", asked.pop())
    sock.sendall(header(md5sum=MD5, type="std_msgs/String") + struct.pack("<II", 5, 1) + b"a")
    show("received", eventually(lambda: len(heard) == 1), heard[0].data)
    got_header = heard.pop()._connection_header
    show("a header of two fields", got_header["md5sum"], got_header["type"])
    subscriber.unregister()
    show("it hangs up", sock.recv(1))
    sock.close()
