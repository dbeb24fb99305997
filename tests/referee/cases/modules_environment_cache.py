"""catkin.environment_cache: the script that repeats the changes of another one."""

import os
import stat
from pathlib import Path

from catkin.environment_cache import generate_environment_script
from referee import outcome, show

SCRIPT = Path(os.environ["ROS_HOME"], "env.sh")
SCRIPT.write_text(
    "#!/bin/sh\nexport CHANGED=now KEPT=kept GROWN=/a:$GROWN NEW=a:b QUOTED='\"x\"' LAST= SPACED='a b'\nexec \"$@\"\n"
)
SCRIPT.chmod(stat.S_IRWXU)
os.environ.update(CHANGED="was", KEPT="kept", GROWN="/b:/c", LAST="x")
# The interpreter's start may add variables of its own.
OWN = ("LC_CTYPE", "_", "PWD", "OLDPWD", "SHLVL", "__CF")
for line in generate_environment_script(str(SCRIPT)):
    if not line.startswith(tuple(f"export {name}" for name in OWN)):
        show(repr(line))
outcome("none", lambda: generate_environment_script("/no/such/script"))
try:
    generate_environment_script("/bin/false")
except Exception as error:  # noqa: BLE001 - its type is shown
    show(type(error).__name__, error.returncode)
