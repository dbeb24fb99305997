"""`make guard`: detect whether minirospy has become slower. The exit status is 1 if it has.

Absolute times depend on the machine, so they are not compared: in one run, the CPU seconds of all participating processes are
divided by those of plain sockets in plain Python (the yardstick). The limit of each ratio is about twice its usual value.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import psutil

SECONDS = 0.7
IMAGE = 921_600
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
]


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

    def _spent(self) -> float:
        others = [process.cpu_times() for process in self.others]
        return time.process_time() + sum(times.user + times.system for times in others)


@contextmanager
def started(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a process that is stopped at the end of the block."""
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
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
    rospy.Subscriber("/images", Image, lambda message: answers.publish(len(message.data)))
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

    def pictured() -> int:
        left[0] = 1
        images.publish(picture)
        wait()
        return 1

    def repeated(call: Callable[[], object]) -> Callable[[], int]:
        return lambda: len([call() for _ in range(50)])

    meter.measure("small message there and back", there_and_back)
    meter.measure("small message of a stream", streamed)
    meter.measure("image of 640 x 480", pictured)
    meter.measure("service call, persistent", repeated(lambda: persistent(True)))
    meter.measure("service call", repeated(lambda: single(True)))
    meter.measure("get_param", repeated(lambda: rospy.get_param("/guard")))
    rospy.signal_shutdown("measured")


def wait_for_port(port: int) -> None:
    """Return when a server listens on the port."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            time.sleep(0.02)
    raise SystemExit("the master does not answer")


def measure_all() -> dict[str, float]:
    """Return the CPU microseconds of each case and yardstick, with a new master and peer."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    os.environ |= {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}

    meter = Meter()
    measure_yardsticks(meter)
    roscore = Path(sys.executable).with_name("roscore")
    with started(str(roscore), "-q", "-p", port) as master:
        wait_for_port(int(port))
        with started(sys.executable, __file__, "peer") as other:
            measure_ours(meter, [psutil.Process(master.pid), psutil.Process(other.pid)])
    return meter.costs


def report(costs: dict[str, float]) -> list[str]:
    """Print the costs and return the cases that are over their limit."""
    print(f"{'CPU of all processes':32}{'us':>10}{'ratio':>10}{'at most':>10}")
    for name in dict.fromkeys(limit.yardstick for limit in LIMITS):
        print(f"{name:32}{costs[name]:10.1f}")

    slower = []
    for case, yardstick, most in LIMITS:
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
    elif sys.argv[1:2] == ["peer"]:
        peer()
    elif sys.argv[1:2] == ["once"]:
        sys.exit(once())
    else:
        sys.exit(main())
