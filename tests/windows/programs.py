"""Helpers for the Windows tests: programs that run in Wine, the commands, and a node's files."""

from __future__ import annotations

import queue
import subprocess
import threading
import time
from collections.abc import Callable

import pytest

from tests.waiting import wait_until
from tests.windows.windows import Windows

WINDOWS = Windows()

# seconds; under Wine, a process takes some of them to start, and several times as many on a busy machine
SECONDS = 240.0

MANIFEST = """<package><name>pkg</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.c">m</maintainer><license>BSD</license></package>"""

TALKER = """#!/usr/bin/env python
import rospy
from std_msgs.msg import String
rospy.init_node("talker")
publisher = rospy.Publisher("/words", String, queue_size=10)
while not rospy.is_shutdown():
    publisher.publish("Größe aus {}".format(rospy.get_param("~place", "nowhere")))
    rospy.sleep(0.05)
"""

ESCAPED = r"Gr\xF6\xDFe"  # the string as rostopic prints it in YAML

WAIT = """#!/usr/bin/env python
import rospy
rospy.init_node("wait")
rospy.loginfo("Größe → 1")
print("waiting: Größe", flush=True)
rospy.spin()
"""


class Run:
    """A running Windows program, whose output is read as it arrives."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process
        self.said = ""
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def until(self, *words: str) -> str:
        """Read until all words have been printed; return the output so far."""
        end = time.monotonic() + SECONDS
        while not all(word in self.said for word in words):
            try:
                line = self._lines.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                pytest.fail(f"{words} were not printed, but:\n{self.said}")
            if not line:
                pytest.fail(f"it ended before it printed {words}:\n{self.said}")
            self.said += line
        return self.said

    def reaches(self, words: str) -> bool:
        """Read until the words have been printed; return False if the program exits before that."""
        while words not in self.said:
            line = self._lines.get(timeout=SECONDS)
            if not line:
                return False
            self.said += line
        return True

    def available(self) -> str:
        """Return the output so far."""
        while not self._lines.empty():
            line = self._lines.get()
            assert line, f"it ended:\n{self.said}"
            self.said += line
        return self.said

    def rest(self) -> str:
        """Return the remaining output of a program that has exited."""
        self._reader.join()
        while line := self._lines.get():
            self.said += line
        return self.said

    def close(self) -> None:
        """Kill the program."""
        self.process.kill()
        self.process.wait()
        # The pipe is closed when its last process exits, including any process that a launcher has started.
        self._reader.join(SECONDS)
        if self._reader.is_alive():
            pytest.fail(f"what it started still has its output:\n{self.said}")
        assert self.process.stdout
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            self._lines.put(line.decode("cp1252", "replace").replace("\r\n", "\n"))
        self._lines.put("")


Start = Callable[..., Run]


def no_process_left() -> None:
    """Wait until no Windows Python is running."""
    wait_until(lambda: not WINDOWS.processes(), SECONDS, "Windows processes run", pause=0.2)


def command(name: str) -> str:
    """Return the path of a command, as pip for Windows created it."""
    return rf"C:\Python312\Scripts\{name}.exe"
