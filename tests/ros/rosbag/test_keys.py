"""Single keys from a terminal."""

from __future__ import annotations

import os
import sys
import threading

import pytest

from minirospy.ros.rosbag.recording.keys import read_keys


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no terminal sessions")
def test_keys_are_read_from_the_terminal_of_another_session(monkeypatch: pytest.MonkeyPatch) -> None:
    """roslaunch starts each node in its own session; in ROS, the space bar pauses `rosbag play` there, too."""
    import pty
    import termios

    user, terminal = pty.openpty()

    def mode() -> list[object]:
        found = termios.tcgetattr(terminal)
        found[3] &= ~getattr(termios, "PENDIN", 0)  # macOS sets it until the next read
        return list(found)

    before = mode()
    keys: list[str] = []
    arrived = threading.Event()

    def on_key(key: str) -> None:
        keys.append(key)
        arrived.set()

    with os.fdopen(user, "wb", buffering=0) as keyboard, os.fdopen(terminal) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        with read_keys(on_key):
            keyboard.write(b" ")
            assert arrived.wait(60)
        assert mode() == before
    assert keys == [" "]
