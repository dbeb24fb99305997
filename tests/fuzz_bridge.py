"""Fuzz the bridge with arbitrary client input: it answers or refuses, and the next client is served as before.

    make fuzz                                            # ten minutes of this, too
    python tests/fuzz_bridge.py --minutes 1 --only rosbridge

Inputs are mutated handshakes and frames of the Foxglove protocol and of rosbridge, and requests for images. A finding is
written to ``fuzz-bridge-finding.bin``, with the kind of its input in the first line; ``python tests/fuzz_bridge.py FILE``
runs it again. At the end, the process's memory after each quarter of the run is printed.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import logging
import os
import random
import socket
import struct
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.fuzz import CUT, Faults, mutated
from tests.fuzz_readers import peak_megabytes
from tests.waiting import until

FINDING = Path("fuzz-bridge-finding.bin")
INPUTS_PER_BRIDGE = 2000
MAX_WAITING = 70_000_000
HANDSHAKE = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
)
FOXGLOVE_HANDSHAKE = HANDSHAKE + b"Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
FOXGLOVE_TEXTS = [
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
FOXGLOVE_BINARIES = [
    struct.pack("<BII", 1, 1, 2) + b"hi",
    struct.pack("<BIII", 2, 1, 1, 4) + b"ros1",
    struct.pack("<BBfBQI", 3, 0, 1.0, 1, 5, 2) + b"id",
]


OPERATIONS: list[dict[str, object]] = [
    {
        "op": "subscribe",
        "id": "a",
        "topic": "/known",
        "type": "std_msgs/String",
        "throttle_rate": 100,
        "queue_length": 2,
    },
    {"op": "subscribe", "topic": "/image", "compression": "png", "fragment_size": 100},
    {"op": "subscribe", "topic": "/image", "compression": "cbor"},
    {"op": "subscribe", "topic": "/image", "compression": "cbor-raw", "queue_length": 1},
    {"op": "unsubscribe", "id": "a", "topic": "/known"},
    {
        "op": "advertise",
        "id": "b",
        "topic": "/fuzz",
        "type": "geometry_msgs/PoseStamped",
        "latch": True,
        "queue_size": 5,
    },
    {
        "op": "publish",
        "topic": "/fuzz",
        "msg": {"header": {"stamp": "now"}, "pose": {"position": {"x": 1.5, "y": 2}}},
    },
    {"op": "publish", "topic": "/known", "msg": {"data": "hi"}},
    {"op": "publish", "topic": "/image", "msg": {"height": 1, "width": 2, "data": "QUJD", "step": 2}},
    {"op": "unadvertise", "id": "b", "topic": "/fuzz"},
    {"op": "call_service", "id": "c", "service": "/set", "args": {"data": True}},
    {"op": "call_service", "service": "/set#7", "args": [True], "compression": "cbor", "fragment_size": 10},
    {"op": "advertise_service", "service": "/ours", "type": "std_srvs/SetBool"},
    {"op": "service_response", "service": "/ours", "id": "d", "values": {"success": True}, "result": True},
    {"op": "unadvertise_service", "service": "/ours"},
    {"op": "fragment", "id": "e", "num": 0, "total": 2, "data": '{"op":"set_level",'},
    {"op": "fragment", "id": "e", "num": 1, "total": 2, "data": '"level":"info"}'},
    {"op": "set_level", "level": "info"},
    {"op": "auth", "mac": "a", "client": "b", "dest": "c", "rand": "d", "t": 1.5, "level": "e", "end": 2},
    {"op": "status", "level": "info", "msg": "hi"},
    {"op": "advertise", "topic": "/odd", "type": "__main__/x"},
    {"op": "advertise_service", "service": "/odd", "type": "sys/x"},
]
ODD_TEXTS = [
    b'{"op":"publish","topic":"/known","msg":{"data":%s}}' % each
    for each in (b"1" * 5_000, b"[" * 5_000, b'{"a":' * 5_000, b"1e999", b'"\\ud800"', b"NaN", b"-")
]
OPCODES = (0x00, 0x80, 0x89, 0x09, 0x8A, 0x88, 0x83, 0x8F, 0xC1, 0xF2)
PAGES = [
    b"/",
    b"/status",
    b"/stream?topic=/image",
    b"/stream?topic=/image&type=png&width=3&height=5&invert",
    b"/stream?topic=/image&type=ros_compressed&quality=20",
    b"/stream_viewer?topic=/image&token=x",
    b"/snapshot?topic=/image&type=png&quality=80&width=100",
    b"/snapshot?topic=/known",
]


def tcp_pair() -> tuple[socket.socket, socket.socket]:
    """Return both sockets of a TCP connection. A Unix socket has no ports, which a request contains."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        theirs = socket.create_connection(server.getsockname())
        ours, _ = server.accept()
    return ours, theirs


class Kind(NamedTuple):
    """The inputs for one protocol: the first bytes of a connection, its text messages and its binary messages."""

    openings: Sequence[bytes]
    texts: Sequence[bytes] = ()
    binaries: Sequence[bytes] = ()


def kinds() -> Mapping[str, Kind]:
    """Return the inputs for each listener, by its name."""
    from minirospy.web.rosbridge.cbor import encode_cbor, typed_array
    from minirospy.web.rosbridge.protocol import encode

    texts = [json.dumps(each).encode() for each in OPERATIONS]
    pictures = [str(encode(each, "png")).encode() for each in OPERATIONS[:4]]
    array = {"op": "publish", "topic": "/scan", "msg": {"ranges": typed_array("float32", [1.5, 2.5])}}
    binaries = [encode_cbor(each) for each in (*OPERATIONS, array)]
    requests = [b"GET " + page + b" HTTP/1.1\r\nHost: localhost\r\n\r\n" for page in PAGES]
    return {
        "foxglove": Kind([FOXGLOVE_HANDSHAKE], FOXGLOVE_TEXTS, FOXGLOVE_BINARIES),
        "rosbridge": Kind([HANDSHAKE + b"\r\n"], [*texts, *pictures, *ODD_TEXTS], binaries),
        "video": Kind(requests),
    }


def frame(payload: bytes, opcode: int) -> bytes:
    """Return a client's frame, masked with zeros."""
    size = len(payload)
    head = bytes([opcode, 0x80 | size]) if size < 126 else bytes([opcode, 0xFE]) + struct.pack("!H", size)
    return head + bytes(4) + payload


class Target:
    """A bridge with its master, to which each input opens a new connection."""

    def __init__(self) -> None:
        self._loop = asyncio.SelectorEventLoop()
        self._faults = Faults()
        for name in ("minirospy", "asyncio"):
            logging.getLogger(name).addHandler(self._faults)
            logging.getLogger(name).propagate = False
        self._count = 0
        self._parts: tuple[Any, Any, Any] | None = None

    def __call__(self, kind: str, data: bytes) -> None:
        """Send one input to a listener. Raise on a finding."""
        self._loop.run_until_complete(self._take(kind, data))

    def close(self) -> None:
        """Stop the bridge."""
        self._loop.run_until_complete(self._end())
        self._loop.close()

    async def _take(self, kind: str, data: bytes) -> None:
        from minirospy.web.server.connection import Connection
        from minirospy.web.server.listener import Relay
        from minirospy.web.server.pipe import PlainPipe

        if self._count % INPUTS_PER_BRIDGE == 0:
            await self._end()
            await self._begin()
        self._count += 1
        assert self._parts
        bridge = self._parts[2]
        listener = bridge.listeners[kind]
        ours, theirs = tcp_pair()
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
            assert connection.queue.size + connection.queue.answers < MAX_WAITING
            connection.abort()

        assert not self._faults.found, self._faults.found.pop()
        await self._settle(bridge)

    async def _settle(self, bridge: Any) -> None:
        """Wait until no state of the client remains."""

        def left() -> list[object]:
            connections = [each for listener in bridge.listeners.values() for each in listener.connections]
            rosbridge = [*bridge.rosbridge.sessions, *bridge.rosbridge.shared.services]
            graph = [*bridge.graph.publishers, *bridge.graph.topics]
            return [*connections, *rosbridge, *bridge.video.feeds, *graph]

        await until(lambda: not left(), pause=0.001)
        assert len(bridge.foxglove.sessions) == 1
        assert not self._faults.found, self._faults.found.pop()

    async def _begin(self) -> None:
        from sensor_msgs.msg import Image
        from std_msgs.msg import String
        from std_srvs.srv import SetBool

        from minirospy import Node
        from minirospy.runtime.master.master import Master
        from minirospy.web.bridge import Bridge, BridgeOptions
        from minirospy.web.rosbridge.shared import RosbridgeOptions

        master = Master()
        await master.start()
        node = Node("bridge", master_uri=f"http://localhost:{master.port}", host="localhost", rosout=False)
        await node.start()
        # Do not log a client's errors, which are not findings and occur for each input.
        logging.getLogger(node.log.name).disabled = True
        options = BridgeOptions(
            foxglove_port=0,
            rosbridge_port=0,
            video_port=0,
            diagnostics=False,
            rosbridge=RosbridgeOptions(unregister_timeout=0.0),
        )
        bridge = Bridge(node, options)
        await bridge.start()
        await node.advertise("/known", String, latch=True)
        images = await node.advertise("/image", Image, latch=True)
        await images.publish(Image(height=2, width=2, encoding="mono8", step=2, data=b"abcd"))
        await node.serve("/set", SetBool, lambda request: (request.data, "set"))
        # Keep a client connected, so that the next one is offered channels immediately.
        bridge.foxglove.open(Steady())  # type: ignore[arg-type]
        await until(lambda: bridge.foxglove.channels.by_id)
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
    """A client that accepts all messages."""

    may_write = True

    def __init__(self) -> None:
        from minirospy.web.server.queue import SendQueue

        self.queue = SendQueue()

    def send_text(self, _: str) -> None:
        """Discard it."""

    def send_binary(self, *_: bytes) -> None:
        """Discard it."""

    def send_message(self, *_: object, **__: object) -> None:
        """Discard it."""


def an_input(rng: random.Random, kind: Kind) -> bytes:
    """Return the start of a connection and some frames, with mutations outside or inside the frames."""
    opening = rng.choice(kind.openings)
    often = 0.95 if kind.texts else 0.3
    parts = [opening if rng.random() < often else mutated(rng, list(kind.openings))]
    for _ in range(rng.randrange(1, 6) if kind.texts else 0):
        is_text = rng.random() < 0.7
        sources = list(kind.texts if is_text else kind.binaries)
        payload = rng.choice(sources)
        if rng.random() < 0.6:
            # Mutate the payload like a request's body.
            requests = [b"\r\n\r\n" + each for each in sources]
            payload = mutated(rng, requests).replace(CUT, b"").partition(b"\r\n\r\n")[2]
        if rng.random() < 0.1:
            # Continuations, pings, pongs, closes, and undefined opcodes and bits.
            parts.append(frame(payload[: rng.choice((0, 2, 100, 200))], rng.choice(OPCODES)))
        opcode = 1 if is_text else 2
        if rng.random() < 0.1:
            # Split it into two fragments.
            cut = rng.randrange(len(payload) + 1)
            parts.append(frame(payload[:cut], opcode))
            payload, opcode = payload[cut:], 0
        parts.append(frame(payload, 0x80 | opcode))
    if rng.random() < 0.2:
        parts[-1] = mutated(rng, [parts[-1]])
    return (CUT if rng.random() < 0.8 else b"").join(parts)


def main() -> int:
    """Fuzz, or run one input again; return the exit status."""
    inputs = kinds()
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="how long")
    parser.add_argument("--only", choices=inputs, help="inputs of this listener alone")
    parser.add_argument("--seed", type=int, default=time.time_ns(), help="for the same inputs again")
    parser.add_argument("finding", nargs="?", type=Path, help="an input to run again")
    options = parser.parse_args()
    os.environ["ROS_HOSTNAME"] = "localhost"
    target = Target()
    if options.finding:
        kind, _, data = options.finding.read_bytes().partition(b"\n")
        target(kind.decode(), data)
        target.close()
        return 0

    print(f"seed {options.seed}", flush=True)
    rng = random.Random(options.seed)
    start, count = time.monotonic(), 0
    memory: list[float] = []
    while (part := (time.monotonic() - start) / (60 * options.minutes)) < 1:
        if part * 4 >= len(memory):
            memory.append(resident_megabytes())
        name = options.only or rng.choice(list(inputs))
        data = an_input(rng, inputs[name])
        count += 1
        try:
            target(name, data)
        except BaseException:
            FINDING.write_bytes(name.encode() + b"\n" + data)
            raise
    memory.append(resident_megabytes())
    target.close()
    print(
        f"{count:,} inputs to the bridge, nothing found; MB at each quarter: {', '.join(f'{each:.0f}' for each in memory)}; "
        f"at its peak: {peak_megabytes()}"
    )
    return 0


def resident_megabytes() -> float:
    """Return the memory of this process in MB."""
    import psutil

    return float(psutil.Process().memory_info().rss) / 1e6


if __name__ == "__main__":
    sys.exit(main())
