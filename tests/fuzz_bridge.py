"""Anything at all, sent to the bridge by a client: it answers or refuses, and the next client finds it as before.

    make fuzz                                            # ten minutes of this, too
    python tests/fuzz_bridge.py --minutes 1

Handshakes and frames with mutations, of the Foxglove protocol. A finding is written to ``fuzz-bridge-finding.bin``;
``python tests/fuzz_bridge.py FILE`` runs it again.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import random
import socket
import struct
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.fuzz import CUT, Faults, mutated

FINDING = Path("fuzz-bridge-finding.bin")
INPUTS_PER_BRIDGE = 2000
MOST_WAITING = 70_000_000
HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
)
TEXTS = [
    b'{"op":"subscribe","subscriptions":[{"id":0,"channelId":1},{"id":1,"channelId":2}]}',
    b'{"op":"unsubscribe","subscriptionIds":[0,1]}',
    b'{"op":"advertise","channels":[{"id":1,"topic":"/fuzz","encoding":"ros1","schemaName":"std_msgs/String"}]}',
    b'{"op":"advertise","channels":[{"id":2,"topic":"/own","encoding":"ros1","schemaName":"a/B","schema":"int8 x"}]}',
    b'{"op":"unadvertise","channelIds":[1,2]}',
    b'{"op":"getParameters","parameterNames":[],"id":"a"}',
    b'{"op":"getParameters","parameterNames":["/a","b"]}',
    b'{"op":"setParameters","parameters":[{"name":"/a","value":{"b":[1,2.5,"c",true,null]}},{"name":"/c"}],"id":"x"}',
    b'{"op":"setParameters","parameters":[{"name":"/d","value":"QUJD","type":"byte_array"}]}',
    b'{"op":"subscribeParameterUpdates","parameterNames":["/a"]}',
    b'{"op":"unsubscribeParameterUpdates","parameterNames":[]}',
    b'{"op":"subscribeConnectionGraph"}',
    b'{"op":"unsubscribeConnectionGraph"}',
    b'{"op":"fetchAsset","uri":"package://std_msgs/package.xml","requestId":1}',
]
BINARIES = [
    struct.pack("<BII", 1, 1, 2) + b"hi",
    struct.pack("<BIII", 2, 1, 1, 4) + b"ros1",
    struct.pack("<BBfBQI", 3, 0, 1.0, 1, 5, 2) + b"id",
]


def frame(payload: bytes, opcode: int) -> bytes:
    """Return a client's frame, masked with zeros."""
    size = len(payload)
    head = bytes([opcode, 0x80 | size]) if size < 126 else bytes([opcode, 0xFE]) + struct.pack("!H", size)
    return head + bytes(4) + payload


class Target:
    """A bridge with its master, and one connection for each input."""

    def __init__(self) -> None:
        self._loop = asyncio.SelectorEventLoop()
        self._faults = Faults()
        for name in ("minirospy", "asyncio"):
            logging.getLogger(name).addHandler(self._faults)
            logging.getLogger(name).propagate = False
        self._count = 0
        self._parts: tuple[Any, Any, Any] | None = None

    def __call__(self, data: bytes) -> None:
        """Give one input. Raises on a finding."""
        self._loop.run_until_complete(self._take(data))

    def close(self) -> None:
        """End the bridge."""
        self._loop.run_until_complete(self._end())
        self._loop.close()

    async def _take(self, data: bytes) -> None:
        from minirospy.bridge.web.connection import Connection
        from minirospy.bridge.web.listener import Relay
        from minirospy.bridge.web.pipe import PlainPipe

        if self._count % INPUTS_PER_BRIDGE == 0:
            await self._end()
            await self._begin()
        self._count += 1
        assert self._parts
        bridge = self._parts[2]
        listener = bridge.listeners["foxglove"]
        ours, theirs = socket.socketpair()
        ours.setblocking(False)

        with theirs:
            theirs.setblocking(False)
            relay = Relay()
            pipe = PlainPipe(ours, self._loop, relay)
            connection = relay.target = Connection(listener, pipe, "fuzz", self._loop)
            listener.connections.add(connection)
            for piece in data.split(CUT):
                if piece and connection in listener.connections:
                    connection.received(piece)
                await asyncio.sleep(0)
                with contextlib.suppress(BlockingIOError, ConnectionError):
                    while theirs.recv(1 << 20):
                        pass
            for _ in range(5):
                await asyncio.sleep(0)
            assert connection.queue.size + connection.queue.answers < MOST_WAITING
            connection.abort()

        assert not self._faults.found, self._faults.found.pop()
        assert not listener.connections
        assert len(bridge.foxglove.sessions) == 1
        assert not bridge.graph._publishers

    async def _begin(self) -> None:
        from std_msgs.msg import String

        from minirospy import Node
        from minirospy.bridge.bridge import Bridge, BridgeOptions
        from minirospy.runtime.master.master import Master

        master = Master()
        await master.start()
        node = Node("bridge", master_uri=f"http://localhost:{master.port}", host="localhost", rosout=False)
        await node.start()
        bridge = Bridge(node, BridgeOptions(foxglove_port=0, diagnostics=False))
        await bridge.start()
        await node.advertise("/known", String, latch=True)
        # A steady client, so that the next one is offered channels immediately.
        bridge.foxglove.open(Steady())  # type: ignore[arg-type]
        while not bridge.foxglove.channels.by_id:
            await asyncio.sleep(0.01)
        self._parts = (master, node, bridge)

    async def _end(self) -> None:
        if self._parts:
            master, node, bridge = self._parts
            self._parts = None
            for session in list(bridge.foxglove.sessions):
                bridge.foxglove.left(session)
            await bridge.close()
            await node.close()
            await master.close()


class Steady:
    """A client that takes everything."""

    may_write = True

    def __init__(self) -> None:
        from minirospy.bridge.web.queue import SendQueue

        self.queue = SendQueue()

    def send_text(self, _: str) -> None:
        """Take it."""

    def send_binary(self, *_: bytes) -> None:
        """Take it."""

    def send_message(self, *_: object, **__: object) -> None:
        """Take it."""


def an_input(rng: random.Random) -> bytes:
    """Return a handshake and some frames, mutated outside or inside of the frames."""
    parts = [HANDSHAKE if rng.random() < 0.95 else mutated(rng, [HANDSHAKE])]
    for _ in range(rng.randrange(1, 6)):
        is_text = rng.random() < 0.7
        sources = TEXTS if is_text else BINARIES
        payload = mutated(rng, sources).replace(CUT, b"") if rng.random() < 0.6 else rng.choice(sources)
        payload = payload.partition(b"\r\n\r\n")[2] or payload
        parts.append(frame(payload, 0x81 if is_text else 0x82))
    if rng.random() < 0.2:
        parts[-1] = mutated(rng, [parts[-1]])
    return (CUT if rng.random() < 0.8 else b"").join(parts)


def main() -> int:
    """Fuzz, or run one input again."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="how long")
    parser.add_argument("finding", nargs="?", type=Path, help="an input to run again")
    options = parser.parse_args()
    os.environ["ROS_HOSTNAME"] = "localhost"
    target = Target()
    if options.finding:
        target(options.finding.read_bytes())
        target.close()
        return 0

    rng = random.Random(time.time_ns())
    end, count = time.monotonic() + 60 * options.minutes, 0
    while time.monotonic() < end:
        data = an_input(rng)
        count += 1
        try:
            target(data)
        except BaseException:
            FINDING.write_bytes(data)
            raise
    target.close()
    print(f"{count:,} inputs to the bridge, nothing found")
    return 0


if __name__ == "__main__":
    sys.exit(main())
