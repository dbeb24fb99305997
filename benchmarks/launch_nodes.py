"""`python benchmarks/launch_nodes.py`: how long `roslaunch` of many Python nodes takes, and what the nodes cost.

For each launch: the time from roslaunch's start until the master lists all nodes as publishers and subscribers
(getSystemState), the CPU time of all processes until then, and their memory (PSS) after a pause. Real ROS is measured in the
same run, alternating, if it is installed in /usr/bin. Other load on the machine makes the times longer, and hardly changes
the memory. Linux only. All traffic is on loopback.
"""

from __future__ import annotations

import argparse
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import psutil
from cases import free_port

from minirospy.base.errors import MinirospyError
from minirospy.runtime.rpc.master_proxy import MasterProxy

MAX_SECONDS = 120.0  # for the registration of all nodes
SETTLE = 3.0  # seconds until the processes have freed what their start needed
COLUMNS = ("registered, s", "CPU, s", "PSS, MB", "not shared, MB")

NODE = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String

if __name__ == "__main__":
    rospy.init_node("node")
    rospy.Publisher("~out", String, queue_size=1)
    rospy.Subscriber("common", String, lambda message: None)
    rospy.spin()
"""
PACKAGE = """<package format="2"><name>many_nodes</name><version>0.0.0</version><description>d</description>
<maintainer email="a@b.org">a</maintainer><license>MIT</license></package>"""

# Environment variables and roslaunch's program of each case.
OURS = str(Path(sys.executable).with_name("roslaunch"))
REAL = "/usr/bin/roslaunch"
CASES = {
    "ROS": ({"PATH": "/usr/bin:/bin"}, REAL),
    "minirospy": ({}, OURS),
    "minirospy, MINIROSPY_PRELOAD=0": ({"MINIROSPY_PRELOAD": "0"}, OURS),
}


def write_launch(folder: Path, count: int) -> Path:
    """Write a package with one program, and a launch file that starts it ``count`` times; return the launch file."""
    package = folder / "many_nodes"
    package.mkdir()
    (package / "package.xml").write_text(PACKAGE)
    program = package / "node.py"
    program.write_text(NODE)
    program.chmod(0o755)
    launch = folder / "many.launch"
    nodes = "".join(f'<node name="n{n}" pkg="many_nodes" type="node.py"/>' for n in range(count))
    launch.write_text(f"<launch>{nodes}</launch>")
    return launch


def registered(master: MasterProxy, count: int) -> bool:
    """Return whether all nodes are registered as publishers and subscribers."""
    try:
        state = master.get_system_state()
    except (MinirospyError, OSError):
        return False
    names = {f"/n{number}" for number in range(count)}
    subscribers = set(state.subscribers.get("/common", ()))
    return names <= subscribers and all(f"{name}/out" in state.publishers for name in names)


def tree(process: psutil.Process) -> list[psutil.Process]:
    """Return a process and all its descendants."""
    return [process, *process.children(recursive=True)]


def measure(
    program: str, variables: dict[str, str], count: int, *, with_memory: bool = True
) -> dict[str, float]:
    """Return the figures of one launch by column. Raise SystemExit if the nodes are not registered in time."""
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        launch = write_launch(Path(home), count)
        uri = f"http://localhost:{port}"
        environ = {
            **os.environ,
            **variables,
            "ROS_HOME": home,
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": uri,
            "ROS_PACKAGE_PATH": f"{home}:/usr/share",
        }
        master = MasterProxy(uri, "/benchmark")
        start = time.monotonic()
        with subprocess.Popen(
            [program, str(launch)], env=environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as launcher:
            try:
                while not registered(master, count):
                    if launcher.poll() is not None or time.monotonic() - start > MAX_SECONDS:
                        raise SystemExit(f"{program}: not all nodes were registered")
                    time.sleep(0.02)
                seconds = time.monotonic() - start
                cpu = sum(sum(each.cpu_times()[:4]) for each in tree(psutil.Process(launcher.pid)))
                figures = {"registered, s": seconds, "CPU, s": cpu}
                if with_memory:
                    time.sleep(SETTLE)
                    memory = [each.memory_full_info() for each in tree(psutil.Process(launcher.pid))]
                    figures["PSS, MB"] = sum(each.pss for each in memory) / 1e6
                    figures["not shared, MB"] = sum(each.uss for each in memory) / 1e6
            finally:
                launcher.send_signal(signal.SIGINT)
                try:
                    launcher.wait(MAX_SECONDS)
                except subprocess.TimeoutExpired:
                    launcher.kill()
    return figures


def main() -> int:
    """Measure all cases, and print the medians of the rounds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--nodes", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cases", default="", help="only cases whose name contains this text")
    options = parser.parse_args()

    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    for _ in range(options.rounds):
        for name, (variables, program) in CASES.items():
            if options.cases in name and Path(program).exists():
                found[name].append(measure(program, variables, options.nodes))
    print(f"{options.nodes:<3} nodes{'':24}" + "".join(f"{column:>18}" for column in COLUMNS))
    for name, rounds in found.items():
        values = [statistics.median(each[column] for each in rounds) for column in COLUMNS]
        print(f"{name:33}" + "".join(f"{value:>18,.2f}" for value in values))
    return 0


if __name__ == "__main__":
    sys.exit(main())
