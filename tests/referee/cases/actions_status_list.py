"""ActionServer.status_list: programs read it, add to it, remove from it and replace it."""

import actionlib
import rospy
from actionlib.msg import TestAction, TestActionGoal
from actionlib.status_tracker import StatusTracker
from actionlib_msgs.msg import GoalID, GoalStatus
from referee import eventually, show

rospy.set_param("/actionlib_status_frequency", 20.0)
rospy.init_node("server")
handles = []
server = actionlib.ActionServer("action", TestAction, handles.append, lambda handle: None, False)
show(server.status_list, type(server.status_list))
server.start()
statuses = server.status_list


def receive(goal_id):
    """Let the server receive a goal."""
    goal = TestActionGoal()
    goal.goal_id.id = goal_id
    goal.goal_id.stamp = rospy.Time.now()
    server.internal_goal_callback(goal)


def published():
    """Return the statuses that the server publishes."""
    messages = []
    publish = server.status_pub.publish
    with server.lock:
        server.status_pub.publish = messages.append
        server.publish_status()
        server.status_pub.publish = publish
    return [(each.goal_id.id, each.status, each.text) for each in messages[0].status_list]


receive("a")
receive("b")
show([each.status.goal_id.id for each in statuses], statuses is server.status_list)
show(statuses[0].handle_destruction_time, statuses[0].handle_tracker is not None)
show(published())

mine = StatusTracker(GoalID(id="mine"), GoalStatus.LOST)
server.status_list.append(mine)
show("added", published(), mine.handle_destruction_time)
receive("mine")
show("known", len(handles), published())
server.status_list.remove(statuses[0])
show("removed", published())
receive("a")
show("unknown", len(handles), published())
handles[1].set_accepted()
handles[1].set_succeeded()
statuses[0].status.text = "changed"
show("changed", published())

server.status_list = [mine]
show("replaced", published())
server.status_list_timeout = rospy.Duration(1)
mine.handle_destruction_time = rospy.Time.now() - rospy.Duration(5)
show("ended", published(), server.status_list)
receive("c")
show(published(), [each.status.goal_id.id for each in server.status_list])
del server.status_list[:]
show("cleared", published())

show("# a subclass")
calls = []


class Server(actionlib.ActionServer):
    """Records when it publishes."""

    def publish_status(self):
        """Publish all statuses."""
        calls.append(1)
        super().publish_status()


Server("other", TestAction, handles.append, lambda handle: None, False).start()
show(eventually(lambda: len(calls) > 4))
