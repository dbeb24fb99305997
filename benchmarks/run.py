"""`make bench`: minirospy and, if /usr/bin/python3 has it, real rospy, alternating in one run.

The results are medians of the rounds; ``ratio`` is how many times better than rospy. All traffic is on loopback.
``--json`` keeps the results of every round, ``--plot`` draws the ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

from cases import BIN, free_port, wait_for_port

WORKER = Path(__file__).parent / "worker.py"
STACKS = {
    "minirospy": (sys.executable, [str(BIN / "roscore"), "-q", "-p"]),
    "minirospy by TCP": (sys.executable, [str(BIN / "roscore"), "-q", "-p"]),
    "minirospy by socket": (sys.executable, [str(BIN / "roscore"), "-q", "-p"]),
    "rospy": ("/usr/bin/python3", ["/usr/bin/rosmaster", "--core", "-p"]),
}
TRANSPORTS = {"minirospy by TCP": "tcp", "minirospy by socket": "unix"}
IMAGE_MB = {"vga": 0.9216, "6mb": 6.2208}

Figures = dict[str, float]


class Peers:
    """A master and the workers for a measurement, which are stopped at the end of the block."""

    def __init__(self, stack: str) -> None:
        self._python, master = STACKS[stack]
        port = free_port()
        self._environment = {
            **os.environ,
            "ROS_HOSTNAME": "localhost",
            "ROS_MASTER_URI": f"http://localhost:{port}",
            "MINIROSPY_TRANSPORT": TRANSPORTS.get(stack, "auto"),
        }
        quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self._running = [subprocess.Popen([*master, str(port)], env=self._environment, **quiet)]
        wait_for_port(port)

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

    def start(self, role: str, **options: object) -> Worker:
        """Start a worker, and return before it prints anything."""
        process = subprocess.Popen(
            [self._python, str(WORKER), role, *(f"{name}={value}" for name, value in options.items())],
            env=self._environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._running.append(process)
        return Worker(process)


class Worker(NamedTuple):
    """A process that prints lines of JSON and reads commands."""

    process: subprocess.Popen[str]

    def said(self) -> dict[str, Any]:
        """Return the next result that it prints."""
        assert self.process.stdout
        for line in self.process.stdout:
            if line.startswith("{"):
                return dict(json.loads(line))
        raise SystemExit(f"a worker ended early: {self.process.args!r}")

    def tell(self, word: str) -> None:
        """Send a command."""
        assert self.process.stdin
        self.process.stdin.write(word + "\n")
        self.process.stdin.flush()


def cost(workers: list[Worker]) -> float:
    """Return the CPU seconds that workers have used, and stop them."""
    for worker in workers:
        worker.tell("stop")
    return float(sum(worker.said()["cpu"] for worker in workers))


def measure_start(stack: str) -> Figures:
    with Peers(stack) as peers:
        worker = peers.start("start", start_time=time.monotonic())
        return {"process to working node, ms": worker.said()["ms"]}


def measure_round_trip(stack: str) -> Figures:
    with Peers(stack) as peers:
        workers = [peers.start("echo"), peers.start("ping", count=5000)]
        for worker in workers:
            worker.said()
            worker.tell("go")
        times = sorted(workers[1].said()["us"])
        return {
            "round trip, median us": times[len(times) // 2],
            "round trip, CPU of both us": 1e6 * cost(workers) / 5000,
        }


def stream(kind: str, *, hz: float = 0.0, listeners: int = 1) -> Callable[[str], Figures]:
    """Return a measurement with one kind of message and this number of listeners."""
    name = f"{kind} to {listeners}" if listeners > 1 else kind

    def measure(stack: str) -> Figures:
        with Peers(stack) as peers:
            seconds = 2.0
            options = {"kind": kind, "hz": hz, "seconds": seconds}
            ears = [peers.start("listen", id=number, **options) for number in range(listeners)]
            for ear in ears:
                ear.said()
            mouth = peers.start("talk", listeners=listeners, **{**options, "seconds": seconds + 1})
            mouth.said()
            for worker in (*ears, mouth):
                worker.tell("go")
            published = mouth.said()["published"]
            heard = [ear.said() for ear in ears]
            delivered = sum(ear["delivered"] for ear in heard)
            of_publisher = cost([mouth])
            cpu = 1e6 * (cost(ears) + of_publisher) / max(1, delivered)

        if hz:
            late = sorted(us for ear in heard for us in ear["late_us"])
            return {
                f"{name} at {hz:g} Hz, publisher's CPU us": 1e6 * of_publisher / published,
                f"{name} at {hz:g} Hz, median us": late[len(late) // 2],
                f"{name} at {hz:g} Hz, p99 us": late[int(0.99 * (len(late) - 1))],
                f"{name} at {hz:g} Hz, CPU us": cpu,
            }

        per_second = sum(ear["per_s"] for ear in heard)
        figures = {f"{name}, per second": per_second, f"{name}, CPU us": cpu}
        if kind in IMAGE_MB:
            figures[f"{name}, MB per second"] = per_second * IMAGE_MB[kind]
        else:
            figures[f"{name}, lost %"] = 100 * (1 - delivered / (published * listeners))
        return figures

    return measure


def measure_calls(stack: str) -> Figures:
    with Peers(stack) as peers:
        server = peers.start("serve")
        server.said()
        client = peers.start("call", seconds=1.0)
        client.said()
        for worker in (server, client):
            worker.tell("go")
        said = client.said()
        cost([server, client])
    return {
        "service calls, per second": said["single"],
        "persistent service calls, per second": said["persistent"],
        "set_param, per second": said["set_param"],
        "get_param, per second": said["get_param"],
        "Subscriber to first message, ms": said["discovery_ms"],
    }


CASES: dict[str, Callable[[str], Figures]] = {
    "start": measure_start,
    "round_trip": measure_round_trip,
    "small": stream("small"),
    "scan": stream("scan"),
    "vga": stream("vga"),
    "6mb": stream("6mb"),
    "vga_30hz": stream("vga", hz=30),
    "6mb_30hz": stream("6mb", hz=30),
    "6mb_fanout_30hz": stream("6mb", hz=30, listeners=5),
    "fanout": stream("small", listeners=10),
    "fanout_100hz": stream("small", hz=100, listeners=10),
    "calls": measure_calls,
}


def is_rate(name: str) -> bool:
    """Return whether a higher value is better."""
    return name.endswith("per second")


def ratio(name: str, ours: float, theirs: float) -> float:
    """Return how many times better minirospy is."""
    better, worse = (ours, theirs) if is_rate(name) else (theirs, ours)
    return better / worse if worse else float("nan")


def table(medians: dict[str, dict[str, float]]) -> str:
    """Return the results, one line for each."""
    stacks = list(medians)
    lines = [f"{'':38}" + "".join(f"{stack:>18}" for stack in stacks) + f"{'ratio':>8}" * ("rospy" in stacks)]
    for name in medians[stacks[-1]]:
        values = [medians[stack].get(name, float("nan")) for stack in stacks]
        line = f"{name:38}" + "".join(f"{value:18,.1f}" for value in values)
        if "rospy" in stacks and not name.endswith("%"):
            line += f"{ratio(name, values[-1], values[0]):8.1f}"
        lines.append(line)
    return "\n".join(lines)


def plot(medians: dict[str, dict[str, float]]) -> str:
    """Return the ratios as bars in an SVG, in which rospy is 1."""
    bars = [
        (name, ratio(name, value, medians["rospy"][name]))
        for name, value in medians["minirospy"].items()
        if not name.endswith("%") and name in medians["rospy"]
    ]
    most = max(value for _, value in bars)
    left, width, step = 300, 500, 24
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left + width + 80} {step * (len(bars) + 2)}" '
        'font-family="sans-serif" font-size="13">',
        f'<text x="{left}" y="16">times better than rospy</text>',
    ]

    for number, (name, value) in enumerate(bars):
        y = step * (number + 1)
        parts += [
            f'<text x="{left - 8}" y="{y + 14}" text-anchor="end">{escape(name)}</text>',
            f'<rect x="{left}" y="{y + 2}" width="{width * value / most:.1f}" height="{step - 6}" fill="#3572a5"/>',
            f'<text x="{left + width * value / most + 6:.1f}" y="{y + 14}">{value:.1f}</text>',
        ]

    one = left + width / most
    parts.append(
        f'<line x1="{one:.1f}" x2="{one:.1f}" y1="{step}" y2="{step * (len(bars) + 1)}" stroke="#c33"/>'
    )
    return "\n".join([*parts, "</svg>", ""])


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cases", help=f"some of {','.join(CASES)}")
    parser.add_argument("--tcp", action="store_true", help="minirospy once more, by TCP alone")
    parser.add_argument("--socket", action="store_true", help="minirospy once more, without shared memory")
    parser.add_argument("--json", type=Path, help="write the figures of every round there")
    parser.add_argument("--plot", type=Path, help="draw the ratios there, as SVG")
    options = parser.parse_args()
    stacks = ["minirospy by TCP"] * options.tcp + ["minirospy by socket"] * options.socket + ["minirospy"]
    if Path("/usr/bin/rosmaster").exists():
        stacks.insert(0, "rospy")
    wanted = options.cases.split(",") if options.cases else list(CASES)
    unknown = [case for case in wanted if case not in CASES]
    if unknown:
        parser.error(f"unknown cases {', '.join(unknown)}: they are {', '.join(CASES)}")
    rounds: dict[str, dict[str, list[float]]] = {stack: defaultdict(list) for stack in stacks}

    for number in range(options.rounds):
        for case in wanted:
            for stack in stacks:
                print(f"round {number + 1}: {case}, {stack}", file=sys.stderr, flush=True)
                for name, value in CASES[case](stack).items():
                    rounds[stack][name].append(value)

    medians = {
        stack: {name: statistics.median(values) for name, values in figures.items()}
        for stack, figures in rounds.items()
    }
    print(table(medians))
    if options.json:
        options.json.write_text(json.dumps(rounds, indent=1))
    if options.plot and "rospy" in medians:
        options.plot.write_text(plot(medians), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
