"""A script that briefly outlives roslaunch: if roslaunch is killed, it terminates the remaining nodes.

The script reads one line per process group from stdin: ``+PID NAME`` when a node has started; ``*PID`` when the master,
which is terminated last, has started; ``-PID`` when a process has exited. EOF means that roslaunch has exited, for
whatever reason. The script then sends SIGINT, SIGTERM and SIGKILL to the remaining groups, and unregisters their nodes
from a master that continues to run. On Windows, the system terminates the processes together with roslaunch, so the
script only unregisters the nodes. The script imports only a few standard modules, because it starts at the same time as
the first nodes.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable, Iterable

_UNREGISTER_SECONDS = 60.0

SYSTEM_ENDS_THEM = "system-ends-them"
"""Last command-line argument if the operating system itself kills the nodes when roslaunch dies, as Windows does."""


def watch(
    lines: Iterable[str],
    interrupt_seconds: float,
    terminate_seconds: float,
    master_uri: str,
    end: Callable[[list[int], float, float], object],
) -> None:
    """Track the process groups listed in ``lines``; at the end of the input, call ``end`` with the remaining groups."""
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
    """Terminate process groups with SIGINT, SIGTERM and SIGKILL, in that order."""
    left = group
    for name, seconds in (("SIGINT", interrupt_seconds), ("SIGTERM", terminate_seconds)):
        left = [pid for pid in left if send(pid, name)]
        end = time.monotonic() + seconds
        while left and time.monotonic() < end:
            time.sleep(0.02)
            left = [pid for pid in left if is_running(pid)]
    for pid in group:
        # This also kills processes that a node left running in its group.
        send(pid, "SIGKILL")


def send(pid: int, name: str) -> bool:
    """Send a signal to a process group; return whether the group exists."""
    if sys.platform == "win32":
        import subprocess

        # Processes in another console receive no signals, so kill the process and all its descendants.
        subprocess.run(["taskkill", "/F", "/T", "/PID", str(pid)], capture_output=True, check=False)
        return False
    try:
        os.killpg(pid, getattr(signal, name))
    except OSError:
        return False
    return True


def is_running(pid: int) -> bool:
    """Return whether a group's first process is running; zombies count as exited."""
    try:
        os.kill(pid, 0)
        with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except ProcessLookupError:
        return False
    except OSError:
        # macOS has no /proc, but its init process reaps zombies immediately.
        return True


if __name__ == "__main__":
    leaves_them = SYSTEM_ENDS_THEM in sys.argv[4:]
    watch(
        sys.stdin,
        float(sys.argv[1]),
        float(sys.argv[2]),
        sys.argv[3],
        # The system has killed the processes: send no signals, because other processes may have their ids now.
        (lambda *_: None) if leaves_them else end_groups,
    )
