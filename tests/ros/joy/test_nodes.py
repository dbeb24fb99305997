"""joy_node and teleop_node as nodes, with a simulated device."""

from __future__ import annotations

import asyncio
import os
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy

from minirospy import Node
from minirospy.base.installation import install_command
from minirospy.ros.joy import devices
from minirospy.ros.joy.devices import DeviceError, PygameDevice, find_by_name, open_device
from minirospy.ros.joy.joystick import EVENT_AXIS, EVENT_BUTTON, EVENT_INIT, Event
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import SECONDS, Start, end

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are Unix's")


class Pad:
    """A pseudo-terminal that sends joystick events."""

    def __init__(self, link: Path) -> None:
        import pty
        import tty

        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self._link = link
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._slave))
        self._is_open = True

    def send(self, kind: int, number: int, value: int) -> None:
        os.write(self._master, struct.pack("<IhBB", 0, value, kind, number))

    def unplug(self) -> None:
        if self._is_open:
            self._is_open = False
            # Remove the link, because the next pseudo-terminal of any process may get the same name.
            self._link.unlink(missing_ok=True)
            os.close(self._slave)
            os.close(self._master)


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[Pad]:
    pad = Pad(tmp_path / "js0")
    yield pad
    pad.unplug()


def test_device_gives_events_and_its_end(tmp_path: Path, pad: Pad) -> None:
    device = open_device(str(tmp_path / "js0"))
    assert device.name == "Unknown"
    assert device.wait(0) is None
    pad.send(EVENT_AXIS, 3, -32767)
    pad.send(EVENT_BUTTON, 1, 1)
    assert device.wait(SECONDS) == (EVENT_AXIS, 3, -32767)
    assert device.wait(SECONDS) == (EVENT_BUTTON, 1, 1)
    pad.unplug()
    with pytest.raises(DeviceError):
        device.wait(SECONDS)
    device.close()


def test_files_that_are_not_joysticks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="No such file"):
        devices.LinuxDevice(str(tmp_path / "js7"))
    (tmp_path / "js1").write_bytes(b"abc")
    device = devices.LinuxDevice(str(tmp_path / "js1"))
    with pytest.raises(DeviceError, match="no device is at the other end"):
        device.wait(SECONDS)
    device.close()
    assert list(find_by_name(tmp_path)) == []


def test_pad_drives_a_robot_and_may_be_plugged_in_again(start: Start, tmp_path: Path, pad: Pad) -> None:
    link = tmp_path / "js0"
    process = start("joy", "joy_node", f"_dev:={link}", "_coalesce_interval:=0.05", "_deadzone:=0.0")
    start("teleop_twist_joy", "teleop_node", "_scale_linear:=0.8")

    async def body(node: Node) -> None:
        twists = node.subscribe("cmd_vel", Twist)
        await twists.wait_for_publishers()
        states = node.subscribe("joy", Joy)
        await states.wait_for_publishers()
        async for array in node.subscribe("/diagnostics", DiagnosticArray):
            (status,) = array.status
            assert status.name == "joy_node: Joystick Driver Status"
            if status.message == "OK":
                break
        moving = asyncio.ensure_future(first_motion(twists))
        # Repeat until teleop_node, which publishes before it subscribes, has received a state.
        while not moving.done():
            second = await press(pad, states)
            assert second.header.frame_id == str(link)
            await asyncio.wait({moving}, timeout=0.2)
        assert moving.result() == pytest.approx(0.8)

        pad.unplug()
        async for array in node.subscribe("/diagnostics", DiagnosticArray):
            if array.status[0].message == "Joystick not open.":
                break
        again = Pad(link)
        try:
            assert list((await press(again, states)).buttons) == [1]
        finally:
            again.unplug()

    async def press(pad: Pad, states: object) -> Joy:
        """Press button 0 until a state shows it, because events are lost while the device is being opened."""
        waiting = asyncio.ensure_future(first(states))
        while not waiting.done():
            pad.send(EVENT_AXIS, 1, -32767)
            pad.send(EVENT_BUTTON, 0, 1)
            await asyncio.wait({waiting}, timeout=0.2)
        return waiting.result()

    async def first_motion(twists: object) -> float:
        async for twist in twists:  # type: ignore[attr-defined]
            if twist.linear.x:
                return float(twist.linear.x)
        raise AssertionError

    async def first(states: object) -> Joy:
        async for state in states:  # type: ignore[attr-defined]
            if list(state.buttons) == [1] and list(state.axes) == [0, 1]:
                return state
        raise AssertionError

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            await asyncio.wait_for(body(node), SECONDS)

    asyncio.run(main())
    output, errors = end(process)
    assert f"Opened joystick: {link} (Unknown). deadzone_: 0.000000." in output
    assert "Connection to joystick device lost unexpectedly. Will reopen." in errors
    assert "joy_node shut down." in output


def test_missing_device_is_one_line_and_waited_for(start: Start, tmp_path: Path) -> None:
    process = start("joy", "joy_node", f"_dev:={tmp_path}/js0", "_dev_name:=No such pad")

    async def main() -> None:
        async with Node("test", rosout=False) as node:
            async for array in node.subscribe("/diagnostics", DiagnosticArray):
                assert array.status[0].level == 2
                break

    # The first diagnostics are published before the device is opened.
    assert process.stderr
    first = ""
    while "Will retry every second." not in first:
        line = process.stderr.readline()
        assert line, first
        first += line
    asyncio.run(asyncio.wait_for(main(), SECONDS))
    _, rest = end(process)
    errors = first + rest
    assert "Couldn't find a joystick with name No such pad. Falling back to default device." in errors
    assert errors.count(f"Couldn't open joystick {tmp_path}/js0. Will retry every second.") == 1
    assert process.returncode == 0


def test_programs_publish_the_same_as_real_ones(master: str) -> None:
    programs = [
        Packages().find_executable(*words)[-1]
        for words in (("joy", "joy_node"), ("teleop_twist_joy", "teleop_node"))
    ]
    command = [sys.executable, str(HERE / "drive.py"), *programs, sys.executable, "usual", "turbo"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=110, check=False)
    assert done.returncode == 0, done.stderr
    recorded = (HERE / "drive.txt").read_text(encoding="utf-8")
    for part in ("joy_node usual\n", "teleop_node turbo\n"):
        lines = recorded.partition(part)[2].splitlines()
        expected = lines[: next(at for at, line in enumerate(lines) if not line.startswith(" "))]
        found = done.stdout.partition(part)[2].splitlines()[: len(expected)]
        assert found == expected


class FakeStick:
    """A simulated pygame joystick."""

    def __init__(self) -> None:
        self.axes, self.buttons, self.hats = [0.5, -1.0], [0, 1], [(0, 1)]

    def get_name(self) -> str:
        return "Fake"

    def get_init(self) -> bool:
        return True

    def get_instance_id(self) -> int:
        return 7

    def get_numaxes(self) -> int:
        return len(self.axes)

    def get_axis(self, at: int) -> float:
        return self.axes[at]

    def get_numbuttons(self) -> int:
        return len(self.buttons)

    def get_button(self, at: int) -> int:
        return self.buttons[at]

    def get_numhats(self) -> int:
        return len(self.hats)

    def get_hat(self, at: int) -> tuple[int, int]:
        return self.hats[at]

    def quit(self) -> None:
        pass


def fake_pygame(stick: FakeStick, removed: list[object]) -> SimpleNamespace:
    joystick = SimpleNamespace(
        init=lambda: None, quit=lambda: None, get_count=lambda: 1, Joystick=lambda _number: stick
    )
    event = SimpleNamespace(pump=lambda: None, get=lambda _kind: removed)
    return SimpleNamespace(
        init=lambda: None, joystick=joystick, event=event, JOYDEVICEREMOVED=1, error=RuntimeError
    )


def test_pygame_gives_the_events_of_linux(monkeypatch: pytest.MonkeyPatch) -> None:
    stick, removed = FakeStick(), []  # type: ignore[var-annotated]
    monkeypatch.setitem(sys.modules, "pygame", fake_pygame(stick, removed))
    device = PygameDevice(0)
    first = [device.wait(0) for _ in range(6)]
    assert first == [
        Event(EVENT_BUTTON | EVENT_INIT, 0, 0),
        Event(EVENT_BUTTON | EVENT_INIT, 1, 1),
        Event(EVENT_AXIS | EVENT_INIT, 0, 16384),
        Event(EVENT_AXIS | EVENT_INIT, 1, -32767),
        # Up on a hat is the negative end of its second axis.
        Event(EVENT_AXIS | EVENT_INIT, 2, 0),
        Event(EVENT_AXIS | EVENT_INIT, 3, -32767),
    ]
    assert device.wait(0) is None
    stick.hats[0] = (0, 0)
    assert device.wait(0) == (EVENT_AXIS, 3, 0)
    removed.append(SimpleNamespace(instance_id=7))
    with pytest.raises(DeviceError, match="unplugged"):
        device.wait(0)
    device.close()
    with pytest.raises(DeviceError, match="1 joysticks are connected: there is no number 3"):
        PygameDevice(3)


def test_missing_pygame_names_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    monkeypatch.setattr(devices.sys, "platform", "darwin")
    with pytest.raises(DeviceError, match=re.escape(install_command("minirospy[joy]"))):
        open_device(str(tmp_path / "js0"))
