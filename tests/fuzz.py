"""Fuzz a master with arbitrary input: it answers or refuses, and keeps its registrations.

    make fuzz                                     # ten minutes
    python tests/fuzz.py --minutes 1

Uses atheris (coverage-guided; ``pip install atheris``) if it is installed, else random mutations of valid
and invalid requests. A finding is written to ``fuzz-finding.bin``; ``python tests/fuzz.py FILE`` runs it again.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import random
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

INPUTS_PER_MASTER = 2000
FINDING = Path("fuzz-finding.bin")
HEAD = b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n"
CUT = b"\xff\xfe"  # separates the parts of an input; each part arrives in a separate receive call


class Faults(logging.Handler):
    """Collects internal errors that a server logs."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.found: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Record it."""
        self.found.append(logging.Formatter().format(record))


class Target:
    """A master, to which each input opens a new connection."""

    def __init__(self) -> None:
        self._loop = asyncio.SelectorEventLoop()
        self._faults = Faults()
        logging.getLogger("minirospy").addHandler(self._faults)
        logging.getLogger("minirospy").propagate = False
        self._count = 0
        self._master: Any = None

    def __call__(self, data: bytes) -> None:
        """Send one input. Raise on a finding."""
        self._loop.run_until_complete(self._take(data))

    def close(self) -> None:
        """Stop the master."""
        if self._master:
            self._loop.run_until_complete(self._master.close())
        self._loop.close()

    async def _take(self, data: bytes) -> None:
        from minirospy.core.wire.xmlrpc import parse_response, serialize_response
        from minirospy.runtime.rpc import connection as connections

        if self._count % INPUTS_PER_MASTER == 0:
            await self._renew()
        self._count += 1
        master = self._master
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        with theirs:
            theirs.setblocking(False)
            connection = connections.Connection(master.server, ours, self._loop)
            master.server.connections[connection] = None
            for piece in data.split(CUT):
                if piece and connection._state is connections.State.OPEN:
                    connection.received(piece)
                with contextlib.suppress(BlockingIOError, ConnectionError):
                    theirs.recv(1 << 20)
            connection.end()
        assert not self._faults.found, self._faults.found.pop()
        assert master.server.held == 0
        assert master.registry.node_uri(self._name) == "http://127.0.0.1:1/", "it forgot a node"
        assert master.registry.publisher_uris("/" + self._name[1:]) == ["http://127.0.0.1:1/"]
        parse_response(serialize_response(master.dispatch("getParam", ["/x", "/"])))
        parse_response(serialize_response(master.serve("getSystemState", ["/x"])))

    async def _renew(self) -> None:
        from minirospy.runtime.master.master import Master

        if self._master:
            await self._master.close()
        self._master = Master()
        self._master.notifier.send = lambda notice: None
        await self._master.start()
        # An input cannot guess this name and thus take it over.
        self._name = f"/kept{random.getrandbits(64):x}"
        self._master.dispatch(
            "registerPublisher", [self._name, self._name, "std_msgs/String", "http://127.0.0.1:1/"]
        )


def seeds() -> list[bytes]:
    """Return valid and invalid requests to start with."""
    from minirospy.core.wire.xmlrpc import serialize_call

    uri = "http://127.0.0.1:1/"
    bodies = [
        serialize_call(method, ["/n", *args])
        for method, *args in (
            ("getSystemState",),
            ("getPublishedTopics", ""),
            ("lookupNode", "/n"),
            ("registerPublisher", "/t", "std_msgs/String", uri),
            ("registerSubscriber", "t", "*", uri),
            ("unregisterPublisher", "/t", uri),
            ("registerService", "/s", "rosrpc://x:1", uri),
            ("setParam", "/p", {"a": [1, 2.5, True, "x", b"y", {}]}),
            ("getParam", "/"),
            ("deleteParam", "/p/a"),
            ("searchParam", "p"),
            ("subscribeParam", uri, "/p"),
            ("minirospy.status",),
        )
    ]
    bodies += [
        serialize_call("system.multicall", [[{"methodName": "getPid", "params": ["/n"]}]]),
        b"<methodCall><methodName>x</methodName><params><param><value>a&lt;\xc3\xa4</value></param></params></methodCall>",
        b'<!DOCTYPE a [<!ENTITY b "c">]><methodCall><methodName>&b;</methodName></methodCall>',
        b"<methodCall><methodName>setParam</methodName><params><param><value><dateTime.iso8601>20200101T00:00:00"
        b"</dateTime.iso8601></value></param></params></methodCall>",
    ]
    found = [HEAD % len(body) + body for body in bodies]
    found += [HEAD % len(body) + CUT + body[:9] + CUT + body[9:] for body in bodies]
    found += [
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n"
        + b"%x\r\n" % len(bodies[0])
        + bodies[0]
        + b"\r\n0\r\n\r\n",
        b"GET / HTTP/1.0\r\n\r\n",
        b"POST / HTTP/1.1\r\nExpect: 100-continue\r\nContent-Length: 5\r\n\r\n" + CUT + b"hello",
        found[0] + found[1] + found[2],
    ]
    return found


def with_atheris(minutes: float) -> int:
    """Fuzz with coverage guidance; do not return on a finding."""
    import atheris  # type: ignore[import-not-found, import-untyped, unused-ignore]

    with atheris.instrument_imports(include=["minirospy"]):
        import minirospy.runtime.master.master  # noqa: F401
    target = Target()
    with tempfile.TemporaryDirectory() as folder:
        for number, seed in enumerate(seeds()):
            Path(folder, f"seed{number}").write_bytes(seed)
        options = [f"-max_total_time={int(60 * minutes)}", "-max_len=4096", f"-exact_artifact_path={FINDING}"]
        atheris.Setup([sys.argv[0], *options, folder], target)
        atheris.Fuzz()
    return 0


def with_mutations(minutes: float) -> int:
    """Fuzz without coverage: combine, cut and repeat pieces of requests."""
    target, sources = Target(), seeds()
    rng = random.Random(time.time_ns())
    end, count = time.monotonic() + 60 * minutes, 0
    while time.monotonic() < end:
        data = mutated(rng, sources)
        count += 1
        try:
            target(data)
        except Exception:
            FINDING.write_bytes(data)
            raise
    target.close()
    print(f"{count:,} inputs, nothing found")
    return 0


def mutated(rng: random.Random, sources: list[bytes]) -> bytes:
    """Return a request with some mutations."""

    def cut(data: bytes) -> bytes:
        at = rng.randrange(len(data) + 1)
        return data[:at] + data[at + rng.randrange(20) :]

    def insert(data: bytes) -> bytes:
        other, at = rng.choice(sources), rng.randrange(len(data) + 1)
        start = rng.randrange(len(other))
        return data[:at] + other[start : start + rng.randrange(40)] + data[at:]

    def change(data: bytes) -> bytes:
        at = rng.randrange(len(data) + 1)
        return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]

    def split(data: bytes) -> bytes:
        at = rng.randrange(len(data) + 1)
        return data[:at] + CUT + data[at:]

    def right_length(data: bytes) -> bytes:
        body = data.partition(b"\r\n\r\n")[2]
        return HEAD % len(body.replace(CUT, b"")) + body

    accidents: list[Callable[[bytes], bytes]] = [cut, insert, insert, change, split]
    data = rng.choice(sources)
    for _ in range(rng.randrange(1, 5)):
        data = rng.choice(accidents)(data)
    return right_length(data) if rng.random() < 0.7 else data


def main() -> int:
    """Fuzz, or run one input again; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="how long")
    parser.add_argument("--mutations", action="store_true", help="without atheris, also if it is installed")
    parser.add_argument("finding", nargs="?", type=Path, help="an input to run again")
    options = parser.parse_args()

    if options.finding:
        target = Target()
        target(options.finding.read_bytes())
        target.close()
        return 0

    if not options.mutations:
        try:
            return with_atheris(options.minutes)
        except ImportError:
            print("atheris is not installed: mutations without coverage")

    return with_mutations(options.minutes)


if __name__ == "__main__":
    sys.exit(main())
