"""Try shared memory in this process, as `minirospy doctor` does. Source: docs/shared_memory.md."""

from __future__ import annotations

import os
import socket

from minirospy.core.wire import ring
from minirospy.core.wire.framing import CHUNK, LargeFrame
from minirospy.runtime.transport.ring_receiver import RingReceiver
from minirospy.runtime.transport.ring_sender import RingMemory
from minirospy.runtime.transport.shared_memory import ascii_text, is_possible, why_impossible

__all__ = ["try_out"]


def try_out() -> str:
    """Try shared memory in this process: pass a sealed file through a socket, map it, and read a message from it.

    Return "" if that works, else the reason. It costs less than a millisecond.
    """
    if not is_possible():
        return why_impossible()
    try:
        return _pass_a_message()
    except (OSError, ValueError) as error:
        # A sandbox may forbid the calls, and a container may lack memory.
        return ascii_text(error)


def _pass_a_message() -> str:
    body = LargeFrame((bytes(range(256)), bytes(CHUNK)), 256 + CHUNK)
    memory = RingMemory(ring.layout_for(body.size))
    counter, receiver = -1, RingReceiver()
    one, other = socket.socketpair()
    with one, other:
        try:
            counter = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
            place = memory.take(body.size)
            assert place is not None
            memory.fill(place, body)
            socket.send_fds(one, [ring.offer(memory.layout.size)], [memory.read_only, counter])
            word = receiver.receive(other, len(ring.offer(0)))
            receiver.take_offer(other, word[-ring.OFFER_BYTES :])
            if one.recv(1) != ring.MAPPED:
                return "a file that another process passes cannot be mapped"
            word = ring.announcement(place * memory.layout.place_size, body.size, 0)
            is_same = receiver.read(word[-ring.ANNOUNCEMENT_BYTES :]) == b"".join(body.pieces)
            if not is_same or os.eventfd_read(counter) != 1:
                return "a message did not arrive as it was sent"
        finally:
            receiver.close()
            memory.close()
            if counter >= 0:
                os.close(counter)
    return ""
