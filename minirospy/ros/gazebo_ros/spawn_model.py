"""`rosrun gazebo_ros spawn_model`: add a model to the simulation. Source: http://wiki.ros.org/gazebo_ros.

Exit statuses: 0 for success, 1 if the model cannot be read or spawned, 2 for wrong arguments.
"""

from __future__ import annotations

import argparse
import os
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from urllib.parse import urlsplit

from gazebo_msgs.msg import ModelStates
from gazebo_msgs.srv import DeleteModel
from geometry_msgs.msg import Point, Pose, Quaternion
from std_srvs.srv import Empty

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.ros.gazebo_ros.gazebo_ros import gazebo_interface
from minirospy.ros.tf.tf.transformations import quaternion_from_euler

__all__ = ["main", "new_parser"]

_DATABASE = """<sdf version="1.4">
    <world name="default">
        <include>
            <uri>model://{}</uri>
        </include>
    </world>
</sdf>"""


def new_parser() -> argparse.ArgumentParser:
    """Return the command line's parser."""
    parser = argparse.ArgumentParser(
        prog="spawn_model", description="Spawn a model in gazebo using the ROS API"
    )
    formats = parser.add_mutually_exclusive_group(required=True)
    formats.add_argument("-urdf", action="store_true", help="Incoming xml is in urdf format")
    formats.add_argument("-sdf", action="store_true", help="Incoming xml is in sdf format")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("-file", metavar="FILE_NAME", help="Load model xml from file")
    source.add_argument("-param", metavar="PARAM_NAME", help="Load model xml from ROS parameter")
    source.add_argument(
        "-database",
        metavar="MODEL_NAME",
        help="Load model XML from specified model in Gazebo Model Database",
    )
    source.add_argument("-stdin", action="store_true", help="Load model from stdin")
    parser.add_argument("-model", required=True, metavar="MODEL_NAME", help="Name of model to spawn")
    parser.add_argument(
        "-reference_frame",
        default="",
        help='Name of the model/body where initial pose is defined. If left empty or specified as "world", gazebo '
        "world frame is used",
    )
    parser.add_argument(
        "-gazebo_namespace",
        default="/gazebo",
        help="ROS namespace of gazebo offered ROS interfaces.  Defaults to /gazebo/",
    )
    parser.add_argument(
        "-robot_namespace", default=rospy.get_namespace(), help="change ROS namespace of gazebo-plugins"
    )
    parser.add_argument(
        "-unpause", action="store_true", help="!!!Experimental!!! unpause physics after spawning model"
    )
    parser.add_argument("-wait", metavar="MODEL_NAME", help="!!!Experimental!!! wait for model to exist")
    for option, what in (("x", "x"), ("y", "y"), ("z", "z")):
        help_text = f"{what} component of initial position, meters"
        parser.add_argument(f"-{option}", type=float, default=0, help=help_text)
    for option, what in (("R", "roll"), ("P", "pitch"), ("Y", "yaw")):
        help_text = f"{what} angle of initial orientation, radians"
        parser.add_argument(f"-{option}", type=float, default=0, help=help_text)
    parser.add_argument(
        "-J",
        dest="joints",
        default=[],
        action="append",
        metavar=("JOINT_NAME", "JOINT_POSITION"),
        nargs=2,
        help="initialize the specified joint at the specified position",
    )
    parser.add_argument(
        "-package_to_model",
        action="store_true",
        help='convert urdf <mesh filename="package://..." to <mesh filename="model://..."',
    )
    parser.add_argument(
        "-b",
        dest="bond",
        action="store_true",
        help="bond to gazebo and delete the model when this program is interrupted",
    )
    return parser


def main() -> int:
    """Run the program; return its exit status."""
    parser = new_parser()
    arguments = parser.parse_args(rospy.myargv()[1:])
    try:
        joints = [(name, float(position)) for name, position in arguments.joints]
    except ValueError as error:
        parser.error(f"argument -J: {error}")
    try:
        rospy.init_node("spawn_model", anonymous=True)
        return _run(arguments, joints)
    except rospy.ROSInterruptException:
        return 0
    except rospy.ROSException as error:
        rospy.logerr("%s", error)
        return 1


def _run(arguments: argparse.Namespace, joints: list[tuple[str, float]]) -> int:
    if arguments.wait and not _wait_for_model(arguments.gazebo_namespace, arguments.wait):
        return 0
    text = _read(arguments)
    if text is None:
        return 1
    try:
        root = ET.fromstring(_without_declaration(text))
    except ET.ParseError as error:
        rospy.logerr("Invalid XML: %s", error)
        return 1
    if arguments.package_to_model:
        for mesh in root.iterfind(".//mesh"):
            url = urlsplit(mesh.get("filename") or "")
            if url.scheme == "package":
                mesh.set("filename", url._replace(scheme="model").geturl())
    text = ET.tostring(root).decode("ascii")

    pose = Pose(
        Point(arguments.x, arguments.y, arguments.z),
        Quaternion(*quaternion_from_euler(arguments.R, arguments.P, arguments.Y)),
    )
    spawn = (
        gazebo_interface.spawn_urdf_model_client
        if arguments.urdf
        else gazebo_interface.spawn_sdf_model_client
    )
    namespace = arguments.gazebo_namespace
    if not spawn(
        arguments.model, text, arguments.robot_namespace, pose, arguments.reference_frame, namespace
    ):
        rospy.logerr("Spawn service failed. Exiting.")
        return 1

    if joints:
        names = [name for name, _ in joints]
        positions = [position for _, position in joints]
        if not gazebo_interface.set_model_configuration_client(
            arguments.model, "", names, positions, namespace
        ):
            rospy.logerr("SetModelConfiguration service failed. Exiting.")
            return 1

    if arguments.unpause:
        rospy.loginfo("Unpausing physics")
        rospy.wait_for_service(f"{namespace}/unpause_physics")
        try:
            rospy.ServiceProxy(f"{namespace}/unpause_physics", Empty)()
        except rospy.ServiceException as error:
            rospy.logerr("Unpause physics service call failed: %s", error)
            return 1

    if arguments.bond:
        rospy.on_shutdown(lambda: _delete(arguments.model, namespace))
        rospy.loginfo("Waiting for shutdown to delete model %s", arguments.model)
        rospy.spin()
    return 0


def _wait_for_model(namespace: str, name: str) -> bool:
    """Wait until a model exists. Return False if the node shuts down first."""
    found = SignalSafeEvent()

    def on_states(states: ModelStates) -> None:
        if name in states.name:
            found.set()

    subscriber = rospy.Subscriber(f"{namespace}/model_states", ModelStates, on_states)
    rospy.loginfo("Waiting for model %s before proceeding.", name)
    rospy.on_shutdown(found.set)
    wait_for_event(found, None)
    subscriber.unregister()
    return not rospy.is_shutdown()


def _read(arguments: argparse.Namespace) -> str | None:
    """Return the model's text, or log an error and return None."""
    if arguments.file:
        return _read_file(arguments.file)
    if arguments.param:
        rospy.loginfo("Loading model XML from ros parameter %s", arguments.param)
        text = rospy.get_param(arguments.param, "")
        if not isinstance(text, str) or not text:
            rospy.logerr("Error: param does not exist or is empty")
            return None
        return text
    if arguments.database:
        rospy.loginfo("Loading model XML from Gazebo Model Database")
        return _DATABASE.format(arguments.database)
    rospy.loginfo("Loading model XML from stdin")
    text = sys.stdin.read()
    if not text:
        rospy.logerr("Error: stdin buffer was empty")
        return None
    return text


def _read_file(name: str) -> str | None:
    rospy.loginfo("Loading model XML from file %s", name)
    if not os.path.exists(name):
        rospy.logfatal("Error: specified file %s does not exist", name)
        return None
    if not os.path.isfile(name):
        rospy.logfatal("Error: specified file %s is not a file", name)
        return None
    try:
        text = Path(name).read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        rospy.logerr("Error reading file %s: %s", name, error)
        return None
    if not text:
        rospy.logerr("Error: file %s is empty", name)
        return None
    return text


def _without_declaration(text: str) -> str:
    """Return the text without its XML declaration, which may have a wrong version or follow an empty line."""
    stripped = text.lstrip()
    return stripped.partition("?>")[2] if stripped.startswith("<?xml") else text


def _delete(model: str, namespace: str) -> None:
    rospy.loginfo("Deleting model %s", model)
    try:
        rospy.ServiceProxy(f"{namespace}/delete_model", DeleteModel)(model)
    except rospy.ServiceException as error:
        rospy.logerr("Delete model service call failed: %s", error)
