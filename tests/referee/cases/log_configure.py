"""rosgraph.roslogging.configure_logging and rospy.core.configure_logging in programs that are not nodes."""

import logging
import os

import rosgraph.roslogging
from referee import outcome, show
from rosgraph.roslogging import configure_logging, makedirs_with_parent_perms, renew_latest_logdir

home = os.environ["ROS_HOME"]


def loggers(*names):
    for name in names:
        logger = logging.getLogger(name)
        show(
            repr(name), logging.getLevelName(logger.level), bool(logger.propagate),
            [(type(each).__name__, logging.getLevelName(each.level)) for each in logger.handlers],
        )  # fmt: skip


logging.getLogger("rosout").addHandler(logging.StreamHandler())
for _ in range(2):
    found = configure_logging("x", logging.ERROR)
    show(
        found.replace(home, "HOME").replace(str(os.getpid()), "PID"), os.environ["ROS_LOG_FILENAME"] == found
    )
    loggers(None, "rosout", "x")
os.environ["ROSCONSOLE_FORMAT"] = "${severity}: ${message}"
logging.getLogger("rosout").info("to both")
logging.getLogger("rosout").debug("to none")
logging.getLogger("x").warning("to the file")
with open(found) as stream:
    show([line.split("]")[0] + line.rsplit(": ", 1)[1] for line in stream])

show(configure_logging("y", filename="run/a.log").replace(home, "HOME"))
latest = os.path.join(home, "log", "latest")
show(os.path.islink(latest), os.readlink(latest).replace(home, "HOME"))
show(
    configure_logging("", env={"ROS_LOG_DIR": os.path.join(home, "other")})
    .replace(home, "HOME")
    .replace(str(os.getpid()), "PID")
)
open(os.path.join(home, "file"), "w").close()
outcome(
    "a file is in the way",
    lambda: str(configure_logging("x", env={"ROS_LOG_DIR": os.path.join(home, "file")})),
)
outcome("class", lambda: rosgraph.roslogging.LoggingException.__mro__[1:2])

os.mkdir(os.path.join(home, "strict"), 0o700)
os.umask(0o022)
makedirs_with_parent_perms(os.path.join(home, "strict", "a", "b"))
show([oct(os.stat(os.path.join(home, "strict", *each)).st_mode) for each in (["a"], ["a", "b"])])
makedirs_with_parent_perms(os.path.join(home, "strict", "a", "b"))
os.makedirs(os.path.join(home, "runs", "latest"))
outcome("a folder", lambda: renew_latest_logdir(os.path.join(home, "runs", "one")))
os.rmdir(os.path.join(home, "runs", "latest"))
for name in ("one", "two"):
    outcome("linked", lambda n=name: renew_latest_logdir(os.path.join(home, "runs", n)))
    show(os.path.basename(os.readlink(os.path.join(home, "runs", "latest"))))

config = os.path.join(home, "own.yaml")
with open(config, "w") as stream:
    stream.write("version: 1\nloggers: {rosout: {level: ERROR}}\n")
os.environ["ROS_PYTHON_LOG_CONFIG_FILE"] = config
configure_logging("z")
loggers("rosout")
