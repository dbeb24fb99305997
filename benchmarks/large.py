"""Large messages beside the limits of the machine: a ring of shared memory, and a Unix socket, of two bare Python processes.

All participants take turns in one run, and the results are medians of the rounds. The bare processes do no more than
necessary: one write, one read into `bytes`. ``with ring`` is minirospy as it is, ``with socket`` the same with
MINIROSPY_TRANSPORT=unix, ``rospy`` real ROS, if it is installed. A point cloud (``cloud_1mb_30hz``) is read by numpy, and
its delay includes this. Linux only.

    python benchmarks/large.py --rounds 5
"""

from __future__ import annotations

import argparse
import mmap
import os
import socket
import statistics
import struct
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import run

ANNOUNCEMENT = struct.Struct("<IId")  # offset, size, time of the start
RING_BYTES = 64 * 1024 * 1024
SEND_BUFFER = 4 * 1024 * 1024  # bytes, as minirospy requests
SECONDS = 2.0
ROSPY = Path("/usr/lib/python3/dist-packages/rospy")
SIZES = {"vga": 921_600, "6mb": 6_220_800, "cloud": 1_048_576}


class Case(NamedTuple):
    """A stream of messages: the kind, its rate, the number of subscribers."""

    kind: str
    hz: float
    listeners: int = 1


CASES = {
    "vga_30hz": Case("vga", 30),
    "6mb_30hz": Case("6mb", 30),
    "6mb": Case("6mb", 0),
    "6mb_fanout_30hz": Case("6mb", 30, 5),
    "cloud_1mb_30hz": Case("cloud", 30),
}


class Bare(NamedTuple):
    """The result of bare processes, in microseconds."""

    median: float
    publisher: float  # CPU per message
    all: float  # CPU of all processes per delivered message


def bare(case: Case, *, is_ring: bool) -> Bare:
    """Send messages from this process to forks of it."""
    size = SIZES[case.kind]
    file = os.memfd_create("large")
    os.ftruncate(file, RING_BYTES)
    pairs = [socket.socketpair() for _ in range(case.listeners)]
    results, children = [], []
    for pair in pairs:
        pair[0].setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        source, sink = os.pipe()
        child = os.fork()
        if not child:
            for other in pairs:
                other[0].close()
            _listen(pair[1], file, sink, is_ring=is_ring)
            os._exit(0)
        os.close(sink)
        results.append(source)
        children.append(child)

    ends = [pair[0] for pair in pairs]
    data, place = bytes(size), -(-size // mmap.PAGESIZE) * mmap.PAGESIZE
    start, due, published = time.process_time(), time.monotonic(), 0
    end = due + SECONDS
    with mmap.mmap(file, RING_BYTES) as memory:
        while time.monotonic() < end:
            if case.hz:
                due += 1 / case.hz
                time.sleep(max(0.0, due - time.monotonic()))
            now = time.monotonic()
            if published > 1:
                for sock in ends:
                    sock.recv(1)  # two messages are on their way
            offset = published % 2 * place
            if is_ring:
                memory[offset : offset + size] = data
            for sock in ends:
                sock.sendall(ANNOUNCEMENT.pack(offset, size, now))
                if not is_ring:
                    sock.sendall(data)
            published += 1
    of_publisher = time.process_time() - start

    for sock in ends:
        sock.shutdown(socket.SHUT_WR)
    said = []
    for source, child in zip(results, children, strict=True):
        said.append(struct.unpack("<dd", os.read(source, 16)))
        os.close(source)
        os.waitpid(child, 0)
    os.close(file)
    for pair in pairs:
        for sock in pair:
            sock.close()
    of_listeners = sum(cpu for _, cpu in said)
    return Bare(
        1e6 * statistics.median(late for late, _ in said),
        1e6 * of_publisher / published,
        1e6 * (of_publisher + of_listeners) / published / case.listeners,
    )


def _listen(sock: socket.socket, file: int, sink: int, *, is_ring: bool) -> None:
    late = []
    start = time.process_time()
    with mmap.mmap(file, RING_BYTES, mmap.MAP_SHARED, mmap.PROT_READ) as memory:
        while len(word := sock.recv(ANNOUNCEMENT.size, socket.MSG_WAITALL)) == ANNOUNCEMENT.size:
            offset, size, then = ANNOUNCEMENT.unpack(word)
            data = memory[offset : offset + size] if is_ring else sock.recv(size, socket.MSG_WAITALL)
            sock.send(b"r")
            late.append(time.monotonic() - then)
            assert len(data) == size
    os.write(sink, struct.pack("<dd", statistics.median(late), time.process_time() - start))


def measure(case: Case) -> dict[str, dict[str, float]]:
    """Return the figures of one round, by figure and participant."""
    figures: dict[str, dict[str, float]] = defaultdict(dict)
    title = f"{case.kind} {f'at {case.hz:g} Hz' if case.hz else 'as fast as they go'}"
    if case.listeners > 1:
        title += f" to {case.listeners}"
    for name, is_ring in (("bare ring", True), ("bare socket", False)):
        result = bare(case, is_ring=is_ring)
        figures[f"{title}, median us"][name] = result.median
        figures[f"{title}, publisher's CPU us"][name] = result.publisher
        figures[f"{title}, CPU us"][name] = result.all
    stacks = {"with ring": "minirospy", "with socket": "minirospy by socket"}
    if ROSPY.exists():
        stacks["rospy"] = "rospy"
    for name, stack in stacks.items():
        for figure, value in run.stream(case.kind, hz=case.hz, listeners=case.listeners)(stack).items():
            what = figure.rpartition(", ")[2]
            figures[f"{title}, {what}"][name] = value
    return figures


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--cases", help=f"some of {','.join(CASES)}")
    options = parser.parse_args()
    wanted = options.cases.split(",") if options.cases else list(CASES)
    unknown = [case for case in wanted if case not in CASES]
    if unknown:
        parser.error(f"unknown cases {', '.join(unknown)}: they are {', '.join(CASES)}")

    rounds: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for number in range(options.rounds):
        for case in wanted:
            print(f"round {number + 1}: {case}", file=sys.stderr, flush=True)
            for figure, values in measure(CASES[case]).items():
                for name, value in values.items():
                    rounds[figure][name].append(value)

    names = ["bare ring", "with ring", "bare socket", "with socket", "rospy"]
    print(f"{'':48}" + "".join(f"{name:>14}" for name in names))
    for figure, measured in rounds.items():
        values = [statistics.median(measured[name]) if name in measured else float("nan") for name in names]
        print(f"{figure:48}" + "".join(f"{value:14,.1f}" for value in values))
    return 0


if __name__ == "__main__":
    sys.exit(main())
