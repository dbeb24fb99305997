"""The services get_loggers and set_logger_level of a node."""

import logging

import rospy
from referee import outcome, show
from roscpp.srv import GetLoggers, SetLoggerLevel

rospy.init_node("case", argv=["__ns:=/somewhere"], disable_rosout=True)
get_loggers = rospy.ServiceProxy("/somewhere/case/get_loggers", GetLoggers)
set_level = rospy.ServiceProxy("~set_logger_level", SetLoggerLevel)
for name, level in (("my.debug", 10), ("my.info", 20), ("my.warn", 30), ("my.error", 40), ("my.fatal", 50)):
    logging.getLogger(name).setLevel(level)


def levels():
    return [
        (each.name, each.level) for each in get_loggers().loggers if each.name.startswith(("my", "rosout"))
    ]


show(sorted(levels()))
for name, level in [
    ("rosout", "debug"),
    ("rosout", "INFO"),
    ("rosout", "Warn"),
    ("rosout", "error"),
    ("rosout", "fatal"),
    ("my.own", "debug"),
    ("my.new.one", "error"),
]:
    outcome(f"set {name} {level}", lambda name=name, level=level: set_level(name, level))
    show(logging.getLogger(name).level)
for level in ("critical", "warning", "bogus", ""):
    outcome(f"set {level!r}", lambda level=level: set_level("rosout", level))
    show(logging.getLogger("rosout").level)
show(sorted(levels()))
set_level("rosout", "debug")
outcome("enabled", lambda: logging.getLogger("rosout").isEnabledFor(logging.DEBUG))
