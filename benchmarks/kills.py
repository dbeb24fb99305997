"""Kill publishers and subscribers of large messages at random moments (kill -9), and check what the others receive.

A talker and a listener live for the whole run; another talker and another listener are killed again and again. Each talker
publishes 1 MB at 200 Hz. The listeners compare every byte and the order of each talker's messages. At the end the script
prints what the survivors have used: file descriptors, memory, and the longest silence of the talker that was not killed.

    python benchmarks/kills.py --kills 1000
    MINIROSPY_TRANSPORT=unix python benchmarks/kills.py --kills 1000

The exit status is 1 if a byte was wrong, a message was out of order, or a survivor has leaked. Linux only.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import psutil

SIZE = 1_000_000
HZ = 200.0
PATTERNS = (
    7  # different contents, so that a message that is overwritten while it is read differs in most bytes
)
SILENCE = 0.2  # seconds
MAX_GROWTH = 40 * 1024 * 1024  # bytes by which a survivor's own memory may vary during a run: a few messages
MAX_FILES = 8  # open files by which a survivor may vary: a ring, its counter and a connection, of two peers
SECONDS = 100.0  # time limit for anything to happen, longer than a busy machine stalls


class Report(NamedTuple):
    """The result of one run."""

    kills: int
    checked: int  # messages that the surviving listener has compared
    faults: list[str]  # wrong bytes, wrong order, leaks
    longest_silence: float  # seconds without a message from the surviving talker
    silences: int  # how often it was longer than SILENCE
    files: dict[str, tuple[int, int]]  # open files of each survivor before and after
    megabytes: dict[str, tuple[float, float]]  # memory of each survivor before and after


def contents() -> list[bytes]:
    return [random.Random(number).randbytes(SIZE) for number in range(PATTERNS)]


def talk(name: str, parts: list[bytes], _: Path) -> None:
    import rospy
    from sensor_msgs.msg import Image

    rospy.init_node(_node_of(name), disable_signals=True)
    publisher = rospy.Publisher("/kills", Image, queue_size=3)
    message = Image()
    message.header.frame_id = name
    number, due = 0, time.monotonic()
    while True:
        number += 1
        message.height, message.width, message.data = number, number % PATTERNS, parts[number % PATTERNS]
        publisher.publish(message)
        due = max(due + 1 / HZ, time.monotonic() - 0.05)
        time.sleep(max(0.0, due - time.monotonic()))


def listen(name: str, parts: list[bytes], folder: Path) -> None:
    """Compare the messages, and write the result into a file several times a second."""
    import rospy
    from sensor_msgs.msg import Image

    rospy.init_node(_node_of(name), disable_signals=True)
    last: dict[str, tuple[int, float]] = {}
    result: dict[str, Any] = {"checked": 0, "faults": [], "longest": 0.0, "silences": 0, "from": {}}

    def on_message(message: Any) -> None:
        talker, now = message.header.frame_id, time.monotonic()
        before, then = last.get(talker, (0, now))
        if message.data != parts[message.width]:
            result["faults"].append(f"{name}: message {message.height} of {talker} has wrong bytes")
        if message.height <= before:
            result["faults"].append(f"{name}: message {message.height} of {talker} after {before}")
        last[talker] = message.height, now
        result["checked"] += 1
        result["from"][talker] = message.height
        if talker == "talker":
            result["longest"] = max(result["longest"], now - then)
            result["silences"] += now - then > SILENCE

    rospy.Subscriber("/kills", Image, on_message)
    path = folder / f"{name}.json"
    while True:
        time.sleep(0.05)
        path.with_suffix(".new").write_text(json.dumps(result))
        path.with_suffix(".new").replace(path)


class Scene:
    """The master, and the talkers and listeners as forks of this process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._parts = contents()
        self._running: set[int] = set()
        port = _free_port()
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
        os.environ["ROS_HOSTNAME"] = "localhost"
        command = [str(Path(sys.executable).parent / "roscore"), "-q", "-p", str(port)]
        self._master = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            _wait_for("the master", lambda: _answers(port))
        except BaseException:
            self.close()
            raise

    def fork(self, role: Callable[[str, list[bytes], Path], None], name: str) -> int:
        """Start a node in a fork, and return its process id."""
        process = os.fork()
        if process:
            self._running.add(process)
            return process
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        try:
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, 1)
            os.dup2(null, 2)
            role(name, self._parts, self._folder)
        finally:
            os._exit(1)

    def kill(self, process: int) -> None:
        """Kill a node."""
        self._running.discard(process)
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)

    def read(self, name: str) -> dict[str, Any]:
        """Return a listener's latest result, or {} if there is none."""
        with contextlib.suppress(FileNotFoundError):
            return dict(json.loads((self._folder / f"{name}.json").read_text()))
        return {}

    def close(self) -> None:
        """Kill everything."""
        for process in list(self._running):
            self.kill(process)
        self._master.kill()
        self._master.wait()


def run(kills: int, *, seed: int = 1) -> Report:
    """Kill a talker or a listener ``kills`` times."""
    chance = random.Random(seed)
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        scene = Scene(Path(name))
        try:
            survivors = {"listener": scene.fork(listen, "listener"), "talker": scene.fork(talk, "talker")}
            _wait_for("messages", lambda: scene.read("listener").get("checked", 0) > 50)
            before = None
            for number in range(kills):
                role, kind = ((talk, "talker"), (listen, "listener"))[number % 2]
                victim = scene.fork(role, f"{kind}_{number}")
                _wait_for("the victim", partial(_is_heard, scene, kind, number))
                time.sleep(chance.random() * 0.05)
                scene.kill(victim)
                faults += scene.read(f"{kind}_{number}").get("faults", [])
                if number % 50 == 49:
                    heard = scene.read("listener")
                    print(
                        f"{number + 1} kills, {heard['checked']} messages, {len(heard['faults'])} faults",
                        flush=True,
                    )
                if number == min(9, kills // 2):
                    before = {each: _used(process) for each, process in survivors.items()}

            # The survivors go on, and close what belonged to the dead.
            heard = scene.read("listener")["from"]["talker"]
            _wait_for("the talker", lambda: scene.read("listener")["from"]["talker"] > heard + 20)
            assert before is not None
            after = before
            end = time.monotonic() + SECONDS
            while time.monotonic() < end:
                after = {each: _used(process) for each, process in survivors.items()}
                if not any(_leaks(each, before[each], after[each]) for each in survivors):
                    break
                time.sleep(0.5)
            for each in survivors:
                faults += _leaks(each, before[each], after[each])
            result = scene.read("listener")
        finally:
            scene.close()
    return Report(
        kills,
        result["checked"],
        faults + result["faults"],
        result["longest"],
        result["silences"],
        {each: (before[each][0], after[each][0]) for each in survivors},
        {each: (before[each][1] / 1e6, after[each][1] / 1e6) for each in survivors},
    )


def _node_of(name: str) -> str:
    """Return the name of a process's node: all victims of one kind have the same, as nodes that are respawned."""
    return f"{name.partition('_')[0]}_victim" if "_" in name else name


def _is_heard(scene: Scene, kind: str, number: int) -> bool:
    """Return whether the victim exchanges messages with a survivor."""
    if kind == "talker":
        return f"talker_{number}" in scene.read("listener")["from"]
    return bool(scene.read(f"listener_{number}").get("checked"))


def _used(process: int) -> tuple[int, int]:
    """Return a process's number of open files, and its memory in bytes."""
    one = psutil.Process(process)
    return one.num_fds(), one.memory_info().rss


def _leaks(name: str, before: tuple[int, int], after: tuple[int, int]) -> list[str]:
    leaks = []
    if after[0] > before[0] + MAX_FILES:
        leaks.append(f"{name}: {before[0]} open files before, {after[0]} after")
    if after[1] > before[1] + MAX_GROWTH:
        leaks.append(f"{name}: {before[1] / 1e6:.0f} MB before, {after[1] / 1e6:.0f} MB after")
    return leaks


def _free_port() -> int:
    """Return a free port for the master, below the ephemeral range: no connection takes it before the master does."""
    while True:
        port = random.SystemRandom().randrange(20_000, 32_000)
        with contextlib.suppress(OSError), socket.socket() as probe:
            probe.bind(("127.0.0.1", port))
            return port


def _answers(port: int) -> bool:
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.2):
        return True
    return False


def _wait_for(what: str, condition: Callable[[], bool]) -> None:
    end = time.monotonic() + SECONDS
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f"nothing happened for {SECONDS:g} s: {what}")
        time.sleep(0.02)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    # Leave no fork behind if the script is stopped.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))
    report = run(options.kills, seed=options.seed)
    print(
        f"{report.kills} kills, {report.checked} messages compared by the survivor, {len(report.faults)} faults"
    )
    print(f"longest silence {report.longest_silence:.3f} s, {report.silences} longer than {SILENCE} s")
    for name, files in report.files.items():
        small, large = report.megabytes[name]
        print(f"{name}: {files[0]} -> {files[1]} open files, {small:.0f} -> {large:.0f} MB")
    for fault in report.faults[:20]:
        print(fault)
    return bool(report.faults)


if __name__ == "__main__":
    sys.exit(main())
