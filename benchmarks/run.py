"""`make bench`: minirospy, beside a real rospy where /usr/bin/python3 has one, in one run, in turns.

Figures are medians of the rounds; ``ratio`` says how many times better than rospy. All traffic is on loopback.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

WORKER = Path(__file__).parent / "worker.py"
BIN = Path(sys.executable).parent
STACKS = {
    "minirospy": (sys.executable, [str(BIN / "roscore"), "-q", "-p"]),
    "rospy": ("/usr/bin/python3", ["/usr/bin/rosmaster", "--core", "-p"]),
}


class Peers:
    """A master and the workers of one measurement; all end with the block."""

    def __init__(self, stack: str) -> None:
        self._python, master = STACKS[stack]
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self._environment = {
            **os.environ,
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": f"http://localhost:{port}",
        }
        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._running = [subprocess.Popen([*master, str(port)], env=self._environment, **quiet)]
        while True:
            try:
                socket.create_connection(("127.0.0.1", port), 0.2).close()
                return
            except OSError:
                time.sleep(0.02)

    def __enter__(self) -> Peers:
        return self

    def __exit__(self, *_: object) -> None:
        for process in reversed(self._running):
            if process.stdin:
                process.stdin.close()
            process.terminate()
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdout:
                process.stdout.close()

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [self._python, str(WORKER), *arguments],
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._running.append(process)
        return process


def said(process: subprocess.Popen[str]) -> dict[str, float]:
    """The next result that a worker prints."""
    assert process.stdout
    for line in process.stdout:
        if line.startswith("{"):
            return dict(json.loads(line))
    raise SystemExit(f"a worker ended early: {process.args}")


def tell(process: subprocess.Popen[str]) -> None:
    """Let a worker go on."""
    assert process.stdin
    process.stdin.write("go\n")
    process.stdin.flush()


def measure(stack: str) -> dict[str, float]:
    """One round of a stack."""
    figures: dict[str, float] = {}
    with Peers(stack) as peers:
        figures |= said(peers.start("start", str(time.monotonic())))
        said(peers.start("echo"))
        figures |= said(peers.start("ping"))
    with Peers(stack) as peers:
        listener = peers.start("listen")
        said(listener)
        said(peers.start("talk"))
        tell(listener)
        figures |= said(listener)
    return figures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", type=Path, help="write the figures of every round there")
    options = parser.parse_args()
    stacks = ["minirospy"]
    if Path("/usr/bin/rosmaster").exists():
        stacks.insert(0, "rospy")
    rounds: dict[str, dict[str, list[float]]] = {stack: defaultdict(list) for stack in stacks}
    for number in range(options.rounds):
        for stack in stacks:
            print(f"round {number + 1}: {stack}", file=sys.stderr, flush=True)
            for name, value in measure(stack).items():
                rounds[stack][name].append(value)
    print(
        f"{'':28}" + "".join(f"{stack:>12}" for stack in stacks) + ("       ratio" if len(stacks) > 1 else "")
    )
    for name in rounds["minirospy"]:
        medians = [statistics.median(rounds[stack][name]) for stack in stacks]
        line = f"{name:28}" + "".join(f"{value:12,.0f}" for value in medians)
        if len(medians) > 1:
            better = medians[1] / medians[0] if name.endswith("per_s") else medians[0] / medians[1]
            line += f"{better:12.1f}"
        print(line)
    if options.json:
        options.json.write_text(json.dumps(rounds, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
