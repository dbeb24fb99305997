"""Share free ports, a new master for each case, and a table with a row for each among the benchmarks."""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

__all__ = ["BIN", "free_port", "measure_cases", "new_master", "wait_for_port"]

BIN = Path(sys.executable).parent
MAX_SECONDS = 60.0  # for the start of a master or node


def free_port() -> int:
    """Return a port of the loopback interface that nothing uses."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def wait_for_port(port: int) -> None:
    """Wait until a server listens on a port of the loopback interface. Raise SystemExit if none does in time."""
    end = time.monotonic() + MAX_SECONDS
    while time.monotonic() < end:
        try:
            socket.create_connection(("127.0.0.1", port), 0.2).close()
            return
        except OSError:
            time.sleep(0.02)
    raise SystemExit(f"nothing listens on port {port}")


@contextmanager
def new_master() -> Iterator[dict[str, str]]:
    """Run a master until the end of the block; yield the environment of its nodes."""
    port = free_port()
    environment = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1"}
    core = subprocess.Popen([str(BIN / "roscore"), "-q", "-p", str(port)], env=environment)
    try:
        yield environment
    finally:
        core.terminate()
        core.wait(20)


def measure_cases(
    script: str,
    about: str,
    names: Iterable[str],
    columns: Sequence[str],
    measure: Callable[[str, float, str], Sequence[str]],
) -> int:
    """Run the command line of a benchmark: print a table with a row for each case; return the exit status.

    Each case has a process of the script with a new master. measure: returns the row of a case, which is measured for some
    seconds; the profile is written to a file if it has a name.
    """
    parser = argparse.ArgumentParser(description=about.partition("\n\n")[0])
    parser.add_argument("cases", nargs="*", choices=[[], *names], help="by default all")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument(
        "--profile", default="", metavar="FILE", help="write a profile of the measured thread"
    )
    parser.add_argument("--worker", default="", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        row = measure(options.worker, options.seconds, options.profile)
        print(f"| {' | '.join(row)} |", flush=True)
        return 0
    print(f"load {os.getloadavg()[0]:.1f}, Python {sys.version.split()[0]}\n")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    for name in options.cases or names:
        words = ["--worker", name, "--seconds", str(options.seconds), "--profile", options.profile]
        with new_master() as environment:
            subprocess.run([sys.executable, script, *words], env=environment, check=True)
    return 0
