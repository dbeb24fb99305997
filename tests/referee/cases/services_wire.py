"""A service on the wire: connection headers, probes, refusals, several calls on one connection."""

import socket
import struct

import rosgraph
import rospy
from referee import show
from std_srvs.srv import SetBool, SetBoolResponse

rospy.init_node("case", argv=[])
seen = []


def handler(request):
    seen.append(request)
    if request.data:
        return SetBoolResponse(True, "yes")
    raise ValueError("no")


service = rospy.Service("s", SetBool, handler)
uri = rosgraph.Master("/case").lookupService("/s")
address = uri.split("//")[1].split(":")
MD5 = SetBool._md5sum


def header(**fields):
    body = b"".join(
        struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v.encode() for k, v in fields.items()
    )
    return struct.pack("<I", len(body)) + body


def receive(sock, count):
    data = b""
    while len(data) < count:
        more = sock.recv(count - len(data))
        if not more:
            raise EOFError
        data += more
    return data


def fields_of(sock):
    body = receive(sock, struct.unpack("<I", receive(sock, 4))[0])
    found = {}
    while body:
        (length,) = struct.unpack("<I", body[:4])
        key, _, value = body[4 : 4 + length].partition(b"=")
        found[key.decode()] = value.decode()
        body = body[4 + length :]
    return found


def connect(label, **fields):
    sock = socket.create_connection((address[0], int(address[1])), 5)
    sock.sendall(header(**fields))
    try:
        # roscpp's fields in addition to rospy's are harmless.
        found = fields_of(sock)
        show(
            label,
            [(key, found[key]) for key in sorted(found) if key not in ("request_type", "response_type")],
        )
    except EOFError:
        show(label, "hung up")
    return sock


def ask(label, sock, body):
    try:
        sock.sendall(struct.pack("<I", len(body)) + body)
        ok, length = struct.unpack("<BI", receive(sock, 5))
        show(label, ok, receive(sock, length))
    except (EOFError, ConnectionError):
        show(label, "hung up")


def ended(label, sock):
    try:
        show(label, "rest", sock.recv(100))
    except ConnectionError:
        show(label, "rest", b"")
    except TimeoutError:
        show(label, "still open")
    sock.close()


sock = connect("call", callerid="/me", md5sum=MD5, service="/s")
ask("  True", sock, b"\x01")
ended("  after one call", sock)
sock = connect("an error", callerid="/me", md5sum=MD5, service="/s")
ask("  False", sock, b"\x00")
ended("  after an error", sock)
sock = connect("persistent", callerid="/me", md5sum=MD5, service="/s", persistent="1")
for body in (b"\x01", b"\x00", b"\x01"):
    ask("  call", sock, body)
sock.settimeout(0.3)
ended("  persistent", sock)
sock = connect("persistent=true", callerid="/me", md5sum=MD5, service="/s", persistent="true")
ask("  call", sock, b"\x01")
ask("  call", sock, b"\x01")
sock.close()
sock = connect("persistent=0", callerid="/me", md5sum=MD5, service="/s", persistent="0")
ask("  call", sock, b"\x01")
ended("  then", sock)
sock = connect("any md5sum", callerid="/me", md5sum="*", service="/s")
ask("  call", sock, b"\x01")
sock.close()
sock = connect("more fields", callerid="/me", md5sum=MD5, service="/s", type="std_srvs/SetBool", mine="hello")
ask("  call", sock, b"\x01")
show("  seen by the handler", sorted(seen[-1]._connection_header.items()))
sock.close()
ended("probe", connect("probe", callerid="/me", md5sum="*", service="/s", probe="1"))
ended("no callerid", connect("no callerid", md5sum=MD5, service="/s"))
ended("no md5sum", connect("no md5sum", callerid="/me", service="/s"))
ended("wrong md5sum", connect("wrong md5sum", callerid="/me", md5sum="0" * 32, service="/s"))
ended("wrong type", connect("wrong type", callerid="/me", md5sum=MD5, service="/s", type="a/B"))
ended("unknown service", connect("unknown service", callerid="/me", md5sum=MD5, service="/t"))
ended("relative name", connect("relative name", callerid="/me", md5sum=MD5, service="s"))
ended("neither", connect("neither", callerid="/me", md5sum=MD5))
sock = connect("too long a request", callerid="/me", md5sum=MD5, service="/s")
ask("  three bytes", sock, b"\x01\x02\x03")
sock.close()
sock = connect("in pieces", callerid="/me", md5sum=MD5, service="/s")
for piece in (b"\x01", b"\0\0", b"\0", b"\x01"):
    sock.sendall(piece)
ok, length = struct.unpack("<BI", receive(sock, 5))
show("  answer", ok, receive(sock, length))
sock.close()
sock = connect("pipelined", callerid="/me", md5sum=MD5, service="/s", persistent="1")
sock.sendall(b"\x01\0\0\0\x01" * 3)
for _ in range(3):
    ok, length = struct.unpack("<BI", receive(sock, 5))
    show("  answer", ok, receive(sock, length))
sock.close()
