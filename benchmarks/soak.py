"""The master under churn for a long time: does it grow?

    python benchmarks/soak.py --minutes 60

Nodes start and stop (with and without unregistering, and twice under one name), topics, services and parameters change,
tools query the master, clients disconnect in the middle of a request. Every ten seconds a line prints the master's memory,
files, threads and journal; the exit status is 1 if memory or files grew between the middle and the end.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import psutil
from master import Dummy

from minirospy.base.errors import RpcError
from minirospy.runtime.rpc.client import RpcClient

NAMES = 500
LIVE = 200
SAMPLE_SECONDS = 10.0
MAX_MB = 2.0
MAX_FILES = 50


class Sample(NamedTuple):
    """The master's resources at one moment."""

    seconds: float
    mb: float
    files: int
    threads: int
    journal_kb: float
    cpu_seconds: float
    calls: int

    def __str__(self) -> str:
        return (
            f"{self.seconds:6.0f} s  {self.calls:9,} calls  {self.mb:6.2f} MB  {self.files:4} files  "
            f"{self.threads:2} threads  journal {self.journal_kb:7.1f} kB  CPU {self.cpu_seconds:6.1f} s"
        )


class Churn:
    """Nodes and tools that call a master."""

    def __init__(self, port: int, seed: int) -> None:
        self._port = port
        self._random = random.Random(seed)
        self._master = RpcClient(f"http://127.0.0.1:{port}", timeout=20.0)
        self._slaves = [Dummy() for _ in range(4)]
        self._live: dict[str, str] = {}
        self.calls = 0

    def step(self) -> None:
        """Make a random change or query."""
        happens = self._random.choices(
            (self.join, self.leave, self.vanish, self.parameters, self.look, self.hang_up),
            (10, 8, 1, 20, 2, 1),
        )[0]
        happens()

    def join(self) -> None:
        """Start a node; a node with the same name may already exist."""
        name = f"/robot{self._random.randrange(NAMES)}"
        # Always use a new address. A new process would have a new port; here it has a new path.
        uri = f"http://127.0.0.1:{self._random.choice(self._slaves).port}/{self._random.randrange(10**9)}/"
        self._live[name] = uri
        for topic in ("/rosout", f"{name}/out"):
            self.call("registerPublisher", name, topic, "std_msgs/String", uri)
        for topic in ("/clock", f"/robot{self._random.randrange(NAMES)}/out"):
            self.call("registerSubscriber", name, topic, "std_msgs/String", uri)
        self.call("registerService", name, f"{name}/get_loggers", "rosrpc://127.0.0.1:1", uri)
        self.call("subscribeParam", name, uri, f"/p{self._random.randrange(20)}")
        if len(self._live) > LIVE:
            self.leave()

    def leave(self) -> None:
        """Shut a node down properly."""
        if not self._live:
            return
        name = self._random.choice(list(self._live))
        uri = self._live.pop(name)
        client = RpcClient(f"http://127.0.0.1:{self._port}", timeout=20.0)
        state = client.call("getSystemState", name)[2]
        for table, method in zip(state[:2], ("unregisterPublisher", "unregisterSubscriber"), strict=True):
            for topic, nodes in table:
                if name in nodes:
                    client.call(method, name, topic, uri)
        client.call("unregisterService", name, f"{name}/get_loggers", "rosrpc://127.0.0.1:1")
        for number in range(20):
            client.call("unsubscribeParam", name, uri, f"/p{number}")
        client.close()
        self.calls += 24

    def vanish(self) -> None:
        """Kill a node, so that its registrations remain."""
        if self._live:
            self._live.popitem()

    def parameters(self) -> None:
        """Set, read and delete parameters."""
        key = f"/p{self._random.randrange(20)}/q{self._random.randrange(20)}"
        self.call(
            "setParam", "/tool", key, self._random.choice([1, 2.5, "x" * 200, [1, "a"], {"k": {"l": True}}])
        )
        self.call("getParam", "/tool", key)
        if self._random.random() < 0.5:
            self.call("deleteParam", "/tool", key)

    def look(self) -> None:
        """Query the master like `rosnode list` and `rosparam list`."""
        self.call("getSystemState", "/tool")
        self.call("getParamNames", "/tool")

    def hang_up(self) -> None:
        """Disconnect in the middle of a request."""
        with socket.create_connection(("127.0.0.1", self._port)) as sock:
            sock.sendall(b"POST / HTTP/1.1\r\nContent-Length: 100\r\n\r\n<methodCall>")

    def call(self, method: str, *args: object) -> None:
        """Make a call and ignore the response."""
        self._master.call(method, *args)
        self.calls += 1


def samples(
    program: psutil.Process, home: Path, churn: Churn, seconds: float, pause: float
) -> Iterator[Sample]:
    """Run the churn for the given time; yield samples."""
    start = time.monotonic()
    following = start

    while (now := time.monotonic()) < start + seconds:
        churn.step()
        if pause:
            time.sleep(pause)

        if now >= following:
            following += SAMPLE_SECONDS
            journal = sum(path.stat().st_size for path in (home / "master").glob("journal-*"))

            with program.oneshot():
                yield Sample(
                    now - start,
                    program.memory_info().rss / 2**20,
                    program.num_fds() if hasattr(program, "num_fds") else program.num_handles(),
                    program.num_threads(),
                    journal / 1024,
                    sum(program.cpu_times()[:2]),
                    churn.calls,
                )


def main() -> int:
    """Run the churn and print the result."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="how long")
    parser.add_argument("--pause", type=float, default=0.0, metavar="S", help="seconds between two steps")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers")
    options = parser.parse_args()
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]

    with tempfile.TemporaryDirectory() as folder:
        environ = {k: v for k, v in os.environ.items() if not k.startswith("ROS_")}
        environ |= {"ROS_HOME": folder, "ROS_LOG_DIR": folder, "ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
        command = [sys.executable, "-m", "minirospy.ros.rosmaster.commands.master", "-q", "-p", str(port)]
        master = subprocess.Popen(command, env=environ | {"ROS_IP": "127.0.0.1"})

        try:
            while True:
                try:
                    churn = Churn(port, options.seed)
                    churn.look()
                    break
                except RpcError:
                    time.sleep(0.05)

            found = []
            program = psutil.Process(master.pid)
            for sample in samples(program, Path(folder), churn, 60 * options.minutes, options.pause):
                found.append(sample)
                print(sample, flush=True)
        finally:
            master.send_signal(signal.SIGINT)
            master.wait(20)

    third = max(1, len(found) // 3)
    middle, end = found[third : 2 * third] or found, found[-third:]
    mb = [statistics.median(sample.mb for sample in part) for part in (middle, end)]
    files = [statistics.median(sample.files for sample in part) for part in (middle, end)]
    print(f"memory {mb[0]:.2f} -> {mb[1]:.2f} MB, files {files[0]:g} -> {files[1]:g}, {churn.calls:,} calls")
    return 1 if mb[1] - mb[0] > MAX_MB or files[1] - files[0] > MAX_FILES else 0


if __name__ == "__main__":
    sys.exit(main())
