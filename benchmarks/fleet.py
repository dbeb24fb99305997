"""`python benchmarks/fleet.py`: a simulated fleet of 10 to 1,000 robots, and one real control room.

Robots are Zenoh sessions with a gateway's declarations, in a few processes; the control room is a real gateway with a
real master. As root on Linux with `ip`, robots are in a separate network namespace, behind a link with delay and loss
(slow_link.py), which counts their traffic; otherwise all is on loopback, and traffic and cuts are left out.
Printed for each number of robots: seconds until the control room's master has all names; bytes per second of each robot
without subscribers (both directions, with TCP, IP and Ethernet headers); seconds from a cut of the link until all are
gone, and from its end until all are back.
"""

import argparse
import asyncio
import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

from slow_link import DEVICE

SIZES = (10, 30, 100, 300, 1000)
PROCESSES = 4
TOPICS = 7
SETTLE_SECONDS, QUIET_SECONDS = 8.0, 60.0
CUT_SECONDS = 15.0
# Properties of the link in each direction: milliseconds, milliseconds, and percent of the frames.
DELAY, JITTER, LOSS = 20, 5, 1
MAX_SECONDS = 300  # maximum seconds for detecting a cut, and for recovering from it
PORT = 27447
MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"


# --- robots


async def robots(endpoint, first, count):
    """Simulate ``count`` robots until stdin is closed."""
    # When it closes a dead link, a Zenoh thread waits for 10 s. A real robot has one link, so give each link its own
    # thread here.
    pools = ", ".join(f"{pool}: (worker_threads: {count})" for pool in ("rx", "tx", "net", "acc", "app"))
    os.environ.setdefault("ZENOH_RUNTIME", f"({pools})")
    from minirospy.fleet.keys import ROOT, Claim, ServiceToken, TopicToken, claim_key, service_key, topic_key
    from minirospy.fleet.network import FleetNetwork, NetworkOptions

    async def robot(number):
        name, gateway = f"robot{number}", f"{number:016x}"
        network = await FleetNetwork.open(NetworkOptions(connect=(endpoint,)))
        ends = f"{name}/{gateway}"

        async def pong(_, __):
            return time.time_ns().to_bytes(8, "little", signed=True)

        def ignore(*_):
            pass

        # Keep references, because a subscription without one is undeclared.
        kept = [network.subscribe(f"{ROOT}/in/{ends}/**", ignore)]
        answered = ("ping/{0}", "status/{0}", "definition/{0}/*/*", "call/{1}/**", "param/{1}")
        kept += [network.answer(f"{ROOT}/{key.format(gateway, ends)}", pong) for key in answered]
        kept += [
            network.watch_tokens(f"{ROOT}/{key}", ignore)
            for key in (f"want/{ends}/**", f"offer/{ends}/**", f"robot/{name}/**")
        ]
        for topic in range(TOPICS):
            token = TopicToken(
                name, gateway, f"/sensor{topic}", "std_msgs/String", MD5, topic > 0, topic == 0
            )
            kept.append(network.declare_token(topic_key(token)))
        kept.append(
            network.declare_token(service_key(ServiceToken(name, gateway, "/reset", "std_srvs/Empty", MD5)))
        )
        kept.append(network.declare_token(claim_key(Claim(name, gateway, 1, gateway))))
        return network, kept

    limit = asyncio.Semaphore(10)

    async def limited(number):
        async with limit:
            return await robot(number)

    sessions = await asyncio.gather(*map(limited, range(first, first + count)))
    print("ready", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    await asyncio.gather(*(session.close() for session, _ in sessions))


# --- the control room


async def control(endpoint, expected):
    """Show the fleet. Print how long that takes and, for each line on stdin, how long until all robots are shown again."""
    from minirospy import Node
    from minirospy.base.errors import MasterUnreachableError
    from minirospy.fleet.gateway import Gateway, GatewayOptions
    from minirospy.fleet.network import NetworkOptions
    from minirospy.runtime.master.master import Master

    master = Master()
    await master.start()
    loop = asyncio.get_running_loop()
    names = expected * (TOPICS + 1)

    async def shown(count):
        """Return once the master has the names of ``count`` robots."""
        while True:
            try:
                state = await node._node.master("getSystemState")
            except MasterUnreachableError:
                # Poll rarely: this process shares the cores with a thousand robots that reconnect.
                await asyncio.sleep(1.0)
                continue
            every = {name for table in state for name, _ in table}
            found = sum(name.startswith("/robot") for name in every)
            if found == count:
                return
            await asyncio.sleep(0.1 + found / 20_000)

    async with Node("fleet_control", rosout=False, master_uri=f"http://localhost:{master.port}") as node:
        started = time.monotonic()
        gateway = Gateway(node, GatewayOptions(imports=True, network=NetworkOptions(connect=(endpoint,))))
        await gateway.start()
        await shown(names)
        print(json.dumps(time.monotonic() - started), flush=True)
        while line := (await loop.run_in_executor(None, sys.stdin.readline)).strip():
            started = time.monotonic()
            await shown(0 if line == "gone" else names)
            print(json.dumps(time.monotonic() - started), flush=True)
        await gateway.close()
    await master.close()


# --- the measurement


class Network:
    """Two network namespaces and the link between them, or loopback without root."""

    def __init__(self):
        self.is_isolated = sys.platform == "linux" and os.geteuid() == 0
        self.names = [f"fleet-{side}-{os.getpid()}" for side in ("room", "robots")]
        self.link = None

    def __enter__(self):
        if self.is_isolated:
            try:
                for name in self.names:
                    self._sh(f"ip netns add {name}")
                self._connect()
                for number, name in enumerate(self.names, 1):
                    self._sh(f"ip -n {name} link set lo up")
                    self._sh(f"ip -n {name} link set {DEVICE} up")
                    self._sh(f"ip -n {name} addr add 10.97.0.{number}/24 dev {DEVICE}")
            except (OSError, subprocess.CalledProcessError):
                self.__exit__()
                self.is_isolated = False
        self.endpoint = f"tcp/{'10.97.0.1' if self.is_isolated else '127.0.0.1'}:{PORT}"
        return self

    def __exit__(self, *_):
        if self.link:
            self.link.stdin.close()
            self.link.wait()
        for name in self.names:
            with contextlib.suppress(OSError):
                subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)

    def _connect(self):
        words = ["--delay", DELAY, "--jitter", JITTER, "--loss", LOSS]
        self.link = subprocess.Popen(
            [sys.executable, Path(__file__).with_name("slow_link.py"), *self.names, *map(str, words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        if self.link.stdout.readline() != "ready\n":
            raise OSError("slow_link.py has not started")

    def switch(self, state):
        """Cut the link ("down"), and restore it ("up")."""
        self._sh(f"ip -n {self.names[1]} link set {DEVICE} {state}")

    def count(self):
        """Return the bytes that have passed the link, in both directions."""
        text = subprocess.check_output(["ip", "-n", self.names[0], "-s", "-j", "link", "show", DEVICE])
        stats = json.loads(text)[0]["stats64"]
        return stats["rx"]["bytes"] + stats["tx"]["bytes"]

    def start(self, is_far, *words, **options):
        """Start this program on one side of the network."""
        inside = ["ip", "netns", "exec", self.names[is_far]] if self.is_isolated else []
        environ = {**os.environ, "ROS_HOSTNAME": "localhost"}
        return subprocess.Popen(
            [*inside, sys.executable, *map(str, words)], text=True, env=environ, **options
        )

    @staticmethod
    def _sh(line):
        subprocess.run(line.split(), check=True, capture_output=True)


def request(process, line):
    """Return a process's response to a line: seconds, or that the limit was exceeded."""
    process.stdin.write(f"{line}\n")
    process.stdin.flush()
    limit = threading.Timer(MAX_SECONDS, process.kill)
    limit.start()
    try:
        answer = process.stdout.readline()
    finally:
        limit.cancel()
    return round(json.loads(answer), 2) if answer else f"more than {MAX_SECONDS}"


def measure(network, count, *, cuts):
    """Return the results for ``count`` robots; with ``cuts``, also those for a link that is cut."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    running = []

    def start(is_far, *words):
        process = network.start(is_far, *words, **pipes)
        running.append(process)
        return process

    results = {"robots": count}
    try:
        if network.is_isolated:
            results["link"] = f"{DELAY} ms, {JITTER} ms of jitter, {LOSS} % lost, each way"
        router = start(False, "-m", "minirospy", "fleet", "router", "--listen", network.endpoint)
        router.stdout.readline()
        each = -(-count // PROCESSES)
        begun = time.monotonic()
        groups = [
            start(True, __file__, "--robots", network.endpoint, first, min(each, count - first))
            for first in range(0, count, each)
        ]
        for group in groups:
            assert group.stdout.readline() == "ready\n"
        results["started, s"] = round(time.monotonic() - begun, 1)

        room = start(False, __file__, "--control", network.endpoint, count)
        results["discovery, s"] = round(json.loads(room.stdout.readline()), 2)
        results["names"] = count * (TOPICS + 1)
        if network.is_isolated:
            time.sleep(SETTLE_SECONDS)  # clocks are synchronized once in this time
            before, since = network.count(), time.monotonic()
            time.sleep(QUIET_SECONDS)
            passed = (network.count() - before) / (time.monotonic() - since)
            results["idle, bytes/s of each robot"] = round(passed / count, 1)
        if network.is_isolated and cuts:
            network.switch("down")
            results["gone, s"] = request(room, "gone")
            if isinstance(results["gone, s"], float):
                time.sleep(max(0.0, CUT_SECONDS - results["gone, s"]))
                network.switch("up")
                results["recovery, s"] = request(room, "again")
    finally:
        for process in reversed(running):
            process.stdin.close()
        for process in reversed(running):
            if process is running[0]:
                process.terminate()
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
    return results


# --- the plot

WIDTH, HEIGHT = 640, 360
LEFT, RIGHT, TOP, BOTTOM = 60, 20, 30, 45
SERIES = (
    ("discovery, s", "#1f77b4", "until all are shown, s"),
    ("recovery, s", "#d62728", "until all are shown after a cut, s"),
    ("idle, bytes/s of each robot", "#2ca02c", "idle traffic of each robot, bytes/s"),
)


def plot(table):
    """Return the results as SVG, both axes logarithmic."""
    import math

    low, high = 0.1, 1000.0

    def x(count):
        share = math.log(count / SIZES[0]) / math.log(SIZES[-1] / SIZES[0])
        return LEFT + share * (WIDTH - LEFT - RIGHT)

    def y(value):
        share = math.log(max(value, low) / low) / math.log(high / low)
        return HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
    ]
    parts += [
        f'<path d="M{LEFT} {y(value):.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>'
        f'<text x="{LEFT - 8}" y="{y(value) + 4:.1f}" text-anchor="end">{value:g}</text>'
        for value in (0.1, 1, 10, 100, 1000)
    ]
    parts += [
        f'<path d="M{x(count):.1f} {TOP}V{HEIGHT - BOTTOM}" stroke="#ddd"/>'
        f'<text x="{x(count):.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{count}</text>'
        for count in SIZES
    ]
    parts.append(f'<text x="{WIDTH / 2}" y="{HEIGHT - 8}" text-anchor="middle">robots</text>')
    for number, (key, colour, label) in enumerate(SERIES):
        points = [(x(row["robots"]), y(row[key])) for row in table if isinstance(row.get(key), (int, float))]
        line = "L".join(f"{across:.1f} {down:.1f}" for across, down in points)
        if points:
            parts.append(f'<path d="M{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [
            f'<circle cx="{across:.1f}" cy="{down:.1f}" r="3" fill="{colour}"/>' for across, down in points
        ]
        parts.append(f'<text x="{LEFT + 10 + 205 * number}" y="18" fill="{colour}">{label}</text>')
    return "\n".join([*parts, "</svg>", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)))
    parser.add_argument("--plot", type=Path, help="write the results as SVG")
    parser.add_argument(
        "--results", type=Path, help="write the results as JSON; those of other sizes in the file are kept"
    )
    parser.add_argument("--no-cut", action="store_true", help="leave the recovery out")
    parser.add_argument("--robots", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--control", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.robots:
        endpoint, first, count = options.robots
        asyncio.run(robots(endpoint, int(first), int(count)))
        return
    if options.control:
        asyncio.run(control(options.control[0], int(options.control[1])))
        return

    table = {}
    if options.results and options.results.exists():
        table = {row["robots"]: row for row in json.loads(options.results.read_text())}
    with Network() as network:
        for size in map(int, options.sizes.split(",")):
            table[size] = measure(network, size, cuts=not options.no_cut)
            print(json.dumps(table[size]), flush=True)
            if options.results:
                options.results.write_text(json.dumps(list(table.values()), indent=1))
    if options.plot:
        options.plot.write_text(plot([table[size] for size in sorted(table)]))


if __name__ == "__main__":
    main()
