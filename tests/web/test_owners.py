"""The owners of sockets on this machine, found by querying the kernel and by reading the table of all sockets."""

from __future__ import annotations

import os
import socket
import sys

import pytest

from minirospy.web.server import owners
from minirospy.web.server.owners import is_own_user, owner_of

needs_table = pytest.mark.skipif(sys.platform != "linux", reason="by Linux's sockets")


@needs_table
@pytest.mark.parametrize("way", ["query", "table"])
@pytest.mark.parametrize(
    ("family", "address", "client_family", "to"),
    [
        (socket.AF_INET, "127.0.0.1", socket.AF_INET, "127.0.0.1"),
        (socket.AF_INET6, "::1", socket.AF_INET6, "::1"),
        (socket.AF_INET, "127.0.0.1", socket.AF_INET6, "::ffff:127.0.0.1"),
    ],
)
def test_owner_of_a_socket_is_known_in_each_state(
    family: socket.AddressFamily,
    address: str,
    client_family: socket.AddressFamily,
    to: str,
    way: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if way == "table":
        monkeypatch.delattr(owners.socket, "AF_NETLINK")
    else:
        monkeypatch.setattr(owners, "_by_table", lambda *_: None)
    with socket.socket(family) as server, socket.socket(client_family) as client:
        try:
            server.bind((address, 0))
            server.listen()
            client.connect((to, server.getsockname()[1]))
        except OSError:
            pytest.skip("no such addresses here")
        accepted, peer = server.accept()
        with accepted:
            here = accepted.getsockname()
            own, other = (peer[0], peer[1]), (here[0], here[1])
            assert owner_of(own, other) == os.getuid()
            assert is_own_user(own, other)
            # The client's state is now FIN_WAIT, and it still reads.
            client.shutdown(socket.SHUT_WR)
            assert accepted.recv(1) == b""
            assert owner_of(own, other) == os.getuid()
            assert owner_of(own, (other[0], own[1])) is None
            assert owner_of(("127.0.0.7", own[1]), other) is None
            assert owner_of(own, ("127.0.0.7", other[1])) is None
            assert owner_of(("?", own[1]), other) is None
            assert owner_of(own, ("::2" if "." in own[0] else "127.0.0.1", other[1])) is None
            # A server listens on this endpoint, but has no such connection.
            assert owner_of(other, ("127.0.0.7" if "." in own[0] else "::2", own[1])) is None
            # The kernel lists a socket that no process has open as root's.
            client.close()
            assert owner_of(own, other) is None


def test_owners_are_unknown_on_other_systems(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(owners.sys, "platform", "darwin")
    monkeypatch.setattr(owners, "owner_of", lambda *_: pytest.fail("there is no table"))
    assert not is_own_user(("127.0.0.1", 1), ("127.0.0.1", 2))
