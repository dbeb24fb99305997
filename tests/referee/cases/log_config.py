"""Configuration of Python's logging by ROS_PYTHON_LOG_CONFIG_FILE or in ROS_HOME."""

import os
import subprocess
import sys
from pathlib import Path

from referee import show

HOME = os.environ["ROS_HOME"]
PROGRAM = """
import logging
import rospy
rospy.init_node("case", argv=[])
rospy.loginfo("info")
rospy.logwarn("warn")
logging.getLogger("mine").warning("mine")
for name in ("", "rosout"):
    logger = logging.getLogger(name)
    print(repr(name), logger.level, [type(handler).__name__ for handler in logger.handlers])
"""
CONF = """
[loggers]
keys=root, rosout
[handlers]
keys=file,stream
[formatters]
keys=mine
[logger_root]
level=ERROR
handlers=file
[logger_rosout]
level=WARN
handlers=stream
propagate=1
qualname=rosout
[handler_file]
class=handlers.RotatingFileHandler
level=DEBUG
formatter=mine
args=(os.environ['ROS_LOG_FILENAME'],'a', 50000000, 4)
[handler_stream]
class=rosgraph.roslogging.RosStreamHandler
level=DEBUG
formatter=mine
args=(True,)
[formatter_mine]
format=CONF %(name)s %(message)s
"""
YAML = """
version: 1
formatters: {mine: {format: 'YAML %(name)s %(message)s'}}
handlers: {stream: {class: logging.StreamHandler, formatter: mine, stream: 'ext://sys.stdout'}}
loggers: {rosout: {level: INFO, handlers: [stream]}}
"""


def run(label, **environment):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    show("#", label)
    show(done.stdout)
    show(done.stderr)


def write(name, text):
    path = os.path.join(HOME, name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)
    return path


run("conf", ROS_PYTHON_LOG_CONFIG_FILE=write("mine.conf", CONF))
for line in Path(HOME, "log", "case.log").read_text().splitlines(True):
    if line.startswith("CONF rosout"):
        show("file:", line.rstrip())
run("yaml", ROS_PYTHON_LOG_CONFIG_FILE=write("mine.yaml", YAML))
write("config/python_logging.yaml", YAML)
run("yaml in ROS_HOME")
write("config/python_logging.conf", CONF)
run("conf in ROS_HOME")
