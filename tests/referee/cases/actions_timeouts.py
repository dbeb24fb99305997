"""Parameters of a server: how long it reports finished goals, how often it reports; queue sizes."""

import time

import actionlib
import rospy
from action_peer import RawClient, Story
from actionlib.msg import TestAction
from referee import eventually, of_ten_looks, outcome, show

rospy.init_node("case", argv=[], disable_rosout=True)
story = Story()
rospy.set_param("server/status_list_timeout", 0.5)
rospy.set_param("actionlib_status_frequency", 50.0)
rospy.set_param("actionlib_server_pub_queue_size", -1)
rospy.set_param("actionlib_server_sub_queue_size", 7)


def execute(goal):
    server.set_succeeded()


server = actionlib.SimpleActionServer("server", TestAction, execute, False)
server.start()
show(server.action_server.status_frequency, server.action_server.status_list_timeout.to_sec())
show(server.action_server.pub_queue_size, server.action_server.sub_queue_size)
client = RawClient("server")
# The default would be five seconds.
before = time.monotonic()
client.goal("a", 1)
show(client.wait_told("a", "SUCCEEDED"))
show(client.wait_gone("a"), 0.3 < time.monotonic() - before < 4.5)
before = time.monotonic()
client.cancel("b")
show(client.wait_told("b", "RECALLING"))
show(client.wait_gone("b"), 0.3 < time.monotonic() - before < 4.5)


def about_50_hz():
    count, before = client.arrays, time.monotonic()
    client.wait_status("never", 1, seconds=1)
    return (35 < (client.arrays - count) / (time.monotonic() - before) < 60,)


show("about 50 Hz", *of_ten_looks(about_50_hz))
eventually(lambda: client.array.header.seq > 50)
array = client.array
show(repr(array.header.frame_id), array.header.seq > 50, abs(array.header.stamp.to_sec() - time.time()) < 5)
connection = array._connection_header
show(connection["latching"], connection["type"], connection["md5sum"], connection["callerid"])

show("== the older name of the frequency")
rospy.set_param("old/status_frequency", 20.0)
old = actionlib.ActionServer("old", TestAction, lambda handle: None, auto_start=False)
old.start()
show(old.status_frequency)
story.tell()

show("== auto start")
auto = actionlib.ActionServer("auto", TestAction, lambda handle: None)
show(auto.started)
simple = actionlib.SimpleActionServer("simple_auto", TestAction)
show(simple.action_server.started, simple.execute_thread)
story.tell()
clients = [RawClient("auto"), RawClient("simple_auto")]
show(*(eventually(lambda client=client: client.arrays > 0) for client in clients))

show("== the client's")
rospy.set_param("actionlib_client_pub_queue_size", 9)
rospy.set_param("actionlib_client_sub_queue_size", 8)
client = actionlib.ActionClient("server", TestAction)
show(client.pub_queue_size, client.sub_queue_size)
rospy.set_param("actionlib_client_pub_queue_size", -9)
rospy.set_param("actionlib_client_sub_queue_size", -8)
client = actionlib.ActionClient("server", TestAction)
show(client.pub_queue_size, client.sub_queue_size)
rospy.set_param("actionlib_client_sub_queue_size", 0)
outcome("a queue of nothing", lambda: actionlib.ActionClient("server", TestAction))
rospy.signal_shutdown("the case is over")
