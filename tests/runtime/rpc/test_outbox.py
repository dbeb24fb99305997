"""Data queued for a socket that is not writable: sent in order, counted, and discarded."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

import pytest

from minirospy.runtime.rpc.outbox import MAX_UNREAD, Outbox


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    with contextlib.ExitStack() as stack:
        ours, peer = socket.socketpair()
        stack.enter_context(ours)
        stack.enter_context(peer)
        ours.setblocking(False)
        peer.setblocking(False)
        yield ours, peer


def read(peer: socket.socket) -> bytes:
    data = b""
    with contextlib.suppress(BlockingIOError):
        while more := peer.recv(1 << 20):
            data += more
    return data


def test_data_accepted_by_the_socket_does_not_wait(pair: tuple[socket.socket, socket.socket]) -> None:
    out = Outbox(pair[0])
    assert out.write([b"one"]) == 0
    assert not out
    assert read(pair[1]) == b"one"


def test_pieces_arrive_in_order_though_the_socket_is_full(pair: tuple[socket.socket, socket.socket]) -> None:
    out = Outbox(pair[0])
    pieces = [bytes([number]) * MAX_UNREAD for number in range(8)]
    kept = out.write(pieces) + out.write([b"last"])
    assert kept == out.size > 0

    arrived = b""
    while out:
        arrived += read(pair[1])
        kept -= out.flush()
        assert kept == out.size
    assert arrived + read(pair[1]) == b"".join(pieces) + b"last"


def test_a_cleared_outbox_returns_how_much_it_held(pair: tuple[socket.socket, socket.socket]) -> None:
    out = Outbox(pair[0])
    kept = out.write([bytes(8 * MAX_UNREAD)])
    assert out.clear() == kept > 0
    assert not out
    assert out.flush() == 0


def test_a_lost_peer_leaves_the_count_to_the_caller(pair: tuple[socket.socket, socket.socket]) -> None:
    out = Outbox(pair[0])
    kept = out.write([bytes(8 * MAX_UNREAD)])
    pair[1].close()
    with pytest.raises(ConnectionError):
        out.flush()
    assert out.clear() == kept
