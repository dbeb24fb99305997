"""The log_level of init_node, and levels set directly."""

import logging

import rospy
from referee import outcome, show

rospy.init_node("case", argv=[], log_level=rospy.WARN)
show(rospy.DEBUG, rospy.INFO, rospy.WARN, rospy.ERROR, rospy.FATAL)
logger = logging.getLogger("rosout")
show(logger.level, logger.propagate == 1, logger.isEnabledFor(logging.INFO))
logger.removeHandler(logger.handlers[0])  # the terminal's handler
lines = []


class Keep(logging.Handler):
    def emit(self, record):
        lines.append((record.levelname, record.getMessage(), record.name))


logger.addHandler(Keep())
for level in (logging.DEBUG, logging.WARNING, logging.ERROR, logging.CRITICAL):
    logger.setLevel(level)
    for name in ("debug", "info", "warn", "err", "fatal", "out"):
        getattr(rospy, "log" + name)(name)
    show(level, lines)
    lines.clear()
logger.setLevel(logging.INFO)
logging.getLogger("rosout.quiet").setLevel(logging.ERROR)
rospy.loginfo("quiet", logger_name="quiet")
rospy.logerr("loud", logger_name="quiet")
rospy.logdebug("child", logger_name="quiet.child")
show(lines)
logging.disable(logging.ERROR)
rospy.logerr("disabled")
rospy.logfatal("not disabled")
show(lines[1:])
outcome("stacklevel", lambda: rospy.logfatal("x", stacklevel=1))
