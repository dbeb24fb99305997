"""Log files: their locations and contents, the link to the latest."""

import os
import re
import subprocess
import sys
from pathlib import Path

import rospy
from referee import show

HOME = os.environ["ROS_HOME"]
PROGRAM = """
import logging
import os
import sys
import rospy
rospy.init_node("case", argv=sys.argv)
rospy.loginfo("info")
rospy.logdebug("debug")
rospy.logwarn("warn %s", "x", logger_name="sub")
rospy.logfatal("fatal")
logging.getLogger("mine").info("mine")
logging.getLogger("mine").debug("mine debug")
logging.warning("root")
try:
    raise KeyError("k")
except KeyError:
    rospy.logerr("error", exc_info=True)
print(os.path.relpath(os.environ["ROS_LOG_FILENAME"], os.environ["ROS_HOME"]))
"""


def run(label, *arguments, **environment):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    show("#", label, "->", done.stdout.splitlines()[-1], done.returncode)
    for folder, folders, files in sorted(os.walk(HOME)):
        for name in sorted(folders + files):
            path = os.path.join(folder, name)
            target = os.path.relpath(os.path.realpath(path), HOME) if os.path.islink(path) else ""
            show("  ", os.path.relpath(path, HOME), "->" if target else "", target)


run("plain")
for line in Path(HOME, "log", "case.log").read_text().splitlines(True):
    if re.match(r"\[(rosout|mine|root|sub)|[^\[]", line):
        show("     ", re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3}", "<when>", line.rstrip()))
run("name and namespace", "__ns:=/a/b", "__name:=other")
run("ROS_LOG_DIR", ROS_LOG_DIR=os.path.join(HOME, "logs"))
run("a run of roslaunch", "__log:=" + os.path.join(HOME, "log", "run-1", "case-1.log"))
run("the next run", "__log:=" + os.path.join(HOME, "log", "run-2", "case-1.log"))
rospy.set_param("/run_id", "run-3")
run("run_id alone")
