"""rospy.msproxy.MasterProxy with a target of the program's own."""

import rospy
import rospy.msproxy
from referee import outcome, show

show(sorted(rospy.msproxy._master_arg_remap.items()))


class Target:
    """Shows each call, and answers with one response."""

    def __init__(self, response):
        self.response = response

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)

        def method(*args):
            show("called", name, args)
            return self.response

        return method


master = rospy.msproxy.MasterProxy("http://localhost:1")
show(list(vars(master)))
for response in ([1, "ok", ["value"]], [-1, "no", 0]):
    show("#", response)
    master.target = Target(response)
    outcome("get", lambda: master.getParam("x"))
    outcome("lookup", lambda: master.lookupNode("~n"))
    outcome("register", lambda: master.registerPublisher("topic", "type", "uri"))
    outcome("pid", lambda: master.getPid())
    outcome("item", lambda: master["k"])
    outcome("set", lambda: master.__setitem__("k", 3))
    outcome("contains", lambda: "k" in master)
    outcome("delete", lambda: master.__delitem__("k"))
    outcome("search", lambda: master.search_param("k"))
    outcome("names", lambda: list(master))
rospy.msproxy._master_arg_remap["getPid"] = [1]
outcome("own method", lambda: master.getPid("a", "b"))
