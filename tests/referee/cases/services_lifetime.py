"""Servers that start, stop and replace each other, and the effects on proxies."""

import rosgraph
import rospy
from referee import Other, eventually, outcome, show
from std_srvs.srv import SetBool, Trigger

SERVER = """
import sys
import rospy
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node(sys.argv[1])
service = rospy.Service("/s", Trigger, lambda request: TriggerResponse(True, sys.argv[1]))
print("ready", flush=True)
for line in sys.stdin:
    exec(line)
    print("done", flush=True)
rospy.signal_shutdown("end of input")
"""

rospy.init_node("case", argv=[])
master = rosgraph.Master("/case")
single = rospy.ServiceProxy("/s", Trigger)
persistent = rospy.ServiceProxy("/s", Trigger, persistent=True)


def providers():
    return [nodes for name, nodes in master.getSystemState()[2] if name == "/s"]


def tell(server, line):
    server.process.stdin.write(line + "\n")
    server.process.stdin.flush()
    server.read()


outcome("single, no server", single)
outcome("persistent, no server", persistent)
one = Other(SERVER, "one")
one.read()
outcome("single", single)
outcome("persistent", persistent)
outcome("persistent again", persistent)
show(providers())

show("a second server of the name")
two = Other(SERVER, "two")
two.read()
show(providers())
outcome("single", single)
outcome("persistent stays", persistent)
outcome("a new persistent", rospy.ServiceProxy("/s", Trigger, persistent=True))

show("the first leaves")
one.close()
show(eventually(lambda: providers() == [["/two"]]))
outcome("single", single)
# Real rospy's persistent proxy then fails permanently, with an AttributeError at each call; minirospy's reconnects.
persistent = rospy.ServiceProxy("/s", Trigger, persistent=True)
outcome("another persistent", persistent)

show("the second shuts its service down")
tell(two, "service.shutdown('no more')")
show(providers())
outcome("single", single)
outcome("wait", lambda: rospy.wait_for_service("/s", 0.2))
persistent.close()

show("and offers it again")
tell(two, "service = rospy.Service('/s', Trigger, lambda request: TriggerResponse(True, 'again'))")
outcome("single", single)
persistent = rospy.ServiceProxy("/s", Trigger, persistent=True)
outcome("persistent", persistent)
persistent.close()
persistent.close()
outcome("close twice", persistent.close)
outcome("close of a single one", single.close)
outcome("single after close", single)

show("and is killed")
two.process.kill()
two.process.wait()
outcome("persistent, killed", rospy.ServiceProxy("/s", Trigger, persistent=True))
two.close()
three = Other(SERVER, "three")
three.read()
outcome("single", single)
show(providers())
three.close()

show("of another type")
other = rospy.Service("/s", SetBool, lambda request: (True, "other"))
outcome("single", single)
outcome("right", rospy.ServiceProxy("/s", SetBool))
other.shutdown()
