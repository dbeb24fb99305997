"""Windows' CPython under Wine compared with Linux, alternating in one run, both over TCP: `python benchmarks/windows.py`.

First run `make windows`, which sets up Wine. The results include Wine's own cost: they show how much of a robot's work is
possible there, not how fast Windows is. Each process of a system uses a master of that system.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.conftest import free_port
from tests.windows.programs import SECONDS as PATIENCE
from tests.windows.programs import WINDOWS, Run, command

ECHO = """
import rospy
from std_msgs.msg import UInt32
rospy.init_node("echo")
pong = rospy.Publisher("/pong", UInt32, queue_size=10)
counted = rospy.Publisher("/counted", UInt32, queue_size=10)
count = 0
def on_stream(message):
    global count
    if message.data:
        count += 1
    else:
        counted.publish(count)
        count = 0
rospy.Subscriber("/ping", UInt32, pong.publish, tcp_nodelay=True)
rospy.Subscriber("/stream", UInt32, on_stream)
print("ready", flush=True)
rospy.spin()
"""

PING = """
import json, statistics, threading, time
import rospy
from std_msgs.msg import UInt32
rospy.init_node("ping")
answered, counts = threading.Semaphore(0), []
ping = rospy.Publisher("/ping", UInt32, queue_size=10)
stream = rospy.Publisher("/stream", UInt32, queue_size=1000)
rospy.Subscriber("/pong", UInt32, lambda message: answered.release(), tcp_nodelay=True)
rospy.Subscriber("/counted", UInt32, lambda message: (counts.append(message.data), answered.release()))
for publisher in (ping, stream):
    publisher.wait_for_subscribers(timeout=60)
while True:
    ping.publish(1)
    if answered.acquire(timeout=1):
        break
times = []
for number in range(2000):
    start = time.perf_counter()
    ping.publish(number)
    answered.acquire()
    times.append(time.perf_counter() - start)
start = time.perf_counter()
for number in range(1, 20001):
    stream.publish(number)
stream.publish(0)
while not answered.acquire(timeout=1):
    # The end was one of those that were dropped.
    stream.publish(0)
rate = counts[0] / (time.perf_counter() - start)
print(json.dumps({"trip": statistics.median(times), "rate": rate, "lost": 20000 - counts[0]}))
"""

NODE = "import rospy; rospy.init_node('x', anonymous=True); rospy.get_param('/run_id')"

Starter = Callable[..., Run]


def main() -> int:
    """Measure, and print a table; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--rounds", type=int, default=3, help="how often each system is measured (default: 3)"
    )
    rounds: int = parser.parse_args().rounds
    if not WINDOWS.is_ready:
        sys.exit("`make windows` sets Wine up first")

    found: dict[str, dict[str, list[float]]] = {"Linux": {}, "Wine": {}}
    WINDOWS.start_server()
    try:
        for _ in range(rounds):
            for system, values in found.items():
                for name, value in measure(system).items():
                    values.setdefault(name, []).append(value)
    finally:
        WINDOWS.stop_server()

    print(f"| median of {rounds} (least to most) | Linux | Wine | ratio |\n|---|---|---|---|")
    for name in found["Linux"]:
        cells = [found[system][name] for system in found]
        middle = [statistics.median(cell) for cell in cells]
        texts = [f"{statistics.median(c):,.4g} ({min(c):,.4g} to {max(c):,.4g})" for c in cells]
        ratio = f"{middle[1] / middle[0]:.2g}" if middle[0] else ""
        print(f"| {name} | {' | '.join(texts)} | {ratio} |")
    return 0


def measure(system: str) -> dict[str, float]:
    """Measure one system once; return the values by name with unit."""
    environ = {
        "ROS_MASTER_URI": f"http://localhost:{(port := free_port())}",
        "MINIROSPY_LOCAL": "1",
        "MINIROSPY_TRANSPORT": "tcp",
        "PYTHONUNBUFFERED": "1",
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        python, core, rostopic = _commands(system, folder, environ)
        master = python(*core, "-p", str(port))
        try:
            master.until("started core service")
            times = {
                "`import rospy`, s": _seconds(python, "-c", "import rospy"),
                "a node's start, a parameter, its end, s": _seconds(python, "-c", NODE),
                "`rostopic list`, s": _seconds(python, *rostopic, "list"),
            }
            echo = python("-c", ECHO)
            try:
                echo.until("ready")
                ping = python("-c", PING)
                printed = ping.rest()
                assert ping.process.wait(PATIENCE) == 0, printed
                result = json.loads(printed.splitlines()[-1])
            finally:
                echo.close()
        finally:
            master.close()
    return {
        "a message there and back, ms": 1e3 * result["trip"],
        "messages of 4 bytes delivered a second": result["rate"],
        "of 20,000 lost": result["lost"],
        **times,
    }


def _commands(system: str, folder: Path, environ: dict[str, str]) -> tuple[Starter, list[str], list[str]]:
    """Return a function that starts Python or a command, and the first words of roscore's and rostopic's command lines."""
    if system == "Wine":
        home = {"ROS_HOME": WINDOWS.path(folder)}

        def in_wine(*words: str) -> Run:
            return Run(WINDOWS.popen(*words, folder=folder, environ={**environ, **home}))

        return in_wine, [command("roscore")], [command("rostopic")]

    def on_linux(*words: str) -> Run:
        process = subprocess.Popen(
            [sys.executable, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env={**os.environ, **environ, "ROS_HOME": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        )
        return Run(process)

    scripts = Path(sys.executable).parent
    return on_linux, [str(scripts / "roscore")], [str(scripts / "rostopic")]


def _seconds(python: Starter, *words: str) -> float:
    """Return how long a process takes. Run it twice: the first run fills the system's caches."""
    for _ in range(2):
        start = time.perf_counter()
        run = python(*words)
        printed = run.rest()
        assert run.process.wait(PATIENCE) == 0, printed
        seconds = time.perf_counter() - start
    return seconds


if __name__ == "__main__":
    sys.exit(main())
