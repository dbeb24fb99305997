"""A node under attack: the delays of a client of its Slave API and of its own `publish` calls, and its memory.

    python benchmarks/node_attack.py                      # each attack alone, for some seconds
    python benchmarks/node_attack.py --only "pipelines"

The node is a rospy program that publishes one topic a hundred times a second and subscribes to another one. Delays
are measured as in ``benchmarks/master_attack.py``; the columns "own" and "publish" exclude the time in which the thread of
the node's event loop, or the client, waited for a processor. The threads of a node share the GIL: the time for which its
loop waits for it is part of "own". The exit status is 1 if a call of the well-behaved client failed.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit
from xmlrpc.client import ServerProxy

import attacks
from attacks import HUGE, MIB, Target, called, multicall
from master_attack import (
    Watch,
    environ_of,
    longest,
    lower_priority,
    raise_file_limit,
    started_master,
    waited,
    watch_clients,
    watch_memory,
)

PUBLISH_PERIOD = 0.01


# --- the node: a separate program


def run_node(turns: str, thread: str) -> None:
    """Publish continuously, print a line for each call, and write the system id of the event loop's thread to a file."""
    import rospy
    from master_turns import record_turns
    from std_msgs.msg import String

    record_turns(turns)
    rospy.init_node("attacked", disable_signals=True)
    publisher = rospy.Publisher("/out", String, queue_size=10)
    rospy.Subscriber("/in", String, lambda message: None)
    loop = next(each for each in threading.enumerate() if each.name == "minirospy-loop")
    Path(thread).write_text(f"{loop.native_id}\n", encoding="ascii")

    main = str(os.getpid())
    while True:
        start, late = time.monotonic(), waited(main)[1]
        publisher.publish("hello")
        print(f"{start} {time.monotonic() - start} 1 {waited(main)[1] - late}", flush=True)
        time.sleep(PUBLISH_PERIOD)


# --- attacks that only a node has


def publisher_update(target: Target) -> None:
    """Send a publisherUpdate with 200,000 publishers."""
    uris = [f"http://127.0.0.1:9/{number}" for number in range(200_000)]
    target.repeat(called("publisherUpdate", "/bad", "/in", uris))


def publisher_updates(target: Target) -> None:
    """Send a publisherUpdate with 20,000 publishers, which is the maximum, and 20,000 updates in a multicall."""
    uris = [f"http://127.0.0.1:9/{number}" for number in range(20_000)]
    update = called("publisherUpdate", "/bad", "/in", uris)
    updates = multicall("publisherUpdate", ["/bad", "/in", ["http://127.0.0.1:9/"]], 20_000)
    while not target.is_over:
        target.exchange(update)
        target.exchange(updates)


def param_update(target: Target) -> None:
    """Send a paramUpdate with a 60 MiB string."""
    target.repeat(called("paramUpdate", "/bad", "/attack", "x" * HUGE))


def half_headers(target: Target) -> None:
    """Send most of a 4 MiB connection header from 400 peers to the port for the node's topics."""
    with ServerProxy(f"http://127.0.0.1:{target.port}") as node:
        _, _, (_, _, port) = node.requestTopic("/bad", "/out", [["TCPROS"]])  # type: ignore[misc]
    length = 4 * MIB
    Target(int(str(port)), target.end).hold(length.to_bytes(4, "little") + b"x" * (length - 100_000), 400)


ATTACKS: tuple[Callable[[Target], None], ...] = (
    attacks.huge_string,
    attacks.huge_array_multicall,
    attacks.many_calls,
    attacks.deep,
    attacks.pipelines,
    attacks.busy_connections,
    attacks.half_bodies,
    attacks.silent_connections,
    attacks.slow_readers,
    publisher_update,
    publisher_updates,
    param_update,
    half_headers,
)


# --- measuring


class Row(NamedTuple):
    """The effects of an attack."""

    attack: str
    median: float
    worst: float
    own: float
    control: float
    turn: float
    loop: float
    publish: float
    peak: float
    calls: int
    failed: int


def measure(name: str, seconds: float) -> Row:
    """Attack a new node, and watch the well-behaved client and the node."""
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        _, master = stack.enter_context(
            started_master(folder, [sys.executable, "-m", "minirospy.ros.rosmaster.commands.master"])
        )
        turns, thread = Path(folder) / "turns", Path(folder) / "thread"
        node = Watch("node", str(turns), str(thread), program=__file__, environ=environ_of(folder, master))
        stack.callback(node.close)
        while not (thread.exists() and thread.read_text(encoding="ascii").endswith("\n")):
            if node.process.poll() is not None:
                sys.exit("the node ended")
            time.sleep(0.05)
        with ServerProxy(f"http://127.0.0.1:{master}") as proxy:
            port = urlsplit(str(proxy.lookupNode("/bench", "/attacked")[2])).port  # type: ignore[index]
        assert port

        loop = f"{node.process.pid}/task/{thread.read_text(encoding='ascii').strip()}"
        good, idle = watch_clients(stack, port, loop)
        time.sleep(1.0)
        begin = time.monotonic()
        part = subprocess.Popen([sys.executable, __file__, "attack", name, str(port), str(seconds)])
        peak, _, end = watch_memory(node.process.pid, [part], good, begin + seconds + 60)

        median, _, worst, calls, failed = good.since(begin)
        return Row(
            name,
            median,
            worst,
            good.own(begin),
            idle.since(begin)[2],
            longest(turns, "turn", begin, end),
            longest(turns, "loop", begin, end),
            node.own(begin),
            peak,
            calls,
            failed,
        )


def main() -> int:
    """Run the benchmark; return its exit status."""
    raise_file_limit()

    match sys.argv[1:]:
        case ["node", turns, thread]:
            run_node(turns, thread)
        case ["attack", name, port, seconds]:
            lower_priority()
            attack = next(each for each in ATTACKS if each.__name__ == name)
            attack(Target(int(port), time.monotonic() + float(seconds)))
            return 0

    parser = argparse.ArgumentParser(description="A node under attack: waits and memory.")
    parser.add_argument("--seconds", type=float, default=4.0, help="how long each attack lasts (default: 4)")
    parser.add_argument("--only", default="", help="the attacks whose name contains this")
    options = parser.parse_args()
    print(
        f"{'attack':24} median ms  worst ms    own ms  control ms  turn ms  loop ms  publish ms  peak MiB"
        "  calls  failed"
    )
    failed = 0

    for attack in ATTACKS:
        if options.only.replace(" ", "_") not in attack.__name__:
            continue
        row = measure(attack.__name__, options.seconds)
        failed += row.failed
        print(
            f"{row.attack:24} {row.median * 1e3:9.2f} {row.worst * 1e3:9.1f} {row.own * 1e3:9.1f} "
            f"{row.control * 1e3:11.1f} {row.turn * 1e3:8.1f} {row.loop * 1e3:8.1f} {row.publish * 1e3:11.2f} "
            f"{row.peak:9.0f} {row.calls:6} {row.failed:7}",
            flush=True,
        )

    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
