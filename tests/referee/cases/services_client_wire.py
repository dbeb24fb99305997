"""A proxy on the wire, and its handling of a server's responses, with a scripted server."""

import socket
import struct
import threading

import rosgraph
import rospy
from referee import outcome, show
from std_srvs.srv import SetBool

rospy.init_node("case", argv=[])
listening = socket.create_server(("127.0.0.1", 0))
port = listening.getsockname()[1]
rosgraph.Master("/other").registerService("/s", f"rosrpc://localhost:{port}", "http://localhost:1/")
MD5 = SetBool._md5sum
received = []


def packed(text):
    return struct.pack("<I", len(text)) + text


def header(**fields):
    return packed(b"".join(packed(k.encode() + b"=" + v.encode()) for k, v in fields.items()))


def receive(sock, count):
    data = b""
    while len(data) < count:
        more = sock.recv(count - len(data))
        if not more:
            return data
        data += more
    return data


def serve(answers):
    """Accept a connection for each of ``answers``: (header, list of the responses to each request)."""
    for greeting, replies in answers:
        sock, _ = listening.accept()
        body = receive(sock, struct.unpack("<I", receive(sock, 4))[0])
        fields = []
        while body:
            (length,) = struct.unpack("<I", body[:4])
            fields.append(body[4 : 4 + length].decode())
            body = body[4 + length :]
        received.append(sorted(fields))
        sock.sendall(greeting)
        for reply in replies:
            receive(sock, struct.unpack("<I", receive(sock, 4))[0])
            sock.sendall(reply)
        sock.close()


good = header(callerid="/by_hand", md5sum=MD5, type="std_srvs/SetBool", request_type="a", response_type="b")
yes = b"\x01" + packed(b"\x01" + packed(b"fine"))


def case(label, answers, calls=None, **kwds):
    received.clear()
    thread = threading.Thread(target=serve, args=(answers,))
    thread.start()
    proxy = rospy.ServiceProxy("/s", SetBool, **kwds)
    for call in calls or [lambda p: p(True)]:
        outcome(label, lambda: call(proxy))
    thread.join()
    for fields in received:
        show("   received", fields)


case("good", [(good, [yes])])
case("headers", [(good, [yes])], headers={"cookie": "abc", "zeta": "1"})
case("headers that are ours", [(good, [yes])], headers={"callerid": "/fake", "md5sum": "x", "service": "/y"})
case("persistent", [(good, [yes, yes])], [lambda p: p(True), lambda p: p(False)], persistent=True)
case("an error", [(good, [b"\0" + packed(b"what went wrong")])])
case("an error without text", [(good, [b"\0" + packed(b"")])])
case("an error that is not UTF-8", [(good, [b"\0" + packed(b"\xff\xfe")])])
case("error, then good", [(good, [b"\0" + packed(b"wrong"), yes])], [lambda p: p(True)] * 2, persistent=True)
case("refused", [(header(error="go away"), [])])
case("hangs up at the header", [(b"", [])])
case("hangs up after the header", [(good, [])])
case("hangs up in the answer", [(good, [b"\x01\x10\0\0\0abc"])])
case("hangs up after the status", [(good, [b"\x01"])])
case("long answer", [(good, [b"\x01" + packed(b"\x01" + packed(b"fine") + b"more")])])
case("status 2", [(good, [b"\x02" + packed(b"\x01" + packed(b"fine"))])])
case("md5sum of another", [(header(callerid="/x", md5sum="0" * 32, type="a/B"), [yes])])
case("no md5sum", [(header(callerid="/x"), [yes])])
case("the answer's header", [(good, [yes])], [lambda p: sorted(p(True)._connection_header.items())])
listening.close()
outcome("nobody listens", lambda: rospy.ServiceProxy("/s", SetBool)(True))
