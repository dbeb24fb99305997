"""A publisher that uses raw sockets to send hostile text in its connection header and messages."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from minirospy.core.wire.framing import serialize_frame
from minirospy.core.wire.header import serialize_header
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.cli.conftest import BIN

MARK = "OWNED"


class HostilePublisher:
    """A node of raw sockets: it responds to every XML-RPC call as to requestTopic, and to every connection with its header."""

    def __init__(self, header: dict[str, str], messages: list[bytes]) -> None:
        self._reply = serialize_header(header) + b"".join(map(serialize_frame, messages))
        self._rpc = socket.create_server(("127.0.0.1", 0))
        self._data = socket.create_server(("127.0.0.1", 0))
        self._kept: list[socket.socket] = []
        self.uri = f"http://127.0.0.1:{self._rpc.getsockname()[1]}/"
        for server, serve in ((self._rpc, self._answer), (self._data, self._stream)):
            threading.Thread(target=self._accept, args=(server, serve), daemon=True).start()

    def close(self) -> None:
        """Close all sockets, which makes the threads exit."""
        for each in (self._rpc, self._data, *self._kept):
            each.close()

    def _accept(self, server: socket.socket, serve: object) -> None:
        assert callable(serve)
        while True:
            try:
                connection, _ = server.accept()
            except OSError:
                return
            self._kept.append(connection)
            try:
                serve(connection)
            except OSError:
                continue

    def _answer(self, connection: socket.socket) -> None:
        request = b""
        while b"</methodCall>" not in request:
            part = connection.recv(65536)
            if not part:
                return
            request += part
        port = self._data.getsockname()[1]
        text = (
            "<?xml version='1.0'?><methodResponse><params><param><value><array><data><value><int>1</int></value>"
            "<value><string>ready</string></value><value><array><data><value><string>TCPROS</string></value>"
            f"<value><string>127.0.0.1</string></value><value><int>{port}</int></value></data></array></value>"
            "</data></array></value></param></params></methodResponse>"
        )
        head = f"HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {len(text)}\r\n\r\n"
        connection.sendall((head + text).encode())

    def _stream(self, connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(self._reply)


@pytest.fixture
def hostile(master: str, request: pytest.FixtureRequest) -> Iterator[HostilePublisher]:
    """Return a publisher of /evil with the parameter's header and messages; the master knows a harmless type for it."""
    header, messages = request.param
    publisher = HostilePublisher(header, messages)
    proxy = MasterProxy(master, "/evil_node")
    proxy.register_publisher("/evil", "std_msgs/String", publisher.uri)
    try:
        yield publisher
    finally:
        proxy.close()
        publisher.close()


def attack(type_: str, definition: str = "int32 a\n") -> tuple[dict[str, str], list[bytes]]:
    """Return a parameter for the fixture ``hostile``."""
    header = {"type": type_, "md5sum": "0" * 32, "message_definition": definition, "callerid": "/evil_node"}
    return header, [bytes(4)] * 5


CODE = f"__import__('os').system('echo x > {MARK}')"
SEPARATOR = "=" * 80
ATTACKS = [
    attack(f'x"+str({CODE})+"y/B'),
    attack(f"x/B(genpy.Message):\n  {CODE}\nclass C"),
    attack("p/M", f'x"+str({CODE})+"y/B a\n{SEPARATOR}\nMSG: x"+str({CODE})+"y/B\nint32 a\n'),
    attack("p/M", f'int32 a\n{SEPARATOR}\nMSG: x"+str({CODE})+"y/B\nint32 a\n'),
    attack("p/M", f'int32 a\nstring X="""+{CODE}+"""\\'),
    attack("evil_module/M"),
]
ECHO = ("rostopic", "echo", "-n", "1")
CASES = [
    *((each, ECHO) for each in ATTACKS),
    (ATTACKS[0], ("rostopic", "echo", "-p", "-n", "1")),
    (ATTACKS[0], ("rostopic", "hz", "--filter", "m.a == 0", "-w", "3")),
    (ATTACKS[0], ("rostopic", "delay", "-w", "3")),
]


@pytest.mark.parametrize(
    ("hostile", "words"),
    CASES,
    indirect=["hostile"],
    ids=[f"{n}_{words[1]}" for n, (_, words) in enumerate(CASES)],
)
def test_no_command_runs_the_code_of_a_publisher(
    hostile: HostilePublisher, words: tuple[str, ...], tmp_path: Path
) -> None:
    name, verb, *options = words
    (tmp_path / "evil_module.py").write_text(f"open({MARK!r}, 'w').close()\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [str(BIN / name), verb, *options, "/evil"]
    # Each command exits, either because the definition is refused, or after the one message that it waits for.
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60, check=False
    )
    out, err = done.stdout, done.stderr

    assert not (tmp_path / MARK).exists()
    assert "Traceback" not in err
    assert "Exception" not in err
    assert len(err.splitlines()) <= 2
    assert not re.search(r"[\x00-\x08\x0b-\x1f]", err)
    assert out or err
