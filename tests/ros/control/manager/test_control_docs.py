"""The controller and the driver on docs/control.md run as they are printed there."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
from pathlib import Path

import pytest

from tests.conftest import write_files
from tests.ros.control.manager.conftest import Start, call

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a Ctrl-C for one process, a pseudo-terminal")

DOCS = Path(__file__).parents[4] / "docs"
PYTHON, XML = (
    re.findall(rf"```{kind}\n(.*?)```", (DOCS / "control.md").read_text(encoding="utf-8"), re.DOTALL)
    for kind in ("python", "xml")
)


def test_controller_of_ones_own(start: Start, workspace: Path) -> None:
    write_files(
        workspace.parent / "mine",
        {
            "package.xml": XML[1].replace("<name>my_controllers", "<name>mine"),
            "controllers.xml": XML[2].replace('type="my_controllers.', 'type="mine.'),
            "src/mine/__init__.py": "",
            "src/mine/swing.py": PYTHON[0],
        },
    )
    arm = Path(__file__).parents[3] / "core" / "urdf" / "arm.urdf"
    call(
        f"rospy.set_param('/robot_description', open({str(arm)!r}).read())\n"
        "rospy.set_param('/swing', {'type': 'my_controllers/Swing', 'joint': 'shoulder'})\n"
    )
    loopback = start("minirospy_hardware", "loopback")
    printed = call('cm.load_controller("swing"), cm.start_controller("swing"), cm.list_controllers()')
    assert printed.splitlines()[-1] == "'swing' - 'hardware_interface::PositionJointInterface' ( running )"
    loopback.process.send_signal(signal.SIGINT)
    status, _, errors = loopback.end()
    assert status == 0
    assert "stopped" not in errors


class ServoOnALine:
    """The servo's end of a serial line."""

    def __init__(self) -> None:
        import pty
        import tty

        self.line, port = pty.openpty()
        tty.setraw(port)
        self.port = os.ttyname(port)
        self.targets: list[float] = []
        self.has_target = threading.Event()
        self.is_silent = False
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        waiting, position = b"", 0.25
        while True:
            waiting += os.read(self.line, 100)
            *words, waiting = waiting.split(b"\n")
            for word in words:
                if word.startswith(b"G "):
                    position = float(word[2:])
                    self.targets.append(position)
                    self.has_target.set()
                elif not self.is_silent:
                    os.write(self.line, b"%.4f\n" % position)


def test_driver_of_a_servo(start: Start) -> None:
    pytest.importorskip("serial")
    servo = ServoOnALine()
    call("rospy.set_param('/hold', {'type': 'my_controllers/Hold', 'joint': 'servo', 'step': 0.001})")
    driver = start("-c", PYTHON[1], f"_port:={servo.port}")
    call('cm.load_controller("hold"), cm.start_controller("hold")')
    assert servo.has_target.wait(60)
    assert servo.targets[0] == 0.25  # where it is: the first update is in the next cycle
    servo.is_silent = True
    status, _, errors = driver.end()
    assert status == 1
    assert "HardwareError: the servo does not answer, it sent b''" in errors
