"""The master under attack: how long a well-behaved client waits, and how much memory the master takes.

    python benchmarks/master_attack.py                    # each attack alone, for some seconds
    python benchmarks/master_attack.py --mixed 600        # all of them at once while nodes register
    python benchmarks/master_attack.py --only "huge tag"

A client in a process of its own calls getPid fifty times a second, each time by a new connection. Its waits hold what
the machine itself adds, so the same calls go to a server that nobody attacks (column "control"). Memory is the resident
memory of the master. Exit status 1 where a call of the good client failed or a registration was refused.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple
from xmlrpc.client import dumps

import psutil

MIB = 1024 * 1024
PERIOD = 0.02
HUGE = 60 * MIB


# --- requests


def post(body: bytes) -> bytes:
    """Return an HTTP request."""
    return b"POST / HTTP/1.1\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n" % len(body) + body


def called(method: str, *args: Any) -> bytes:
    """Return a whole request."""
    return post(dumps(args, method).encode())


def valued(value: bytes, key: str = "/attack") -> bytes:
    """Return a setParam of a value that is XML already."""
    return post(
        b"<?xml version='1.0'?><methodCall><methodName>setParam</methodName><params><param><value>/bad</value>"
        b"</param><param><value>%s</value></param><param><value>"
        % key.encode()
        + value
        + b"</value></param></params></methodCall>"
    )


def array(item: bytes, count: int) -> bytes:
    """Return an array of the same item."""
    return b"<array><data>" + item * count + b"</data></array>"


def multicall(method: str, params: list[Any], count: int) -> bytes:
    """Return a multicall of the same call."""
    call = dumps(([{"methodName": method, "params": params}],), "system.multicall").encode()
    start, end = call.index(b"<data>") + 6, call.rindex(b"</data>")
    return post(call[:start] + call[start:end] * count + call[end:])


# --- attacks


class Target:
    """The master that is attacked, and when to stop."""

    def __init__(self, port: int, end: float) -> None:
        self.port = port
        self.end = end

    @property
    def is_over(self) -> bool:
        """Return whether the attack has lasted long enough."""
        return time.monotonic() >= self.end

    def connect(self) -> socket.socket:
        """Return a new connection."""
        sock = socket.create_connection(("127.0.0.1", self.port), 20)
        sock.settimeout(20)
        return sock

    def exchange(self, request: bytes) -> None:
        """Send a request and read its answer, on a new connection."""
        with contextlib.suppress(OSError), self.connect() as sock:
            sender = threading.Thread(target=_send, args=(sock, request))
            sender.start()
            with contextlib.suppress(OSError):
                _read_answer(sock, self)
            with contextlib.suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            sender.join()

    def repeat(self, request: bytes, pause: float = 0.0) -> None:
        """Exchange the same request again and again."""
        while not self.is_over:
            self.exchange(request)
            time.sleep(pause)

    def hold(self, request: bytes, count: int) -> None:
        """Send it on many connections, and read nothing."""
        while not self.is_over:
            with contextlib.ExitStack() as stack:
                for _ in range(count):
                    if self.is_over:
                        return
                    with contextlib.suppress(OSError):
                        sock = stack.enter_context(self.connect())
                        sock.setblocking(False)
                        sock.send(request)
                self.wait(5.0)

    def wait(self, seconds: float) -> None:
        """Wait, at most until the end."""
        time.sleep(max(0.0, min(seconds, self.end - time.monotonic())))


def _send(sock: socket.socket, data: bytes) -> None:
    with contextlib.suppress(OSError):
        sock.sendall(data)


def _read_answer(sock: socket.socket, target: Target) -> None:
    data = b""
    while b"\r\n\r\n" not in data:
        more = sock.recv(65536)
        if not more:
            return
        data += more
    head, _, body = data.partition(b"\r\n\r\n")
    left = int(head.lower().partition(b"content-length:")[2].split(b"\r\n")[0]) - len(body)
    buffer = bytearray(MIB)
    while left > 0 and not target.is_over:
        count = sock.recv_into(buffer)
        if not count:
            return
        left -= count


def huge_array_multicall(target: Target) -> None:
    """200 getParam of an array of 300,000 numbers in one multicall of 40 kB."""
    target.exchange(valued(array(b"<value><int>1</int></value>", 300_000), "/attack/array"))
    target.repeat(multicall("getParam", ["/bad", "/attack/array"], 200))


def huge_string(target: Target) -> None:
    """setParam of a string of 60 MiB."""
    target.repeat(valued(b"x" * HUGE, "/attack/string"))


def wide_characters(target: Target) -> None:
    """setParam of strings of 15 million characters of which one, the first or the last, needs four bytes."""
    wide, others = "\U0001f600".encode(), b"x" * (HUGE // 4)
    while not target.is_over:
        target.exchange(valued(wide + others, "/attack/wide"))
        target.exchange(valued(others + wide, "/attack/wide"))


def huge_tag(target: Target) -> None:
    """Send a tag name of 60 MiB."""
    target.repeat(post(b"<methodCall><" + b"x" * HUGE))


def huge_comment(target: Target) -> None:
    """Send an XML comment of 60 MiB, full of what ends a tag."""
    target.repeat(post(b"<methodCall><!-- " + b"> " * (HUGE // 2)))


def many_calls(target: Target) -> None:
    """Send a multicall of 60,000 calls."""
    target.repeat(multicall("getPid", ["/bad"], 60_000))


def many_sets(target: Target) -> None:
    """Send a multicall of 20,000 setParam."""
    calls = [
        {"methodName": "setParam", "params": ["/bad", f"/attack/many/p{number}", number]}
        for number in range(20_000)
    ]
    target.repeat(called("system.multicall", calls))


def many_elements(target: Target) -> None:
    """setParam of an array of 900,000 elements."""
    target.repeat(valued(array(b"<value>a</value>", 900_000), "/attack/elements"))


def many_structs(target: Target) -> None:
    """setParam of an array of 300,000 structs, and getParam of it."""
    item = b"<value><struct><member><name>a</name><value>b</value></member></struct></value>"
    target.exchange(valued(array(item, 150_000), "/attack/structs"))
    while not target.is_over:
        target.exchange(valued(array(item, 150_000), "/attack/structs"))
        target.exchange(called("getParam", "/bad", "/attack/structs"))


def huge_base64(target: Target) -> None:
    """setParam of 60 MiB of base64."""
    target.repeat(valued(b"<base64>" + b"QUJD" * (HUGE // 4) + b"</base64>", "/attack/base64"))


def huge_chunk(target: Target) -> None:
    """Send a body of 60 MiB in one chunk, and one with the next request right behind it."""
    body = valued(b"x" * HUGE, "/attack/string").partition(b"\r\n\r\n")[2]
    chunked = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n%x\r\n%s\r\n0\r\n\r\n" % (
        len(body),
        body,
    )
    while not target.is_over:
        target.exchange(chunked)
        target.exchange(post(body) + called("getPid", "/bad"))


def huge_number(target: Target) -> None:
    """Send an integer of a million digits, and a double of ten million."""
    while not target.is_over:
        target.exchange(valued(b"<int>" + b"9" * 1_000_000 + b"</int>"))
        target.exchange(valued(b"<double>" + b"9" * 10_000_000 + b"</double>"))


def deep(target: Target) -> None:
    """Send a million arrays inside each other."""
    target.repeat(valued(b"<array><data><value>" * 1_000_000))


def whole_tree(target: Target) -> None:
    """getParam of / by twenty clients, of a tree of 200,000 parameters, which one goes on changing."""
    target.exchange(valued(array(b"<value><int>1</int></value>", 100_000), "/attack/array"))
    many = {f"p{number}": number for number in range(100_000)}
    target.exchange(called("setParam", "/bad", "/attack/tree", many))
    _side_by_side(
        [lambda: target.repeat(called("getParam", "/bad", "/"))] * 20
        + [lambda: target.repeat(called("setParam", "/bad", "/attack/tree/p1", "x"), 0.01)]
    )


def names_of_parameters(target: Target) -> None:
    """getParamNames of 100,000 parameters by ten clients."""
    many = {f"p{number}": number for number in range(100_000)}
    target.exchange(called("setParam", "/bad", "/attack/tree", many))
    _side_by_side([lambda: target.repeat(called("getParamNames", "/bad"))] * 10)


def slow_readers(target: Target) -> None:
    """200 clients that ask for 8 MiB each and read nothing."""
    target.exchange(valued(b"x" * (8 * MIB), "/attack/large"))
    target.hold(called("getParam", "/bad", "/attack/large"), 200)


def pipelines(target: Target) -> None:
    """300 clients that send a thousand calls at once each and read nothing."""
    target.hold(called("getParamNames", "/bad") * 1000, 300)


def half_bodies(target: Target) -> None:
    """1000 clients that send 900 kB of a body of 60 MiB each."""
    request = b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % HUGE + b"x" * 900_000
    while not target.is_over:
        with contextlib.ExitStack() as stack:
            for _ in range(1000):
                if target.is_over:
                    return
                with contextlib.suppress(OSError):
                    sock = stack.enter_context(target.connect())
                    sock.settimeout(1.0)
                    sock.sendall(request)
            target.wait(3.0)


def endless_head(target: Target) -> None:
    """1000 clients that send header lines without end."""
    target.hold(b"POST / HTTP/1.1\r\n" + b"X-Header: nothing\r\n" * 3000, 1000)


def small_chunks(target: Target) -> None:
    """Send a body of ten million chunks of one byte."""
    head = b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"
    target.repeat(head + b"1\r\nx\r\n" * 10_000_000)


def silent_connections(target: Target) -> None:
    """5,000 connections that say nothing."""
    target.hold(b"", 5000)


def system_states(target: Target) -> None:
    """getSystemState of a graph of 20,000 topics, by ten clients, while another one changes it."""
    calls = [
        {
            "methodName": "registerPublisher",
            "params": [f"/bad{n % 20}", f"/attack/t{n}", "a/B", "http://127.0.0.1:9/"],
        }
        for n in range(20_000)
    ]
    for at in range(0, len(calls), 5000):
        target.exchange(called("system.multicall", calls[at : at + 5000]))
    change = called("registerPublisher", "/bad", "/attack/changing", "a/B", "http://127.0.0.1:9/")
    _side_by_side(
        [lambda: target.repeat(called("getSystemState", "/bad"))] * 10 + [lambda: target.repeat(change, 0.01)]
    )


def all_topics(target: Target) -> None:
    """getTopicTypes and getPublishedTopics by ten clients, of as many topics as there may be."""
    for first in range(0, 200_000, 5_000):
        calls = [
            {
                "methodName": "registerPublisher",
                "params": [f"/bad{first}", f"/attack/all/{number}", "a/B", f"http://127.0.0.1:9/{first}"],
            }
            for number in range(first, first + 5_000)
        ]
        if not target.is_over:
            target.exchange(called("system.multicall", calls))
    _side_by_side(
        [lambda: target.repeat(called("getTopicTypes", "/bad"))] * 5
        + [lambda: target.repeat(called("getPublishedTopics", "/bad", ""))] * 5
    )


def new_addresses(target: Target) -> None:
    """Register a node of 20,000 topics again and again from another address."""
    calls = [
        {"methodName": "registerPublisher", "params": ["/bad", f"/attack/n{n}", "a/B", "http://127.0.0.1:9/"]}
        for n in range(20_000)
    ]
    number = 0
    while not target.is_over:
        target.exchange(called("system.multicall", calls))
        number += 1
        target.exchange(
            called("registerPublisher", "/bad", "/attack/n", "a/B", f"http://127.0.0.1:9/{number}")
        )


def topic_subscribers(target: Target) -> None:
    """Register 20,000 subscribers at a dead address, and a publisher that comes and goes."""
    calls = [
        {
            "methodName": "registerSubscriber",
            "params": [f"/bad{n}", "/attack/fan", "a/B", f"http://127.0.0.1:9/{n}"],
        }
        for n in range(20_000)
    ]
    target.exchange(called("system.multicall", calls))
    args = ("/bad", "/attack/fan", "a/B", "http://127.0.0.1:9/")
    while not target.is_over:
        target.exchange(called("registerPublisher", *args))
        target.exchange(called("unregisterPublisher", args[0], args[1], args[3]))


def parameter_subscribers(target: Target) -> None:
    """5,000 subscribers of a parameter that never answer, and large values for them."""
    with socket.create_server(("127.0.0.1", 0), backlog=1) as dead:
        port = dead.getsockname()[1]
        calls = [
            {
                "methodName": "subscribeParam",
                "params": [f"/bad{n}", f"http://127.0.0.1:{port}/{n}", "/attack/watched"],
            }
            for n in range(5_000)
        ]
        target.exchange(called("system.multicall", calls))
        while not target.is_over:
            for number in range(5):
                target.exchange(valued(b"x" * (4 * MIB), f"/attack/watched/{number}"))


def long_names(target: Target) -> None:
    """Registrations with names of 10 MiB."""
    number = 0
    while not target.is_over:
        number += 1
        name = f"/{number}" + "x" * (10 * MIB)
        target.exchange(called("registerPublisher", name, name, "a/B", "http://127.0.0.1:9/"))
        target.exchange(called("getParam", "/bad", name))
        target.exchange(called(name, "/bad"))


def many_registrations(target: Target) -> None:
    """Registrations of ever new nodes and topics, 5,000 in each multicall."""
    number = 0
    while not target.is_over:
        calls = []
        for _ in range(5_000):
            number += 1
            args = [f"/bad{number}", f"/attack/ever/{number}", "a/B", "http://127.0.0.1:9/"]
            calls.append({"methodName": "registerPublisher", "params": args})
        target.exchange(called("system.multicall", calls))


def many_values(target: Target) -> None:
    """setParam of ever new strings of 8 MiB."""
    number = 0
    while not target.is_over:
        number += 1
        target.exchange(valued(b"x" * (8 * MIB), f"/attack/ever/{number}"))


ATTACKS: tuple[Callable[[Target], None], ...] = (
    huge_array_multicall,
    huge_string,
    wide_characters,
    huge_tag,
    huge_comment,
    many_calls,
    many_sets,
    many_elements,
    many_structs,
    huge_base64,
    huge_chunk,
    huge_number,
    deep,
    whole_tree,
    names_of_parameters,
    slow_readers,
    pipelines,
    half_bodies,
    endless_head,
    small_chunks,
    silent_connections,
    system_states,
    all_topics,
    new_addresses,
    topic_subscribers,
    parameter_subscribers,
    long_names,
    many_registrations,
    many_values,
)


def _side_by_side(functions: list[Callable[[], None]]) -> None:
    threads = [threading.Thread(target=function) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


# --- the good client, the nodes, the control: programs of their own


def run_client(port: int) -> None:
    """Call getPid all the time; a line for each call: the start, the wait, whether it was answered."""
    request = called("getPid", "/good")
    while True:
        start = time.monotonic()
        answered = True
        try:
            with socket.create_connection(("127.0.0.1", port), 120) as sock:
                sock.settimeout(120)
                sock.sendall(request)
                answered = b"200 OK" in sock.recv(65536)
        except OSError:
            answered = False
        print(f"{start} {time.monotonic() - start} {int(answered)}", flush=True)
        time.sleep(max(0.0, start + PERIOD - time.monotonic()))


def run_control() -> None:
    """Answer as a master does, at a port that is printed."""
    answer = b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n"
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(server.getsockname()[1], flush=True)
        while True:
            with contextlib.suppress(OSError), server.accept()[0] as sock:
                sock.recv(65536)
                sock.sendall(answer)


def run_nodes(port: int, count: int) -> None:
    """Register nodes of three publications and three subscriptions, and unregister them; a line for each round."""
    from minirospy.runtime.rpc.master_proxy import MasterProxy

    with socket.create_server(("127.0.0.1", 0), backlog=200) as api:
        threading.Thread(target=_serve_nodes, args=(api,), daemon=True).start()
        uri = f"http://127.0.0.1:{api.getsockname()[1]}/"
        while True:
            worst, start = 0.0, time.monotonic()
            proxies = [MasterProxy(f"http://127.0.0.1:{port}", f"/node{n}", 120.0) for n in range(count)]
            for proxy in proxies:
                begin = time.monotonic()
                for topic in ("/rosout", f"{proxy.caller_id}/out", "/status"):
                    proxy.register_publisher(topic, "std_msgs/String", uri)
                for topic in ("/clock", f"{proxy.caller_id}/cmd", "/status"):
                    proxy.register_subscriber(topic, "std_msgs/String", uri)
                worst = max(worst, time.monotonic() - begin)
            for proxy in proxies:
                for topic in ("/rosout", f"{proxy.caller_id}/out", "/status"):
                    assert proxy.unregister_publisher(topic, uri) == 1
                for topic in ("/clock", f"{proxy.caller_id}/cmd", "/status"):
                    assert proxy.unregister_subscriber(topic, uri) == 1
                proxy.close()
            print(f"{start} {worst} 1", flush=True)


def _serve_nodes(server: socket.socket) -> None:
    body = dumps(([1, "", 0],), methodresponse=True).encode()
    answer = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body

    def serve(sock: socket.socket) -> None:
        with contextlib.suppress(OSError), sock:
            while sock.recv(1 << 20):
                sock.sendall(answer)

    while True:
        with contextlib.suppress(OSError):
            threading.Thread(target=serve, args=(server.accept()[0],), daemon=True).start()


def run_attack(name: str, port: int, seconds: float) -> None:
    """Attack with one of ATTACKS."""
    attack = next(each for each in ATTACKS if each.__name__ == name)
    attack(Target(port, time.monotonic() + seconds))


# --- measuring


class Watch:
    """A program that prints a line for each call: the worst of them."""

    def __init__(self, *args: str) -> None:
        self.calls: list[tuple[float, float, bool]] = []
        self.process = subprocess.Popen(
            [sys.executable, __file__, *args], stdout=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def close(self) -> None:
        """End the program."""
        self.process.kill()
        self.process.wait()
        self._reader.join(5)

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            start, wait, answered = line.split()
            self.calls.append((float(start), float(wait), answered == "1"))

    def since(self, begin: float) -> tuple[float, float, float, int, int]:
        """Return the median, the 99th percentile, the worst wait, the calls and the failures since ``begin``."""
        calls = [call for call in self.calls if call[0] >= begin]
        waits = sorted(wait for _, wait, _ in calls) or [float("nan")]
        failed = sum(not answered for _, _, answered in calls)
        return waits[len(waits) // 2], waits[len(waits) * 99 // 100], waits[-1], len(calls), failed


class Row(NamedTuple):
    """What an attack cost."""

    attack: str
    median: float
    p99: float
    worst: float
    control: float
    peak: float
    after: float
    calls: int
    failed: int


@contextlib.contextmanager
def started_master(folder: str, python: list[str]) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """Run a master with its journal, at a free port."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    environ = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))}
    environ |= {"ROS_HOME": folder, "ROS_LOG_DIR": str(Path(folder) / "log"), "ROS_HOSTNAME": "localhost"}
    environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    with open(Path(folder) / "master.out", "wb") as out:
        process = subprocess.Popen([*python, "-q", "-p", str(port)], env=environ, stdout=out, stderr=out)
    try:
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            time.sleep(0.05)
        yield process, port
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def measure(names: list[str], seconds: float, nodes: int, label: str) -> tuple[Row, str]:
    """Attack a new master, and watch the good client; and how the nodes fared."""
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        master, port = stack.enter_context(
            started_master(folder, [sys.executable, "-m", "minirospy", "master"])
        )
        control = subprocess.Popen([sys.executable, __file__, "control"], stdout=subprocess.PIPE, text=True)
        stack.callback(control.wait)
        stack.callback(control.kill)
        assert control.stdout
        control_port = control.stdout.readline().strip()
        good, idle = Watch("client", str(port)), Watch("client", control_port)
        stack.callback(good.close)
        stack.callback(idle.close)
        fleet = Watch("nodes", str(port), str(nodes)) if nodes else None
        if fleet:
            stack.callback(fleet.close)
        time.sleep(1.0)
        memory, peak, begin = psutil.Process(master.pid), 0.0, time.monotonic()
        if nodes:
            random.seed(1)
            parts = [stack.enter_context(_mix(names, port, seconds, number)) for number in range(4)]
        else:
            parts = [
                subprocess.Popen([sys.executable, __file__, "attack", name, str(port), str(seconds)])
                for name in names
            ]
        while any(part.poll() is None for part in parts) and time.monotonic() < begin + seconds + 60:
            peak = max(peak, memory.memory_info().rss / MIB)
            time.sleep(0.02)
        for part in parts:
            part.kill()
            part.wait()
        # The call that waits is answered, or not.
        end = time.monotonic()
        while good.calls[-1][0] < end and time.monotonic() < end + 60:
            peak = max(peak, memory.memory_info().rss / MIB)
            time.sleep(0.02)
        after = memory.memory_info().rss / MIB
        median, p99, worst, calls, failed = good.since(begin)
        last, wait, _ = good.calls[-1]
        if last < end:
            # The present call has no answer yet.
            worst, failed = max(worst, time.monotonic() - last - wait), failed + 1
        if fleet:
            _, _, wait, rounds, _ = fleet.since(0.0)
            alive = fleet.process.poll() is None
            said = f"{nodes} nodes registered and unregistered {rounds} times, worst node {wait:.3f} s, " + (
                "every call answered" if alive else "A REGISTRATION FAILED"
            )
            failed += not alive
        else:
            said = ""
        return Row(label, median, p99, worst, idle.since(begin)[2], peak, after, calls, failed), said


@contextlib.contextmanager
def _mix(names: list[str], port: int, seconds: float, number: int) -> Iterator[subprocess.Popen[bytes]]:
    """Attacks one after the other in random order, of which several such programs run side by side."""
    process = subprocess.Popen(
        [sys.executable, __file__, "mix", str(port), str(seconds), str(number), json.dumps(names)]
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def run_mix(port: int, seconds: float, seed: int, names: list[str]) -> None:
    """Attack in random order, ten seconds each; the first of these programs holds 5,000 connections all the time."""
    generator, end = random.Random(seed), time.monotonic() + seconds
    if seed == 0:
        silent_connections(Target(port, end))
        return
    while time.monotonic() < end:
        child = subprocess.Popen(
            [
                sys.executable,
                __file__,
                "attack",
                generator.choice(names),
                str(port),
                str(min(10.0, end - time.monotonic())),
            ]
        )
        try:
            child.wait(30)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def main() -> int:
    """Run the benchmark; return its exit status."""
    _raise_file_limit()
    match sys.argv[1:]:
        case ["client", port]:
            run_client(int(port))
        case ["control"]:
            run_control()
        case ["nodes", port, count]:
            run_nodes(int(port), int(count))
        case ["attack", name, port, seconds]:
            run_attack(name, int(port), float(seconds))
        case ["mix", port, seconds, seed, names]:
            run_mix(int(port), float(seconds), int(seed), json.loads(names))
    parser = argparse.ArgumentParser(description="A master under attack: waits and memory.")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long each attack lasts (default: 5)")
    parser.add_argument("--only", default="", help="the attacks whose name contains this")
    parser.add_argument("--mixed", type=float, default=0.0, help="all attacks at once, for so many seconds")
    parser.add_argument("--nodes", type=int, default=200, help="nodes that register meanwhile, with --mixed")
    parser.add_argument("--json", action="store_true", help="print a JSON object for each row")
    if len(sys.argv) > 1 and sys.argv[1] in {"client", "control", "nodes", "attack", "mix"}:
        return 0
    options = parser.parse_args()
    names = [each.__name__ for each in ATTACKS if options.only.replace(" ", "_") in each.__name__]
    if not options.json:
        print(f"{'attack':24} median ms    p99 ms  worst ms  control ms  peak MiB  after MiB  calls  failed")
    failed = 0
    runs = [("mixed", names)] if options.mixed else [(name, [name]) for name in names]
    for label, each in runs:
        row, said = measure(
            each, options.mixed or options.seconds, options.nodes if options.mixed else 0, label
        )
        failed += row.failed
        if options.json:
            print(json.dumps(row._asdict()), flush=True)
        else:
            print(
                f"{row.attack:24} {row.median * 1e3:9.2f} {row.p99 * 1e3:9.2f} {row.worst * 1e3:9.1f} "
                f"{row.control * 1e3:11.1f} {row.peak:9.0f} {row.after:10.0f} {row.calls:6} {row.failed:7}",
                flush=True,
            )
        if said:
            print(said)
    return 1 if failed else 0


def _raise_file_limit() -> None:
    if sys.platform != "win32":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 65536) if hard > 0 else 65536, hard))


if __name__ == "__main__":
    sys.exit(main())
