"""A class of simulated laptops: each joins the teacher's master and checks an exercise; some make mistakes.

Run as root on Linux: each laptop is a network namespace with its own address and, with ``--masters``, its own master. The
script prints whether the teacher's table names exactly the students with mistakes, and the CPU time and memory of the
teacher's master and dashboard.

    sudo .venv/bin/python benchmarks/classroom.py --laptops 20 --mistakes 3
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil

PYTHON = [sys.executable, "-m", "minirospy"]
TEACHER = "10.77.0.1"
PORT = 11511
DASHBOARD_PORT = 18771
EXERCISE = "ball"
PROGRAM = """
import rospy
import RPi.GPIO as GPIO
from std_msgs.msg import Int32

def on_ball(message):
    GPIO.output((2, 7), (message.data < {limit}, message.data >= {limit}))

rospy.init_node("my_ball_leds")
GPIO.setmode(GPIO.BCM)
GPIO.setup((2, 7), GPIO.OUT)
rospy.Subscriber("/ball", Int32, on_ball)
rospy.spin()
"""
RIGHT, WRONG = 80, 20  # columns: the wrong program lights the red LED on the left, too
BATCH = 4  # laptops that check at the same time: two cores play all of them
CHECK_SECONDS = 300.0
SETTLE_SECONDS = 10.0  # for the start of twenty processes


class Room:
    """The classroom's network: a bridge with the teacher's address, and a namespace for each laptop."""

    def __init__(self, laptops: int) -> None:
        self.tag = f"mc{os.getpid() % 10000}"
        self.bridge = f"{self.tag}b"
        self.names = [f"{self.tag}-{number}" for number in range(1, laptops + 1)]

    def address(self, number: int) -> str:
        """Return the address of laptop ``number``, from 1."""
        return f"10.77.0.{number + 10}"

    @contextlib.contextmanager
    def built(self) -> Iterator[None]:
        """Create the network, and remove it at the end."""
        try:
            _ip(f"link add {self.bridge} type bridge")
            _ip(f"addr add {TEACHER}/24 dev {self.bridge}")
            _ip(f"link set {self.bridge} up")
            for number, name in enumerate(self.names, 1):
                cable = f"{self.tag}v{number}"
                _ip(f"netns add {name}")
                _ip(f"link add {cable} type veth peer name eth0 netns {name}")
                _ip(f"link set {cable} master {self.bridge} up")
                _ip(f"-n {name} link set lo up")
                _ip(f"-n {name} addr add {self.address(number)}/24 dev eth0")
                _ip(f"-n {name} link set eth0 up")
            yield
        finally:
            for name in self.names:
                subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)
            subprocess.run(["ip", "link", "del", self.bridge], check=False, capture_output=True)


def _ip(words: str) -> None:
    subprocess.run(["ip", *words.split()], check=True, capture_output=True, text=True)


def environ_of(room: Room, number: int, home: Path, *, own_master: bool) -> dict[str, str]:
    """Return the environment of the programs on a laptop."""
    return {
        **{key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))},
        "HOME": str(home),
        "ROS_HOME": str(home / ".ros"),
        "MINIROSPY_RUNTIME_DIR": str(home / "boards"),
        "ROS_IP": room.address(number),
        "ROS_MASTER_URI": f"http://{room.address(number)}:11311"
        if own_master
        else f"http://{TEACHER}:{PORT}",
    }


@contextlib.contextmanager
def running_on(room: Room, folder: Path, words: list[str], *, own_master: bool) -> Iterator[None]:
    """Run a command on each laptop; terminate it at the end."""
    with contextlib.ExitStack() as stack:
        for number, name in enumerate(room.names, 1):
            home = folder / f"laptop{number}"
            home.mkdir(exist_ok=True)
            process = subprocess.Popen(
                ["ip", "netns", "exec", name, *PYTHON, *words],
                env=environ_of(room, number, home, own_master=own_master),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
        yield


def join(room: Room, number: int, folder: Path, *, own_master: bool) -> None:
    """Join the class from a laptop, as a student does: one command."""
    home = folder / f"laptop{number}"
    home.mkdir(exist_ok=True)
    words = ["check", "--name", f"student{number:02d}", "--join", f"http://{TEACHER}:{PORT}"]
    subprocess.run(
        ["ip", "netns", "exec", room.names[number - 1], *PYTHON, *words],
        env=environ_of(room, number, home, own_master=own_master),
        check=True,
        capture_output=True,
        timeout=CHECK_SECONDS,
    )


def laptop(room: Room, number: int, folder: Path, *, is_wrong: bool, own_master: bool) -> tuple[int, float]:
    """Check the exercise on a laptop; return the exit status and the seconds."""
    home = folder / f"laptop{number}"
    home.mkdir(exist_ok=True)
    program = home / "ball_leds.py"
    program.write_text(PROGRAM.format(limit=WRONG if is_wrong else RIGHT))
    environ = environ_of(room, number, home, own_master=own_master)
    inside = ["ip", "netns", "exec", room.names[number - 1], *PYTHON]
    start = time.monotonic()
    done = subprocess.run(
        [*inside, "check", EXERCISE, str(program), "--patience", "3"],
        env=environ,
        check=False,
        capture_output=True,
        text=True,
        timeout=CHECK_SECONDS,
    )
    if done.returncode not in (0, 1):
        print(done.stdout, done.stderr, file=sys.stderr)
    return done.returncode, time.monotonic() - start


@contextlib.contextmanager
def teacher(folder: Path) -> Iterator[dict[str, psutil.Process]]:
    """Run the teacher's master and dashboard; yield their processes."""
    environ = {
        **{key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))},
        "ROS_HOME": str(folder / "teacher"),
        "ROS_IP": TEACHER,
        "ROS_MASTER_URI": f"http://{TEACHER}:{PORT}",
        "MINIROSPY_RUNTIME_DIR": str(folder / "teacher-boards"),
    }
    commands = {
        "master": ["master", "-p", str(PORT)],
        "dashboard": ["dashboard", "class", "--no-browser", "--port", str(DASHBOARD_PORT)],
    }
    running: dict[str, subprocess.Popen[bytes]] = {}
    with (folder / "teacher.log").open("wb") as log, contextlib.ExitStack() as stack:
        for name, words in commands.items():
            process = subprocess.Popen(
                [*PYTHON, *words], env=environ, stdin=subprocess.DEVNULL, stdout=log, stderr=log
            )
            stack.callback(process.wait)
            stack.callback(process.terminate)
            running[name] = process
            time.sleep(3)
        yield {name: psutil.Process(process.pid) for name, process in running.items()}


def table(folder: Path) -> str:
    """Return the teacher's table."""
    environ = {
        **os.environ,
        "ROS_MASTER_URI": f"http://{TEACHER}:{PORT}",
        "ROS_HOME": str(folder / "teacher"),
    }
    return subprocess.run(
        [*PYTHON, "check", "--class"], env=environ, check=True, capture_output=True, text=True
    ).stdout


def main() -> int:
    """Run the class; return 0 if the table names exactly the students with mistakes."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--laptops", type=int, default=20)
    parser.add_argument("--mistakes", type=int, default=3)
    parser.add_argument(
        "--masters", action="store_true", help="a master on each laptop, besides the teacher's"
    )
    parser.add_argument(
        "--share", action="store_true", help="each laptop shows its board on the teacher's page"
    )
    options = parser.parse_args()
    room = Room(options.laptops)
    step = max(1, options.laptops // max(1, options.mistakes))
    numbers = range(1, options.laptops + 1)
    wrong = set(range(step, options.laptops + 1, step)[: options.mistakes])

    with (
        tempfile.TemporaryDirectory(prefix="classroom-") as name,
        room.built(),
        teacher(Path(name)) as processes,
        contextlib.ExitStack() as outer,
    ):
        folder = Path(name)
        own_master = options.masters
        with ThreadPoolExecutor(BATCH) as pool:
            joined = [pool.submit(join, room, number, folder, own_master=own_master) for number in numbers]
            for each in joined:
                each.result()
        if options.masters:
            outer.enter_context(running_on(room, folder, ["master"], own_master=True))
        if options.share:
            outer.enter_context(running_on(room, folder, ["check", "--share"], own_master=own_master))
        if options.masters or options.share:
            time.sleep(SETTLE_SECONDS)
        idle = {key: process.memory_info().rss for key, process in processes.items()}
        before = {key: sum(process.cpu_times()[:2]) for key, process in processes.items()}
        start = time.monotonic()
        with ThreadPoolExecutor(BATCH) as pool:
            futures = {
                number: pool.submit(
                    laptop, room, number, folder, is_wrong=number in wrong, own_master=own_master
                )
                for number in numbers
            }
            results = {number: future.result() for number, future in futures.items()}
        took = time.monotonic() - start
        text = table(folder)
        shown_wrong = {
            int(line[7:9])
            for line in text.splitlines()
            if line.startswith("student") and line.split()[1:] == ["no"]
        }
        shown_right = {
            int(line[7:9])
            for line in text.splitlines()
            if line.startswith("student") and line.split()[1:] == ["yes"]
        }
        print(text)
        median = sorted(seconds for _, seconds in results.values())[len(results) // 2]
        print(f"{options.laptops} laptops, {BATCH} at a time: {took:.0f} s; one check {median:.1f} s")
        for key, process in processes.items():
            cpu = sum(process.cpu_times()[:2]) - before[key]
            memory = process.memory_info().rss
            print(
                f"teacher's {key}: {cpu:.2f} s of CPU ({100 * cpu / took:.1f} % of a core), "
                f"{memory / 1e6:.0f} MB (idle {idle[key] / 1e6:.0f} MB)"
            )
        is_right = shown_wrong == wrong and shown_right == set(results) - wrong
        is_right = is_right and all(
            (status == 1) == (number in wrong) for number, (status, _) in results.items()
        )
        print(
            "the table names exactly the students with mistakes"
            if is_right
            else f"WRONG: {shown_wrong} instead of {wrong}"
        )
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
