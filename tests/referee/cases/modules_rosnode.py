"""rosnode's texts and clean-up in programs that watch a robot's nodes."""

import rosgraph
import rosnode
import rospy
from referee import outcome, printed, show
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, SetBoolResponse

rospy.init_node("tester")
bools = rospy.Publisher("/ns/bools", Bool, queue_size=1)
listener = rospy.Subscriber("/heard", String, lambda message: None)
anything = rospy.Subscriber("/any", rospy.AnyMsg, lambda message: None)
service = rospy.Service("~switch", SetBool, lambda request: SetBoolResponse(request.data, "done"))
master = rosgraph.Master(rosnode.ID)
dead = rosgraph.Master("/dead")


def register_dead():
    dead.registerPublisher("/dead_topic", "std_msgs/Bool", "http://localhost:1/")
    dead.registerSubscriber("/dead_heard", "std_msgs/Bool", "http://localhost:1/")
    dead.registerService("/dead_service", "rosrpc://localhost:1", "http://localhost:1/")


register_dead()
show("# info")
outcome("node", lambda: rosnode.get_node_info_description("/tester"))
outcome("nobody", lambda: rosnode.get_node_info_description("/nobody"))
uri = rosnode.get_api_uri(master, "/tester")
outcome("itself", lambda: rosnode.get_node_connection_info_description(uri, master).partition(" ")[0])
outcome("dead", lambda: rosnode.get_node_connection_info_description("http://localhost:1/", master))
printed("info", lambda: rosnode.rosnode_info("/tester"))
printed("info quiet", lambda: rosnode.rosnode_info("/tester", quiet=True))
printed("info nobody", lambda: rosnode.rosnode_info("/nobody"))
printed("info dead", lambda: rosnode.rosnode_info("/dead"))
show("# list")
printed("list", rosnode.rosnode_listnodes)
printed("list all", lambda: rosnode.rosnode_listnodes(list_all=True))
outcome("list text", rosnode._sub_rosnode_listnodes)
outcome("list text below", lambda: rosnode._sub_rosnode_listnodes("/nothing"))
outcome("list uris", lambda: rosnode._sub_rosnode_listnodes("/tester", list_uri=True))
printed("command", lambda: rosnode.rosnodemain(["rosnode", "list"]))
show("# ping")
printed("ping", lambda: rosnode.rosnode_ping("/tester", max_count=1, verbose=True))
printed("ping twice", lambda: rosnode.rosnode_ping("/tester", max_count=2, verbose=True))
printed("ping nobody", lambda: rosnode.rosnode_ping("/nobody", max_count=1))
printed("ping dead", lambda: rosnode.rosnode_ping("/dead", max_count=1))
printed("ping all", lambda: rosnode.rosnode_ping_all())
show("# clean up")
printed("blacklist", lambda: rosnode.cleanup_master_blacklist(master, ["/dead"]))
outcome("names", rosnode.get_node_names)
register_dead()
outcome("names", lambda: sorted(rosnode.get_node_names()))
printed("whitelist", lambda: rosnode.cleanup_master_whitelist(master, ["/tester"]))
outcome("names", rosnode.get_node_names)
outcome("state", lambda: [row for side in master.getSystemState() for row in side if "dead" in row[0]])
outcome("answer", lambda: rosnode._succeed((1, "fine", 7)))
outcome("refusal", lambda: rosnode._succeed([0, "bad", 7]))
show(rosnode.rosgraph.Master is rosgraph.Master)
