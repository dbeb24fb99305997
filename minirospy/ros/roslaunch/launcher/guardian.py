"""A process that outlives roslaunch by a moment: it ends the nodes that a killed roslaunch has left. A script.

From its input it reads a line for each process group: ``+PID NAME`` has started, a node; ``*PID`` has started and is to end
last (the master); ``-PID`` has ended. Where the input ends, roslaunch has exited, for any reason: the groups that are left get
SIGINT, SIGTERM, SIGKILL, and what their nodes leave registered with a master that goes on is unregistered. On Windows the
system has ended them with roslaunch, and only the last is left to do. Nothing but the standard library is imported, and little of
that: it starts while the first nodes do.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterable

_UNREGISTER_SECONDS = 60.0

SYSTEM_ENDS_THEM = "system-ends-them"
"""The last argument where the system ends the processes of a killed roslaunch, as Windows does."""


def watch(
    lines: Iterable[str],
    interrupt_seconds: float,
    terminate_seconds: float,
    master_uri: str,
    end: Callable[[list[int], float, float], object],
) -> None:
    """Keep a list of the groups until ``lines`` end; then ``end`` those that are left."""
    nodes: dict[int, str] = {}
    masters: dict[int, str] = {}
    for line in lines:
        pid, _, name = line[1:].rstrip("\n").partition(" ")
        if line[0] == "-":
            nodes.pop(int(pid), None)
            masters.pop(int(pid), None)
        else:
            (masters if line[0] == "*" else nodes)[int(pid)] = name

    end(list(nodes), interrupt_seconds, terminate_seconds)
    names = [name for name in nodes.values() if name]
    if names and not masters:
        import subprocess

        command = [sys.executable, "-m", "minirospy.ros.roslaunch.launcher.registrations", master_uri, *names]
        subprocess.run(command, check=False, timeout=_UNREGISTER_SECONDS)
    end(list(masters), interrupt_seconds, terminate_seconds)


def end_groups(group: list[int], interrupt_seconds: float, terminate_seconds: float) -> None:
    """End process groups, step by step."""
    left = group
    for name, seconds in (("SIGINT", interrupt_seconds), ("SIGTERM", terminate_seconds)):
        left = [pid for pid in left if send(pid, name)]
        end = time.monotonic() + seconds
        while left and time.monotonic() < end:
            time.sleep(0.02)
            left = [pid for pid in left if is_running(pid)]
    for pid in group:
        # With what a node left behind in its group.
        send(pid, "SIGKILL")


def send(pid: int, name: str) -> bool:
    """Send a signal to a process group; return whether there was one."""
    if sys.platform == "win32":
        import subprocess

        # No signal reaches a process of another console: it is ended, with all that it started.
        subprocess.run(["taskkill", "/F", "/T", "/PID", str(pid)], capture_output=True, check=False)
        return False
    try:
        os.killpg(pid, getattr(signal, name))
    except OSError:
        return False
    return True


def is_running(pid: int) -> bool:
    """Return whether the first process of a group runs; a zombie does not."""
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except ProcessLookupError:
        return False
    except OSError:
        # No /proc (macOS), whose first process reaps zombies immediately.
        return True


if __name__ == "__main__":
    leaves_them = SYSTEM_ENDS_THEM in sys.argv[4:]
    watch(
        sys.stdin,
        float(sys.argv[1]),
        float(sys.argv[2]),
        sys.argv[3],
        # Their numbers may be other processes' already.
        (lambda *_: None) if leaves_them else end_groups,
    )
