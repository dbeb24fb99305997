"""wait_for_message and get_published_topics."""

import threading

import rospy
from referee import outcome, show
from std_msgs.msg import Bool, String


def published(*namespace):
    """Return the published topics, except for those that depend on whether a rosout node runs."""
    return sorted(pair for pair in rospy.get_published_topics(*namespace) if pair[0] != "/rosout_agg")


outcome("before init_node", lambda: rospy.wait_for_message("/t", Bool, 0.1))
rospy.init_node("case", argv=["mapped:=to"])
outcome("nobody", lambda: rospy.wait_for_message("/nobody", Bool, 0.2))
outcome("nobody, a relative name", lambda: rospy.wait_for_message("nobody", Bool, timeout=0.2))
outcome("nobody, a mapped name", lambda: rospy.wait_for_message("mapped", Bool, timeout=0.2))
outcome("a private name", lambda: rospy.wait_for_message("~nobody", Bool, timeout=0.2))
outcome("no time", lambda: rospy.wait_for_message("/nobody", Bool, 0))
outcome("a negative time", lambda: rospy.wait_for_message("/nobody", Bool, -1))
outcome("a Duration", lambda: rospy.wait_for_message("/nobody", Bool, rospy.Duration(0.2)))
outcome("no class", lambda: rospy.wait_for_message("/nobody", None, 0.2))
outcome("no name", lambda: rospy.wait_for_message("", Bool, 0.2))
latched = rospy.Publisher("/ready", String, queue_size=1, latch=True)
latched.publish("here")
outcome("there", lambda: rospy.wait_for_message("/ready", String, 10).data)
outcome("again", lambda: rospy.wait_for_message("/ready", String).data)
ns = rospy.Publisher("/ns/topic", Bool, queue_size=1)
for namespace in (
    (),
    ("/",),
    ("",),
    ("/ns",),
    ("/ns/",),
    ("ns",),
    ("/n",),
    ("/nobody",),
    (None,),
    ("/ready",),
):
    outcome(f"published {namespace}", lambda namespace=namespace: published(*namespace))
waiting = []


def wait_long():
    try:
        rospy.wait_for_message("/nobody", Bool)
    except rospy.ROSException as error:
        waiting.append((type(error).__name__, str(error)))


thread = threading.Thread(target=wait_long)
thread.start()
rospy.sleep(0.2)
rospy.signal_shutdown("the end")
thread.join(60)
show("interrupted", waiting)
outcome("after shutdown", lambda: rospy.wait_for_message("/nobody", Bool, 0.2))
