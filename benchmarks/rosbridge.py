"""`python benchmarks/rosbridge.py`: cost of rosbridge: 640x480 RGB at 30 Hz to five clients, CPU in percent of one core.

Measures JSON (base64), and cbor, which roslib.js uses for images. With ``--peer 'COMMAND {port}'``, also the real
rosbridge_websocket, in the same run: COMMAND starts it with the environment's master.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import socket
import subprocess
import sys
import threading
import time

import psutil
from bridge import BIN, Run, free_port


class Client(threading.Thread):
    """A client that subscribes to the image, and counts messages without parsing them."""

    def __init__(self, port: int, compression: str) -> None:
        super().__init__(daemon=True)
        from websockets.sync.client import connect

        self.count = self.bytes = 0
        self._stack = contextlib.ExitStack()
        opening = connect(f"ws://127.0.0.1:{port}", compression=None, max_size=None)
        self._socket = self._stack.enter_context(opening)
        fields = {"op": "subscribe", "topic": "/bench/0000", "type": "sensor_msgs/Image", "queue_length": 1}
        self._socket.send(json.dumps({**fields, "compression": compression}))

    def run(self) -> None:
        for message in self._socket:
            self.count += 1
            self.bytes += len(message)


def clients(port: int, compression: str, seconds: float) -> None:
    """Role: run five clients; print the slowest one's rate, and the total data received in MB/s."""
    readers = [Client(port, compression) for _ in range(5)]
    for reader in readers:
        reader.start()
    while not all(reader.count for reader in readers):
        time.sleep(0.05)
    before = [(reader.count, reader.bytes) for reader in readers]
    print("ready", flush=True)
    time.sleep(seconds)
    found = [
        (reader.count - was[0], reader.bytes - was[1]) for reader, was in zip(readers, before, strict=True)
    ]
    print(
        min(each[0] for each in found) / seconds, sum(each[1] for each in found) / 1e6 / seconds, flush=True
    )


def measure(command: list[str], port: int, environ: dict[str, str], compression: str, seconds: float) -> str:
    """Return the cost for a server."""
    server = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except OSError:
                time.sleep(0.2)
        time.sleep(1.0)
        words = [sys.executable, __file__, "--role", str(port), compression, str(seconds)]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
            assert child.stdout
            child.stdout.readline()
            process = psutil.Process(server.pid)
            before, start = sum(process.cpu_times()[:2]), time.monotonic()
            time.sleep(seconds * 0.9)
            percent = 100 * (sum(process.cpu_times()[:2]) - before) / (time.monotonic() - start)
            memory = process.memory_info().rss / 1e6
            rate, size = map(float, child.stdout.readline().split())
    finally:
        server.terminate()
        server.wait(30)
    return f"cpu {percent:.0f} %, slowest {rate:.1f} Hz, {size:.0f} MB/s, memory {memory:.0f} MB"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--peer", default="", help="a command that starts the real server")
    parser.add_argument("--role", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.role:
        port, compression, seconds = options.role
        clients(int(port), compression, float(seconds))
        return 0

    master = free_port()
    environ = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{master}", "ROS_HOSTNAME": "localhost"}
    publish = Run.role("publish", kind="image", rate=30, size=0, topics=1)
    children = [subprocess.Popen([str(BIN / "rosmaster"), "-p", str(master)], env=environ)]
    time.sleep(1.5)
    children.append(subprocess.Popen(publish, env=environ, stdin=subprocess.PIPE))
    try:
        for compression in ("none", "cbor"):
            port = free_port()
            ours = [
                str(BIN / "minirospy"),
                "run",
                "rosbridge_server",
                "rosbridge_websocket",
                f"_port:={port}",
            ]
            print(
                f"{compression:5} minirospy",
                measure(ours, port, environ, compression, options.seconds),
                flush=True,
            )
            if options.peer:
                port = free_port()
                peer = shlex.split(options.peer.format(port=port))
                print(
                    f"{compression:5} rosbridge",
                    measure(peer, port, environ, compression, options.seconds),
                    flush=True,
                )
    finally:
        for child in reversed(children):
            child.terminate()
            child.wait(20)
    return 0


if __name__ == "__main__":
    sys.exit(main())
