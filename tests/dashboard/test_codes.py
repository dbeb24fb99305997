"""Codes that a browser exchanges for the token, and the users of sockets."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable
from http.client import HTTPConnection
from typing import TYPE_CHECKING

import pytest

from minirospy.dashboard import codes
from minirospy.dashboard.codes import Codes, users_of

if TYPE_CHECKING:
    from tests.dashboard.conftest import Served


def test_code_is_used_once_within_a_minute() -> None:
    now = 0.0
    kept = Codes(lambda: now)
    first, second = kept.new("token-1"), kept.new("token-2")
    assert first != second
    assert (kept.redeem("x"), kept.redeem(first), kept.redeem(first)) == ("", "token-1", "")
    now = 61.0
    assert kept.redeem(second) == ""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="by Linux's table of sockets")
@pytest.mark.parametrize(("family", "address"), [(socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")])
def test_user_of_a_socket_is_known(family: socket.AddressFamily, address: str) -> None:
    with socket.socket(family) as server:
        try:
            server.bind((address, 0))
        except OSError:
            pytest.skip("no such addresses here")
        server.listen()
        with socket.create_connection(server.getsockname()[:2]) as client:
            port, own = server.getsockname()[1], client.getsockname()[1]
            assert users_of(own, port) == {os.getuid()}
            assert users_of(own, own) == set()


def exchanged(port: int, code: str) -> tuple[int, str]:
    connection = HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", "/token", headers={"Authorization": f"Bearer {code}"} if code else {})
    answer = connection.getresponse()
    found = answer.status, answer.read().decode()
    connection.close()
    return found


@pytest.mark.skipif(sys.platform == "win32", reason="users have no numbers there")
def test_code_is_exchanged_by_this_user_alone(
    serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = serve()
    assert served.dashboard
    kept = served.dashboard.codes
    code = kept.new("token-1")
    assert exchanged(served.port, "") == (403, "this link has been used\n")
    assert exchanged(served.port, code) == (200, "token-1")
    assert exchanged(served.port, code)[0] == 403
    monkeypatch.setattr(codes, "users_of", lambda port, peer_port: {os.getuid(), 4711})
    assert exchanged(served.port, kept.new("token-1"))[0] == 403
