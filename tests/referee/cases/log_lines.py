"""Log lines: stdout or stderr, their format; messages of all types."""

import subprocess
import sys

from referee import show

PROGRAM = """
import logging
import os
import rospy
import signal
import threading

rospy.logdebug("debug before init_node")
rospy.loginfo("info before init_node")
rospy.logwarn("warn before init_node")
rospy.logfatal("fatal %s init_node", "before")
rospy.init_node("case", argv=[])
for name in ("debug", "info", "warn", "err", "fatal", "out"):
    getattr(rospy, "log" + name)("level %s %d", name, 5)
for message in (5, 1.5, None, (1, 2), [], {"a": 1}, b"bytes", "", "\\u00e4\\u20ac", "two\\nlines", "100%", "%%", "%s"):
    rospy.loginfo(message)
rospy.loginfo("%% of %s", 100)
rospy.loginfo("%(a)s", {"a": 2})
try:
    rospy.loginfo()
except TypeError as error:
    print("TypeError", error)
try:
    rospy.loginfo("x", bogus=1)
except TypeError as error:
    print("TypeError")
try:
    raise KeyError("k")
except KeyError as error:
    rospy.logerr("with the error", exc_info=True)
    rospy.logwarn("with this error", exc_info=error)
rospy.loginfo("without", exc_info=False)
rospy.loginfo("extra", extra={"more": 1})
rospy.loginfo("named", logger_name="my.logger")
rospy.logwarn("named", logger_name="my.logger")
logging.getLogger("rosout").info("python %s", 1)
logging.getLogger("rosout.child").warning("python child")
logging.getLogger("rosout").log(5, "too low")
logging.getLogger("other").warning("to no terminal")
logging.warning("nor this")
thread = threading.Thread(target=rospy.loginfo, args=("in a thread",))
thread.start()
thread.join()
signal.signal(signal.SIGUSR1, lambda *_: rospy.loginfo("in a signal handler"))
os.kill(os.getpid(), signal.SIGUSR1)
rospy.on_shutdown(lambda: rospy.loginfo("in a hook"))
rospy.signal_shutdown("")
rospy.loginfo("after shutdown")
rospy.logerr("after shutdown")
"""

done = subprocess.run(
    [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=30, check=False
)
show(done.stdout)
show(done.stderr)
show(done.returncode)
