"""runtime/transport/links and readers: frames over TCP and Unix sockets; peers that stall, disconnect or send bad data."""

from __future__ import annotations

import asyncio
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from minirospy.base.errors import WireError
from minirospy.core.wire import framing
from minirospy.core.wire.framing import CHUNK, SPLIT, Frame, LargeFrame, Pieces, SplitFrame, serialize_frame
from minirospy.runtime.transport import links, readers
from minirospy.runtime.transport.loop import LoopThread
from minirospy.runtime.transport.sockets import is_writable
from tests.interruption import ends_elsewhere, interrupt_in_lock

KINDS = ["tcp", "unix"] if hasattr(socket, "AF_UNIX") else ["tcp"]


@pytest.fixture(params=KINDS)
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[socket.socket, socket.socket]]:
    """Return both sockets of a connection on this machine."""
    if request.param == "unix":
        one, other = socket.socketpair(socket.AF_UNIX)
    else:
        with socket.create_server(("127.0.0.1", 0)) as server:
            one = socket.create_connection(server.getsockname())
            other, _ = server.accept()
    with one, other:
        yield one, other


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread("test-loop")
    yield thread
    thread.close()


@dataclass
class QueueSize:
    """The number of frames that a slow receiver receives."""

    newest: int


def open_link(
    loop: LoopThread,
    sock: socket.socket,
    queue_size: int,
    on_closed: Callable[[links.OutLink], None],
    *,
    split: bool = False,
) -> links.OutLink:
    async def make() -> links.OutLink:
        sock.setblocking(False)
        link = links.OutLink(sock, asyncio.get_running_loop(), "/peer", queue_size, on_closed, split=split)
        link.open()
        return link

    return loop.run(make())


def receive_all(sock: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        more = sock.recv(1 << 20)
        assert more, "the link ended"
        data += more
    return bytes(data)


def test_frames_of_several_threads_stay_whole(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None)
    frames = [serialize_frame(bytes([number]) * 300_000) for number in range(8)]
    threads = [threading.Thread(target=lambda f=f: [link.send(f) for _ in range(5)]) for f in frames]
    for thread in threads:
        thread.start()
    data = receive_all(pair[1], sum(map(len, frames)) * 5)
    for thread in threads:
        thread.join()
    # Data that the peer has already received may not be counted yet.
    loop.run(link.drain(30))
    seen = []

    while data:
        (length,) = struct.unpack_from("<I", data)
        body = data[4 : 4 + length]
        assert set(body) == {body[0]}
        seen.append(body[0])
        data = data[4 + length :]

    assert sorted(seen) == sorted(list(range(8)) * 5)
    assert (link.sent, link.dropped, link.waiting) == (40, 0, 0)


def test_ctrl_c_at_any_point_of_publishing_leaves_the_link_usable(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None)
    interrupt_in_lock(lambda: link.send(b"first"))
    interrupt_in_lock(link.wait)
    assert ends_elsewhere(lambda: link.send(b"second"))
    loop.post(link.close)
    assert ends_elsewhere(link.wait)


def test_a_full_queue_drops_the_oldest_and_never_half_a_frame(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 3, lambda _: None)
    size = 4_000_000
    for number in range(50):
        link.send(serialize_frame(bytes([number]) * size))
    assert link.waiting <= 4
    count = 50 - link.dropped
    data = receive_all(pair[1], count * (size + 4))
    numbers = [data[at + 4] for at in range(0, len(data), size + 4)]
    assert numbers[-3:] == [47, 48, 49]
    assert numbers == sorted(numbers)
    assert all(data[at : at + 4] == struct.pack("<I", size) for at in range(0, len(data), size + 4))


def test_disconnecting_peer_closes_the_link_and_wakes_threads(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    ended = threading.Event()
    link = open_link(loop, pair[0], 0, lambda _: ended.set())
    link.send(serialize_frame(bytes(50_000_000)))
    waiter = threading.Thread(target=link.wait)
    waiter.start()
    pair[1].close()
    waiter.join(30)
    assert not waiter.is_alive()
    assert ended.wait(30)
    link.send(b"to nobody")


def test_bytes_from_a_subscriber_are_ignored(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    ended = threading.Event()
    link = open_link(loop, pair[0], 0, lambda _: ended.set())
    pair[1].sendall(b"x" * 10_000)
    link.send(serialize_frame(b"still here"))
    assert receive_all(pair[1], 14)[4:] == b"still here"
    assert not ended.is_set()


def test_reading_ends_at_a_length_over_the_limit(pair: tuple[socket.socket, socket.socket]) -> None:
    pair[1].sendall(serialize_frame(b"good") + b"\xff\xff\xff\xff")
    bodies: list[bytes] = []
    with pytest.raises(WireError, match="over the limit"):
        readers.read_frames(
            pair[0], lambda frame: bodies.append(bytes(frame)), QueueSize(0), readers.ReaderSet()
        )
    assert bodies == [b"good"]
    assert pair[0].fileno() == -1


def test_reading_ends_with_half_a_frame(pair: tuple[socket.socket, socket.socket]) -> None:
    pair[1].sendall(serialize_frame(b"whole") + b"\x05\0\0\0ab")
    pair[1].close()
    bodies: list[bytes] = []
    readers.read_frames(pair[0], lambda frame: bodies.append(bytes(frame)), QueueSize(0), readers.ReaderSet())
    assert bodies == [b"whole"]


@pytest.mark.parametrize(
    ("newest", "expected"), [(1, [9]), (3, [7, 8, 9]), (100, list(range(10))), (0, list(range(10)))]
)
def test_newest(pair: tuple[socket.socket, socket.socket], newest: int, expected: list[int]) -> None:
    pair[1].sendall(b"".join(serialize_frame(bytes([number])) for number in range(10)))
    pair[1].close()
    bodies: list[int] = []
    readers.read_frames(
        pair[0], lambda frame: bodies.append(frame[0]), QueueSize(newest), readers.ReaderSet()
    )
    assert bodies == expected


@pytest.mark.parametrize(
    ("seconds", "is_alone", "looks"), [(60.0, True, 2), (60.0, False, 0), (0.0, True, 0)]
)
def test_reader_busy_polls_while_messages_arrive_quickly(
    monkeypatch: pytest.MonkeyPatch, seconds: float, is_alone: bool, looks: int
) -> None:
    """``seconds``: the longest wait that counts as short. The reader never busy-polls for the first message.

    ``is_alone``: no other reader of the node has read in the meantime.
    """
    one, other = socket.socketpair()
    looked = 0

    def busy_receive(sock: socket.socket, space: memoryview) -> int:
        nonlocal looked
        looked += 1
        if looked == 1:
            other.sendall(serialize_frame(b"second"))
        else:
            other.close()
        return sock.recv_into(space)

    def deliver(frame: Frame) -> None:
        bodies.append(bytes(frame))
        if not is_alone:
            reader_set.last = "another"
        if not looks:
            other.close()

    monkeypatch.setattr(readers, "BUSY_POLL_SECONDS", seconds)
    monkeypatch.setattr(readers, "may_busy_poll", lambda _: True)
    monkeypatch.setattr(readers, "busy_receive", busy_receive)
    bodies: list[bytes] = []
    reader_set = readers.ReaderSet()
    waiting = threading.Event()

    class Waiting(socket.socket):
        def recv_into(self, buffer: Any, nbytes: int = 0, flags: int = 0) -> int:
            waiting.set()
            return super().recv_into(buffer, nbytes, flags)

    with other:
        reader = threading.Thread(
            target=readers.read_frames, args=(Waiting(fileno=one.detach()), deliver, QueueSize(0), reader_set)
        )
        reader.start()
        assert waiting.wait(60)
        other.sendall(serialize_frame(b"first"))
        reader.join(60)
    assert bodies == [b"first", b"second"][: looks or 1]
    assert looked == looks


def test_reader_blocks_after_busy_polling_without_success(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The measured wait includes both the busy-poll and the blocking. After a long wait, the next receive blocks."""
    one, other = socket.socketpair()
    looks: list[str] = []
    clock = SimpleNamespace(now=0.0)

    def recv_into(_: Any) -> int:
        clock.now += 0.0001
        return 4

    def busy_receive(sock: socket.socket, space: memoryview) -> int:
        looks.append("look")
        if len(looks) == 1:
            clock.now += readers.BUSY_POLL_SECONDS
            raise BlockingIOError
        clock.now += 0.005
        return 4

    monkeypatch.setattr(readers, "may_busy_poll", lambda _: True)
    monkeypatch.setattr(readers, "busy_receive", busy_receive)
    monkeypatch.setattr(readers, "time", SimpleNamespace(perf_counter=lambda: clock.now))
    with one, other:
        sock: Any = SimpleNamespace(recv_into=recv_into, family=socket.AF_INET)
        source = readers._FrameSource(sock, readers.ReaderSet())
        space = memoryview(bytearray(8))
        for expected in (0, 1, 1, 2, 2):  # blocked, no data, blocked, late, blocked
            source._receive(space)
            assert len(looks) == expected


# --- large messages


def image(array: bytes) -> LargeFrame:
    """Return a message that ends with a byte array, as its class serializes it."""
    pieces = Pieces()
    pieces.write(b"head")
    pieces.write(struct.pack("<BI", 7, len(array)))
    pieces.write(array)
    frame = pieces.frame(0)
    assert isinstance(frame, LargeFrame)
    return frame


def joined(frame: LargeFrame) -> bytes:
    return b"".join(frame.pieces)


def read_in_thread(sock: socket.socket, frames: list[Frame], newest: int = 0) -> threading.Thread:
    thread = threading.Thread(
        target=readers.read_frames,
        args=(
            sock,
            lambda frame: frames.append(frame if isinstance(frame, bytes) else bytes(frame)),
            QueueSize(newest),
            readers.ReaderSet(),
        ),
    )
    thread.start()
    return thread


@pytest.mark.parametrize("split", [False, True])
def test_small_and_large_messages_in_turns(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread, split: bool
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None, split=split)
    large = [image(bytes([number]) * (CHUNK + 1000 * number)) for number in range(20)]
    sent: list[bytes] = []
    frames: list[Frame] = []
    reader = read_in_thread(pair[1], frames)

    for number, frame in enumerate(large):
        link.send(frame)
        sent.append(joined(frame))
        for size in [0, 10, CHUNK - 4, CHUNK][: number % 5]:
            link.send(serialize_frame(bytes(size)))
            sent.append(bytes(size))

    loop.run(link.drain(30))
    loop.loop.call_soon_threadsafe(link.close)
    reader.join(30)
    assert [len(frame) for frame in frames] == [len(frame) for frame in sent]
    assert list(map(bytes, frames)) == sent
    assert {type(frame) for frame in frames if len(frame) > CHUNK} == {SplitFrame if split else bytes}
    assert link.sent_bytes == sum(map(len, sent)) + 4 * len(sent)


def test_the_array_is_an_object_of_its_own(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None, split=True)
    frames: list[Frame] = []
    reader = read_in_thread(pair[1], frames)
    link.send(image(b"x" * 1_000_000))
    loop.run(link.drain(30))
    loop.loop.call_soon_threadsafe(link.close)
    reader.join(30)
    (frame,) = frames
    assert isinstance(frame, SplitFrame)
    assert frame[9:] is frame.array


def test_the_array_is_an_object_of_its_own_if_fields_follow_it(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    link = open_link(loop, pair[0], 0, lambda _: None, split=True)
    frames: list[Frame] = []
    reader = read_in_thread(pair[1], frames)
    pieces = Pieces([struct.pack("<I", CHUNK), bytes(CHUNK), b"dense"])
    link.send(pieces.frame(5))
    link.send(pieces.frame())
    loop.run(link.drain(30))
    loop.loop.call_soon_threadsafe(link.close)
    reader.join(30)
    frame, unsplit = frames
    assert isinstance(frame, SplitFrame)
    assert (frame.array, frame.rest) == (bytes(CHUNK), b"dense")
    assert type(unsplit) is bytes
    assert bytes(frame) == unsplit == b"".join(pieces)


@pytest.mark.parametrize("count", [0, 1, 3, 20_000])
def test_pieces_that_are_no_bytes(count: int) -> None:
    array = memoryview(struct.pack(f"{count}d", *range(count))).cast("d")
    frame = Pieces([array]).frame()
    sent = frame if isinstance(frame, bytes) else b"".join(frame.buffers(split=False))
    assert sent == serialize_frame(array.tobytes())
    assert Pieces([b"", array, b"end"]).frame() is not None


def test_mutable_values_are_copied() -> None:
    array = bytearray(2 * CHUNK)
    frame = Pieces([struct.pack("<I", 2 * CHUNK), array]).frame()
    array[0] = 1
    assert isinstance(frame, LargeFrame)
    assert frame.pieces[-1][0] == 0


def test_a_peer_that_ends_in_the_middle_of_a_large_message(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread
) -> None:
    ended = threading.Event()
    link = open_link(loop, pair[0], 0, lambda _: ended.set(), split=True)
    sender = threading.Thread(target=link.send, args=(image(bytes(50_000_000)),))
    sender.start()
    receive_all(pair[1], 1_000_000)
    pair[1].close()
    assert ended.wait(30)
    sender.join(30)
    assert not sender.is_alive()
    assert link.waiting == 0


@pytest.mark.parametrize(
    "start",
    [
        struct.pack("<I", 115_536 | SPLIT),
        struct.pack("<II", 115_536 | SPLIT, 115_520),
        struct.pack("<III", 115_536 | SPLIT, 115_520, 0) + b"headABCD",
        struct.pack("<III", CHUNK + 12 | SPLIT, CHUNK, 8) + struct.pack("<I", CHUNK) + bytes(CHUNK) + b"rest",
    ],
)
def test_a_publisher_that_ends_in_the_middle_of_a_split_frame(
    pair: tuple[socket.socket, socket.socket], start: bytes
) -> None:
    pair[1].sendall(serialize_frame(b"whole") + start)
    pair[1].close()
    frames: list[Frame] = []
    readers.read_frames(pair[0], lambda frame: frames.append(bytes(frame)), QueueSize(0), readers.ReaderSet())
    assert frames == [b"whole"]


@pytest.mark.parametrize(
    ("size", "array", "rest", "head", "words"),
    [
        (200_000, 100_000, 0, bytes(100_000), "not split where its array begins"),
        (200_000, 199_999, 0, b"", "has an array of 199999, followed by 0"),
        (200_000, 100_000, 99_997, b"", "has an array of 100000, followed by 99997"),
        (200_000, 100_000, 2**32 - 1, b"", "has an array of 100000, followed by 4294967295"),
        (200_000, 10, 0, b"", "has an array of 10"),
        (100, 90, 0, b"", "has an array of 90"),
        (1 << 30 | 1, 90, 0, b"", "over the limit"),
    ],
)
def test_split_frames_that_lie(
    pair: tuple[socket.socket, socket.socket], size: int, array: int, rest: int, head: bytes, words: str
) -> None:
    data = struct.pack("<III", size | SPLIT, array, rest) + head + bytes(array if head else 0)
    sender = threading.Thread(target=pair[1].sendall, args=(data,))
    sender.start()
    with pytest.raises(WireError, match=words):
        readers.read_frames(pair[0], lambda _: None, QueueSize(0), readers.ReaderSet())
    sender.join(30)


def test_no_memory_for_a_message_ends_the_link_with_a_line() -> None:
    def receive(_count: int, _flags: int = 0) -> bytes:
        raise MemoryError

    def receive_into(space: memoryview, _count: int = 0, _flags: int = 0) -> int:
        space[:4] = struct.pack("<I", 1 << 29)
        return 4

    sock: Any = SimpleNamespace(
        family=socket.AF_INET,
        setblocking=lambda _: None,
        recv=receive,
        recv_into=receive_into,
        close=lambda: None,
    )
    with pytest.raises(WireError, match="no memory for a message of 536870912 bytes"):
        readers.read_frames(sock, lambda _: None, QueueSize(0), readers.ReaderSet())


def test_newest_of_large_messages(pair: tuple[socket.socket, socket.socket]) -> None:
    data = b"".join(b"".join(image(bytes([number]) * CHUNK).buffers(split=True)) for number in range(3))
    pair[1].setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
    sender = threading.Thread(target=lambda: (pair[1].sendall(data), pair[1].close()))
    sender.start()
    frames: list[bytes] = []
    readers.read_frames(pair[0], lambda frame: frames.append(bytes(frame)), QueueSize(1), readers.ReaderSet())
    sender.join(30)
    assert frames[-1] == joined(image(bytes([2]) * CHUNK))


# --- a subscriber that is slower than its publisher


def test_slow_reader_gets_every_frame_while_it_reads(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The sender's wait for space never times out here, even if other programs occupy the reader's processor for long."""
    monkeypatch.setattr(links, "time", SimpleNamespace(monotonic=lambda: 0.0, perf_counter=time.perf_counter))
    monkeypatch.setattr(links, "is_writable", lambda sock, _: is_writable(sock, 30_000))
    link = open_link(loop, pair[0], 10, lambda _: None)
    frames: list[Frame] = []
    reader = read_in_thread(pair[1], frames)
    for number in range(50_000):
        link.send(serialize_frame(number.to_bytes(8, "little")))
    loop.run(link.drain(30))
    loop.loop.call_soon_threadsafe(link.close)
    reader.join(30)

    assert link.dropped == 0
    assert [int.from_bytes(frame, "little") for frame in frames] == list(range(50_000))


def test_peer_that_does_not_read_is_not_waited_for(
    pair: tuple[socket.socket, socket.socket], loop: LoopThread, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[int] = []

    def wait(sock: socket.socket, milliseconds: int) -> bool:
        waits.append(milliseconds)
        return is_writable(sock, milliseconds)

    monkeypatch.setattr(links, "is_writable", wait)
    link = open_link(loop, pair[0], 2, lambda _: None)
    frame = serialize_frame(bytes(60_000))
    while not link.dropped:
        link.send(frame)
    for _ in range(1000):
        link.send(frame)
    # TCP accepts a little more for a while, and each time the peer gets another chance.
    assert 1 <= len(waits) < 20
    assert link.waiting <= 3


@pytest.mark.parametrize(
    ("head", "why"),
    [
        (struct.pack("<I", 0xFFFFFFFF), "a message of 4294967295 bytes is over the limit of 1073741824"),
        (struct.pack("<I", 1 << 29), "no memory for a message of 536870912 bytes"),
    ],
)
def test_message_that_the_loop_refuses_ends_the_link_with_its_reason(
    pair: tuple[socket.socket, socket.socket], monkeypatch: pytest.MonkeyPatch, head: bytes, why: str
) -> None:
    def no_memory(size: int) -> bytearray:
        if size > CHUNK:
            raise MemoryError
        return bytearray(size)

    async def scene() -> list[str]:
        said: list[str] = []
        ended = asyncio.Event()
        pair[0].setblocking(False)
        readers.watch_frames(
            asyncio.get_running_loop(),
            pair[0],
            lambda _: None,
            ended.set,
            lambda error: said.append(str(error)),
        )
        monkeypatch.setattr(framing, "bytearray", no_memory, raising=False)
        pair[1].sendall(head)
        await asyncio.wait_for(ended.wait(), 30)
        return said

    assert asyncio.run(scene()) == [why]
