"""SO_LINGER on Zenoh's links: removed from Zenoh's sockets, and from no others."""

from __future__ import annotations

import asyncio
import socket
import struct
import sys
from pathlib import Path

import pytest

from minirospy.fleet.network import FleetNetwork, NetworkOptions
from minirospy.zenoh.linger import LingerRemover
from tests.conftest import free_port
from tests.waiting import until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows lists no open files")


def linger_of(sock: socket.socket) -> tuple[int, int]:
    on, seconds = struct.unpack("ii", sock.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8))
    return on, seconds


def test_only_links_with_the_linger_of_zenoh_lose_it(tmp_path: Path) -> None:
    remover = LingerRemover()
    remover.look()
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
    with left, right, socket.socket() as zenohs, socket.socket() as others, (tmp_path / "x").open("w"):
        zenohs.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 10))
        others.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 3))
        assert remover.look() == 1
        assert linger_of(zenohs)[0] == 0
        assert linger_of(others) == (1, 3)
        assert remover.look() == 0


def test_link_whose_linger_is_set_after_a_look_loses_it() -> None:
    remover = LingerRemover()
    with socket.socket() as zenohs:
        remover.look()
        zenohs.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 10))
        remover.look()
        assert linger_of(zenohs)[0] == 0


def test_links_of_a_router_do_not_linger(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also a test of Zenoh: if it sets another linger time, or none, no socket is found."""
    found: list[int] = []
    look = LingerRemover.look

    def looked(self: LingerRemover) -> int:
        found.append(look(self))
        return found[-1]

    monkeypatch.setattr(LingerRemover, "look", looked)
    monkeypatch.setattr("minirospy.fleet.network.LINGER_SECONDS", 0.05)
    monkeypatch.setattr("minirospy.zenoh.linger.LOOKS", 10_000)

    async def run() -> None:
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        router = await FleetNetwork.open(NetworkOptions(listen=(endpoint,)))
        robot = await FleetNetwork.open(NetworkOptions(connect=(endpoint,)))
        # Both sockets of the link are in this process. Links of earlier tests may be counted, too.
        await until(lambda: sum(found) >= 2)
        await robot.close()
        await router.close()

    asyncio.run(run())
