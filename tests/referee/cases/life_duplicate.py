"""Two nodes of one name: the older one shuts down and prints the reason."""

from referee import Other, show

CODE = """
import os, sys
os.dup2(1, 2)
import rospy
rospy.on_shutdown(lambda: print("hook", flush=True))
rospy.init_node("twin", argv=[])
rospy.core.add_preshutdown_hook(lambda reason: print("reason:", reason, flush=True))
print("ready", flush=True)
rospy.spin()
print("spun", rospy.is_shutdown(), flush=True)
"""


def shown(line):
    """Return a log line without its time."""
    level, bracket, rest = line.partition("] [")
    return level + "]" + rest.partition("]")[2] if bracket else line


older = Other(CODE)
show(older.read())
newer = Other(CODE)
show(newer.read())
for _ in range(4):
    show("older:", shown(older.read()))
show("older ends:", older.close())
show("newer ends:", newer.close(3.0))
