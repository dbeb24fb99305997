"""A program's own handlers, and Python's loggers, together with rospy's."""

import logging

import rospy
from referee import show


class Keep(logging.Handler):
    def __init__(self, lines):
        super().__init__()
        self.lines = lines

    def emit(self, record):
        self.lines.append((record.name, record.levelname, record.getMessage()))


rospy.init_node("case", argv=[])
rosout, root = logging.getLogger("rosout"), logging.getLogger()
show(rosout.level, rosout.propagate == 1, [type(handler).__name__ for handler in rosout.handlers])
show(root.level, [type(handler).__name__ for handler in root.handlers])
rosout.removeHandler(rosout.handlers[0])  # the terminal's handler
at_rosout, at_root, at_child = [], [], []
rosout.addHandler(Keep(at_rosout))
logging.getLogger("rosout.child").addHandler(Keep(at_child))
rospy.loginfo("one")
rospy.loginfo("two", logger_name="child")
rospy.logdebug("three")
logging.getLogger("rosout.child").error("four")
show(at_rosout)
show(at_child)
root.addHandler(Keep(at_root))
rospy.loginfo("five")
logging.getLogger("mine").info("six")
show([line for line in at_root if line[0] in ("rosout", "mine")])
records = []
rosout.addFilter(lambda record: records.append(record) or True)


def place():
    rospy.loginfo("%s place", "this", extra={"more": 5})


place()
record = records[0]
show(record.name, record.levelno, record.msg, record.args, record.funcName, record.lineno, record.filename)
show(record.module, record.threadName, record.processName, record.exc_info, record.more)
logging.basicConfig(level=logging.DEBUG)
show([type(handler).__name__ for handler in root.handlers if not isinstance(handler, Keep)], root.level)
