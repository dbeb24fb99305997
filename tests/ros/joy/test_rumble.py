"""Force feedback: the kernel's structures, and the motor commands from joy/set_feedback."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import pytest
from sensor_msgs.msg import JoyFeedback, JoyFeedbackArray

from minirospy.ros.joy import rumble
from minirospy.ros.joy.devices import LinuxDevice
from minirospy.ros.joy.joy_node import Motors
from minirospy.ros.joy.joystick import Event
from minirospy.ros.joy.rumble import Rumble, RumbleError, event_device, pack_effect, pack_event


class FakeDevice:
    """A joystick that records its motor commands."""

    name = "pad"

    def __init__(self) -> None:
        self.played: list[tuple[float, float]] = []
        self.is_broken = False

    def wait(self, seconds: float) -> Event | None:
        return None

    def rumble(self, strong: float, weak: float) -> None:
        self.played.append((strong, weak))
        if self.is_broken:
            raise RumbleError("no motors")

    def close(self) -> None:
        pass


def feedback(*values: tuple[int, int, float]) -> JoyFeedbackArray:
    """Return a message of (type, id, intensity)."""
    return JoyFeedbackArray(
        array=[JoyFeedback(type=kind, id=at, intensity=share) for kind, at, share in values]
    )


def test_an_effect_has_the_kernels_bytes() -> None:
    effect = pack_effect(-1, 1.0, 0.5)
    assert len(effect) == (48 if struct.calcsize("P") == 8 else 44)
    # type, id, direction, trigger, replay (length 1000 ms, delay), padding, strong and weak magnitude
    assert effect[:20] == struct.pack("=HhHHHHHHHH", 0x50, -1, 0, 0, 0, 1000, 0, 0, 0xFFFF, 0x8000)
    assert not any(effect[20:])
    assert pack_effect(3, 7.0, -1.0)[16:20] == b"\xff\xff\0\0"


def test_an_event_has_the_kernels_bytes() -> None:
    event = pack_event(3, 1)
    assert len(event) == 2 * struct.calcsize("l") + 8
    assert event[-8:] == struct.pack("=HHi", 0x15, 3, 1)


@pytest.mark.skipif(sys.platform == "win32", reason="ioctl is Unix's")
def test_an_effect_is_uploaded_once_and_played(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import array
    import fcntl

    uploaded = []

    def ioctl(file: int, request: int, effect: array.array[int]) -> int:
        uploaded.append((request, bytes(effect[2:4]), bytes(effect[16:20])))
        effect[2], effect[3] = 5, 0
        return 0

    monkeypatch.setattr(fcntl, "ioctl", ioctl)
    path = tmp_path / "event3"
    path.touch()
    motors = Rumble(str(path))
    motors.play(1.0, 0.0)
    motors.close()

    request = 0x40304580 if struct.calcsize("P") == 8 else 0x402C4580
    assert uploaded == [(request, b"\xff\xff", bytes(4)), (request, b"\x05\0", b"\xff\xff\0\0")]
    assert path.read_bytes() == pack_event(0x60, 0xFFFF) + pack_event(5, 1)


@pytest.mark.skipif(sys.platform == "win32", reason="ioctl is Unix's")
def test_a_file_without_motors_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "event0"
    path.touch()
    with pytest.raises(RumbleError, match="event0 takes no force feedback: "):
        Rumble(str(path))
    with pytest.raises(RumbleError, match="No such file"):
        Rumble(str(tmp_path / "none"))

    device = LinuxDevice(str(path))
    with pytest.raises(RumbleError, match="names one"):
        device.rumble(1, 1)
    device.close()


def test_the_event_device_belongs_to_the_joystick(tmp_path: Path) -> None:
    (tmp_path / "js1" / "device" / "event7").mkdir(parents=True)
    assert event_device("/dev/input/js1", tmp_path) == "/dev/input/event7"
    assert event_device("/dev/input/js0", tmp_path) == ""
    assert rumble.RumbleError("a").args


def test_motors_run_until_they_are_stopped() -> None:
    motors, device = Motors(), FakeDevice()
    motors.run(device, 0.0)
    assert device.played == []

    motors.set(feedback((JoyFeedback.TYPE_RUMBLE, 0, 0.5), (JoyFeedback.TYPE_LED, 1, 1.0)))
    for now in (1.0, 1.2, 1.6, 1.7):
        motors.run(device, now)
    assert device.played == [(0.5, 0.0), (0.5, 0.0)]

    motors.set(feedback((JoyFeedback.TYPE_RUMBLE, 1, 1.0), (JoyFeedback.TYPE_RUMBLE, 0, float("nan"))))
    motors.run(device, 1.8)
    motors.set(feedback((JoyFeedback.TYPE_RUMBLE, 0, 0.0), (JoyFeedback.TYPE_RUMBLE, 1, 0.0)))
    for now in (1.9, 2.5, 9.0):
        motors.run(device, now)
    assert device.played[2:] == [(0.5, 1.0), (0.0, 0.0)]


def test_a_device_without_motors_is_a_warning(capfd: pytest.CaptureFixture[str]) -> None:
    motors, device = Motors(), FakeDevice()
    device.is_broken = True
    motors.set(feedback((JoyFeedback.TYPE_RUMBLE, 0, 1.0)))
    motors.run(device, 1.0)
    motors.run(device, 1.1)
    assert device.played == [(1.0, 0.0)]
