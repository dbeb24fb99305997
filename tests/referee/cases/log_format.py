"""ROSCONSOLE_FORMAT."""

import os
import subprocess
import sys

from referee import show

PROGRAM = """
import rospy
rospy.init_node("case", argv=["__ns:=/n"])
class Robot:
    def drive(self):
        rospy.loginfo("message %d", 5)
        rospy.logerr("named", logger_name="x")
Robot().drive()
"""

for form in [
    "${severity}|${message}|${logger}|${line}|${function}|${node}|",
    "${file}",
    "${time} ${walltime}",
    "${time:year} ${walltime:year}",
    "${message} ${message} $ ${} $message {message} %s %% ${MESSAGE} ${bogus} ${severity:x}",
    "plain",
    "\x1b[1m${message}",
]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "ROSCONSOLE_FORMAT": form},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    show("#", form)
    show(done.stdout)
    show(done.stderr)
