"""The master under load, minirospy's compared with real rosmaster: CPU of a registration, memory of a node, look-ups.

    python benchmarks/master.py                           # minirospy's, and rosmaster if it is installed
    python benchmarks/master.py --sizes 100,1000,10000 --stacks "ours,ours without rosout"

minirospy's runs under the interpreter that runs this file: use rosmaster's (/usr/bin/python3) for a fair comparison.

Fake nodes of three publications and three subscriptions register by raw XML-RPC from one client, as in the case
`master` of the workshop's benchmark; a dummy answers for all of them. CPU and memory are the master's only.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from xmlrpc.client import ServerProxy, dumps

import psutil

from minirospy.runtime.rpc.client import RpcClient

OURS = [sys.executable, "-m", "minirospy.ros.rosmaster.commands.master", "-q"]
STACKS = {
    "ours": OURS,
    "ours without journal": [*OURS, "--no-journal"],
    "ours without rosout": [*OURS, "--no-rosout"],
    "rosmaster": ["/usr/bin/rosmaster", "--core"],
}
ANSWER = (
    b"<?xml version='1.0'?><methodResponse><params><param><value><array><data><value><int>1</int></value>"
    b"<value></value><value><int>0</int></value></data></array></value></param></params></methodResponse>"
)
REPLY = b"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nContent-Length: %d\r\n\r\n" % len(ANSWER) + ANSWER


class Dummy:
    """A Slave API that responds to every call with success, and counts the calls."""

    def __init__(self) -> None:
        self.calls = 0
        self._sock = socket.create_server(("127.0.0.1", 0), backlog=1000)
        self.port = self._sock.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            sock, _ = self._sock.accept()
            threading.Thread(target=self._serve, args=(sock,), daemon=True).start()

    def _serve(self, sock: socket.socket) -> None:
        data = b""
        with sock:
            while more := sock.recv(1 << 20):
                data += more
                head = re.search(rb"(?i)content-length: *(\d+)[^\0]*?\r\n\r\n", data)
                if head and len(data) >= head.end() + int(head[1]):
                    self.calls += 1
                    data = b""
                    sock.sendall(REPLY)


class Client:
    """A client with one connection and minimal overhead."""

    def __init__(self, port: int) -> None:
        self._sock = socket.create_connection(("127.0.0.1", port))
        self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def call(self, method: str, *args: object) -> bytes:
        body = dumps(args, method).encode()
        self._sock.sendall(
            b"POST /RPC2 HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n" % len(body) + body
        )
        data = b""
        while True:
            data += self._sock.recv(1 << 20)
            end = data.find(b"\r\n\r\n")
            if end >= 0:
                length = int(re.search(rb"(?i)content-length: *(\d+)", data[:end])[1])  # type: ignore[index]
                if len(data) >= end + 4 + length:
                    return data[end + 4 :]

    def close(self) -> None:
        self._sock.close()


def measure(command: list[str], sizes: list[int], dummy: Dummy) -> dict[str, float]:
    """Return the measurements for one master."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as home:
        environ = {k: v for k, v in os.environ.items() if not k.startswith("ROS_")}
        environ |= {"ROS_HOME": home, "ROS_LOG_DIR": home, "ROS_HOSTNAME": "localhost"}
        environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
        program = subprocess.Popen([*command, "-p", str(port)], env=environ, stdout=subprocess.DEVNULL)
        try:
            return _measured(psutil.Process(program.pid), port, sizes, dummy)
        finally:
            program.send_signal(signal.SIGINT)
            program.wait(20)


def _measured(program: psutil.Process, port: int, sizes: list[int], dummy: Dummy) -> dict[str, float]:
    while True:
        try:
            Client(port).close()
            break
        except OSError:
            time.sleep(0.05)

    def cpu() -> float:
        return sum(program.cpu_times()[:2])

    figures: dict[str, float] = {}
    time.sleep(1.0)
    first_rss, nodes = program.memory_info().rss, 0
    for size in sizes:
        used, before, start = cpu(), nodes, time.monotonic()
        for nodes in range(before, size):
            me, uri, client = f"/node{nodes}", f"http://localhost:{dummy.port}/node{nodes}/", Client(port)
            for topic in ("/rosout", me + "/out", me + "/status"):
                client.call("registerPublisher", me, topic, "std_msgs/String", uri)
            for topic in ("/clock", f"/node{nodes + 1}/out", me + "/cmd"):
                client.call("registerSubscriber", me, topic, "std_msgs/String", uri)
            client.close()
        nodes = size
        seconds, last = time.monotonic() - start, -1
        while dummy.calls != last:
            last = dummy.calls
            time.sleep(0.3)
        count = 6 * (size - before)
        figures[f"cpu_us_per_registration_{size}"] = 1e6 * (cpu() - used) / count
        figures[f"registrations_per_s_{size}"] = count / seconds
        figures[f"kB_per_node_{size}"] = (program.memory_info().rss - first_rss) / size / 1024
        client, used = Client(port), cpu()
        # Make many calls, because the system counts CPU time in ticks of 10 ms.
        times = [_timed(client.call, "getSystemState", "/bench") for _ in range(200)]
        figures[f"getSystemState_ms_{size}"] = statistics.median(times) * 1e3
        figures[f"getSystemState_cpu_ms_{size}"] = (cpu() - used) / len(times) * 1e3
        times, used, uri = [], cpu(), f"http://localhost:{dummy.port}/changing/"
        for number in range(40):
            client.call("registerPublisher", "/changing", f"/changing{number}", "std_msgs/String", uri)
            times.append(_timed(client.call, "getSystemState", "/bench"))
        figures[f"getSystemState_changed_ms_{size}"] = statistics.median(times) * 1e3
        figures[f"getSystemState_changed_cpu_ms_{size}"] = (cpu() - used) / len(times) * 1e3
        for number in range(40):
            client.call("unregisterPublisher", "/changing", f"/changing{number}", uri)
        client.close()
        with ServerProxy(f"http://localhost:{port}") as proxy:
            times = [_timed(proxy.getSystemState, "/bench") for _ in range(3)]
            figures[f"getSystemState_by_xmlrpc.client_ms_{size}"] = statistics.median(times) * 1e3
        ours = RpcClient(f"http://localhost:{port}", timeout=60.0)
        times = [_timed(ours.call, "getSystemState", "/bench") for _ in range(5)]
        figures[f"getSystemState_by_minirospy_ms_{size}"] = statistics.median(times) * 1e3
        ours.close()
    figures |= _dead_subscribers(port)
    return figures


def _dead_subscribers(port: int) -> dict[str, float]:
    """Return the delay until a live subscriber is notified, among fifty subscribers that never respond."""
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        dead = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        notified, live = threading.Event(), Dummy()
        client = Client(port)
        for number in range(50):
            client.call("registerSubscriber", f"/dead{number}", "/busy", "a/B", f"{dead}{number}/")
        client.call("registerSubscriber", "/live", "/busy", "a/B", f"http://127.0.0.1:{live.port}/")
        start = time.monotonic()
        client.call("registerPublisher", "/pub", "/busy", "a/B", "http://127.0.0.1:1/")
        while not live.calls and time.monotonic() - start < 60:
            notified.wait(0.0005)
        delay = time.monotonic() - start
        client.close()
        return {"told_beside_50_dead_ms": delay * 1e3}


def _timed(step: Callable[..., object], *args: object) -> float:
    start = time.perf_counter()
    step(*args)
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sizes", default="100,1000,3000", help="numbers of nodes")
    parser.add_argument("--stacks", default="ours,rosmaster", help=", ".join(STACKS))
    options = parser.parse_args()
    sizes = [int(size) for size in options.sizes.split(",")]
    stacks = [name for name in options.stacks.split(",") if Path(STACKS[name][0]).exists()]
    dummy = Dummy()
    table = {name: measure(STACKS[name], sizes, dummy) for name in stacks}
    print("".ljust(44) + "".join(name.rjust(18) for name in table))
    for row in next(iter(table.values())):
        print(row.ljust(44) + "".join(f"{figures[row]:18,.1f}" for figures in table.values()))


if __name__ == "__main__":
    main()
