"""`python benchmarks/packages.py [NAME ...]`: packages that programs import, minirospy's compared with Debian's, in one run.

Each measurement is a program that prints one number, run alternately under both interpreters; the best of three runs
counts. Real ROS is the one that /usr/bin/python3 imports.
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import functools
import os
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from cases import free_port

REAL = "/usr/bin/python3"
RUNS = 3


class Measurement(NamedTuple):
    """A program that prints one number, and the number's meaning."""

    unit: str
    code: str
    ours: str = ""
    """The program for minirospy, if minirospy has a faster method."""
    needs_master: bool = False
    peer: str = ""
    """The interpreter for both programs, if only the programs that they start differ; otherwise, each stack uses its own."""


SYNCHRONIZER = """
import random, time
import message_filters, rospy
from std_msgs.msg import Header

class Stamped:
    def __init__(self, nanoseconds):
        self.header = Header(stamp=rospy.Time(nanoseconds // 10**9, nanoseconds % 10**9))

rospy.rostime.set_rostime_initialized(True)
numbers = random.Random(1)
arrivals = []
for tick in range(1000):
    for topic in range(6):
        stamp = 10**12 + tick * 10_000_000 + numbers.randrange(-4_000_000, 4_000_000)
        # Each topic has a delay, as cameras and their processing have.
        arrivals.append((stamp + topic * {delay} + numbers.randrange(2_000_000), topic, Stamped(stamp)))
arrivals.sort(key=lambda each: each[:2])
sources = [message_filters.SimpleFilter() for _ in range(6)]
synchronizer = message_filters.ApproximateTimeSynchronizer(sources, {queue}, {slop})
sets = [0]
def count(*messages):
    sets[0] += 1
synchronizer.registerCallback(count)
start = time.perf_counter()
for _, topic, message in arrivals:
    sources[topic].signalMessage(message)
print((time.perf_counter() - start) / len(arrivals) * 1e6)
"""


def synchronizer(queue: int, slop: float, delay: int) -> Measurement:
    """Return the cost of a message; ``slop`` is in seconds, ``delay`` in nanoseconds between one topic and the next."""
    code = SYNCHRONIZER
    for name, value in (("queue", queue), ("slop", slop), ("delay", delay)):
        code = code.replace("{" + name + "}", str(value))
    return Measurement("us a message", code)


CLOUD = """
import time
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2, PointField

# 640x480 points of a depth camera: x, y, z, rgb in steps of 32 bytes; one in ten has no depth.
import struct
nan = float("nan")
row = b"".join(struct.pack("<3f4xf12x", *((nan,) * 3 if u % 10 == 0 else (u, u / 2, 1)), 0) for u in range(640))
names = [("x", 0), ("y", 4), ("z", 8), ("rgb", 16)]
cloud = PointCloud2(
    height=480, width=640, point_step=32, row_step=32 * 640, data=row * 480, is_bigendian=False,
    fields=[PointField(name, offset, PointField.FLOAT32, 1) for name, offset in names],
)
times = []
for _ in range(3):
    start = time.perf_counter()
    BODY
    times.append(time.perf_counter() - start)
print(min(times) * 1e3)
"""


def cloud(body: str, instead: str = "") -> Measurement:
    """Return the time for a line of code; ``instead`` is minirospy's alternative, which real ROS does not have."""
    return Measurement(
        "ms a 640x480 cloud", CLOUD.replace("BODY", body), CLOUD.replace("BODY", instead or body)
    )


IMAGE = """
import time
from cv_bridge import CvBridge
from sensor_msgs.msg import Image
import numpy
bridge = CvBridge()
image = Image(height=1080, width=1920, encoding="bgr8", step=5760, data=bytes(1080 * 5760))
rounds = 100
start = time.perf_counter()
for _ in range(rounds):
    bridge.imgmsg_to_cv2(image, "WANTED")
print((time.perf_counter() - start) / rounds * 1e6)
"""

RECONFIGURE = """
import sys, time
from types import SimpleNamespace
import rospy
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.server import Server
names = [f"p{number}" for number in range(10)]
parameters = [
    {"name": n, "type": "int", "default": 0, "min": 0, "max": 10**6, "level": 1, "description": "", "edit_method": ""}
    for n in names
]
kind = SimpleNamespace(
    defaults=dict.fromkeys(names, 0), min=dict.fromkeys(names, 0), max=dict.fromkeys(names, 10**6),
    config_description={
        "name": "Default", "type": "", "state": True, "id": 0, "parent": 0, "parameters": parameters, "groups": []
    },
)
rospy.init_node("server", argv=[])
server = Server(kind, lambda config, level: config)
client = Client("server", timeout=30)
client.get_configuration(timeout=30)
times = []
for number in range(50):
    start = time.perf_counter()
    client.update_configuration({"p3": number + 1})
    times.append(time.perf_counter() - start)
print(sorted(times)[len(times) // 2] * 1e3)
"""


PASS_ON = """
import os, subprocess, sys, threading, time
import rospy
from sensor_msgs.msg import Image

rospy.init_node("bench", argv=[])
arrived, sent, times = threading.Semaphore(0), [0.0], []

def received(message):
    times.append(time.perf_counter() - sent[0])
    arrived.release()

program = subprocess.Popen(COMMAND, stdout=subprocess.DEVNULL)
publisher = rospy.Publisher("/bench_in", Image, queue_size=1)
subscriber = rospy.Subscriber("/bench_out", Image, received, queue_size=1, buff_size=1 << 24)
image = Image(height=1080, width=1920, encoding="bgr8", step=5760, data=bytes(1080 * 5760))

def send():
    sent[0] = time.perf_counter()
    publisher.publish(image)

while not arrived.acquire(timeout=0.2):
    send()
time.sleep(0.5)
while arrived.acquire(timeout=0.1):
    pass
times.clear()

def used():
    words = open(f"/proc/{program.pid}/stat").read().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

before = used()
for _ in range(100):
    send()
    arrived.acquire(timeout=2)
cpu = (used() - before) / 100
times.sort()
program.terminate()
program.wait()
print(cpu * 1e3 if WHAT == "cpu" else times[len(times) // 2] * 1e3)
"""


def pass_on(what: str, peer: str, *words: str) -> Measurement:
    """Return the cost of an image through a program in topic_tools, minirospy's or Debian's, between the same endpoints."""
    scripts = Path(__file__).resolve().parents[1] / "msgs" / "topic_tools" / "scripts"
    code = PASS_ON.replace("WHAT", repr(what))
    real = code.replace("COMMAND", repr([f"/usr/lib/topic_tools/{words[0]}", *words[1:]]))
    ours = code.replace("COMMAND", repr([sys.executable, str(scripts / words[0]), *words[1:]]))
    unit = "ms of CPU" if what == "cpu" else "ms until it has arrived"
    return Measurement(f"{unit}, a 6 MB image", real, ours, needs_master=True, peer=peer)


RELAY = ("relay", "/bench_in", "/bench_out")
THROTTLE = ("throttle", "messages", "/bench_in", "1000000", "/bench_out")

MEASUREMENTS = {
    "relay": pass_on("time", sys.executable, *RELAY),
    "relay-cpu": pass_on("cpu", sys.executable, *RELAY),
    "relay-rospy": pass_on("time", REAL, *RELAY),
    "relay-rospy-cpu": pass_on("cpu", REAL, *RELAY),
    "throttle": pass_on("time", sys.executable, *THROTTLE),
    "throttle-cpu": pass_on("cpu", sys.executable, *THROTTLE),
    "image": Measurement("us a 6 MB image", IMAGE.replace("WANTED", "passthrough")),
    "image-rgb": Measurement("us a 6 MB image", IMAGE.replace("WANTED", "rgb8")),
    "reconfigure": Measurement("ms a change of 1 of 10 parameters", RECONFIGURE, needs_master=True),
    "cloud": cloud('sum(1 for _ in point_cloud2.read_points(cloud, ("x", "y", "z")))'),
    "cloud-no-nans": cloud(
        'sum(1 for _ in point_cloud2.read_points(cloud, ("x", "y", "z"), skip_nans=True))'
    ),
    "cloud-list": cloud('point_cloud2.read_points_list(cloud, ("x", "y", "z"))'),
    "cloud-numpy": cloud(
        'import numpy; numpy.array(list(point_cloud2.read_points(cloud, ("x", "y", "z"), skip_nans=True)))',
        'point_cloud2.read_points_numpy(cloud, ("x", "y", "z"), skip_nans=True)',
    ),
    "sync-prompt": synchronizer(10, 0.01, 0),
    "sync-delayed": synchronizer(20, 0.02, 10_000_000),
    "sync-wide": synchronizer(50, 0.1, 30_000_000),
}


@functools.cache
def our_master() -> int:
    """Start a minirospy master for this run; return its port."""
    port = free_port()
    folder = tempfile.mkdtemp()
    master = subprocess.Popen(
        [str(Path(sys.executable).with_name("roscore")), "-p", str(port)],
        env={**os.environ, "ROS_HOME": folder, "ROS_HOSTNAME": "localhost"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    atexit.register(master.terminate)
    for _ in range(100):
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 5):
            return port
        time.sleep(0.1)
    sys.exit("the master does not answer")


def measure(python: str, measurement: Measurement) -> float:
    """Run a program; return the number that it prints."""
    code = measurement.code if python == REAL else measurement.ours or measurement.code
    environment = {**os.environ, "ROS_HOSTNAME": "localhost"}
    if measurement.needs_master:
        environment["ROS_MASTER_URI"] = f"http://localhost:{our_master()}"
    python = measurement.peer or python
    done = subprocess.run([python, "-c", code], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{python}: {done.stderr}")
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print a table of the selected measurements."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="*", choices=[*MEASUREMENTS, []])
    names = parser.parse_args().name or list(MEASUREMENTS)
    pythons = [sys.executable, *([REAL] if Path(REAL).exists() else [])]
    print(f"{'':16}{'ours':>12}{'real':>12}  ratio")
    for name in names:
        each = MEASUREMENTS[name]
        runs = [[measure(python, each) for python in pythons] for _ in range(RUNS)]
        best = [min(column) for column in zip(*runs, strict=True)]
        row = "".join(f"{value:12.2f}" for value in best)
        ratio = f"{best[1] / best[0]:7.1f}" if len(best) > 1 else ""
        print(f"{name:16}{row}{ratio}  {each.unit}", flush=True)


if __name__ == "__main__":
    main()
