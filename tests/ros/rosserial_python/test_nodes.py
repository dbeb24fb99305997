"""serial_node.py with a device on a pseudo-terminal, and with one that connects over TCP."""

from __future__ import annotations

import asyncio
import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rosserial_msgs.msg import TopicInfo
from std_msgs.msg import String

from minirospy import Node
from minirospy.base.installation import install_command
from minirospy.ros.rosserial_python.devices.endpoints import to_bytes
from minirospy.ros.rosserial_python.devices.packets import Decoder, Packet, encode
from minirospy.ros.rosserial_python.devices.ports import SerialPort
from minirospy.workspace.packages import Packages
from tests.conftest import free_port
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, end
from tests.waiting import until

HERE = Path(__file__).parent
UNIX = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")
CHATTER, WORDS = 100, 101


def describe(endpoint: int, topic_id: int, name: str, size: int = 512) -> bytes:
    info = TopicInfo(topic_id, name, "std_msgs/String", String._md5sum, size)
    return encode(endpoint, to_bytes(info))


def say(text: str) -> bytes:
    return encode(CHATTER, to_bytes(String(text)))


@UNIX
def test_device_and_node_see_the_same_as_with_the_real_program(master: str) -> None:
    program = Packages().find_executable("rosserial_python", "serial_node.py")
    done = subprocess.run(
        [sys.executable, str(HERE / "drive.py"), *program],
        capture_output=True,
        text=True,
        timeout=110,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    recorded = (HERE / "drive.txt").read_text(encoding="utf-8")
    # These messages are Python's own and do not name a type.
    for python, ours in (
        ("no_such_msgs", "no_such_msgs/Thing"),
        ("module 'std_msgs.msg' has no attribute 'NoSuch'", "std_msgs/NoSuch"),
    ):
        line = f"Cannot import package of message type [{ours}]: build or install it on this side, too"
        recorded = recorded.replace(f"failed: {python}\n", f"failed: {line}\n")
    # The message is published once the node runs, even if the subscriber to /rosout is not connected yet.
    printed = done.stdout
    for early in ("log: 2 ROS Serial Python Node\n", "log: 2 Connecting to PORT at 57600 baud\n"):
        printed, recorded = printed.replace(early, ""), recorded.replace(early, "")
    assert printed == recorded


def packets(connection: socket.socket, decoder: Decoder, count: int) -> list[Packet]:
    found: list[object] = []
    while len(found) < count:
        data = connection.recv(4096)
        assert data
        found += decoder.feed(data)
    assert all(isinstance(each, Packet) for each in found)
    return found  # type: ignore[return-value]


@pytest.mark.parametrize("fork", ["false", "true"])
def test_devices_connect_by_tcp_one_after_the_other(start: Start, fork: str) -> None:
    port = free_port()
    process = start("rosserial_python", "serial_node.py", "tcp", str(port), f"_fork_server:={fork}")

    def connected() -> socket.socket | None:
        try:
            return socket.create_connection(("127.0.0.1", port), SECONDS)
        except OSError:
            return None

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            received = node.subscribe("chatter", String)
            words = node.advertise("words", String)
            for turn in ("first", "second"):
                device = await until(connected)
                assert device
                with device:
                    decoder = Decoder()
                    assert await asyncio.to_thread(packets, device, decoder, 1) == [(0, b"")]
                    device.sendall(describe(0, CHATTER, "chatter") + describe(1, WORDS, "words", 280))
                    await received.wait_for_publishers()
                    device.sendall(say(turn))
                    async for message in received:
                        assert message.data == turn
                        break
                    await words.wait_for_subscribers()
                    # The message is larger than the device's buffer, so it is dropped. The next one is received.
                    await words.publish(String("x" * 400))
                    await words.publish(String("short"))
                    (packet,) = await asyncio.to_thread(packets, device, decoder, 1)
                    assert packet == (WORDS, to_bytes(String("short")))
                await until(lambda: not (words.num_connections or received.num_connections))

    asyncio.run(asyncio.wait_for(body(), SECONDS * 2))
    output, errors = end(process)
    assert output.count("Client has exited, closing socket.") == 2
    assert "message larger than buffer (404 of 280 bytes)" in errors


@UNIX
def test_line_that_breaks_is_opened_again(start: Start, tmp_path: Path) -> None:
    import pty
    import tty

    def plug() -> tuple[int, int]:
        master, slave = pty.openpty()
        tty.setraw(slave)
        (tmp_path / "link").symlink_to(os.ttyname(slave))
        (tmp_path / "link").replace(tmp_path / "tty")
        return master, slave

    async def talk(device: int, text: str, received: object) -> None:
        decoder, found = Decoder(), []  # type: ignore[var-annotated]
        while not found:
            found += decoder.feed(await asyncio.to_thread(os.read, device, 100))
        os.write(device, describe(0, CHATTER, "chatter"))
        await received.wait_for_publishers()  # type: ignore[attr-defined]
        os.write(device, say(text))
        async for message in received:  # type: ignore[attr-defined]
            assert message.data == text
            break

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            received = node.subscribe("chatter", String)
            await talk(first[0], "first", received)
            for end_of_line in first:
                os.close(end_of_line)
            await until(lambda: not received.num_connections)
            second = plug()
            await talk(second[0], "second", received)
            os.close(second[0])
            os.close(second[1])

    first = plug()
    process = start("rosserial_python", "serial_node.py", f"_port:={tmp_path / 'tty'}", "_baud:=115200")
    asyncio.run(asyncio.wait_for(body(), SECONDS * 2))
    output, _ = end(process)
    assert output.count(f"Connecting to {tmp_path / 'tty'} at 115200 baud") >= 2


CLIENT = """
import rospy
from rosserial_python import SerialClient

class Line:
    '''A device that never says more than the start of a packet.'''
    data = b""
    def inWaiting(self):
        return len(self.data)
    def read(self, count):
        found, self.data = self.data[:count], self.data[count:]
        return found
    def write(self, data):
        print("written", bytes(data), flush=True)
        self.data = b"\\xff\\xfe\\x04"

rospy.init_node("client")
SerialClient(Line(), timeout=0.3).run()
"""


def test_silent_device_is_reported(master: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", CLIENT], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )

    async def body() -> None:
        async with Node("test", rosout=False) as node:
            seen = set()
            async for array in node.subscribe("/diagnostics", DiagnosticArray):
                (status,) = array.status
                assert (status.name, status.level) == ("rosserial_python", 2)
                assert [each.key for each in status.values] == ["last sync", "last sync lost"]
                assert status.values[0].value == "never"
                seen.add(status.message)
                if "no sync with device" in seen:
                    break

    try:
        asyncio.run(asyncio.wait_for(body(), SECONDS))
    finally:
        process.terminate()
        output, errors = process.communicate(timeout=SECONDS)
    assert r"written b'\xff\xfe\x00\x00\xff\x00\x00\xff'" in output
    assert "Last read step: message length" in errors
    assert "Returned short (expected 5 bytes, received 3 instead)." in errors
    assert "Unable to sync with device" in errors
    assert "Traceback" not in errors


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["/dev/null", "_baud:=fast"], "~baud and the port of TCP are whole numbers: "),
        (["tcp", "many"], "~baud and the port of TCP are whole numbers: "),
        (["tcp", "PORT"], "the port PORT of TCP cannot be had: "),
    ],
)
def test_node_that_cannot_be_run_is_one_line(start: Start, words: list[str], text: str) -> None:
    with socket.create_server(("", 0)) as taken:
        port = str(taken.getsockname()[1])
        process = start("rosserial_python", "serial_node.py", *(word.replace("PORT", port) for word in words))
        _, errors = process.communicate(timeout=SECONDS)
    assert process.returncode == 1
    assert text.replace("PORT", port) in errors
    assert "Traceback" not in errors


def test_missing_port_is_reported_and_waited_for(start: Start, tmp_path: Path) -> None:
    process = start("rosserial_python", "serial_node.py", str(tmp_path / "tty"))
    assert process.stderr
    line = process.stderr.readline()
    assert re.search(r"Error opening serial: .*No such file or directory", line)
    _, errors = end(process)
    assert process.returncode == 0
    assert "Traceback" not in errors


def test_missing_pyserial_names_what_to_install(master: str) -> None:
    module = "minirospy.ros.rosserial_python.devices.serial_node"
    code = f"import sys; sys.modules['serial'] = None; from {module} import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert f"serial ports need pyserial: {install_command('minirospy[serial]')}" in done.stderr
    assert "Traceback" not in done.stderr


def test_client_without_pyserial_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(ImportError, match="serial ports need pyserial"):
        SerialPort("/dev/ttyUSB0", 57600)


def test_message_info_service_says_that_it_is_not_needed(start: Start, master: str) -> None:
    process = start("rosserial_python", "message_info_service.py")
    assert process.stderr
    assert "The message info service node is no longer needed" in process.stderr.readline()
