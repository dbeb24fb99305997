"""An interactive marker server, based on Debian's interactive_markers or minirospy's, depending on the interpreter.

It prints each viewer event as JSON, and reads commands from stdin: move NAME X Y, erase NAME, lose (an update), big, hostile.
"""

import json
import sys

import rospy
from geometry_msgs.msg import Pose
from interactive_markers.interactive_marker_server import InteractiveMarkerServer
from interactive_markers.menu_handler import MenuHandler
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerFeedback,
    Marker,
)

EVENTS = ("alive", "pose", "menu", "click", "down", "up")
HOSTILE = "<img src=x onerror=\"document.title='taken'\">"


def pose(x, y, z=0.0):
    made = Pose()
    made.position.x, made.position.y, made.position.z, made.orientation.w = x, y, z, 1.0
    return made


def box(red, green, blue, size=0.4):
    made = Marker(type=Marker.CUBE)
    made.scale.x = made.scale.y = made.scale.z = size
    made.color.r, made.color.g, made.color.b, made.color.a = red, green, blue, 1.0
    made.pose.orientation.w = 1.0
    return made


def control(mode, name="", axis="x", shapes=(), **fields):
    made = InteractiveMarkerControl(interaction_mode=mode, name=name, markers=list(shapes), **fields)
    made.orientation.w = 1.0
    if axis != "x":
        # Turn the x axis to z or y.
        setattr(made.orientation, {"z": "y", "y": "z"}[axis], 1.0)
    return made


def insert(name, at, controls, **fields):
    made = InteractiveMarker(name=name, scale=1.0, controls=controls, pose=pose(*at), **fields)
    made.header.frame_id = "map"
    server.insert(made, said)


def said(feedback):
    place, point = feedback.pose.position, feedback.mouse_point
    turned = feedback.pose.orientation
    print(
        json.dumps(
            {
                "event": EVENTS[feedback.event_type],
                "marker": feedback.marker_name,
                "control": feedback.control_name,
                "client": feedback.client_id,
                "frame": feedback.header.frame_id,
                "place": [place.x, place.y, place.z],
                "turned": [turned.x, turned.y, turned.z, turned.w],
                "entry": feedback.menu_entry_id,
                "point": [point.x, point.y, point.z] if feedback.mouse_point_valid else None,
            }
        ),
        flush=True,
    )
    if feedback.event_type == InteractiveMarkerFeedback.POSE_UPDATE:
        server.applyChanges()


def chosen(feedback):
    if feedback.menu_entry_id == checked:
        menu.setCheckState(checked, MenuHandler.CHECKED)
    menu.reApply(server)
    server.applyChanges()
    # Print the event after its effects are complete.
    said(feedback)


rospy.init_node("marker_server")
server = InteractiveMarkerServer("/markers")
modes = InteractiveMarkerControl
insert(
    "arm",
    (0, 0, 0.2),
    [
        control(modes.MOVE_AXIS, "move_x"),
        control(modes.MOVE_AXIS, "move_y", "y"),
        control(modes.MOVE_AXIS, "move_z", "z"),
        control(modes.ROTATE_AXIS, "turn_z", "z"),
        control(modes.NONE, shapes=[box(0.6, 0.6, 0.7)], always_visible=True),
    ],
    description="arm",
)
insert(
    "flat",
    (2, 2, 0),
    [control(modes.MOVE_PLANE, "slide", "z", [box(0.9, 0.6, 0.1)], always_visible=True)],
    description="flat",
)
insert(
    "button",
    (-2, -2, 0),
    [control(modes.BUTTON, "press", shapes=[box(0.9, 0.1, 0.3)], always_visible=True)],
    description=HOSTILE,
)
insert(
    "listed",
    (-2, 2, 0),
    [control(modes.MENU, "choose", shapes=[box(0.2, 0.7, 0.4)], always_visible=True)],
    description="menu",
)
insert(
    "facing",
    (2, -2, 0),
    [
        control(modes.ROTATE_AXIS, "turn_view", orientation_mode=modes.VIEW_FACING),
        control(
            modes.MOVE_PLANE,
            "slide_view",
            shapes=[box(0.3, 0.4, 0.9)],
            orientation_mode=modes.VIEW_FACING,
            independent_marker_orientation=True,
            always_visible=True,
        ),
    ],
    description="facing the view",
)
menu = MenuHandler()
first = menu.insert("First", callback=chosen)
more = menu.insert("More")
checked = menu.insert("Checked", parent=more, callback=chosen)
menu.insert(HOSTILE, parent=more, callback=chosen)
menu.insert("Program", command_type=1, command="rospy_tutorials talker", callback=chosen)
menu.setCheckState(checked, MenuHandler.UNCHECKED)
menu.apply(server, "listed")
server.applyChanges()
print("ready", flush=True)

for line in sys.stdin:
    command, *words = line.split()
    if command == "move":
        server.setPose(words[0], pose(float(words[1]), float(words[2])))
    elif command == "erase":
        server.erase(words[0])
    elif command == "lose":
        # Simulate an update that is lost on the network.
        server.seq_num += 1
        insert("found", (3, 0, 0), [control(modes.BUTTON, shapes=[box(1, 1, 1)])])
    elif command == "many":
        insert("many", (1, 1, 0), [control(modes.BUTTON, shapes=[box(1, 1, 1)]) for _ in range(201)])
        insert("nowhere", (float("nan"), 1, 0), [control(modes.BUTTON, shapes=[box(1, 1, 1)])])
    server.applyChanges()
