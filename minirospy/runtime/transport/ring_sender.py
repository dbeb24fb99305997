"""The memory of a topic's ring, and the publisher's end of a connection that uses it. Linux only.

:class:`SharedRing` belongs to a topic, :class:`RingSender` to one of its connections. :mod:`minirospy.core.wire.ring` makes the
decisions. The ring is an anonymous file, so nothing is left behind when a process is killed. Source: docs/shared_memory.md.
"""

from __future__ import annotations

import array
import asyncio
import contextlib
import logging
import mmap
import os
import select
import socket
import threading
import time
from types import TracebackType

from minirospy.core.wire import ring
from minirospy.core.wire.framing import LargeFrame
from minirospy.core.wire.ring import Layout, Places, Step
from minirospy.runtime.transport.shared_memory import ascii_text
from minirospy.runtime.transport.sockets import peer

__all__ = ["QUIET_SECONDS", "RingMemory", "RingSender", "SharedRing", "Sharing"]

QUIET_SECONDS = 5.0  # seconds without a large message after which a ring's memory is given back

# Seconds for which a publishing thread waits for a subscriber to release a place: the same as for a full socket.
_WAIT_SECONDS = 0.005
_WAIT_MS = 1  # milliseconds per wait for a subscriber to release a place

_log = logging.getLogger(__name__)


class RingMemory:
    """The memory of one ring at the publisher. Hold the lock of the :class:`SharedRing` for everything except :meth:`fill`."""

    def __init__(self, layout: Layout) -> None:
        """Create and map the file, which has no memory at first. Raise OSError if that fails."""
        self.layout = layout
        self.places = Places(layout.places)
        self._backed = [0] * layout.places  # number of bytes with allocated memory at the start of each place
        self.file = os.memfd_create("minirospy-ring", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        self.read_only = -1
        try:
            os.ftruncate(self.file, layout.size)
            _seal(self.file)
            # Subscribers receive a read-only descriptor.
            self.read_only = os.open(f"/proc/self/fd/{self.file}", os.O_RDONLY | os.O_CLOEXEC)
            self._map = mmap.mmap(self.file, layout.size)
        except BaseException:
            self.close()
            raise

    def take(self, size: int) -> int | None:
        """Return a free place with memory for ``size`` bytes, or None. Raise OSError if the machine is out of memory."""
        place = self.places.take()
        if place is not None and self._backed[place] < size:
            try:
                # Allocate first: otherwise, writing when the machine is out of memory would kill the process with SIGBUS.
                os.posix_fallocate(self.file, place * self.layout.place_size, size)
            except BaseException:
                self.places.let_go(place)
                raise
            self._backed[place] = size
        return place

    def fill(self, place: int, frame: LargeFrame) -> None:
        """Write a message into a place that the calling thread has taken."""
        start = place * self.layout.place_size
        for piece in frame.pieces:
            end = start + len(piece)
            self._map[start:end] = piece
            start = end

    def give_back(self) -> None:
        """Return the memory of free places to the system. It is allocated again when they are reused."""
        for place in self.places.free:
            if self._backed[place]:
                self._map.madvise(mmap.MADV_REMOVE, place * self.layout.place_size, self.layout.place_size)
                self._backed[place] = 0

    @property
    def backed_bytes(self) -> int:
        """Return how many bytes of the ring are backed by allocated memory."""
        return sum(self._backed)

    def close(self) -> None:
        """Close the files. The mapping remains while a thread fills a place or a subscriber reads one."""
        for file in (self.file, self.read_only):
            if file >= 0:
                os.close(file)
        self.file = self.read_only = -1


class SharedRing:
    """A topic's ring at the publisher. The first large message creates it; larger messages may replace it.

    A ring is also replaced if a connection closes before it has released its places: the subscriber may still read them, so they
    must not be overwritten. ``senders``: the connections that may use the ring. Thread-safe.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.lock = threading.Lock()
        self.memory: RingMemory | None = None
        self.trouble = ""  # why shared memory is off; set by turn_off()
        self._loop = loop
        self._senders: set[RingSender] = set()
        self._retired: list[
            RingMemory
        ] = []  # replaced memories that are still allocated, and that a connection still uses
        self._is_off = False
        self._was_used = False
        self._timer: asyncio.TimerHandle | None = None
        self._is_watched = False  # whether the timer runs, or is about to
        # dict from the pidfd of a subscriber that closed its connection while it held places, to the memory and connection
        self._closed: dict[int, tuple[RingMemory, RingSender]] = {}

    @property
    def memory_bytes(self) -> int:
        """Return the number of bytes that this process has allocated for the ring."""
        with self.lock:
            memories = [*self._retired, *([self.memory] if self.memory else [])]
            return sum(memory.backed_bytes for memory in memories)

    def share(self, frame: LargeFrame) -> Sharing:
        """Return an object that writes ``frame`` into the ring when the first connection needs it."""
        with self.lock:
            self.collect()
        return Sharing(self, frame)

    def add(self, sock: socket.socket) -> RingSender:
        """Return the publisher's end of a new connection."""
        sender = RingSender(self, sock)
        with self.lock:
            self._senders.add(sender)
        return sender

    def remove(self, sender: RingSender) -> None:
        """Remove a closed connection. Call this with the lock held."""
        self._senders.discard(sender)
        if not self._senders:
            self.retire()
        self.give_back_retired()

    def release_at_exit(self, memory: RingMemory, sender: RingSender, process: int) -> None:
        """Release a closed connection's places when its subscriber exits; until then, the subscriber may still read them.

        Call this on the loop, with the lock held.
        """
        if memory not in self._retired:
            return  # no other connection uses this memory, so it is freed when the subscriber unmaps it
        try:
            file = os.pidfd_open(process)
        except ProcessLookupError:
            # The subscriber has exited, and its parent has been notified.
            self._release(memory, sender)
            return
        except (OSError, AttributeError):
            # The memory stays allocated until the next large messages have given the other subscribers a new ring.
            return
        self._closed[file] = memory, sender
        self._loop.add_reader(file, self._exited, file)

    def _exited(self, file: int) -> None:
        memory, sender = self._closed[file]
        self._stop_waiting(file)
        with self.lock:
            self._release(memory, sender)

    def _release(self, memory: RingMemory, sender: RingSender) -> None:
        memory.places.release(sender, memory.places.held_by(sender))
        self.collect()

    def _stop_waiting(self, file: int) -> None:
        del self._closed[file]
        self._loop.remove_reader(file)
        os.close(file)

    def collect(self) -> None:
        """Free the places that subscribers have released. Call this with the lock held."""
        for sender in self._senders:
            sender.collect()
        if self._retired:
            self.give_back_retired()

    def give_back_retired(self) -> None:
        """Give back the free places of replaced memories, which will not be written again. Call this with the lock held."""
        used = {sender.memory for sender in self._senders}
        for memory in self._retired:
            # If the system does not support this, the memory is freed when its last user unmaps it.
            with contextlib.suppress(OSError):
                memory.give_back()
        self._retired = [memory for memory in self._retired if memory in used and memory.backed_bytes]

    def fitting(self, size: int) -> RingMemory | None:
        """Return the memory, after replacing it if its places are too small for ``size`` bytes.

        Return None if memory cannot be allocated. Call this with the lock held.
        """
        if self.memory and size <= self.memory.layout.place_size:
            return self.memory
        if self._is_off:
            return None
        self.retire()
        try:
            self.memory = RingMemory(ring.layout_for(size))
        except (OSError, ValueError) as error:
            self.turn_off(error)
        return self.memory

    def turn_off(self, error: Exception) -> None:
        """Use only sockets from now on. Call this with the lock held."""
        _log.debug("no shared memory for a topic's large messages: %s", error)
        self.trouble = f"the publisher has no memory for it: {ascii_text(error)}"
        self._is_off = True
        self.retire()

    def retire(self) -> None:
        """Stop using the current memory; it remains for subscribers that have mapped it. Call this with the lock held."""
        if self.memory:
            self.memory.close()
            self._retired.append(self.memory)
            self.memory = None
            self.give_back_retired()

    def close(self) -> None:
        """Use only sockets from now on, and stop the timer. Call this on the loop. Idempotent."""
        with self.lock:
            self._is_off = True
            self.retire()
            self._retired = []
        for file in list(self._closed):
            self._stop_waiting(file)
        if self._timer:
            self._timer.cancel()

    def note_use(self) -> None:
        """Record that the memory is in use, which postpones giving it back. Call this with the lock held."""
        self._was_used = True
        if not self._is_watched:
            self._is_watched = True
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._watch)

    def _watch(self) -> None:
        if not self._is_off or self._retired:
            self._timer = self._loop.call_later(QUIET_SECONDS, self._look)

    def _look(self) -> None:
        """Give back memory if no place was used since the last call."""
        with self.lock:
            self.collect()
            if self._was_used:
                self._was_used = False
            elif self.memory:
                try:
                    self.memory.give_back()
                except OSError as error:
                    self.turn_off(error)
            for file, (memory, _) in list(self._closed.items()):
                if memory not in self._retired:
                    self._stop_waiting(file)
            self._is_watched = bool(self._retired or (self.memory and self.memory.backed_bytes))
            if self._is_watched:
                self._watch()


class Sharing:
    """One message that is being sent to all subscribers. It is written once, into a place that is held until :meth:`close`."""

    def __init__(self, shared: SharedRing, frame: LargeFrame) -> None:
        self.frame = frame
        self._ring = shared
        # the message's place, and the memory that contains it, which may no longer be the ring's current memory
        self._memory: RingMemory | None = None
        self._place = 0

    def place_in(self, memory: RingMemory) -> int | None:
        """Return the message's place in ``memory``, after writing it there if necessary; None if no place is free."""
        if self._memory is memory:
            return self._place
        self.close()
        with self._ring.lock:
            if self._ring.memory is not memory:
                return None
            try:
                place = memory.take(self.frame.size)
            except OSError as error:
                self._ring.turn_off(error)
                return None
            if place is None:
                return None
            self._memory, self._place = memory, place
            self._ring.note_use()
        memory.fill(place, self.frame)
        return place

    def close(self) -> None:
        """Release this object's hold on the place. Each subscriber holds the place until it has read the message."""
        memory, self._memory = self._memory, None
        if memory:
            with self._ring.lock:
                memory.places.let_go(self._place)
                if memory is not self._ring.memory:
                    self._ring.give_back_retired()

    def __enter__(self) -> Sharing:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class RingSender:
    """The publisher's end of a connection. Hold the link's lock for every call except :meth:`answered` and :meth:`collect`."""

    def __init__(self, shared: SharedRing, sock: socket.socket) -> None:
        self.step = Step.NEW
        self.announced = 0  # number of messages that went through the ring
        self._trouble = ""  # the reason why the ring is not used, set with Step.OFF
        self._ring = shared
        self._sock = sock
        self._process = peer(sock).process
        self.memory: RingMemory | None = None  # the memory that was offered last
        self._counter = -1  # the eventfd in the last offer, which counts the subscriber's releases
        self._is_releasing = True  # whether the last wait for a release was successful

    def obstacle(self, large: int, last_size: int) -> str:
        """Return why messages go through the socket, or "" if most go through the ring.

        ``large``: the number of messages that are long enough for a ring; ``last_size``: the size of the last one.
        """
        if self.step is Step.OFF:
            return self._trouble
        if last_size > ring.MAX_MESSAGE:
            return f"messages over {ring.MAX_MESSAGE // 2**20} MB are too large for it"
        if not self.announced:
            return "the first messages use the socket"
        return "the subscriber reads more slowly than it is sent to" if 2 * self.announced < large else ""

    def announce(self, sharing: Sharing, *, may_wait: bool) -> bool:
        """Announce a message in the ring. Return False if the message must be sent through the socket.

        ``may_wait``: wait a few milliseconds for the subscriber to release a place. Raise OSError if the connection has failed.
        """
        step = self.step
        if step is Step.IN_USE:
            memory = self.memory
            assert memory is not None
            if memory is self._ring.memory and sharing.frame.size <= memory.layout.place_size:
                return self._announce(memory, sharing, may_wait=may_wait)
            step = self.step = Step.NEW
        try:
            # Change the step first, because the answer may arrive before this thread continues.
            if step is Step.NEW:
                self.step = Step.ASKED
                self._send(ring.prepare())
            elif step is Step.LISTENING:
                self._offer(sharing.frame.size)
        except (BlockingIOError, InterruptedError):
            self.step = step
        return False

    def answered(self, data: bytes) -> None:
        """Handle bytes that the subscriber has sent. Call this on the loop."""
        for byte in data:
            after = ring.ANSWERS.get((self.step, bytes((byte,))))
            # A publishing thread may change the step at the same time, but not from a step that waits for an answer.
            if after:
                self._trouble = (
                    "the subscriber cannot map the publisher's memory" if after is Step.OFF else ""
                )
                self.step = after

    def collect(self) -> None:
        """Free the places that the subscriber has released. Call this with the ring's lock held."""
        memory = self.memory
        if memory is None or not memory.places.held_by(self):
            return
        try:
            count = os.eventfd_read(self._counter)
        except BlockingIOError:
            return
        self._is_releasing = True
        if not memory.places.release(self, count):
            self._turn_off("the subscriber has released more than it held")

    def close(self) -> None:
        """Forget the connection. If the subscriber holds places, replace the ring, because the subscriber may still read them.

        Call this on the loop.
        """
        with self._ring.lock:
            self.collect()
            memory, self.memory = self.memory, None
            holds = memory is not None and memory.places.held_by(self)
            if holds and memory is self._ring.memory:
                self._ring.retire()
            self._ring.remove(self)
            if holds and memory:
                self._ring.release_at_exit(memory, self, self._process)
            self.step = Step.OFF
            self._close_counter()

    def _announce(self, memory: RingMemory, sharing: Sharing, *, may_wait: bool) -> bool:
        frame = sharing.frame
        places = memory.places
        with self._ring.lock:
            has_room = places.may_hold(self, frame.size)
        if not has_room and not (may_wait and self._wait_for_room(places, frame.size)):
            return False
        place = sharing.place_in(memory)
        if place is None:
            return False

        with self._ring.lock:
            places.hold(self, place, frame.size)
        try:
            self._send(
                ring.announcement(place * memory.layout.place_size, frame.size, frame.array, frame.rest)
            )
        except (BlockingIOError, InterruptedError):
            with self._ring.lock:
                places.take_back(self)
            return False
        self.announced += 1
        return True

    def _wait_for_room(self, places: Places, size: int) -> bool:
        """Wait briefly for the subscriber to release a place; return whether the subscriber may now hold another one.

        Return False immediately if the subscriber released no place during the last wait, and none since.
        """
        if not self._is_releasing:
            return False
        poll = select.poll()
        poll.register(self._counter, select.POLLIN)
        end = time.monotonic() + _WAIT_SECONDS
        while True:
            is_released = poll.poll(_WAIT_MS)
            with self._ring.lock:
                self.collect()
                if self.step is not Step.IN_USE:
                    return False
                if places.may_hold(self, size):
                    return True
            if not is_released or time.monotonic() > end:
                self._is_releasing = False
                return False

    def _offer(self, size: int) -> None:
        with self._ring.lock:
            memory = self._ring.fitting(size)
            if memory is None:
                self._turn_off(self._ring.trouble)
                return
            self._forget_memory()
            try:
                self._counter = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
            except OSError as error:
                # This process has reached its limit of open files.
                _log.debug("no shared memory for a connection: %s", error)
                self._turn_off(f"the publisher cannot open another file: {ascii_text(error)}")
                return
            self.memory = memory
            self._is_releasing = True
            self.step = Step.OFFERED
            files = array.array("i", [memory.read_only, self._counter])
            self._send(ring.offer(memory.layout.size), [(socket.SOL_SOCKET, socket.SCM_RIGHTS, files)])

    def _turn_off(self, trouble: str) -> None:
        """Use the socket only from now on."""
        self._trouble = trouble
        self.step = Step.OFF

    def _forget_memory(self) -> None:
        """Release all places of the previous ring. The subscriber had read them before it answered :data:`ring.READY`."""
        memory, self.memory = self.memory, None
        if memory:
            memory.places.release(self, memory.places.held_by(self))
            self._ring.give_back_retired()
        self._close_counter()

    def _send(self, data: bytes, ancillary: list[tuple[int, int, array.array[int]]] | None = None) -> None:
        """Send a few bytes. Raise OSError if the connection has failed, BlockingIOError if its buffer is full."""
        sent = self._sock.sendmsg([data], ancillary) if ancillary else self._sock.send(data)
        if sent != len(data):
            # Linux sends such a small number of bytes completely or not at all.
            raise OSError("a Unix socket has accepted a part of some bytes")

    def _close_counter(self) -> None:
        if self._counter >= 0:
            os.close(self._counter)
            self._counter = -1


def _seal(file: int) -> None:
    """Seal a file's size. Otherwise a process that has mapped the file is killed if another process shrinks it."""
    import fcntl

    fcntl.fcntl(file, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
