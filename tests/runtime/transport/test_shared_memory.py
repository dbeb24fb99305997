"""Large messages through a ring (runtime/transport/ring_sender, ring_receiver), and every way back to the socket."""

from __future__ import annotations

import array
import contextlib
import mmap
import os
import random
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.errors import WireError
from minirospy.core.wire import ring, tcpros
from minirospy.core.wire.framing import CHUNK, Frame, LargeFrame, SplitFrame, serialize_frame
from minirospy.core.wire.ring import Step
from minirospy.core.wire.tcpros import InterfaceType, subscriber_header
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.transport import readers, ring_sender, shared_memory, sockets
from minirospy.runtime.transport.loop import LoopThread
from minirospy.runtime.transport.ring_receiver import RingReceiver
from tests.runtime.transport.conftest import no_memory, refuse
from tests.waiting import wait_until

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not shared_memory.is_possible(), reason="rings need Linux"
)

IMAGE = InterfaceType("sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743", "uint8[] data\n")
SECONDS = 100.0  # a machine that runs tests may stall
KILLS = Path(__file__).parents[3] / "benchmarks" / "kills.py"


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    thread = LoopThread("test-loop")
    yield thread
    thread.close()


@pytest.fixture(autouse=True)
def short_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let all large messages use a ring, so that the tests are quick."""
    monkeypatch.setattr(ring, "MIN_MESSAGE", CHUNK)


@pytest.fixture(autouse=True)
def no_file_is_left(loop: LoopThread) -> Iterator[None]:
    before = len(rings_of_this_process())
    yield
    wait_until(lambda: len(rings_of_this_process()) <= before, SECONDS)


def rings_of_this_process() -> list[str]:
    """Return the open files and mappings of rings."""
    found = []
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            name = os.readlink(f"/proc/self/fd/{number}")
            if "minirospy-ring" in name or "eventfd" in name:
                found.append(name)
    mapped = Path("/proc/self/maps").read_text(encoding="utf-8")
    # The loop itself may have an eventfd in some Pythons; a mapping is a ring's in any case.
    return [each for each in found if "ring" in each] + [
        line for line in mapped.splitlines() if "minirospy-ring" in line
    ]


def splittable(data: bytes) -> int:
    """Return the size of an array, or 0 if it is too small to be split off."""
    return len(data) if len(data) >= CHUNK else 0


def image(number: int, size: int) -> LargeFrame:
    """Return a message of ``size`` bytes that ends with a byte array of random contents."""
    data = random.Random(number).randbytes(size - 12)
    return LargeFrame((struct.pack("<QI", number, len(data)), data), size, splittable(data))


def cloud(number: int, size: int) -> LargeFrame:
    """Return a message with one more field after its array of random contents."""
    data = random.Random(number).randbytes(size - 13)
    return LargeFrame((struct.pack("<QI", number, len(data)), data, b"\1"), size, splittable(data))


def block(number: int, size: int) -> LargeFrame:
    """Return a message that must not be split."""
    return LargeFrame((random.Random(number).randbytes(size),), size)


def take(sock: socket.socket, count: int) -> bytes:
    """Receive exactly ``count`` bytes."""
    data = b""
    while len(data) < count:
        more = sock.recv(count - len(data))
        assert more, "the connection ended"
        data += more
    return data


def whole(frame: LargeFrame) -> bytes:
    return b"".join(frame.pieces)


class Ear:
    """A subscriber: reads its end of a connection in a thread."""

    def __init__(self, sock: socket.socket, *, shares_memory: bool = True) -> None:
        self.frames: list[Frame] = []
        self.newest = 0
        self.fault: Exception | None = None
        self.may_read = threading.Event()
        self.may_read.set()
        self._sock = sock
        self._shares_memory = shares_memory
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        try:
            readers.read_frames(
                self._sock, self._deliver, self, readers.ReaderSet(), shares_memory=self._shares_memory
            )
        except (OSError, WireError) as error:
            self.fault = error

    def _deliver(self, frame: Frame) -> None:
        self.frames.append(frame if isinstance(frame, bytes) else bytes(frame))
        self.may_read.wait(SECONDS)

    def wait(self, count: int) -> None:
        wait_until(lambda: len(self.frames) >= count or self.fault, SECONDS)

    def join(self) -> None:
        """Wait until the connection has ended."""
        self._thread.join(SECONDS)
        assert not self._thread.is_alive()

    def close(self) -> None:
        self.may_read.set()
        sockets.hang_up(self._sock)
        self._thread.join(SECONDS)


class Mouth:
    """A publication whose subscribers are connected by socket pairs."""

    def __init__(self, loop: LoopThread, queue_size: int = 0) -> None:
        self.publication = Publication("/t", IMAGE, queue_size=queue_size)
        self._loop = loop

    def connect(self, *, shared: bool = True, name: str = "/ear") -> socket.socket:
        """Return the subscriber's end of a new connection, after the headers."""
        one, other = socket.socketpair()
        self.accept(one, shared=shared, name=name)
        (length,) = struct.unpack("<I", other.recv(4, socket.MSG_WAITALL))
        other.recv(length, socket.MSG_WAITALL)
        return other

    def accept(self, sock: socket.socket, *, shared: bool = True, name: str = "/ear") -> None:
        """Connect a subscriber whose other end of ``sock`` receives the header."""
        sock.setblocking(False)
        fields = subscriber_header("/t", IMAGE, name, split_frames=True, shared_memory=shared)

        async def accept() -> str | None:
            return self.publication.accept(sock, fields, "/mouth", "", shares_memory=True)

        assert self._loop.run(accept()) is None

    def publish(self, *frames: bytes | LargeFrame) -> None:
        for frame in frames:
            self.publication.publish(frame)

    def steps(self) -> list[Step | None]:
        return [sender.step if (sender := self.sender(number)) else None for number in range(len(self.links))]

    @property
    def links(self) -> tuple[Any, ...]:
        return self.publication.links

    def sender(self, number: int) -> Any:
        return self.links[number].ring

    def warm_up(self, *ears: Ear, size: int = CHUNK) -> int:
        """Publish until all connections use the ring; return the number of messages."""
        for count in range(1, 20):
            self.publish(image(0, size))
            for ear in ears:
                ear.wait(count)
            wait_until(lambda: Step.ASKED not in self.steps() and Step.OFFERED not in self.steps(), SECONDS)
            if set(self.steps()) <= {Step.IN_USE, Step.OFF, None}:
                return count
        raise AssertionError(self.steps())

    def warm_up_from(self, ear: Ear, count: int, size: int) -> int:
        """Publish four messages of ``size`` bytes after ``count`` others, each when the one before has arrived."""
        for number in range(4):
            frame = image(number, size)
            self.publish(frame)
            ear.wait(count + number + 1)
            assert bytes(ear.frames[-1]) == whole(frame)
            wait_until(lambda: Step.ASKED not in self.steps() and Step.OFFERED not in self.steps(), SECONDS)
        return 4

    def close_link(self, link: Any) -> None:
        """Close a connection on the loop, as the publication does if its node has lost it."""

        async def close() -> None:
            link.close()

        self._loop.run(close())

    def close(self) -> None:
        async def close() -> None:
            self.publication.close()

        self._loop.run(close())


@pytest.fixture
def mouth(loop: LoopThread) -> Iterator[Mouth]:
    mouth = Mouth(loop)
    yield mouth
    mouth.close()


def test_messages_arrive_whole_and_in_order(mouth: Mouth) -> None:
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=1_000_000)
    sent: list[bytes] = []
    for number in range(60):
        frame = (image, cloud, block)[number % 3](number, CHUNK + 100 + number * 15_000)
        small = [bytes([number]) * size for size in [0, 9, CHUNK - 5][: number % 4]]
        mouth.publish(frame, *map(serialize_frame, small))
        sent += [whole(frame), *small]
    ear.wait(count + len(sent))
    assert list(map(bytes, ear.frames[count:])) == sent
    split = [isinstance(frame, SplitFrame) for frame in ear.frames[count:] if len(frame) >= CHUNK]
    assert split == [number % 3 < 2 for number in range(60)]

    (link,) = mouth.links
    assert mouth.sender(0).announced
    # The statistics count messages as if the socket had carried them.
    assert link.sent == count + len(sent)
    assert mouth.publication.sent_bytes == count * 1_000_004 + sum(len(each) + 4 for each in sent)
    ear.close()


def test_one_write_serves_all_subscribers(mouth: Mouth, monkeypatch: pytest.MonkeyPatch) -> None:
    ears = [Ear(mouth.connect(name=f"/ear{number}")) for number in range(4)]
    ears.append(Ear(mouth.connect(shared=False, name="/plain"), shares_memory=False))
    count = mouth.warm_up(*ears)
    places = []
    announcement = ring.announcement
    monkeypatch.setattr(ring, "announcement", lambda *where: places.append(where) or announcement(*where))
    frame = image(7, CHUNK)
    mouth.publish(frame)
    for ear in ears:
        ear.wait(count + 1)
        assert bytes(ear.frames[-1]) == whole(frame)
    assert len(places) == 4
    assert len(set(places)) == 1
    for ear in ears:
        ear.close()


def test_a_subscriber_that_stops_reading_does_not_stop_the_others(mouth: Mouth) -> None:
    slow, fast = Ear(mouth.connect(name="/slow")), Ear(mouth.connect(name="/fast"))
    count = mouth.warm_up(slow, fast, size=1_000_000)
    slow.may_read.clear()
    frames = [image(number, 1_000_000) for number in range(40)]
    for number, frame in enumerate(frames):
        mouth.publish(frame)
        fast.wait(count + number + 1)
    assert list(map(bytes, fast.frames[count:])) == list(map(whole, frames))
    assert mouth.publication.shared_bytes <= ring.MAX_RING
    # The queue of the slow one is unlimited: it receives all, those in the ring and those of the socket in order.
    slow.may_read.set()
    slow.wait(count + len(frames))
    assert list(map(bytes, slow.frames[count:])) == list(map(whole, frames))
    slow.close()
    fast.close()


def test_the_oldest_are_dropped_when_the_queue_is_full(loop: LoopThread) -> None:
    mouth = Mouth(loop, queue_size=2)
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=3_000_000)
    ear.may_read.clear()
    frames = [image(number, 3_000_000) for number in range(20)]
    mouth.publish(*frames)
    (link,) = mouth.links
    kept = len(frames) - link.dropped
    # One is being delivered, two are in the ring, some megabytes are in the socket, two messages are in the queue.
    assert link.dropped
    ear.may_read.set()
    ear.wait(count + kept)
    bodies = list(map(bytes, ear.frames[count:]))
    numbers = [struct.unpack_from("<Q", body)[0] for body in bodies]
    assert numbers == sorted(set(numbers))
    assert numbers[-2:] == [18, 19]
    assert bodies == [whole(frames[number]) for number in numbers]
    ear.close()
    mouth.close()


def test_a_message_larger_than_the_places_gets_a_new_ring(mouth: Mouth) -> None:
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear)
    for size in (CHUNK, 2_000_000, CHUNK, 2_000_000, 40_000_000, 2_000_000):
        before = mouth.sender(0).announced
        count += mouth.warm_up_from(ear, count, size)
        assert (mouth.sender(0).announced > before) == (size < 40_000_000)
        # The old ring is unmapped on both sides.
        wait_until(lambda: len(rings_of_this_process()) == 6, SECONDS)
    ear.close()


@pytest.mark.parametrize("is_publishers", [True, False])
def test_a_closed_connection_ends_its_memory(mouth: Mouth, is_publishers: bool) -> None:
    one, other = Ear(mouth.connect(name="/one")), Ear(mouth.connect(name="/other"))
    count = mouth.warm_up(one, other, size=200_000)
    one.may_read.clear()
    frames = [image(number, 200_000) for number in range(4)]
    mouth.publish(*frames)
    # One frame is with the callback, and three are announced: nobody may write into their places.
    link = mouth.links[0]
    if is_publishers:
        mouth.close_link(link)
    else:
        one.close()
    wait_until(lambda: len(mouth.links) == 1, SECONDS)
    more = [image(number, 200_000) for number in range(4, 30)]
    for number, frame in enumerate(more):
        mouth.publish(frame)
        other.wait(count + len(frames) + number + 1)
    assert list(map(bytes, other.frames[count:])) == list(map(whole, frames + more))
    one.may_read.set()
    if is_publishers:
        one.wait(count + len(frames))
        assert list(map(bytes, one.frames[count:])) == list(map(whole, frames))
    assert mouth.steps() == [Step.IN_USE]
    one.close()
    other.close()


def test_a_quiet_topic_gives_its_memory_back(loop: LoopThread, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ring_sender, "QUIET_SECONDS", 0.05)
    mouth = Mouth(loop)
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=1_000_000)
    mouth.publish(image(1, 1_000_000))
    assert mouth.sender(0).announced
    ear.wait(count + 1)
    wait_until(lambda: not mouth.publication.shared_bytes, SECONDS)
    frame = image(2, 1_000_000)
    mouth.publish(frame)
    ear.wait(count + 2)
    assert bytes(ear.frames[-1]) == whole(frame)
    assert mouth.sender(0).announced >= 2
    ear.close()
    mouth.close()


def resident_bytes() -> int:
    """Return the bytes of rings that are in this process's memory."""
    total = 0
    is_ring = False
    for line in Path("/proc/self/smaps").read_text(encoding="utf-8").splitlines():
        if "-" in line.split(maxsplit=1)[0]:
            is_ring = "minirospy-ring" in line
        elif is_ring and line.startswith("Rss:"):
            total += int(line.split()[1]) * 1024
    return total


def test_a_replaced_ring_gives_its_memory_back(loop: LoopThread, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ring_sender, "QUIET_SECONDS", 0.05)
    mouth = Mouth(loop)
    slow, fast = Ear(mouth.connect(name="/slow")), Ear(mouth.connect(name="/fast"))
    count = mouth.warm_up(slow, fast, size=200_000)
    slow.may_read.clear()
    frames = [image(number, 200_000) for number in range(4)]
    mouth.publish(*frames)
    fast.wait(count + 4)
    # The fast subscriber gets a ring with larger places, while the slow one holds places of the old ring.
    for number in range(4, 7):
        frames.append(image(number, 400_000))
        mouth.publish(frames[-1])
        fast.wait(count + len(frames))
        wait_until(lambda: mouth.steps()[1] not in (Step.ASKED, Step.OFFERED), SECONDS)
    wait_until(lambda: mouth.publication.shared_bytes <= 4 * 200_000, SECONDS)
    # The slow one holds at least three: the memory of these is kept, and counted.
    assert mouth.publication.shared_bytes >= 3 * 200_000

    slow.may_read.set()
    slow.wait(count + len(frames))
    assert list(map(bytes, slow.frames[count:])) == list(map(whole, frames))
    # No large message follows, so the slow subscriber still maps the old ring.
    wait_until(lambda: not mouth.publication.shared_bytes, SECONDS)
    wait_until(lambda: not resident_bytes(), SECONDS)
    slow.close()
    fast.close()
    mouth.close()


STUCK = 99  # the number of the image whose callback never returns
STUCK_SUBSCRIBER = f"""
import socket, struct, sys, threading
from types import SimpleNamespace
from minirospy.runtime.transport import readers

sock = socket.socket(socket.AF_UNIX)
sock.connect(sys.argv[1])
sock.recv(*struct.unpack("<I", sock.recv(4, socket.MSG_WAITALL)), socket.MSG_WAITALL)

def deliver(frame):
    if struct.unpack_from("<Q", frame)[0] == {STUCK}:
        print("stuck", flush=True)
        threading.Event().wait()

readers.read_frames(sock, deliver, SimpleNamespace(newest=0), readers.ReaderSet(), shares_memory=True)
"""


@pytest.fixture
def stuck_subscriber(mouth: Mouth, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Connect a subscriber in another process. It never returns from the callback of the image number STUCK."""
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        server.listen()
        server.settimeout(60)
        command = [sys.executable, "-c", STUCK_SUBSCRIBER, str(tmp_path / "socket")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                mouth.accept(server.accept()[0], name="/stuck")
                yield process
            finally:
                process.kill()


@pytest.mark.parametrize(
    ("fault", "is_given_back"), [(None, True), (ProcessLookupError, True), (OSError, False)]
)
def test_a_killed_subscriber_gives_its_unread_messages_back(
    mouth: Mouth,
    stuck_subscriber: subprocess.Popen[str],
    fault: type[OSError] | None,
    is_given_back: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if not fault:
        try:
            os.close(os.pidfd_open(os.getpid()))
        except (OSError, AttributeError):
            pytest.skip("pidfd_open is not available here")
    monkeypatch.setattr(ring_sender, "QUIET_SECONDS", 0.05)
    size = 200_000
    ear = Ear(mouth.connect(name="/fast"))
    count = mouth.warm_up(ear, size=size)
    frames = [image(STUCK, size), image(1, size), image(2, size)]
    mouth.publish(*frames)
    ear.wait(count + 3)
    assert stuck_subscriber.stdout
    assert stuck_subscriber.stdout.readline() == "stuck\n"
    assert mouth.steps() == [Step.IN_USE, Step.IN_USE]

    files = len(os.listdir("/proc/self/fd"))
    if fault:

        def pidfd_open(_process: int) -> int:
            raise fault

        monkeypatch.setattr(os, "pidfd_open", pidfd_open, raising=False)
    stuck_subscriber.kill()
    wait_until(lambda: len(mouth.links) == 1, SECONDS)
    if is_given_back:
        # No large message follows, so the other subscriber still maps the ring.
        wait_until(lambda: not mouth.publication.shared_bytes, SECONDS)
        wait_until(lambda: not resident_bytes(), SECONDS)
    else:
        wait_until(lambda: mouth.publication.shared_bytes == 2 * size, SECONDS)
    # The connection's socket and its counter, and the two files of the ring are closed, and a pidfd, too.
    wait_until(lambda: len(os.listdir("/proc/self/fd")) <= files - 4, SECONDS)

    for number in range(3, 13):
        frames.append(image(number, size))
        mouth.publish(frames[-1])
        ear.wait(count + len(frames))
        wait_until(lambda: mouth.steps()[0] not in (Step.ASKED, Step.OFFERED), SECONDS)
    assert list(map(bytes, ear.frames[count:])) == list(map(whole, frames))
    assert mouth.steps() == [Step.IN_USE]
    ear.close()


def test_memory_ends_with_the_last_subscriber(mouth: Mouth) -> None:
    ear = Ear(mouth.connect())
    mouth.warm_up(ear)
    assert rings_of_this_process()
    ear.close()
    wait_until(lambda: not rings_of_this_process(), SECONDS)
    again = Ear(mouth.connect())
    mouth.warm_up(again)
    assert mouth.steps() == [Step.IN_USE]
    again.close()


def test_threads_that_publish_at_the_same_time(mouth: Mouth) -> None:
    ears = [Ear(mouth.connect(name=f"/ear{number}")) for number in range(2)]
    count = mouth.warm_up(*ears, size=400_000)
    frames = [[image(100 * thread + number, 300_000 + number) for number in range(15)] for thread in range(4)]
    threads = [threading.Thread(target=mouth.publish, args=each) for each in frames]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(SECONDS)
    for ear in ears:
        ear.wait(count + 60)
        bodies = list(map(bytes, ear.frames[count:]))
        assert sorted(bodies) == sorted(whole(frame) for each in frames for frame in each)
        for each in frames:
            mine = set(map(whole, each))
            assert [body for body in bodies if body in mine] == list(map(whole, each))
        ear.close()


# --- every way back to the socket


@pytest.mark.parametrize("size", [199_999, 262_145])
def test_messages_for_which_a_ring_does_not_pay_use_the_socket(
    mouth: Mouth, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ring, "MIN_MESSAGE", 200_000)
    monkeypatch.setattr(ring, "MAX_MESSAGE", 262_144)
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=200_000)
    before = mouth.sender(0).announced
    mouth.publish(image(1, size), image(2, 262_144))
    ear.wait(count + 2)
    assert list(map(bytes, ear.frames[count:])) == [whole(image(1, size)), whole(image(2, 262_144))]
    assert mouth.sender(0).announced == before + 1
    ear.close()


def no_memfd(_name: str, _flags: int) -> int:
    raise OSError("no memfd here")


@pytest.mark.parametrize(
    ("name", "broken"),
    [("memfd_create", no_memfd), ("posix_fallocate", no_memory), ("eventfd", no_memfd)],
)
def test_a_publisher_without_memory_uses_the_socket(
    mouth: Mouth, name: str, broken: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, name, broken)
    ear = Ear(mouth.connect())
    frames = [image(number, 300_000) for number in range(10)]
    for number, frame in enumerate(frames):
        mouth.publish(frame)
        ear.wait(number + 1)
        wait_until(lambda: Step.ASKED not in mouth.steps(), SECONDS)
    assert list(map(bytes, ear.frames)) == list(map(whole, frames))
    assert mouth.sender(0).announced == 0
    ear.close()


def test_a_subscriber_that_cannot_map_uses_the_socket(mouth: Mouth, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(RingReceiver, "take_offer", refuse)
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=300_000)
    assert mouth.steps() == [Step.OFF]
    frames = [image(number, 300_000) for number in range(10)]
    mouth.publish(*frames)
    ear.wait(count + 10)
    assert list(map(bytes, ear.frames[count:])) == list(map(whole, frames))
    ear.close()


def test_a_subscriber_of_another_user_uses_the_socket(mouth: Mouth, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    ear = Ear(mouth.connect())
    frames = [image(number, 300_000) for number in range(5)]
    mouth.publish(*frames)
    ear.wait(5)
    assert mouth.steps() == [None]
    assert list(map(bytes, ear.frames)) == list(map(whole, frames))
    ear.close()


def test_a_subscriber_of_another_version_is_sent_whole_frames_and_no_ring(
    mouth: Mouth, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tcpros, "LARGE_MESSAGES", "1")  # in the subscriber's header
    sock = mouth.connect()
    frames = [cloud(number, 100_000) for number in range(3)]
    thread = threading.Thread(target=mouth.publish, args=frames)
    thread.start()
    expected = b"".join(serialize_frame(whole(frame)) for frame in frames)
    assert take(sock, len(expected)) == expected
    thread.join(SECONDS)
    assert mouth.steps() == [None]
    sock.close()


def test_a_subscriber_that_does_not_know_rings_is_sent_frames(mouth: Mouth) -> None:
    sock = mouth.connect(shared=False)
    frames = [cloud(number, 100_000) for number in range(3)]
    thread = threading.Thread(target=mouth.publish, args=frames)
    thread.start()
    expected = b"".join(buffer for frame in frames for buffer in frame.buffers(split=True))
    assert take(sock, len(expected)) == expected
    thread.join(SECONDS)
    sock.close()


# --- what a connection says about it


def test_a_connection_says_how_large_messages_are_sent(mouth: Mouth, monkeypatch: pytest.MonkeyPatch) -> None:
    ear = Ear(mouth.connect())
    (link,) = mouth.links
    mouth.publish(serialize_frame(b"small"))
    assert (link.large, link.shared, link.obstacle) == (0, 0, "")
    mouth.publish(image(0, CHUNK))
    assert (link.large, link.shared, link.obstacle) == (1, 0, "the first messages use the socket")
    ear.wait(2)
    count = 1 + mouth.warm_up(ear)
    for number in range(10):
        mouth.publish(image(number, CHUNK))
        ear.wait(1 + count + number + 1)
    assert (link.large, link.obstacle) == (count + 10, "")
    assert link.shared == mouth.sender(0).announced >= 10

    monkeypatch.setattr(ring, "MAX_MESSAGE", 2**21)
    mouth.publish(image(1, 2**21 + 1))
    assert (link.large, link.obstacle) == (count + 11, "messages over 2 MB are too large for it")
    ear.close()


def test_a_connection_says_that_its_subscriber_is_slow(mouth: Mouth) -> None:
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=3_000_000)
    ear.may_read.clear()
    mouth.publish(*(image(number, 3_000_000) for number in range(2 * count + 20)))
    assert mouth.links[0].obstacle == "the subscriber reads more slowly than it is sent to"
    ear.close()


def test_a_connection_says_why_its_subscriber_does_not_map(
    mouth: Mouth, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RingReceiver, "take_offer", refuse)
    ear = Ear(mouth.connect())
    mouth.warm_up(ear)
    assert mouth.links[0].obstacle == "the subscriber cannot map the publisher's memory"
    ear.close()


@pytest.mark.parametrize(
    ("name", "broken", "why"),
    [
        ("memfd_create", no_memfd, "the publisher has no memory for it: no memfd here"),
        ("posix_fallocate", no_memory, "the publisher has no memory for it: no space left"),
        ("eventfd", no_memfd, "the publisher cannot open another file: no memfd here"),
    ],
)
def test_a_connection_says_why_its_publisher_has_no_memory(
    mouth: Mouth, name: str, broken: Any, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, name, broken)
    ear = Ear(mouth.connect())
    for number in range(10):
        mouth.publish(image(number, CHUNK))
        ear.wait(number + 1)
        wait_until(lambda: Step.ASKED not in mouth.steps() and Step.OFFERED not in mouth.steps(), SECONDS)
    assert mouth.links[0].obstacle == why
    ear.close()


def test_a_connection_without_a_ring_says_why(mouth: Mouth, monkeypatch: pytest.MonkeyPatch) -> None:
    ear = Ear(mouth.connect(shared=False), shares_memory=False)
    (link,) = mouth.links
    mouth.publish(image(0, CHUNK))
    ear.wait(1)
    assert link.obstacle == (
        "the subscriber does not use it (MINIROSPY_TRANSPORT=unix, a bridge or a dashboard)"
    )
    with monkeypatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: 12345)
        assert link.obstacle == "the subscriber belongs to another user"
    with monkeypatch.context() as patch:
        patch.delattr(os, "eventfd")
        assert link.obstacle == "this Python has no os.memfd_create or os.eventfd"
    with monkeypatch.context() as patch:
        patch.setattr(sys, "platform", "darwin")
        assert link.obstacle == "it needs Linux"
    ear.close()


@pytest.mark.parametrize(
    ("is_same_host", "why"),
    [
        (False, "the subscriber is on another machine or in another container"),
        (
            True,
            "the subscriber is not a minirospy node, or cannot use Unix sockets (MINIROSPY_TRANSPORT=tcp)",
        ),
    ],
)
def test_a_tcp_connection_says_why_it_has_no_ring(is_same_host: bool, why: str) -> None:
    with socket.socket() as sock:
        assert shared_memory.obstacle(sock, is_same_host=is_same_host) == why


# --- peers that lie


def test_releases_of_places_that_are_not_held_end_the_ring(mouth: Mouth) -> None:
    sock = mouth.connect()
    mouth.publish(image(1, CHUNK))
    assert take(sock, 4) == ring.prepare()
    take(sock, 4 + CHUNK)
    sock.send(ring.READY)
    wait_until(lambda: mouth.steps() == [Step.LISTENING], SECONDS)
    mouth.publish(image(2, CHUNK))
    data, files, _, _ = socket.recv_fds(sock, 8, 2)
    assert ring.parse_offer(data[4:]) == ring.layout_for(CHUNK).size
    take(sock, 4 + CHUNK)
    file, counter = files
    with pytest.raises(PermissionError):
        mmap.mmap(file, ring.PAGE, mmap.MAP_SHARED, mmap.PROT_READ | mmap.PROT_WRITE)
    with pytest.raises(OSError, match=r"Invalid argument|Operation not permitted"):
        os.ftruncate(file, 0)
    sock.send(ring.MAPPED + b"nonsense")
    wait_until(lambda: mouth.steps() == [Step.IN_USE], SECONDS)
    mouth.publish(image(3, CHUNK))
    assert take(sock, len(ring.announcement(0, 0)))[:4] == ring.announcement(0, 0)[:4]
    os.eventfd_write(counter, 2)
    frame = image(4, CHUNK)
    thread = threading.Thread(target=mouth.publish, args=(frame, frame))
    thread.start()
    expected = b"".join(frame.buffers(split=True))
    assert take(sock, 2 * len(expected)) == 2 * expected
    thread.join(SECONDS)
    assert mouth.steps() == [Step.OFF]
    for each in files:
        os.close(each)
    sock.close()


def offered_files(size: int, *, seal: bool = True) -> list[int]:
    """Return the file of a ring and a counter."""
    import fcntl

    file = os.memfd_create("minirospy-ring", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(file, size)
    if seal:
        fcntl.fcntl(file, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW)
    return [file, os.eventfd(0, os.EFD_CLOEXEC)]


@pytest.mark.parametrize(
    ("seal", "real_size", "files_sent", "answer"),
    [
        (True, ring.PAGE, 2, ring.MAPPED),
        (False, ring.PAGE, 2, ring.REFUSED),
        (True, ring.PAGE // 2, 2, ring.REFUSED),
        (True, ring.PAGE, 1, ring.REFUSED),
        (True, ring.PAGE, 0, ring.REFUSED),
    ],
)
def test_only_a_sealed_ring_of_the_right_size_is_mapped(
    seal: bool, real_size: int, files_sent: int, answer: bytes
) -> None:
    one, other = socket.socketpair()
    one.settimeout(SECONDS)
    ear = Ear(other)
    one.sendall(ring.prepare())
    assert one.recv(1) == ring.READY
    files = offered_files(real_size, seal=seal)
    rights = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", files[:files_sent]))]
    one.sendmsg([ring.offer(ring.PAGE)], rights if files_sent else [])
    assert one.recv(1) == answer
    one.sendall(serialize_frame(b"after"))
    ear.wait(1)
    for file in files:
        os.close(file)
    one.close()
    ear.close()
    assert ear.frames == [b"after"]


@pytest.mark.parametrize(
    ("words", "data"),
    [
        ("before any memory was offered", ring.announcement(0, 10)),
        ("a ring of 0 bytes", ring.offer(0)),
        ("over the limit", struct.pack("<I", ring.PLACE_WORD + 1)),
    ],
)
def test_words_that_lie_end_the_connection(words: str, data: bytes) -> None:
    one, other = socket.socketpair()
    ear = Ear(other)
    one.sendall(serialize_frame(b"before") + data)
    wait_until(lambda: ear.fault, SECONDS)
    assert words in str(ear.fault)
    assert ear.frames == [b"before"]
    one.close()
    ear.close()


def test_an_announcement_that_lies_ends_the_connection() -> None:
    one, other = socket.socketpair()
    one.settimeout(SECONDS)
    ear = Ear(other)
    one.sendall(ring.prepare())
    assert one.recv(1) == ring.READY
    files = offered_files(ring.PAGE)
    socket.send_fds(one, [ring.offer(ring.PAGE)], files)
    assert one.recv(1) == ring.MAPPED
    one.sendall(ring.announcement(0, 100) + ring.announcement(ring.PAGE - 99, 100))
    wait_until(lambda: ear.fault, SECONDS)
    assert "outside the ring" in str(ear.fault)
    assert ear.frames == [bytes(100)]
    for file in files:
        os.close(file)
    one.close()
    ear.close()


@pytest.mark.parametrize("newest", [0, 1, 10])
@pytest.mark.parametrize(
    ("end", "fault"),
    [
        ([], None),
        ([struct.pack("<I", 5000), b"cut off"], None),
        ([struct.pack("<I", CHUNK + 1), b"cut off"], None),
        ([struct.pack("<I", 0xC0000009)], "is over the limit"),
        ([ring.announcement(0, 9)], "before any memory was offered"),
    ],
)
def test_what_arrived_before_the_end_is_delivered(newest: int, end: list[bytes], fault: str | None) -> None:
    publisher, subscriber = socket.socketpair()
    ear = Ear(subscriber)
    ear.newest = newest
    ear.may_read.clear()
    publisher.sendall(serialize_frame(b"first"))
    ear.wait(1)
    # While the callback runs, two frames arrive, and the publisher closes. It never reads the answer to PREPARE_WORD,
    # so Linux resets the connection.
    ear.may_read.set()
    publisher.sendall(ring.prepare())
    publisher.recv(1, socket.MSG_PEEK)
    ear.may_read.clear()
    publisher.sendall(serialize_frame(b"second"))
    ear.wait(2)
    publisher.sendall(b"".join([serialize_frame(b"x" * (CHUNK + 100)), serialize_frame(b"last"), *end]))
    publisher.close()
    ear.may_read.set()
    ear.join()
    kept = [b"x" * (CHUNK + 100), b"last"]
    assert ear.frames[2:] == (kept[-newest:] if newest else kept)
    assert (fault in str(ear.fault)) if fault else ear.fault is None


def test_a_publisher_that_is_gone_has_sent_its_messages(loop: LoopThread) -> None:
    mouth = Mouth(loop)
    ear = Ear(mouth.connect())
    count = mouth.warm_up(ear, size=200_000)
    ear.may_read.clear()
    frames = [image(number, 200_000) for number in range(4)]
    mouth.publish(*frames)
    mouth.close()
    ear.may_read.set()
    ear.wait(count + 4)
    assert list(map(bytes, ear.frames[count:])) == list(map(whole, frames))
    ear.close()


def test_twenty_kills() -> None:
    """benchmarks/kills.py in short: no wrong byte, no leak."""
    done = subprocess.run(
        [sys.executable, str(KILLS), "--kills", "20"],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
        env={**os.environ, "MINIROSPY_TRANSPORT": "auto"},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " 0 faults" in done.stdout
