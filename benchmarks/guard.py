"""`make guard`: detect whether minirospy has become slower. The exit status is 1 if it has.

Absolute times depend on the machine, so they are not compared: in one run, the CPU seconds of all participating processes are
divided by those of plain sockets, a plain ring of shared memory, or a start of a plain Python (the yardsticks). The limit of each
ratio is about twice its usual value; that of large messages is less, because one more copy of a message must exceed it.
"""

from __future__ import annotations

import mmap
import os
import re
import socket
import subprocess
import sys
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import launch_nodes
import psutil
from cases import free_port, wait_for_port

SECONDS = 0.7
IMAGE = 921_600
LARGE = 6_220_800
BATCH = 10  # large messages per measurement
ALTERNATIONS = 40  # between large messages and their yardstick
MIN_SHARE = 0.9  # of the large messages that must go through shared memory
NODES = 12  # to launch: their number hides the cost of roslaunch and the master
STARTS = 5  # of a plain Python
STANDARD = "import asyncio, http.client, json, logging, socket, subprocess, threading, xml.parsers.expat"
# number of runs before a ratio over its limit counts: noise disappears, a slowdown does not
TRIES = 4


class Limit(NamedTuple):
    """The limit for a ``case``, as a multiple of the cost of a ``yardstick``."""

    case: str
    yardstick: str
    most: float


LIMITS = [
    Limit("small message there and back", "12 bytes there and back", 7.0),
    Limit("small message of a stream", "12 bytes there and back", 2.5),
    Limit("image of 640 x 480", "900 kB by a socket", 4.0),
    Limit("service call, persistent", "12 bytes there and back", 8.0),
    Limit("service call", "12 bytes there and back", 130.0),
    Limit("get_param", "12 bytes there and back", 35.0),
    Limit("6 MB image", "6 MB by a ring", 1.75),
    Limit("launch of a node", "start of a plain Python", 2.0),
]
IS_LINUX = sys.platform == "linux"  # large messages use shared memory, and nodes are forked


class Meter:
    """Measures CPU microseconds per step, in this process and in the other participating processes."""

    def __init__(self) -> None:
        self.others: list[psutil.Process] = []
        self.costs: dict[str, float] = {}

    def measure(self, name: str, step: Callable[[], int]) -> None:
        """Call ``step`` for a while; it returns the number of operations that it has done."""
        step()
        start, count, end = self._spent(), 0, time.monotonic() + SECONDS
        while time.monotonic() < end:
            count += step()
        self.costs[name] = 1e6 * (self._spent() - start) / count

    def compare(
        self,
        name: str,
        step: Callable[[], int],
        yardstick: str,
        plain_step: Callable[[], int],
        plain_others: list[psutil.Process],
    ) -> None:
        """Measure a case and its yardstick alternately, each by its cheapest step. Linux only.

        The cost of copying memory depends on the other processes of the machine, and changes within a second.
        """

        def spent(processes: list[psutil.Process]) -> float:
            # The clock of a process has nanoseconds, the times of psutil have hundredths of a second.
            clocks = [(~process.pid << 3) | 2 for process in processes]
            return time.process_time() + sum(map(time.clock_gettime, clocks))

        costs: dict[str, list[float]] = {name: [], yardstick: []}
        for _ in range(ALTERNATIONS):
            for key, each, others in ((yardstick, plain_step, plain_others), (name, step, self.others)):
                start = spent(others)
                count = each()
                costs[key].append(1e6 * (spent(others) - start) / count)
        self.costs.update({key: min(values) for key, values in costs.items()})

    def _spent(self) -> float:
        others = [process.cpu_times() for process in self.others]
        return time.process_time() + sum(times.user + times.system for times in others)


@contextmanager
def started(*command: str, files: Collection[int] = ()) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process that is stopped at the end of the block. It inherits the descriptors ``files``."""
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, pass_fds=files)
    try:
        yield process
    finally:
        process.terminate()
        process.communicate()


def measure_yardsticks(meter: Meter) -> None:
    """Measure plain sockets."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with started(sys.executable, __file__, "echo", str(port)) as peer:
            sock, _ = server.accept()
            with sock:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                meter.others = [psutil.Process(peer.pid)]

                def there_and_back(data: bytes, times: int) -> int:
                    for _ in range(times):
                        sock.sendall(data)
                        sock.recv(12)
                    return times

                small, large = b"\x0c\0\0\0" + bytes(8), IMAGE.to_bytes(4, "little") + bytes(IMAGE - 4)
                meter.measure("12 bytes there and back", lambda: there_and_back(small, 1000))
                meter.measure("900 kB by a socket", lambda: there_and_back(large, 20))


def echo(port: str) -> None:
    """Respond to each block, whose first 4 bytes are its size, with 12 bytes."""
    with socket.create_connection(("127.0.0.1", int(port))) as sock:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        buffer = memoryview(bytearray(IMAGE))
        while count := sock.recv_into(buffer):
            size = int.from_bytes(buffer[:4], "little")
            while count < size:
                count += sock.recv_into(buffer[count:])
            sock.sendall(bytes(12))


@contextmanager
def plain_ring() -> Iterator[tuple[Callable[[], int], psutil.Process]]:
    """Yield a step that writes ``BATCH`` messages into a ring, and the process that copies each into bytes."""
    file = os.memfd_create("guard")
    os.ftruncate(file, LARGE)
    one, other = socket.socketpair()
    files = (file, other.fileno())
    data = bytes(LARGE)
    with (
        one,
        other,
        started(sys.executable, __file__, "ring", *map(str, files), files=files) as reader,
        mmap.mmap(file, LARGE) as memory,
    ):
        os.close(file)
        other.close()

        def write() -> int:
            for _ in range(BATCH):
                memory[:] = data
                one.send(b"w")
                one.recv(1)
            return BATCH

        yield write, psutil.Process(reader.pid)


def ring(file: str, sock: str) -> None:
    """Copy each announced message from the ring, and answer with a byte."""
    with socket.socket(fileno=int(sock)) as end, mmap.mmap(int(file), LARGE, prot=mmap.PROT_READ) as memory:
        while end.recv(1):
            data = memory[:]
            end.send(b"r")
            assert data[-1] == 0


def measure_starts(meter: Meter) -> None:
    """Measure a plain Python that imports parts of the standard library, and roslaunch of nodes, which are forked."""

    def cpu_of_children() -> float:
        times = os.times()
        return times.children_user + times.children_system

    before = cpu_of_children()
    for _ in range(STARTS):
        subprocess.run([sys.executable, "-c", STANDARD], check=True)
    meter.costs["start of a plain Python"] = 1e6 * (cpu_of_children() - before) / STARTS
    launched = launch_nodes.measure(launch_nodes.OURS, {}, NODES, with_memory=False)
    meter.costs["launch of a node"] = 1e6 * launched["CPU, s"] / NODES


def share_of_shared_memory(node_uri: str) -> float:
    """Return the part of the node's large messages that went through shared memory, from its getBusInfo."""
    _, _, rows = xmlrpc.client.ServerProxy(node_uri).getBusInfo("/guard")
    counts = [re.search(r"; (\d+) of (\d+) large messages by shared memory", row[6]) for row in rows]  # type: ignore[index]
    found = [(int(match[1]), int(match[2])) for match in counts if match]
    return sum(shared for shared, _ in found) / max(1, sum(all_ for _, all_ in found))


def peer() -> None:
    """Run the node on the other side."""
    import rospy
    from sensor_msgs.msg import Image
    from std_msgs.msg import UInt64
    from std_srvs.srv import SetBool

    rospy.init_node("guard_peer")
    answers = rospy.Publisher("/answers", UInt64, queue_size=10, tcp_nodelay=True)
    rospy.Subscriber("/requests", UInt64, answers.publish, tcp_nodelay=True)
    rospy.Subscriber("/stream", UInt64, lambda message: answers.publish(message) if message.data else None)
    for topic in ("/images", "/large_images"):
        rospy.Subscriber(topic, Image, lambda message: answers.publish(len(message.data)))
    # The peer waits for the service, and by then receives the messages published here.
    answers.wait_for_subscribers(1, 10)
    rospy.Service("/service", SetBool, lambda request: (request.data, ""))
    rospy.spin()


def measure_ours(meter: Meter, others: list[psutil.Process]) -> None:
    """Measure the cases."""
    import rospy
    from sensor_msgs.msg import Image
    from std_msgs.msg import UInt64
    from std_srvs.srv import SetBool

    rospy.init_node("guard", disable_signals=True)
    meter.others = others
    answered = threading.Event()
    left = [0]

    def on_answer(_message: Any) -> None:
        left[0] -= 1
        if left[0] > 0:
            requests.publish(1)
        else:
            answered.set()

    rospy.Subscriber("/answers", UInt64, on_answer, tcp_nodelay=True)
    requests = rospy.Publisher("/requests", UInt64, queue_size=10, tcp_nodelay=True)
    stream = rospy.Publisher("/stream", UInt64, queue_size=0)
    images = rospy.Publisher("/images", Image, queue_size=2)
    for publisher in (requests, stream, images):
        publisher.wait_for_subscribers(1, 10)
    single = rospy.ServiceProxy("/service", SetBool)
    persistent = rospy.ServiceProxy("/service", SetBool, persistent=True)
    single.wait_for_service(10)
    rospy.set_param("/guard", 1)
    picture = Image(height=480, width=640, encoding="rgb8", step=1920, data=bytes(IMAGE))

    def wait() -> None:
        if not answered.wait(20):
            raise SystemExit("the other node does not answer")
        answered.clear()

    def there_and_back() -> int:
        left[0] = 1000
        requests.publish(1)
        wait()
        return 1000

    def streamed() -> int:
        for number in range(9_999, -1, -1):
            stream.publish(0 if number else 1)
        left[0] = 1
        wait()
        return 10_000

    def pictured(publisher: Any, message: Image) -> int:
        left[0] = 1
        publisher.publish(message)
        wait()
        return 1

    def repeated(call: Callable[[], object]) -> Callable[[], int]:
        return lambda: len([call() for _ in range(50)])

    meter.measure("small message there and back", there_and_back)
    meter.measure("small message of a stream", streamed)
    meter.measure("image of 640 x 480", lambda: pictured(images, picture))
    measure_large(meter, pictured)
    meter.measure("service call, persistent", repeated(lambda: persistent(True)))
    meter.measure("service call", repeated(lambda: single(True)))
    meter.measure("get_param", repeated(lambda: rospy.get_param("/guard")))
    rospy.signal_shutdown("measured")


def measure_large(meter: Meter, pictured: Callable[[Any, Any], int]) -> None:
    """Measure large messages, and check that they go through shared memory, if that works on this machine.

    ``pictured`` publishes one and waits for its arrival.
    """
    import rospy
    from sensor_msgs.msg import Image

    from minirospy.runtime.transport.shared_memory_trial import try_out

    if why := try_out():
        print(f"large messages are not measured: no shared memory, because {why}")
        return

    publisher = rospy.Publisher("/large_images", Image, queue_size=2)
    publisher.wait_for_subscribers(1, 10)
    image = Image(height=1080, width=1920, encoding="rgb8", step=5760, data=bytes(LARGE))
    for _ in range(5):
        pictured(publisher, image)  # the first messages use the socket

    def write() -> int:
        return sum(pictured(publisher, image) for _ in range(BATCH))

    with plain_ring() as (write_plainly, reader):
        meter.compare("6 MB image", write, "6 MB by a ring", write_plainly, [reader])
    share = share_of_shared_memory(rospy.get_node_uri())
    if share < MIN_SHARE:
        print(f"only {100 * share:.0f} % of the large messages used shared memory", file=sys.stderr)
        meter.costs["6 MB image"] = float("inf")


def measure_all() -> dict[str, float]:
    """Return the CPU microseconds of each case and yardstick, with a new master and peer."""
    for variable in ("MINIROSPY_TRANSPORT", "MINIROSPY_PRELOAD"):
        os.environ.pop(variable, None)  # they turn off what is measured
    port = str(free_port())
    os.environ |= {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}

    meter = Meter()
    measure_yardsticks(meter)
    if IS_LINUX:
        measure_starts(meter)
    roscore = Path(sys.executable).with_name("roscore")
    with started(str(roscore), "-q", "-p", port) as master:
        wait_for_port(int(port))
        with started(sys.executable, __file__, "peer") as other:
            measure_ours(meter, [psutil.Process(master.pid), psutil.Process(other.pid)])
    return meter.costs


def report(costs: dict[str, float]) -> list[str]:
    """Print the costs and return the cases that are over their limit."""
    print(f"{'CPU of all processes':32}{'us':>10}{'ratio':>10}{'at most':>10}")
    limits = [limit for limit in LIMITS if limit.yardstick in costs]
    for name in dict.fromkeys(limit.yardstick for limit in limits):
        print(f"{name:32}{costs[name]:10.1f}")

    slower = []
    for case, yardstick, most in limits:
        ratio = costs[case] / costs[yardstick]
        print(f"{case:32}{costs[case]:10.1f}{ratio:10.2f}{most:10.1f}")
        if ratio > most:
            slower.append(case)
    sys.stdout.flush()
    return slower


def main() -> int:
    """Measure, and repeat if a ratio is over its limit; return the exit status."""
    for _ in range(TRIES):
        # Use a new process each time: a process cannot start a node twice.
        result = subprocess.run([sys.executable, __file__, "once"], check=False)
        if result.returncode == 0:
            return 0
    return 1


def once() -> int:
    """Measure, print and return the exit status."""
    slower = report(measure_all())
    if slower:
        print(f"slower than it was: {', '.join(slower)}. `make bench` shows more.", file=sys.stderr)
    return 1 if slower else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["echo"]:
        echo(sys.argv[2])
    elif sys.argv[1:2] == ["ring"]:
        ring(*sys.argv[2:])
    elif sys.argv[1:2] == ["peer"]:
        peer()
    elif sys.argv[1:2] == ["once"]:
        sys.exit(once())
    else:
        sys.exit(main())
