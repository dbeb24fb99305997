"""`python benchmarks/bag_nodes.py`: `rosbag record` and `play` compared with the C++ ones of Debian's ROS 1, in one run.

record: a publisher that waits for its subscriber sends images of 6 MB, then messages of 1 kB, as fast as it accepts them.
Measured are the bytes per second in the finished bag, the messages missing from it, CPU time and peak memory of the recorder.
play: how much later than stored each message arrives, relative to the earliest one, at plain sockets, which are the same for
all players. `--rounds 3` repeats all, alternating, and prints the medians of the rounds; `--folder` is the folder of the bags,
and so the disk that is measured.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import random
import selectors
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from minirospy.base.environment import Environment
from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.writer import BagWriter
from minirospy.core.wire.framing import LargeFrame
from minirospy.core.wire.header import serialize_header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.master.master import Master
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.transport.loop import LoopThread

CPP = Path("/usr/lib/rosbag")
IMAGE = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
SECOND = 10**9
_SETTLE_SECONDS = 0.5


def program(stack: str, verb: str) -> list[str]:
    """Return the command of a recorder or player."""
    code = f"import sys; from minirospy.ros.rosbag.commands.rosbag_{verb} import main; sys.exit(main())"
    return [sys.executable, "-c", code] if stack == "minirospy" else [str(CPP / verb)]


def stacks() -> list[str]:
    """Return the stacks that are installed."""
    return ["C++", "minirospy"] if (CPP / "record").exists() else ["minirospy"]


class Measured(NamedTuple):
    """A case, the stack, and the measurements: names with their units, and values."""

    case: str
    stack: str
    values: dict[str, float]

    def __str__(self) -> str:
        values = "  ".join(f"{name} {value:.0f}" for name, value in self.values.items())
        return f"{self.case:26} {self.stack:10} {values}"


def record(stack: str, size: int, count: int, folder: Path) -> Measured:
    """Record ``count`` messages of ``size`` bytes; return the measurements."""
    loop = LoopThread("publisher")
    node = Node(f"/bench_{time.time_ns()}", Environment.read())
    loop.run(node.start())
    publication = Publication("/bench", IMAGE, queue_size=None)
    loop.run(node.advertise(publication))
    data = size.to_bytes(4, "little") + os.urandom(size)
    frame: bytes | LargeFrame = (
        LargeFrame((data,), len(data)) if size > 60_000 else len(data).to_bytes(4, "little") + data
    )

    bag = folder / f"{stack}.bag"
    command = [*program(stack, "record"), "-O", str(bag), "/bench"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    while not publication.links:
        time.sleep(0.01)
    time.sleep(0.5)
    start = time.perf_counter()
    for _ in range(count):
        publication.publish(frame)
    # Wait until no messages are left in the sockets. There is no condition for this, because a recorder may have lost some.
    time.sleep(_SETTLE_SECONDS)
    process.send_signal(signal.SIGINT)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start - _SETTLE_SECONDS
    process.returncode = os.waitstatus_to_exitcode(status)

    with bag.open("rb") as stream:
        found = sum(sum(chunk.counts.values()) for chunk in open_bag(stream).chunks)
    bag.unlink()
    loop.run(node.close())
    loop.close()
    return Measured(
        f"record {size} B",
        stack,
        {
            "MB/s": size * found / seconds / 1e6,
            "messages/s": found / seconds,
            "lost": count - found,
            "CPU ms": 1000 * (usage.ru_utime + usage.ru_stime),
            "peak MB": usage.ru_maxrss / 1024,
        },
    )


class Stream(NamedTuple):
    """Messages on one topic of a bag: their rate per second, and their size."""

    hz: float
    size: int


PLAYED = {
    "100 Hz of 100 B": [Stream(100, 100)],
    "1000 Hz of 100 B": [Stream(1000, 100)],
    "30 Hz of 1 MB": [Stream(30, 1_000_000)],
    "all three": [Stream(100, 100), Stream(1000, 100), Stream(30, 1_000_000)],
}


def make_bag(path: Path, streams: list[Stream], seconds: float) -> list[int]:
    """Write a bag of numbered messages at irregular times; return the times. Stream N is on the topic /bench/N."""
    chance = random.Random(3)
    due = []
    for topic, stream in enumerate(streams):
        now = 10**18
        for _ in range(int(stream.hz * seconds)):
            now += int(chance.uniform(0.5, 1.5) * SECOND / stream.hz)
            due.append((now, topic))
    due.sort()
    with path.open("wb") as file:
        writer = BagWriter(file)
        header = {"type": IMAGE.name, "md5sum": IMAGE.md5sum, "message_definition": IMAGE.definition}
        numbers = [
            writer.add_connection(f"/bench/{topic}", header | {"topic": f"/bench/{topic}"})
            for topic in range(len(streams))
        ]
        for i, (now, topic) in enumerate(due):
            data = (b"%08d" % i).ljust(streams[topic].size, b"\0")
            writer.write(numbers[topic], now, len(data).to_bytes(4, "little") + data)
        writer.close()
    return [now for now, _ in due]


def subscribe(topic: str) -> socket.socket:
    """Return a connection to the publisher of a topic, which may not have started yet."""
    master: Any = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    end = time.monotonic() + 30
    while topic not in (published := dict(master.getSystemState("/bench")[2][0])):
        if time.monotonic() > end:
            raise TimeoutError(f"nobody publishes {topic}")
        time.sleep(0.01)
    publisher: Any = xmlrpc.client.ServerProxy(master.lookupNode("/bench", published[topic][0])[2])
    _, _, (_, host, port) = publisher.requestTopic("/bench", topic, [["TCPROS"]])
    sock = socket.create_connection((host, port))
    fields = {
        "callerid": "/bench",
        "topic": topic,
        "type": IMAGE.name,
        "md5sum": IMAGE.md5sum,
        "tcp_nodelay": "1",
    }
    sock.sendall(serialize_header(fields | {"message_definition": IMAGE.definition}))
    return sock


def receive(socks: list[socket.socket]) -> dict[int, int]:
    """Return the arrival time of each message by its number, until the publisher exits."""
    arrived: dict[int, int] = {}
    received = [bytearray() for _ in socks]
    space = bytearray(1 << 22)
    is_header = [True] * len(socks)
    with selectors.DefaultSelector() as selector:
        for number, sock in enumerate(socks):
            selector.register(sock, selectors.EVENT_READ, number)
        while selector.get_map():
            for key, _ in selector.select():
                try:
                    count = key.fileobj.recv_into(space)  # type: ignore[union-attr]
                except ConnectionResetError:
                    count = 0
                now = time.monotonic_ns()
                if not count:
                    selector.unregister(key.fileobj)
                    continue

                data = received[key.data]
                data += memoryview(space)[:count]
                while len(data) >= 4 and len(data) >= (end := 4 + int.from_bytes(data[:4], "little")):
                    if not is_header[key.data]:
                        # The number is after the sizes of the message and of its string.
                        arrived[int(data[8:16])] = now
                    is_header[key.data] = False
                    del data[:end]
    return arrived


def play(stack: str, path: Path, times: list[int], what: str) -> Measured:
    """Play a bag; return how many microseconds late its messages arrived, compared with the stored times."""
    command = [*program(stack, "play"), str(path), "-d", "1", "-q"]
    with contextlib.ExitStack() as opened:
        process = opened.enter_context(
            subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
        )
        socks = [opened.enter_context(subscribe(f"/bench/{topic}")) for topic in range(len(PLAYED[what]))]
        gc.disable()
        arrived = receive(socks)
        gc.enable()
    if process.returncode:
        raise RuntimeError(f"{stack} play ended with status {process.returncode}")
    late = sorted(arrived[i] - times[i] for i in arrived)
    errors = [(each - late[0]) / 1000 for each in late]

    def quantile(fraction: float) -> float:
        return errors[int(fraction * (len(errors) - 1))]

    return Measured(
        f"play {what}",
        stack,
        {
            "median us": quantile(0.5),
            "90 %": quantile(0.9),
            "99 %": quantile(0.99),
            "most": errors[-1],
            "lost": len(times) - len(errors),
        },
    )


def medians(measured: list[Measured]) -> Iterator[Measured]:
    """Yield the medians of all rounds of each case and stack."""
    for key in dict.fromkeys((one.case, one.stack) for one in measured):
        rounds = [one.values for one in measured if (one.case, one.stack) == key]
        yield Measured(*key, {name: statistics.median(each[name] for each in rounds) for name in rounds[0]})


def run(arguments: argparse.Namespace, folder: Path) -> Iterator[Measured]:
    """Yield the measurements of each case, round by round."""
    for _ in range(arguments.rounds):
        if "record" in arguments.cases:
            for size, count in ((6_000_000, arguments.megabytes // 6), (1000, arguments.megabytes * 250)):
                for stack in stacks():
                    yield record(stack, size, count, folder)
        if "play" in arguments.cases:
            for what, streams in PLAYED.items():
                path = folder / "play.bag"
                times = make_bag(path, streams, arguments.seconds)
                for stack in stacks():
                    yield play(stack, path, times, what)
                path.unlink()


def main() -> None:
    """Run the cases that the command line selects."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", default="record,play", help="record, play, or both")
    parser.add_argument("--megabytes", type=int, default=600, help="what is recorded of each size")
    parser.add_argument("--seconds", type=float, default=3, help="the length of the bags that are played")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--folder", type=Path, default=None)
    arguments = parser.parse_args()

    loop = LoopThread("master")

    async def start() -> Master:
        master = Master()
        await master.start()
        return master

    master = loop.run(start())
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        os.environ.update(
            ROS_MASTER_URI=f"http://localhost:{master.port}", ROS_HOSTNAME="localhost", ROS_HOME=folder
        )
        measured = []
        for one in run(arguments, Path(folder)):
            measured.append(one)
            print(one, flush=True)
        if arguments.rounds > 1:
            print(f"medians of {arguments.rounds} rounds:")
            print(*medians(measured), sep="\n")
    loop.run(master.close())
    loop.close()
    assert threading.active_count() < 20


if __name__ == "__main__":
    main()
