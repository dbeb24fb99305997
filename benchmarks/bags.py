"""`python benchmarks/bags.py`: messages per second and memory of the rosbag API and commands, compared with Debian's and rosbags.

Each case runs in a separate process: minirospy, Debian's rosbag (if /usr/bin/python3 has it) and PyPI's rosbags, on the same
bag. Rates are per second of CPU time, so that a busy machine affects them less; memory is the process's peak. All modules
are compiled in advance, as in installed packages. `--messages 10000000 --cases open,list,filter` shows the memory for a large
bag; `--large 5000 --cases info,info_mcap` shows the time for a bag of 5 GB and its MCAP counterpart; `--nodes 3` adds three
rounds of bag_nodes.py, which compares record and play with the C++ programs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

REAL = "/usr/bin/python3"

API = """
import itertools, json, resource, sys, time
case, path, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
import rosbag, rospy
from std_msgs.msg import String

def write():
    message = String("x" * 100)
    with rosbag.Bag(path + ".written", "w") as bag:
        for number in range(count):
            bag.write("/chatter", message, rospy.Time(1 + number // 1000, number % 1000 * 1000000))
    return count

def read():
    with rosbag.Bag(path) as bag:
        return sum(1 for _ in bag.read_messages())

def raw():
    with rosbag.Bag(path) as bag:
        return sum(1 for _ in bag.read_messages(raw=True))

def topic():
    with rosbag.Bag(path) as bag:
        return sum(1 for _ in bag.read_messages("/topic3"))

def open_():
    rosbag.Bag(path)
    return 1

def list_():
    with rosbag.Bag(path) as bag:
        return bag.get_message_count() and len(str(bag)) and 1

def entries():
    with rosbag.Bag(path) as bag:
        return sum(1 for _ in bag._get_entries())

start, wall = time.process_time(), time.perf_counter()
done = {"open": open_, "list": list_}.get(case, globals().get(case))()
cpu, wall = time.process_time() - start, time.perf_counter() - wall
print(json.dumps([done, cpu, wall, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""

ROSBAGS = """
import json, resource, sys, time
from pathlib import Path
case, path, count = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_typestore
store = get_typestore(Stores.ROS1_NOETIC)

def write():
    String = store.types["std_msgs/msg/String"]
    path.with_suffix(".bag.rosbags").unlink(missing_ok=True)
    with Writer(path.with_suffix(".bag.rosbags")) as bag:
        connection = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        message = String("x" * 100)
        for number in range(count):
            bag.write(connection, number * 1000000, store.serialize_ros1(message, "std_msgs/msg/String"))
    return count

def read():
    with Reader(path) as bag:
        return sum(1 for connection, _, data in bag.messages() if store.deserialize_ros1(data, connection.msgtype))

def raw():
    with Reader(path) as bag:
        return sum(1 for _ in bag.messages())

def topic():
    with Reader(path) as bag:
        return sum(1 for _ in bag.messages([each for each in bag.connections if each.topic == "/topic3"]))

def open_():
    Reader(path).open()
    return 1

start, wall = time.process_time(), time.perf_counter()
done = {"open": open_}.get(case, globals().get(case))()
cpu, wall = time.process_time() - start, time.perf_counter() - wall
print(json.dumps([done, cpu, wall, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""

CASES = {
    "write": ("messages/s", ("minirospy", "Debian's rosbag", "rosbags")),
    "read": ("messages/s", ("minirospy", "Debian's rosbag", "rosbags")),
    "raw": ("messages/s", ("minirospy", "Debian's rosbag", "rosbags")),
    "topic": ("messages/s", ("minirospy", "Debian's rosbag", "rosbags")),
    "open": ("ms", ("minirospy", "Debian's rosbag", "rosbags")),
    "list": ("ms", ("minirospy", "Debian's rosbag")),
    "info": ("ms", ("minirospy", "Debian's rosbag")),
    "info_mcap": ("ms", ("minirospy",)),
    "start": ("ms", ("minirospy", "Debian's rosbag")),
    "filter": ("ms", ("minirospy", "Debian's rosbag")),
}
"""The unit of each case, and the stacks that run it."""


def make_bag(path: Path, messages: int, size: int, compression: str) -> None:
    """Write a bag of strings on ten topics, each with ``size`` bytes."""
    from minirospy.core.bag.writer import BagWriter

    definition = {
        "type": "std_msgs/String",
        "md5sum": "992ce8a1687cec8c8bd883ec73ca41d1",
        "message_definition": "string data\n",
    }
    body = size.to_bytes(4, "little") + os.urandom(size // 2).hex().encode().ljust(size, b"x")[:size]
    with path.open("wb", buffering=0) as stream:
        writer = BagWriter(stream, compression=compression)
        numbers = [
            writer.add_connection(f"/topic{each}", {"topic": f"/topic{each}"} | definition)
            for each in range(10)
        ]
        for number in range(messages):
            writer.write(numbers[number % 10], number * 1_000_000, body)
        writer.close()


def run(case: str, stack: str, path: Path, messages: int) -> list[float] | None:
    """Return the number of messages, CPU seconds, seconds and MB of one process, or None if the stack is missing."""
    if case in ("info", "info_mcap", "start", "filter"):
        return command(case, stack, path)
    python, program = {
        "minirospy": (sys.executable, API),
        "Debian's rosbag": (REAL, API),
        "rosbags": (sys.executable, ROSBAGS),
    }[stack]
    done = subprocess.run(
        [python, "-W", "ignore", "-c", program, case, str(path), str(messages)],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        print(f"{stack}: {done.stderr.strip().splitlines()[-1:]}", file=sys.stderr)
        return None
    figures: list[float] = json.loads(done.stdout.splitlines()[-1])
    return figures


def command(case: str, stack: str, path: Path) -> list[float] | None:
    """Return the same numbers as :func:`run` for a command, including the time to start it."""
    program = Path(sys.executable).with_name("rosbag") if stack == "minirospy" else Path("/usr/bin/rosbag")
    if not program.exists():
        return None
    words = {
        "info": ["info", str(path)],
        "info_mcap": ["info", str(path.with_suffix(".mcap"))],
        "start": ["-h"],
        "filter": ["filter", str(path), f"{path}.filtered", "topic == '/topic3'"],
    }[case]
    measuring = (
        "import json, os, subprocess, sys, time\n"
        "start = time.perf_counter()\n"
        "process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)\n"
        "_, status, usage = os.wait4(process.pid, 0)\n"
        "seconds = usage.ru_utime + usage.ru_stime\n"
        "print(json.dumps([1, seconds, time.perf_counter() - start, usage.ru_maxrss / 1024]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", measuring, str(program), *words], capture_output=True, text=True, check=True
    )
    figures: list[float] = json.loads(done.stdout)
    return figures


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=100_000)
    parser.add_argument("--size", type=int, default=100, help="bytes of a message")
    parser.add_argument(
        "--large", type=int, default=0, metavar="MB", help="messages of 1 MB, so many, instead"
    )
    parser.add_argument("--compression", default="none", choices=["none", "bz2", "lz4"])
    parser.add_argument(
        "--cases",
        default=",".join(case for case in CASES if case != "info_mcap"),
        help="some of: " + ", ".join(CASES),
    )
    parser.add_argument("--stacks", default="minirospy,Debian's rosbag,rosbags")
    parser.add_argument("--nodes", type=int, default=0, metavar="ROUNDS", help="rounds of bag_nodes.py")
    options = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bench.bag"
        messages, size = (options.large, 1_000_000) if options.large else (options.messages, options.size)
        make_bag(path, messages, size, options.compression)
        print(
            f"{messages} messages of {size} bytes, {options.compression}: {path.stat().st_size / 1e6:.0f} MB"
        )
        print(f"{'case':8}{'stack':18}{'CPU':>14} {'':12}{'wall s':>8}{'peak MB':>9}{'to minirospy':>14}")
        os.environ["PYTHONPYCACHEPREFIX"] = str(Path(folder) / "compiled")
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        cases = options.cases.split(",")
        if "info_mcap" in cases:
            subprocess.run(
                [
                    str(Path(sys.executable).with_name("rosbag")),
                    "convert",
                    "-q",
                    path,
                    path.with_suffix(".mcap"),
                ],
                check=True,
            )
        for case in cases:
            ours = 0.0
            run(case, "minirospy", path, messages)
            unit, stacks = CASES[case]
            for stack in stacks:
                figures = run(case, stack, path, messages) if stack in options.stacks.split(",") else None
                if not figures:
                    continue
                done, cpu, wall, memory = figures
                value = done / cpu if unit == "messages/s" else 1000 * cpu
                ours = ours or value
                ratio = ours / value if unit == "messages/s" else value / ours
                print(f"{case:8}{stack:18}{value:>14,.0f} {unit:12}{wall:>8.2f}{memory:>9.0f}{ratio:>13.1f}x")
            for extra in Path(folder).glob("bench.bag.*"):
                extra.unlink()
    if options.nodes:
        nodes = Path(__file__).with_name("bag_nodes.py")
        subprocess.run([sys.executable, nodes, "--rounds", str(options.nodes)], check=True)


if __name__ == "__main__":
    main()
