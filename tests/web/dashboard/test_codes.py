"""Codes that a browser exchanges for the token, and the owners of sockets."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from minirospy.web.dashboard import codes
from minirospy.web.dashboard.codes import Codes

if TYPE_CHECKING:
    from tests.web.dashboard.conftest import Served

needs_table = pytest.mark.skipif(sys.platform != "linux", reason="by Linux's table of sockets")


def test_code_is_used_once_within_a_minute() -> None:
    now = 0.0
    kept = Codes(lambda: now)
    first, second = kept.new("token-1"), kept.new("token-2")
    assert first != second
    # 22 base64 characters represent 128 bits.
    assert len(first) == 22
    assert (kept.token_of(first), kept.token_of(first), kept.token_of("x")) == ("token-1", "token-1", "")
    assert (kept.redeem("x"), kept.redeem(first), kept.redeem(first)) == ("", "token-1", "")
    now = 59.9
    assert kept.token_of(second) == "token-2"
    now = 60.0
    assert kept.token_of(second) == kept.redeem(second) == ""


def test_end_of_a_code_is_reported_once() -> None:
    now = 0.0
    kept, ended = Codes(lambda: now), []
    names = {kept.new("token"): name for name in ("used", "expired", "forgotten", "unknown")}
    used, expired, forgotten, unknown = names
    kept.redeem(unknown)
    for code, name in names.items():
        kept.when_ended(code, lambda name=name: ended.append(name))  # type: ignore[misc]
    assert ended == ["unknown"]
    kept.redeem(used)
    assert ended == ["unknown", "used"]
    now = 30.0
    kept.redeem(forgotten)
    last = kept.new("token")
    kept.when_ended(last, lambda: ended.append("last"))
    now = 60.0
    kept.forget_expired()
    assert ended == ["unknown", "used", "forgotten", "expired"]
    assert kept.redeem(expired) == ""
    kept.close()
    kept.close()
    assert ended[4:] == ["last"]
    kept.when_ended(kept.new("token"), lambda: ended.append("oldest"))
    now = 120.0
    kept.new("token")
    assert ended[5:] == ["oldest"]


def exchanged(port: int, code: str, *, half_closes: bool = False) -> tuple[int, str]:
    head = f"GET /token HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAuthorization: Bearer {code}\r\n\r\n"
    with socket.create_connection(("127.0.0.1", port), 60) as sock:
        sock.sendall(head.encode())
        if half_closes:
            sock.shutdown(socket.SHUT_WR)
        data = b""
        while more := sock.recv(65536):
            data += more
    answer, _, body = data.decode().partition("\r\n\r\n")
    return int(answer.split()[1]), body


@needs_table
@pytest.mark.parametrize("half_closes", [False, True])
def test_code_is_exchanged_by_this_user_alone(
    half_closes: bool, serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    served = serve()
    assert served.dashboard
    kept = served.dashboard.codes
    code = kept.new("token-1")
    assert exchanged(served.port, "", half_closes=half_closes) == (403, "this link has been used\n")
    # None means that the client's socket is not found, as in another network namespace.
    for owner in (os.getuid() + 4711, None):
        monkeypatch.setattr(codes, "owner_of", lambda end, other_end, owner=owner: owner)
        status, text = exchanged(served.port, code, half_closes=half_closes)
        assert (status, text.count("\n")) == (403, 1)
        assert text == "this code is for the user who started the dashboard, on this machine\n"
    monkeypatch.undo()
    # A refused attempt has not used up the code.
    assert exchanged(served.port, code, half_closes=half_closes) == (200, "token-1")
    assert exchanged(served.port, code, half_closes=half_closes)[0] == 403


@needs_table
@pytest.mark.parametrize("half_closes", [False, True])
def test_another_user_does_not_get_the_token(
    half_closes: bool, serve: Callable[..., Served], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The dashboard pretends to run as another user, so that the socket table shows the client as a different user."""
    served = serve()
    assert served.dashboard
    monkeypatch.setattr(codes, "ROOT_UID", -1)
    monkeypatch.setattr(codes.os, "getuid", lambda: 4711)
    code = served.dashboard.codes.new("token-1")
    assert exchanged(served.port, code, half_closes=half_closes)[0] == 403


@pytest.mark.skipif(
    sys.platform != "linux" or os.getuid() != 0, reason="only root has processes of two users"
)
@pytest.mark.parametrize("half_closes", ["", "client.shutdown(socket.SHUT_WR)"])
def test_process_of_another_user_does_not_get_the_token(
    half_closes: str, serve: Callable[..., Served]
) -> None:
    served = serve()
    assert served.dashboard
    code = served.dashboard.codes.new("token-1")
    program = f"""
import encodings.idna, os, socket
os.setuid(65534)
client = socket.create_connection(("127.0.0.1", {served.port}))
client.sendall(b"GET /token HTTP/1.1\\r\\nHost: localhost\\r\\nAuthorization: Bearer {code}\\r\\n\\r\\n")
{half_closes}
print(client.makefile().read())
"""
    found = subprocess.run(
        [sys.executable, "-c", program], check=False, capture_output=True, text=True, timeout=60
    )
    assert found.stdout.startswith("HTTP/1.1 403"), found
    assert served.dashboard.codes.redeem(code) == "token-1"
