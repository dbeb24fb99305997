"""interactive_markers: the server's messages for each change, its callbacks, and menus."""

import queue

import rospy
from geometry_msgs.msg import Pose
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler
from referee import eventually, outcome, show
from std_msgs.msg import Header
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    InteractiveMarkerInit,
    InteractiveMarkerUpdate,
)

rospy.init_node("markers")


class Clock:
    """Controls the time that rospy.Time.now() returns."""

    now = 1000.0


rospy.Time.now = staticmethod(lambda: rospy.Time.from_sec(Clock.now))
updates, inits = queue.Queue(), queue.Queue()
subscribers = [
    rospy.Subscriber("cubes/update", InteractiveMarkerUpdate, updates.put),
    rospy.Subscriber("cubes/update_full", InteractiveMarkerInit, inits.put),
]
server = InteractiveMarkerServer("cubes", "_first", q_size=10)
sender = rospy.Publisher("cubes/feedback", InteractiveMarkerFeedback, queue_size=20)
eventually(lambda: all(each.get_num_connections() for each in (*subscribers, sender)))


def marker_text(marker):
    menu = [
        (entry.id, entry.parent_id, entry.title, entry.command, entry.command_type)
        for entry in marker.menu_entries
    ]
    return (marker.name, marker.header.frame_id, marker.header.stamp.secs, marker.pose.position.x, marker.scale,
            len(marker.controls), menu)  # fmt: skip


def update_text(update):
    poses = [(pose.name, pose.header.frame_id, pose.pose.position.x) for pose in update.poses]
    return (update.type, update.server_id, update.seq_num, sorted(marker_text(each) for each in update.markers), poses,
            list(update.erases))  # fmt: skip


def apply(label):
    """Apply the changes, and print the published messages."""
    before = server.seq_num
    server.applyChanges()
    if server.seq_num == before:
        show(label, "publishes nothing")
        return
    while True:
        update = updates.get(timeout=30)
        if update.type == InteractiveMarkerUpdate.UPDATE:
            break
    while True:
        init = inits.get(timeout=30)
        if init.seq_num == server.seq_num:
            break
    show(label, update_text(update))
    show(label, init.server_id, init.seq_num, [marker_text(each) for each in init.markers])


def make(name, x=0.0, frame="map"):
    marker = InteractiveMarker(name=name, scale=0.5)
    marker.header.frame_id, marker.pose.position.x, marker.pose.orientation.w = frame, x, 1
    marker.controls.append(InteractiveMarkerControl(name="move", always_visible=True))
    return marker


def pose(x):
    made = Pose()
    made.position.x, made.orientation.w = x, 1
    return made


def alive():
    while True:
        update = updates.get(timeout=30)
        if update.type == InteractiveMarkerUpdate.KEEP_ALIVE:
            return update_text(update)


first = inits.get(timeout=30)
show("init", first.server_id, first.seq_num, list(first.markers))
show("alive", alive())
apply("nothing")

# Insert, move, erase.
outcome("move none", lambda: server.setPose("a", pose(1)))
outcome("erase none", lambda: server.erase("a"))
outcome("callback of none", lambda: server.setCallback("a", print))
outcome("get none", lambda: server.get("a"))
server.insert(make("a"))
outcome("move a new one", lambda: server.setPose("a", pose(1)))
show("get", marker_text(server.get("a")))
server.insert(make("b", 2))
server.insert(make("gone"))
outcome("erase a new one", lambda: server.erase("gone"))
apply("insert")
outcome("move", lambda: server.setPose("a", pose(3)))
show("get", marker_text(server.get("a")))
apply("move")
outcome("move with frame", lambda: server.setPose("a", pose(4), Header(frame_id="odom")))
server.insert(make("b", 5))
apply("move and replace")
outcome("erase", lambda: server.erase("b"))
outcome("get an erased one", lambda: server.get("b"))
apply("erase")
outcome("erase again", lambda: server.erase("b"))
show("alive", alive())

# Feedback.
called = queue.Queue()


def callback(label):
    return lambda feedback: called.put((label, feedback.marker_name, feedback.event_type, feedback.client_id))


def send(event, name="a", client="rviz", **fields):
    sender.publish(InteractiveMarkerFeedback(client_id=client, marker_name=name, event_type=event, **fields))


server.insert(make("c"), callback("inserted"))
server.insert(make("stamped"), callback("stamped"), InteractiveMarkerFeedback.POSE_UPDATE)
server.get("stamped").header.stamp = rospy.Time(5)
server.setCallback("a", callback("default"))
server.setCallback("a", callback("clicked"), InteractiveMarkerFeedback.BUTTON_CLICK)
apply("with callbacks")
# For a second, a new marker accepts no feedback.
Clock.now += 2
for event, name in (
    (InteractiveMarkerFeedback.BUTTON_CLICK, "a"),
    (InteractiveMarkerFeedback.MOUSE_DOWN, "a"),
    (InteractiveMarkerFeedback.KEEP_ALIVE, "c"),
):
    send(event, name)
    show("called", called.get(timeout=30))
send(InteractiveMarkerFeedback.BUTTON_CLICK, "a", "another")
send(InteractiveMarkerFeedback.BUTTON_CLICK, "nothing")
send(InteractiveMarkerFeedback.POSE_UPDATE, "c", pose=pose(6), header=Header(frame_id="other"))
show("called", called.get(timeout=30))
send(InteractiveMarkerFeedback.POSE_UPDATE, "stamped", pose=pose(7), header=Header(frame_id="other"))
show("called", called.get(timeout=30))
show("not called", called.qsize())
apply("feedback")
server.setCallback("a", None, InteractiveMarkerFeedback.BUTTON_CLICK)
send(InteractiveMarkerFeedback.BUTTON_CLICK, "a")
show("called", called.get(timeout=30))

# Menus.
menu = MenuHandler()
top = menu.insert("Top", callback=callback("top"))
sub = menu.insert("Sub", parent=top, callback=callback("sub"))
leaf = menu.insert("Leaf", parent=sub, command_type=1, command="rostopic list", callback=callback("leaf"))
hidden = menu.insert("Hidden", callback=callback("hidden"))
below = menu.insert("Below", parent=hidden)
show("handles", top, sub, leaf, hidden, below, menu.insert("Nowhere", parent=77))
outcome("check", lambda: menu.setCheckState(leaf, MenuHandler.CHECKED))
outcome("uncheck", lambda: menu.setCheckState(sub, MenuHandler.UNCHECKED))
outcome("hide", lambda: menu.setVisible(hidden, False))
show(
    menu.getCheckState(leaf),
    menu.getCheckState(top),
    menu.getCheckState(99),
    menu.getTitle(sub),
    menu.getTitle(99),
)
show(menu.setCheckState(99, 1), menu.setVisible(99, True))
outcome("apply", lambda: menu.apply(server, "a"))
outcome("apply", lambda: menu.apply(server, "c"))
apply("menu")
menu.setVisible(hidden, True)
menu.setCheckState(sub, MenuHandler.NO_CHECKBOX)
outcome("apply again", lambda: menu.reApply(server))
apply("menu again")
for entry in (leaf, top, 99):
    send(InteractiveMarkerFeedback.MENU_SELECT, "a", menu_entry_id=entry)
send(InteractiveMarkerFeedback.MENU_SELECT, "c", menu_entry_id=sub)
for _ in range(3):
    show("selected", called.get(timeout=30))
server.erase("c")
outcome("apply to an erased one", lambda: menu.reApply(server))
apply("erased with a menu")

server.insert(make("pending"))
server.clear()
apply("clear")
apply("clear again")
