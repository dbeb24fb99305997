"""`minirospy bridge` and `rosrun foxglove_bridge foxglove_bridge` as processes."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from minirospy.base.environment import Environment
from minirospy.base.errors import BridgeError
from minirospy.base.installation import install_command
from minirospy.cli import bridge as command
from minirospy.web.addresses import links, own_addresses, qr_code
from minirospy.web.foxglove.node import options_of
from minirospy.web.serve import LIBRARIES
from minirospy.web.tokens import kept_tokens, read_tokens
from tests.conftest import free_port
from tests.web.conftest import Client

PACKAGES = Path(command.__file__).parents[1] / "ros"
Start = Callable[..., "Process"]


class Process:
    """A bridge as a process, and the lines that it has printed."""

    def __init__(self, words: tuple[str, ...]) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "minirospy", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.lines: list[str] = []

    def line(self, part: str) -> str:
        """Return the first line that contains ``part``."""
        assert self._process.stdout
        while not any(part in each for each in self.lines):
            line = self._process.stdout.readline()
            assert line, self.lines
            self.lines.append(line.rstrip())
        return next(each for each in self.lines if part in each)

    @property
    def port(self) -> int:
        found = re.search(r"wss?://[^ ]*:(\d+)", self.line("Foxglove protocol at"))
        assert found
        return int(found[1])

    def end(self, number: int = signal.SIGTERM) -> int:
        """Send a signal; return the exit status."""
        if self._process.poll() is None:
            self._process.send_signal(number)
        output, _ = self._process.communicate(timeout=60)
        self.lines += output.splitlines()
        return self._process.returncode


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Return a function that starts a command."""
    started: list[Process] = []

    def starting(*words: str) -> Process:
        started.append(Process(words))
        return started[-1]

    yield starting
    for each in started:
        each.end()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another process")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_bridge_prints_its_links_serves_and_ends_with_status_0(start: Start, number: int) -> None:
    process = start("bridge", "--port", "0")
    port = process.port
    address = f"ws%3A%2F%2Flocalhost%3A{port}"
    assert process.line("open in Foxglove:").endswith(f"?ds=foxglove-websocket&ds.url={address}")
    assert process.line("open in Lichtblick:").endswith(f"?ds=foxglove-websocket&ds.url={address}")
    client = Client(port)
    client.next("serverInfo")
    client.close()
    assert process.end(number) == 0
    assert not [line for line in process.lines if "Traceback" in line]


def test_listening_bridge_requires_the_token_that_it_prints(
    start: Start, capsys: pytest.CaptureFixture[str]
) -> None:
    process = start("bridge", "--port", "0", "--listen", "--address", "127.0.0.1")
    port = process.port
    with pytest.raises(InvalidStatus):
        Client(port)
    process.line("read-write, rosbridge:")
    # Every address that is printed has its token, also those of rosbridge.
    printed = [line for line in process.lines if "ws://" in line]
    assert len(printed) == 5
    assert all("/?token=" in line for line in printed)
    for line in [process.lines[process.lines.index(process.line("read-only, Foxglove protocol:")) + 1]]:
        found = re.search(r"ws://\S+/\?token=(\S+)$", line)
        assert found
        client = Client(port, path=f"/?token={found[1]}")
        assert "clientPublish" not in client.next("serverInfo")["capabilities"]
        # The tokens are in a file that belongs to this user, from which --status reads them.
        assert command.main(["--status", "--port", str(port)]) == 0
        out = capsys.readouterr().out
        assert "127.0.0.1 (foxglove, read-only," in out
        assert found[1] not in out
        client.close()
    assert command.main(["--show-tokens"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_status_is_also_json(start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    port = start("bridge", "--port", "0", "--name", "endpoint").port
    assert command.main(["--status", "--json", "--port", str(port)]) == 0
    assert json.loads(capsys.readouterr().out)["node"] == "/endpoint"


def test_status_lists_all_ports_of_a_bridge(start: Start, capsys: pytest.CaptureFixture[str]) -> None:
    process = start("bridge", "--port", "0")
    port = process.port
    found = re.search(r":(\d+)$", process.line("rosbridge at ws://"))
    assert found
    other = found[1]
    for words in ([str(port)], [other], [str(port), "--rosbridge-port", other]):
        assert command.main(["--status", "--port", *words]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert lines[0].startswith("node [/minirospy_bridge], for ")
        assert lines[1].startswith(f"foxglove: ws://127.0.0.1:{port}, ")
        assert lines[2].startswith(f"rosbridge: ws://127.0.0.1:{other}, ")
        assert lines[3] == f"video: http://127.0.0.1:{port}, http://127.0.0.1:{other}"
        assert len(lines) == 5
    assert command.main(["--status", "--json", "--port", str(port), "--rosbridge-port", other]) == 0
    (status,) = json.loads(capsys.readouterr().out)
    assert sorted(status["endpoints"]) == ["foxglove", "rosbridge"]


def test_status_shows_what_answers_and_names_what_refuses(
    start: Start, capsys: pytest.CaptureFixture[str]
) -> None:
    port = start("bridge", "--port", "0", "--name", "open").port
    locked = start("bridge", "--port", "0", "--name", "locked", "--token", "right-token-000").port
    assert command.main(["--status", "--port", str(port), "--rosbridge-port", str(locked)]) == 1
    output = capsys.readouterr()
    assert output.out.startswith("node [/open]")
    assert output.err.count("\n") == 1
    assert f"the bridge at port {locked} wants its token: give --token" in output.err


def test_status_names_what_is_wrong_in_one_line(
    start: Start, capsys: pytest.CaptureFixture[str], master: str
) -> None:
    def refusal(*words: str) -> str:
        assert command.main(["--status", *words]) == 1
        output = capsys.readouterr()
        assert output.out == ""
        assert output.err.count("\n") == 1
        return output.err

    port = start("bridge", "--port", "0", "--token", "right-token-000").port
    assert command.main(["--status", "--port", str(port), "--token", "right-token-000"]) == 0
    assert "right-token-000" not in capsys.readouterr().out
    assert f"the bridge at port {port} wants its token: give --token" in refusal("--port", str(port))
    wrong = refusal("--port", str(port), "--token", "wrong-token-000")
    assert f"the token is not one of the bridge at port {port}: give --token as it was started with" in wrong
    assert "wrong-token-000" not in wrong
    kept = kept_tokens(Environment.read().home)
    refused = refusal("--port", str(port))
    assert f"the bridge at port {port} was started with another token: give --token" in refused
    assert kept.read not in refused
    none = free_port()
    assert f"no bridge answers at port {none} of this machine" in refusal("--port", str(none))
    other = master.rpartition(":")[2].strip("/")
    assert f"port {other} is that of another program" in refusal("--port", other)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--port", "70000"], "--port 70000 is not between 0 and 65535"),
        (["--address", "0.0.0.0"], "add --listen"),
        (["--json"], "--json is for --status"),
        (["--connections", "0"], "--connections 0 is not between"),
        (["--token", "short"], "a token has 8 to 200 characters"),
        (["--token", ""], "--token wants a token of 8 to 200 characters, and got an empty one"),
        (["--read-token", ""], "--read-token wants a token"),
        (["--cert", "/none.pem", "--port", "0"], "none.pem: No such file"),
        (["--status", "--port", "1"], "no bridge answers at port 1"),
    ],
)
def test_wrong_words_are_refused_with_one_line(
    words: list[str], text: str, master: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command.main(words) in (1, 2)
    errors = capsys.readouterr().err
    assert text in errors
    assert "Traceback" not in errors


def test_missing_library_is_named_with_the_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "websockets", None)
    monkeypatch.setitem(sys.modules, "websockets.server", None)
    assert command.main([]) == 1
    assert install_command(*LIBRARIES) in capsys.readouterr().err


@pytest.mark.parametrize(
    ("package", "program"),
    [
        ("foxglove_bridge", "foxglove_bridge"),
        ("rosbridge_server", "rosbridge_websocket"),
        ("web_video_server", "web_video_server"),
    ],
)
def test_missing_library_ends_a_node_in_one_line(package: str, program: str) -> None:
    path = PACKAGES / package / "nodes" / program
    without = f"import runpy, sys; sys.modules['websockets'] = None; runpy.run_path({str(path)!r}, run_name='__main__')"
    done = subprocess.run(
        [sys.executable, "-c", without], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"{program}: ERROR: the bridge needs the library websockets")
    assert install_command(*LIBRARIES) in done.stderr
    assert done.stderr.count("\n") == 1


def test_launch_file_starts_the_bridge_with_its_arguments(start: Start, master: str) -> None:
    port = free_port()
    words = [f"port:={port}", "topic_whitelist:=['/ros.*']", "capabilities:=[assets]", "max_qos_depth:=5"]
    process = start("launch", "foxglove_bridge", "foxglove_bridge.launch", *words)
    process.line(f"Foxglove protocol at ws://127.0.0.1:{port}")
    client = Client(port)
    assert client.next("serverInfo")["capabilities"] == ["assets"]
    client.channel("/rosout")
    assert all(topic.startswith("/ros") for topic in client.channels)
    client.close()


@pytest.mark.parametrize(
    ("private", "text"),
    [
        ({"port": "x"}, "parameter ~port is 'x': it has to be of type int"),
        ({"port": True}, "of type int"),
        ({"tls": True}, "~certfile and ~keyfile"),
        ({"topic_whitelist": "x"}, "has to be a list of strings"),
        ({"topic_whitelist": ["("]}, "not a regular expression"),
        ({"capabilities": ["fly"]}, "~capabilities: fly: known are clientPublish"),
    ],
)
def test_wrong_parameters_of_the_node_are_named(private: dict[str, Any], text: str) -> None:
    with pytest.raises(BridgeError, match=re.escape(text)):
        options_of(private, {})


def test_node_beyond_loopback_takes_the_users_tokens(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    options = options_of({"address": "0.0.0.0"}, {})
    assert options.access.requires_token
    assert read_tokens(tmp_path) == (options.access.write_token, options.access.read_token)
    given = options_of({"address": "0.0.0.0"}, {"MINIROSPY_BRIDGE_READ_TOKEN": "look-only-token"})
    assert (given.access.read_token, given.access.write_token) == ("look-only-token", "")


@pytest.mark.parametrize("words", [("--token", "right-token-000"), ()])
def test_links_with_a_token_do_not_name_localhost(
    words: tuple[str, ...], start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another user's server may respond at ::1, which a client may try first."""
    if not words:
        monkeypatch.setenv("MINIROSPY_BRIDGE_TOKEN", "right-token-000")
    process = start("bridge", "--port", "0", *words)
    process.line("read-write, rosbridge:")
    local = f"ws://127.0.0.1:{process.port}/?token=right-token-000"
    assert [line for line in process.lines if str(process.port) in line][:2] == [
        f"Foxglove protocol at {local}",
        f"  {local}",
    ]
    assert not [line for line in process.lines if "localhost" in line]


def test_links_carry_the_address_and_codes_the_token() -> None:
    found = links(["::1", "10.0.0.5"], 8765, encrypted=True)
    assert found.websocket == ["wss://[::1]:8765", "wss://10.0.0.5:8765"]
    assert found.foxglove.endswith("ds.url=wss%3A%2F%2F%5B%3A%3A1%5D%3A8765")
    assert all(not address.startswith("127.") for address in own_addresses())
    code = qr_code("ws://10.0.0.5:8765/?token=abcdefgh")
    assert len(code.splitlines()) > 10
