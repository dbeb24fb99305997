"""`python benchmarks/packages.py [NAME ...]`: packages that programs import, ours next to Debian's, in one run.

Each measurement is a program that prints one number, run in turns under both interpreters; of three runs the best one
counts. Real ROS is what /usr/bin/python3 imports.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

REAL = "/usr/bin/python3"
RUNS = 3


class Measurement(NamedTuple):
    """A program that prints one number, and what the number is."""

    unit: str
    code: str


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
    """Return the cost of a message: ``slop`` in seconds, ``delay`` of each topic after the one before it in nanoseconds."""
    code = SYNCHRONIZER
    for name, value in (("queue", queue), ("slop", slop), ("delay", delay)):
        code = code.replace("{" + name + "}", str(value))
    return Measurement("us a message", code)


MEASUREMENTS = {
    "sync-prompt": synchronizer(10, 0.01, 0),
    "sync-delayed": synchronizer(20, 0.02, 10_000_000),
    "sync-wide": synchronizer(50, 0.1, 30_000_000),
}


def measure(python: str, measurement: Measurement) -> float:
    """Run a program; return the number that it prints."""
    environment = {**os.environ, "ROS_HOSTNAME": "localhost"}
    done = subprocess.run(
        [python, "-c", measurement.code], env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{python}: {done.stderr}")
    return float(done.stdout.split()[-1])


def main() -> None:
    """Print a table of what was asked for."""
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
