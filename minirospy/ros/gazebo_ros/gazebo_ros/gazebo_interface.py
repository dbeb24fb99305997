"""gazebo_ros.gazebo_interface: clients of the services that spawn models. Source: http://wiki.ros.org/gazebo_ros."""

from __future__ import annotations

import time
from collections.abc import Sequence

from gazebo_msgs.srv import SetModelConfiguration, SpawnModel
from geometry_msgs.msg import Pose

from minirospy import client as rospy

__all__ = ["set_model_configuration_client", "spawn_sdf_model_client", "spawn_urdf_model_client"]


def spawn_sdf_model_client(
    model_name: str,
    model_xml: str,
    robot_namespace: str,
    initial_pose: Pose,
    reference_frame: str,
    gazebo_namespace: str,
) -> bool | None:
    """Wait for the service and spawn a model from SDF; return the response's ``success``, or None if the call failed."""
    service = f"{gazebo_namespace}/spawn_sdf_model"
    return _spawn(service, model_name, model_xml, robot_namespace, initial_pose, reference_frame)


def spawn_urdf_model_client(
    model_name: str,
    model_xml: str,
    robot_namespace: str,
    initial_pose: Pose,
    reference_frame: str,
    gazebo_namespace: str,
) -> bool | None:
    """Wait for the service and spawn a model from URDF; return the response's ``success``, or None if the call failed."""
    service = f"{gazebo_namespace}/spawn_urdf_model"
    return _spawn(service, model_name, model_xml, robot_namespace, initial_pose, reference_frame)


def set_model_configuration_client(
    model_name: str,
    model_param_name: str,
    joint_names: Sequence[str],
    joint_positions: Sequence[float],
    gazebo_namespace: str,
) -> bool | None:
    """Wait for the service and a second more, then set joint positions; return ``success``, or None if the call failed."""
    service = f"{gazebo_namespace}/set_model_configuration"
    rospy.loginfo(f"Waiting for service {service}")
    rospy.wait_for_service(service)
    rospy.loginfo(
        "temporary hack to **fix** the -J joint position option (issue #93), sleeping for 1 second to avoid race condition."
    )
    time.sleep(1)
    try:
        proxy = rospy.ServiceProxy(service, SetModelConfiguration)
        rospy.loginfo(f"Calling service {service}")
        response = proxy(model_name, model_param_name, joint_names, joint_positions)
        rospy.loginfo(f"Set model configuration status: {response.status_message}")
    except rospy.ServiceException as error:
        print(f"Service call failed: {error}")
        return None
    return bool(response.success)


def _spawn(service: str, *arguments: object) -> bool | None:
    rospy.loginfo(f"Waiting for service {service}")
    rospy.wait_for_service(service)
    try:
        proxy = rospy.ServiceProxy(service, SpawnModel)
        rospy.loginfo(f"Calling service {service}")
        response = proxy(*arguments)
        rospy.loginfo(f"Spawn status: {response.status_message}")
    except rospy.ServiceException as error:
        print(f"Service call failed: {error}")
        return None
    return bool(response.success)
