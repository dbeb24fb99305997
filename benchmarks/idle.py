"""`python benchmarks/idle.py`: what processes cost that do nothing, or little, for a long time.

For each process: how often the kernel wakes it per second, its CPU seconds per hour, and its memory (PSS). The cases with a
talker add the CPU time of one message. Real ROS is measured in the same run, alternating, if /usr/bin/python3 has rospy. The
counts come from /proc, so other load on the machine hardly changes them. Linux only. All traffic is on loopback.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

import psutil
from cases import BIN, free_port, wait_for_port

SETTLE = 4.0  # seconds until a process has started and has freed what the start needed
COLUMNS = ("wake-ups/s", "CPU s/hour", "CPU us/message", "PSS, MB")

NODE = "import rospy; rospy.init_node('idle'); rospy.spin()"
TALKER = """
import sys, rospy
from std_msgs.msg import UInt64
rospy.init_node('talker')
publisher = rospy.Publisher('numbers', UInt64, queue_size=10)
rate = rospy.Rate(float(sys.argv[1]))
while not rospy.is_shutdown():
    publisher.publish(1)
    rate.sleep()
"""
LISTENER = """
import rospy
from std_msgs.msg import UInt64
rospy.init_node('listener')
rospy.Subscriber('numbers', UInt64, lambda message: None)
rospy.spin()
"""


class Stack(NamedTuple):
    """An implementation of ROS 1: the interpreter of its nodes, and its commands."""

    python: str
    commands: Path


STACKS = {"minirospy": Stack(sys.executable, BIN), "ROS": Stack("/usr/bin/python3", Path("/usr/bin"))}


class Case(NamedTuple):
    """A process to measure. ``arguments``: Python code or a command; ``hz``: of the talker beside a listener."""

    name: str
    arguments: tuple[str, ...]
    hz: float = 0.0
    in_ros: bool = True


CASES = [
    Case("roscore", ("roscore",)),
    Case("a node that spins", ("-c", NODE)),
    Case("a talker and a listener, 10 Hz", (), 10.0),
    Case("a talker and a listener, 1 kHz", (), 1000.0),
    Case(
        "the dashboard, no page open", ("minirospy", "dashboard", "--no-browser", "--port", "0"), in_ros=False
    ),
    Case("rosbridge, no client", ("minirospy", "bridge", "--port", "0"), in_ros=False),
]


class Usage(NamedTuple):
    """Wake-ups and CPU seconds of processes since their start."""

    wake_ups: int
    cpu: float


def usage(processes: list[psutil.Process]) -> Usage:
    """Return what all threads of ``processes`` have used."""
    wake_ups, cpu = 0, 0.0
    for process in processes:
        for task in Path(f"/proc/{process.pid}/task").iterdir():
            status = (task / "status").read_text().splitlines()
            wake_ups += sum(int(line.split()[1]) for line in status if line.startswith("voluntary_ctxt"))
            cpu += int((task / "schedstat").read_text().split()[0]) / 1e9
    return Usage(wake_ups, cpu)


@contextmanager
def running(stack: Stack, arguments: tuple[str, ...], environ: dict[str, str]) -> Iterator[psutil.Process]:
    """Run Python code (``-c``), or a command of the stack, until the end of the block."""
    first = [stack.python] if arguments[0] == "-c" else [str(stack.commands / arguments[0])]
    rest = arguments if arguments[0] == "-c" else arguments[1:]
    process = subprocess.Popen(
        [*first, *rest], env=environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield psutil.Process(process.pid)
    finally:
        process.terminate()
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def measure(stack: Stack, case: Case, seconds: float) -> dict[str, float]:
    """Return the figures of one case by column. Raise SystemExit if a process ends early."""
    port = free_port()
    with tempfile.TemporaryDirectory() as home, ExitStack() as open_now:
        environ = {
            **os.environ,
            "ROS_HOME": home,
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": f"http://localhost:{port}",
        }
        measured = [open_now.enter_context(running(stack, ("roscore", "-p", str(port)), environ))]
        wait_for_port(port)
        if case.hz:
            programs: list[tuple[str, ...]] = [("-c", LISTENER), ("-c", TALKER, str(case.hz))]
        else:
            programs = [case.arguments] if case.arguments != ("roscore",) else []
        if programs:
            measured = [open_now.enter_context(running(stack, each, environ)) for each in programs]

        time.sleep(SETTLE)
        everything = [each for process in measured for each in (process, *process.children(recursive=True))]
        if not all(each.is_running() and each.status() != psutil.STATUS_ZOMBIE for each in everything):
            raise SystemExit(f"{case.name}: a process ended early")
        before, start = usage(everything), time.monotonic()
        time.sleep(seconds)
        after, passed = usage(everything), time.monotonic() - start
        cpu = (after.cpu - before.cpu) / passed
        return {
            "wake-ups/s": (after.wake_ups - before.wake_ups) / passed,
            "CPU s/hour": 3600 * cpu,
            "CPU us/message": 1e6 * cpu / case.hz if case.hz else math.nan,
            "PSS, MB": sum(each.memory_full_info().pss for each in everything) / 1e6,
        }


def main() -> int:
    """Measure all cases, and print the medians of the rounds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="the measured time of each case")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cases", default="", help="only cases whose name contains this text")
    options = parser.parse_args()
    probe = subprocess.run(["/usr/bin/python3", "-c", "import rospy"], check=False, capture_output=True)

    print(f"{'':32}{'':12}" + "".join(f"{column:>16}" for column in COLUMNS))
    for case in CASES:
        if options.cases not in case.name:
            continue
        found: dict[str, list[dict[str, float]]] = defaultdict(list)
        for _ in range(options.rounds):
            for name, stack in STACKS.items():
                if name == "minirospy" or (case.in_ros and not probe.returncode):
                    found[name].append(measure(stack, case, options.seconds))
        for name, rounds in found.items():
            values = [statistics.median(each[column] for each in rounds) for column in COLUMNS]
            row = "".join(f"{'' if math.isnan(value) else f'{value:,.1f}':>16}" for value in values)
            print(f"{case.name:32}{name:12}{row}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
