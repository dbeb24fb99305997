"""get_param_cached: it follows the changes of other nodes and of this one."""

import rospy
from referee import Other, eventually, outcome, show

PROGRAM = """
import rosgraph
import sys
master = rosgraph.Master("/other")
for line in sys.stdin:
    exec(line)
    print("done", flush=True)
"""

rospy.init_node("case", argv=[])
other = Other(PROGRAM)


def by_other(code):
    other.process.stdin.write(code + "\n")
    other.process.stdin.flush()
    show(code, other.read())


def follows(name, value):
    show(
        name,
        value,
        eventually(lambda: rospy.get_param_cached(name, "none") == value),
        rospy.get_param(name, "none"),
    )


rospy.set_param("/a", 1)
rospy.set_param("/list", [1, [2]])
rospy.set_param("/deep/er/x", 1)
for name in ("/a", "/list", "/deep/er/x", "/none"):
    outcome(f"cached {name}", lambda name=name: rospy.get_param_cached(name, "default"))
    outcome(f"cached {name}", lambda name=name: rospy.get_param_cached(name))
by_other("master.setParam('/a', 2)")
follows("/a", 2)
by_other("master.setParam('/a', 'text')")
follows("/a", "text")
rospy.set_param("/a", 3)
follows("/a", 3)
by_other("master.setParam('/none', 5)")
follows("/none", 5)
by_other("master.deleteParam('/none')")
follows("/none", "none")
outcome("deleted", lambda: rospy.get_param_cached("/none"))
by_other("master.setParam('/none', [1])")
follows("/none", [1])
by_other("master.setParam('/list', [1, [2], 3])")
follows("/list", [1, [2], 3])
by_other("master.setParam('/deep/er/x', 2)")
follows("/deep/er/x", 2)
by_other("master.setParam('/deep', {'er': {'x': 3}})")
follows("/deep/er/x", 3)
by_other("master.deleteParam('/deep/er')")
follows("/deep/er/x", "none")
by_other("master.setParam('/deep/er', {'x': 4})")
follows("/deep/er/x", 4)
rospy.set_param("~mine", 1)
outcome("private", lambda: rospy.get_param_cached("~mine"))
by_other("master.setParam('/case/mine', 2)")
follows("~mine", 2)
for i in range(20):
    by_other(f"master.setParam('/a', {i})")
follows("/a", 19)
show(other.close())
