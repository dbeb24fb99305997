"""roslib.rospack: rospack's output as functions."""

import warnings

with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always")
    import roslib.rospack
from referee import outcome, show

show([(each.category.__name__, str(each.message)) for each in warned if "rospack" in str(each.message)])
show(roslib.rospack.rospackexec(["find", "rospy"]).endswith("/rospy"))
for words in (
    ["find", "no_package"],
    ["bogus"],
    [],
    ["depends1", "rosgraph_msgs"],
    ["plugins", "--attrib=x", "rospy"],
):
    outcome(words, lambda w=words: roslib.rospack.rospackexec(w))
show(roslib.rospack.rospack_depends_1("rosgraph_msgs"), roslib.rospack.rospack_plugins("rospy"))
show("std_msgs" in roslib.rospack.rospack_depends("rosgraph_msgs"))
show("rosgraph_msgs" in roslib.rospack.rospack_depends_on_1("std_msgs"))
show(roslib.rospack.rospack_depends("no_package"), roslib.rospack.rosstack_depends("no_stack"))
outcome("stack", lambda: roslib.rospack.rosstackexec(["find", "no_stack"]))
