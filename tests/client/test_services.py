"""Where minirospy's services deliberately differ from rospy's, which hang or leave a dead proxy."""

from __future__ import annotations

import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Iterator

import pytest

from minirospy.base.errors import CallFailed
from minirospy.runtime.node.service_client import ServiceClient
from minirospy.runtime.rpc.master_proxy import MasterProxy

SERVER = """
import sys
import threading
import rospy
from std_srvs.srv import SetBool, Trigger

gate = threading.Event()

def slow(request):
    print("called", flush=True)
    gate.wait(30)
    return True, "late"

rospy.init_node(sys.argv[1])
rospy.Service("/slow", Trigger, slow)
rospy.Service("/s", SetBool, lambda request: (request.data, sys.argv[1]))
print("ready", flush=True)
for line in sys.stdin:
    exec(line)
"""

PERSISTENT = """
import sys
import rospy
from std_srvs.srv import SetBool

rospy.init_node("client")
proxy = rospy.ServiceProxy("/s", SetBool, persistent=True)
for line in sys.stdin:
    try:
        print(proxy(True).message, flush=True)
    except rospy.ServiceException as error:
        print(error, flush=True)
"""

WAITING = """
import threading
import rospy
from std_srvs.srv import Trigger

def call():
    try:
        rospy.ServiceProxy("/slow", Trigger)()
    except rospy.ROSInterruptException as error:
        print(error, flush=True)

rospy.init_node("client")
thread = threading.Thread(target=call)
thread.start()
input()
rospy.signal_shutdown("enough")
thread.join()
"""

WAITING_TRANSPORT = WAITING.replace('rospy.ServiceProxy("/slow", Trigger)()', "proxy()").replace(
    'rospy.init_node("client")',
    """rospy.init_node("client")
proxy = rospy.ServiceProxy("/slow", Trigger, persistent=True)
proxy()
print(type(proxy.transport).__name__, flush=True)
input()""",
)

Program = subprocess.Popen[str]


@pytest.fixture
def started(master: str) -> Iterator[list[Program]]:
    """Yield a list of programs that are stopped after the test."""
    programs: list[Program] = []
    yield programs
    for program in programs:
        program.kill()
        program.communicate()


def start(started: list[Program], code: str, *arguments: str) -> Program:
    program = subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    started.append(program)
    return program


def say(program: Program, line: str = "") -> None:
    assert program.stdin
    program.stdin.write(line + "\n")
    program.stdin.flush()


def hear(program: Program) -> str:
    assert program.stdout
    return program.stdout.readline().rstrip("\n")


def test_a_persistent_proxy_outlives_its_server(started: list[Program]) -> None:
    """Afterwards, rospy's proxy would raise AttributeError at each call."""
    client = start(started, PERSISTENT)
    for name in ("one", "two"):
        server = start(started, SERVER, name)
        assert hear(server) == "ready"
        for _ in range(2):
            say(client)
            assert hear(client) == name
        say(server, "rospy.signal_shutdown('end')")
        say(server, "sys.exit()")
        server.wait(30)
        say(client)
        assert hear(client) == "service [/s] unavailable"


def test_a_proxy_whose_transport_was_read_connects_again(started: list[Program]) -> None:
    client = start(
        started, PERSISTENT.replace("print(proxy(True)", "print(proxy.transport is None, proxy(True)")
    )
    for name, has_none in (("one", True), ("two", False)):
        server = start(started, SERVER, name)
        assert hear(server) == "ready"
        for is_none in (has_none, False):
            say(client)
            assert hear(client) == f"{is_none} {name}"
        server.terminate()
        server.wait(30)


CONCURRENT = """
import threading
import rospy
from std_srvs.srv import SetBool

def call(value):
    for count in range(300):
        if count == 100:
            proxy.transport
        response = proxy(value)
        if response.success is not value:
            print("the response of the other thread", flush=True)

rospy.init_node("client")
proxy = rospy.ServiceProxy("/s", SetBool, persistent=True)
threads = [threading.Thread(target=call, args=[value]) for value in (True, False)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(proxy.seq, flush=True)
"""


def test_calls_of_two_threads_run_one_at_a_time_after_transport_was_read(started: list[Program]) -> None:
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    client = start(started, CONCURRENT)
    assert hear(client) == "600"
    assert client.wait(30) == 0


ABORTING = """
import threading
import rospy
from std_srvs.srv import Trigger

def call():
    try:
        proxy()
    except rospy.ServiceException as error:
        print(error, flush=True)

rospy.init_node("client")
proxy = rospy.ServiceProxy("/slow", Trigger, persistent=True)
thread = threading.Thread(target=call)
thread.start()
input()
proxy.transport.close()
thread.join()
input()
print(proxy().message, flush=True)
"""


@pytest.mark.parametrize("end", ["proxy.transport.close()", "proxy.transport = None"])
def test_transport_can_be_read_and_set_during_a_call(started: list[Program], end: str) -> None:
    """Programs close the transport to abort the call of another thread, so reading it does not wait for that call."""
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    client = start(started, ABORTING.replace("proxy.transport.close()", end))
    assert hear(server) == "called"
    say(client)
    assert hear(client).startswith("transport error completing service call: ")
    say(server, "gate.set()")
    say(client)
    assert hear(client) == "late"


def test_transport_that_returns_no_response_is_a_service_error(started: list[Program]) -> None:
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    client = start(
        started,
        PERSISTENT.replace(
            "print(proxy(True)", "proxy.transport.receive_once = list; print(proxy(True)"
        ).replace("for line in", "proxy(True)\nfor line in"),
    )
    say(client)
    assert hear(client) == "service [/s] returned no response"


CLOSING = """
import threading
import rospy
from std_srvs.srv import Trigger

def call():
    try:
        proxy()
    except rospy.ServiceException as error:
        print(error, flush=True)

rospy.init_node("client")
proxy = rospy.ServiceProxy("/slow", Trigger, persistent=True)
thread = threading.Thread(target=call)
thread.start()
input()
proxy.close()
thread.join()
input()
print(proxy().message, flush=True)
"""


def test_closing_a_persistent_proxy_ends_the_call_of_another_thread(started: list[Program]) -> None:
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    client = start(started, CLOSING)
    assert hear(server) == "called"
    say(client)
    assert hear(client).startswith(
        "transport error completing service call: unable to receive data from sender"
    )
    say(server, "gate.set()")
    say(client)
    assert hear(client) == "late"


def test_a_proxy_follows_a_service_that_moves(started: list[Program]) -> None:
    """The proxy first connects to the last known address. The response comes from the node that the master returns."""
    client = start(started, PERSISTENT.replace("persistent=True", "persistent=False"))
    servers = []
    for name in ("one", "two"):
        servers.append(start(started, SERVER, name))
        assert hear(servers[-1]) == "ready"
        for _ in range(2):
            say(client)
            assert hear(client) == name
    # The first server is still running, and serves its clients.
    assert servers[0].poll() is None
    servers[1].kill()
    servers[1].wait()
    say(client)
    assert hear(client).startswith("unable to connect to service: ")


def test_a_shutdown_ends_a_call_that_waits(started: list[Program]) -> None:
    """rospy would wait for the handler to return."""
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    client = start(started, WAITING)
    assert hear(server) == "called"
    say(client)
    assert hear(client) == "node shutdown interrupted service call"
    assert client.wait(30) == 0


def test_shutdown_ends_a_call_through_a_transport(started: list[Program]) -> None:
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    say(server, "gate.set()")
    client = start(started, WAITING_TRANSPORT)
    assert hear(server) == "called"
    assert hear(client) == "TCPROSTransport"
    say(server, "gate.clear(); print('cleared', flush=True)")
    assert hear(server) == "cleared"
    say(client)
    assert hear(server) == "called"
    say(client)
    assert hear(client) == "node shutdown interrupted service call"
    assert client.wait(30) == 0


HOOKED = """
import rospy
from std_srvs.srv import Trigger

def hook():
    print(proxy().message, flush=True)

rospy.init_node("client")
rospy.on_shutdown(hook)
proxy = rospy.ServiceProxy("/slow", Trigger, persistent=True)
proxy()
proxy.transport
print("ready", flush=True)
input()
proxy()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals between processes")
@pytest.mark.parametrize("reads", ["proxy.transport", ""])
def test_shutdown_hook_may_call_the_proxy_whose_call_it_interrupts(
    started: list[Program], reads: str
) -> None:
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    say(server, "gate.set()")
    client = start(started, HOOKED.replace("\nproxy.transport\n", f"\n{reads}\n"))
    assert hear(server) == "called"
    assert hear(client) == "ready"
    say(server, "gate.clear(); print('cleared', flush=True)")
    assert hear(server) == "cleared"
    say(client)
    assert hear(server) == "called"
    client.send_signal(signal.SIGINT)
    assert hear(server) == "called"
    say(server, "gate.set()")
    assert hear(client) == "late"
    client.wait(30)


def test_a_request_that_does_not_fit_is_answered(started: list[Program], master: str) -> None:
    """In rospy, the thread would exit and the client would wait forever."""
    server = start(started, SERVER, "server")
    assert hear(server) == "ready"
    proxy = MasterProxy(master, "/test")
    host, port = proxy.lookup_service("/s").removeprefix("rosrpc://").split(":")
    proxy.close()
    pairs = [
        f"{key}={value}".encode() for key, value in (("callerid", "/me"), ("md5sum", "*"), ("service", "/s"))
    ]
    header = b"".join(struct.pack("<I", len(pair)) + pair for pair in pairs)
    with socket.create_connection((host, int(port)), 30) as sock, sock.makefile("rb") as answer:
        sock.sendall(struct.pack("<I", len(header)) + header)
        answer.read(struct.unpack("<I", answer.read(4))[0])
        sock.sendall(struct.pack("<I", 0))
        ok, length = struct.unpack("<BI", answer.read(5))
        assert ok == 0
        assert answer.read(length).startswith(b"error processing request: ")


def test_call_of_missing_service_raises_one_error(started: list[Program]) -> None:
    """rospy would also print its own internals."""
    client = start(
        started,
        """
import rospy
from std_srvs.srv import Trigger

rospy.init_node("n")
try:
    rospy.ServiceProxy("/nobody", Trigger)()
except rospy.ServiceException as error:
    print(error, error.__suppress_context__ and error.__cause__, flush=True)
""",
    )
    assert hear(client) == "service [/nobody] unavailable None"
    assert client.wait(30) == 0


def test_a_service_that_one_thread_ends_another_may_offer_at_that_moment(started: list[Program]) -> None:
    node = start(
        started,
        """
import threading
import minirospy.client.service as module
import rospy
from std_srvs.srv import Trigger

rospy.init_node("n")
offered = []

def offer():
    offered.append(rospy.Service("/s", Trigger, lambda request: (True, str(len(offered)))))

def let_another_begin(wait):
    other = threading.Thread(target=offer)
    other.start()
    other.join(20)
    unregister_from_master(wait)

unregister_from_master = module.unregister_from_master
module.unregister_from_master = let_another_begin
offer()
offered[0].shutdown()
print(rospy.ServiceProxy("/s", Trigger)().message, flush=True)
""",
    )
    assert hear(node) == "2"
    assert node.wait(30) == 0


ERROR_HANDLER = """
import rospy
from std_srvs.srv import Trigger

def handler(request):
    raise ValueError("no such joint")

def error_handler(error, *_):
    raise RuntimeError("no log")

rospy.init_node("server")
rospy.Service("/s", Trigger, handler, error_handler=error_handler)
print("ready", flush=True)
rospy.spin()
"""


def test_error_handler_that_raises_does_not_hide_the_error(started: list[Program], master: str) -> None:
    assert hear(start(started, ERROR_HANDLER)) == "ready"
    proxy = MasterProxy(master, "/test")
    uri = proxy.lookup_service("/s")
    proxy.close()
    client = ServiceClient(uri, "/s", "*", "/test", persistent=True)
    for _ in range(2):
        with pytest.raises(CallFailed, match="error processing request: no such joint"):
            client.call(b"")
    client.close()
