"""The master under attack: the delays of a well-behaved client, and the master's memory.

    python benchmarks/master_attack.py                    # each attack alone, for some seconds
    python benchmarks/master_attack.py --mixed 600        # all of them together while nodes register
    python benchmarks/master_attack.py --only "huge tag"

A client in a separate process calls getPid fifty times a second, each time on a new connection. Its delays include those
of the machine itself, so the same calls go to a server that is not attacked (column "control"). Column "own" is the delay
without the time that the master or the client waited for a processor meanwhile (on Linux). Two more columns are the CPU
time of the longest callback and of the longest iteration of the master's loop, which runs everything that is due
(``benchmarks/master_turns.py``). Memory is the master's resident memory. The exit status is 1 if a call of the
well-behaved client failed or a registration was refused.
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
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from xmlrpc.client import dumps

import psutil
from attacks import ATTACKS, MIB, Target, called, silent_connections

PERIOD = 0.02
LONG = 0.5  # seconds; if a call takes longer, its cause is printed


def waited(thread: str) -> tuple[float, float]:
    """Return for how many seconds a thread has run, and waited for a processor (on Linux; else 0).

    ``thread`` is ``PID`` for the main thread of a process, ``PID/task/TID`` for another one.
    """
    with contextlib.suppress(OSError):
        ran, late, _ = Path(f"/proc/{thread}/schedstat").read_text(encoding="ascii").split()
        return int(ran) / 1e9, int(late) / 1e9
    return 0.0, 0.0


def retransmissions(sock: socket.socket) -> int:
    """Return the number of segments that the kernel has retransmitted on a connection (Linux's tcpi_total_retrans; else 0)."""
    if sys.platform != "linux":
        return 0
    return int.from_bytes(sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 104)[100:104], sys.byteorder)


# --- the good client, the nodes, the control: separate programs


def run_client(port: int, server: str) -> None:
    """Call getPid continuously; print each call's start, its delay, whether it was answered, and the machine's share.

    On Linux, that share is the longer of the times for which the thread ``server`` and this one waited for a processor.
    The reason why a call failed is printed to stderr.
    """
    request, threads = called("getPid", "/good"), (server, str(os.getpid()))
    while True:
        late = [waited(thread)[1] for thread in threads]
        start = time.monotonic()
        answered = True
        try:
            with socket.create_connection(("127.0.0.1", port), 120) as sock:
                connected = time.monotonic()
                sock.settimeout(120)
                sock.sendall(request)
                answer = sock.recv(65536)
                if time.monotonic() - start > LONG:
                    print(
                        f"port {port}: a getPid took {time.monotonic() - start:.1f} s, {connected - start:.1f} s of them "
                        f"to connect; the kernel sent {retransmissions(sock)} segments again",
                        file=sys.stderr,
                        flush=True,
                    )
                answered = b"200 OK" in answer
                if not answered:
                    print(f"port {port}: {answer[:80]!r} after a getPid", file=sys.stderr, flush=True)
        except OSError as error:
            answered = False
            print(f"port {port}: {error} at a getPid", file=sys.stderr, flush=True)
        wait = time.monotonic() - start
        machine = max(waited(thread)[1] - before for thread, before in zip(threads, late, strict=True))
        print(f"{start} {wait} {int(answered)} {machine}", flush=True)
        time.sleep(max(0.0, start + PERIOD - time.monotonic()))


def run_control() -> None:
    """Respond as a master does, on a port that is printed."""
    answer = b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n"
    with socket.create_server(("127.0.0.1", 0)) as server:
        print(server.getsockname()[1], flush=True)
        while True:
            with contextlib.suppress(OSError), server.accept()[0] as sock:
                sock.recv(65536)
                sock.sendall(answer)


def run_nodes(port: int, count: int) -> None:
    """Register nodes of three publications and three subscriptions, and unregister them; print a line for each round."""
    with contextlib.ExitStack() as stack:
        uris = []
        for _ in range(count):
            # Each node has its own port.
            api = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=200))
            threading.Thread(target=_serve_nodes, args=(api,), daemon=True).start()
            uris.append(f"http://127.0.0.1:{api.getsockname()[1]}/")
        while True:
            start = time.monotonic()
            worst, answered = _run_round(port, uris)
            print(f"{start} {worst} {int(answered)} 0", flush=True)


def _run_round(port: int, uris: list[str]) -> tuple[float, bool]:
    """Return the seconds of the slowest node, and whether all calls were answered."""
    from minirospy.base.errors import MinirospyError
    from minirospy.runtime.rpc.master_proxy import MasterProxy

    worst, answered = 0.0, True
    proxies = [MasterProxy(f"http://127.0.0.1:{port}", f"/node{n}", 120.0) for n in range(len(uris))]
    registered = []

    for proxy, uri in zip(proxies, uris, strict=True):
        begin = time.monotonic()
        try:
            for topic in ("/rosout", f"{proxy.caller_id}/out", "/status"):
                proxy.register_publisher(topic, "std_msgs/String", uri)
            for topic in ("/clock", f"{proxy.caller_id}/cmd", "/status"):
                proxy.register_subscriber(topic, "std_msgs/String", uri)
            registered.append(proxy)
        except MinirospyError as error:
            answered = False
            print(f"{proxy.caller_id} could not register: {error}", file=sys.stderr, flush=True)
        worst = max(worst, time.monotonic() - begin)

    for proxy, uri in zip(proxies, uris, strict=True):
        try:
            removed = [
                proxy.unregister_publisher(topic, uri)
                for topic in ("/rosout", f"{proxy.caller_id}/out", "/status")
            ]
            removed += [
                proxy.unregister_subscriber(topic, uri)
                for topic in ("/clock", f"{proxy.caller_id}/cmd", "/status")
            ]
            if proxy in registered and 0 in removed:
                answered = False
                print(f"{proxy.caller_id} had been forgotten", file=sys.stderr, flush=True)
        except MinirospyError as error:
            answered = False
            print(f"{proxy.caller_id} could not unregister: {error}", file=sys.stderr, flush=True)
        proxy.close()
    return worst, answered


def _serve_nodes(server: socket.socket) -> None:
    body = dumps(([1, "", 0],), methodresponse=True).encode()
    answer = b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body

    def serve(sock: socket.socket) -> None:
        with contextlib.suppress(OSError), sock:
            while sock.recv(1 << 20):
                sock.sendall(answer)

    while True:
        with contextlib.suppress(OSError):
            threading.Thread(target=serve, args=(server.accept()[0],), daemon=True).start()


def run_attack(name: str, port: int, seconds: float) -> None:
    """Attack with one of ATTACKS."""
    lower_priority()
    attack = next(each for each in ATTACKS if each.__name__ == name)
    attack(Target(port, time.monotonic() + seconds))


def lower_priority() -> None:
    """Run attackers at the ordinary priority, even if the benchmark was started with a higher one.

    Real attackers have their own processors, whereas these would use those of the master and the well-behaved client.
    """
    if sys.platform != "win32":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, 0)
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


# --- measuring


class Watch:
    """A program that prints a line for each call, and statistics about the calls."""

    def __init__(self, *args: str, program: str = __file__, environ: Mapping[str, str] | None = None) -> None:
        self.calls: list[tuple[float, float, bool, float]] = []
        self.process = subprocess.Popen(
            [sys.executable, program, *args],
            stdout=subprocess.PIPE,
            text=True,
            stdin=subprocess.DEVNULL,
            env=environ,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def close(self) -> None:
        """Stop the program."""
        self.process.kill()
        self.process.wait()
        self._reader.join(5)

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            start, wait, answered, machine = line.split()
            self.calls.append((float(start), float(wait), answered == "1", float(machine)))

    def since(self, begin: float) -> tuple[float, float, float, int, int]:
        """Return the median, 99th percentile and maximum of the delays, and the numbers of calls and failures since ``begin``."""
        calls = [call for call in self.calls if call[0] >= begin]
        waits = sorted(wait for _, wait, _, _ in calls) or [float("nan")]
        failed = sum(not answered for _, _, answered, _ in calls)
        return waits[len(waits) // 2], waits[len(waits) * 99 // 100], waits[-1], len(calls), failed

    def own(self, begin: float) -> float:
        """Return the longest delay since ``begin`` without the machine's share, which is the delay caused by the server."""
        return max((wait - machine for start, wait, _, machine in self.calls if start >= begin), default=0.0)


class Row(NamedTuple):
    """The effects of an attack."""

    attack: str
    median: float
    p99: float
    worst: float
    own: float
    control: float
    turn: float
    loop: float
    peak: float
    after: float
    calls: int
    failed: int


def longest(turns: Path, what: str, begin: float, end: float) -> float:
    """Return the CPU seconds of the master's longest "turn" or "loop" between two moments."""
    lines = [line.split() for line in turns.read_text(encoding="ascii").splitlines()]
    taken = (float(taken) for moment, kind, taken in lines if kind == what and begin <= float(moment) <= end)
    return max(taken, default=0.0)


def environ_of(folder: str, port: int) -> dict[str, str]:
    """Return the environment of a master at ``port`` and its nodes, with their files in ``folder``."""
    environ = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "MINIROSPY_"))}
    environ |= {"ROS_HOME": folder, "ROS_LOG_DIR": str(Path(folder) / "log"), "ROS_HOSTNAME": "localhost"}
    return environ | {"ROS_MASTER_URI": f"http://localhost:{port}"}


@contextlib.contextmanager
def started_master(folder: str, python: list[str]) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """Run a master with its journal on a free port."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    environ = environ_of(folder, port)
    with open(Path(folder) / "master.out", "wb") as out:
        process = subprocess.Popen([*python, "-q", "-p", str(port)], env=environ, stdout=out, stderr=out)

    try:
        while True:
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
                break
            if process.poll() is not None:
                sys.exit("the master ended: " + (Path(folder) / "master.out").read_text(errors="replace"))
            time.sleep(0.05)
        yield process, port
    finally:
        process.send_signal(signal.SIGINT)

        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def measure(names: list[str], seconds: float, nodes: int, label: str) -> tuple[Row, str]:
    """Attack a new master, and watch the well-behaved client; return the row, and the nodes' results."""
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        turns = Path(folder) / "turns"
        program = str(Path(__file__).with_name("master_turns.py"))
        master, port = stack.enter_context(started_master(folder, [sys.executable, program, str(turns)]))
        good, idle = watch_clients(stack, port, str(master.pid))
        fleet = Watch("nodes", str(port), str(nodes)) if nodes else None
        if fleet:
            stack.callback(fleet.close)
        time.sleep(1.0)
        begin = time.monotonic()

        if nodes:
            random.seed(1)
            parts = [stack.enter_context(_mix(names, port, seconds, number)) for number in range(4)]
        else:
            parts = [
                subprocess.Popen([sys.executable, __file__, "attack", name, str(port), str(seconds)])
                for name in names
            ]

        peak, after, end = watch_memory(master.pid, parts, good, begin + seconds + 60)
        median, p99, worst, calls, failed = good.since(begin)
        last, wait, _, _ = good.calls[-1]
        if last < end:
            # There is no response to the current call yet.
            worst, failed = max(worst, time.monotonic() - last - wait), failed + 1

        said = ""
        if fleet:
            said, refused = _describe_nodes(fleet, nodes)
            failed += refused
            load = ", ".join(f"{each:.1f}" for each in psutil.getloadavg())
            ran, late = waited(str(master.pid))
            said += (
                f"\ncontrol: p99 {idle.since(begin)[1] * 1e3:.1f} ms; load of the machine: {load}"
                f"\nthe master ran for {ran:.0f} s and waited for a processor for {late:.0f} s"
            )

        control_wait = idle.since(begin)[2]
        turn, loop = longest(turns, "turn", begin, end), longest(turns, "loop", begin, end)
        return Row(
            label, median, p99, worst, good.own(begin), control_wait, turn, loop, peak, after, calls, failed
        ), said


def watch_clients(stack: contextlib.ExitStack, port: int, thread: str) -> tuple[Watch, Watch]:
    """Return the well-behaved client of the server at ``port``, whose loop runs in ``thread``, and the client of the control."""
    control = subprocess.Popen([sys.executable, __file__, "control"], stdout=subprocess.PIPE, text=True)
    stack.callback(control.wait)
    stack.callback(control.kill)
    assert control.stdout
    control_port = control.stdout.readline().strip()
    good, idle = Watch("client", str(port), thread), Watch("client", control_port, str(control.pid))
    stack.callback(good.close)
    stack.callback(idle.close)
    return good, idle


def watch_memory(
    pid: int, parts: Sequence[subprocess.Popen[bytes]], good: Watch, latest: float
) -> tuple[float, float, float]:
    """Wait for the end of the attacks and for the client's pending call; return the peak memory, the last value, and the end."""
    memory, peak = psutil.Process(pid), 0.0
    while any(part.poll() is None for part in parts) and time.monotonic() < latest:
        peak = max(peak, memory.memory_info().rss / MIB)
        time.sleep(0.02)
    for part in parts:
        part.kill()
        part.wait()

    # Wait for the pending call.
    end = time.monotonic()
    while good.calls[-1][0] < end and time.monotonic() < end + 60:
        peak = max(peak, memory.memory_info().rss / MIB)
        time.sleep(0.02)
    return peak, memory.memory_info().rss / MIB, end


def _describe_nodes(fleet: Watch, nodes: int) -> tuple[str, int]:
    """Return the nodes' results, and the number of failed rounds of registrations."""
    _, _, wait, rounds, refused = fleet.since(0.0)
    failed = refused + (fleet.process.poll() is not None)
    end = "A REGISTRATION FAILED" if failed else "every call answered"
    return f"{nodes} nodes registered and unregistered {rounds} times, worst node {wait:.3f} s, {end}", failed


@contextlib.contextmanager
def _mix(names: list[str], port: int, seconds: float, number: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program that makes attacks in random order, one after the other; several of these run in parallel."""
    process = subprocess.Popen(
        [sys.executable, __file__, "mix", str(port), str(seconds), str(number), json.dumps(names)]
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def run_mix(port: int, seconds: float, seed: int, names: list[str]) -> None:
    """Attack in random order for ten seconds each. The first of these programs also keeps 5,000 connections open all the time."""
    lower_priority()
    generator, end = random.Random(seed), time.monotonic() + seconds
    if seed == 0:
        silent_connections(Target(port, end))
        return

    while time.monotonic() < end:
        child = subprocess.Popen(
            [
                sys.executable,
                __file__,
                "attack",
                generator.choice(names),
                str(port),
                str(min(10.0, end - time.monotonic())),
            ]
        )

        try:
            child.wait(30)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def main() -> int:
    """Run the benchmark; return its exit status."""
    raise_file_limit()

    match sys.argv[1:]:
        case ["client", port, server]:
            run_client(int(port), server)
        case ["control"]:
            run_control()
        case ["nodes", port, count]:
            run_nodes(int(port), int(count))
        case ["attack", name, port, seconds]:
            run_attack(name, int(port), float(seconds))
        case ["mix", port, seconds, seed, names]:
            run_mix(int(port), float(seconds), int(seed), json.loads(names))

    parser = argparse.ArgumentParser(description="A master under attack: waits and memory.")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long each attack lasts (default: 5)")
    parser.add_argument("--only", default="", help="the attacks whose name contains this")
    parser.add_argument(
        "--mixed", type=float, default=0.0, help="all attacks together, for this many seconds"
    )
    parser.add_argument("--nodes", type=int, default=200, help="nodes that register meanwhile, with --mixed")
    parser.add_argument("--json", action="store_true", help="print a JSON object for each row")
    if len(sys.argv) > 1 and sys.argv[1] in {"client", "control", "nodes", "attack", "mix"}:
        return 0
    options = parser.parse_args()
    names = [each.__name__ for each in ATTACKS if options.only.replace(" ", "_") in each.__name__]
    if not options.json:
        print(
            f"{'attack':24} median ms    p99 ms  worst ms    own ms  control ms"
            "  turn ms  loop ms  peak MiB  after MiB  calls  failed"
        )
    failed = 0
    runs = [("mixed", names)] if options.mixed else [(name, [name]) for name in names]

    for label, each in runs:
        row, said = measure(
            each, options.mixed or options.seconds, options.nodes if options.mixed else 0, label
        )
        failed += row.failed

        if options.json:
            print(json.dumps(row._asdict()), flush=True)
        else:
            print(
                f"{row.attack:24} {row.median * 1e3:9.2f} {row.p99 * 1e3:9.2f} {row.worst * 1e3:9.1f} "
                f"{row.own * 1e3:9.1f} {row.control * 1e3:11.1f} {row.turn * 1e3:8.1f} {row.loop * 1e3:8.1f} "
                f"{row.peak:9.0f} {row.after:10.0f} {row.calls:6} {row.failed:7}",
                flush=True,
            )

        if said:
            print(said)

    return 1 if failed else 0


def raise_file_limit() -> None:
    """Raise the limit of open files as far as the system allows."""
    if sys.platform != "win32":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 65536) if hard > 0 else 65536, hard))


if __name__ == "__main__":
    sys.exit(main())
