"""What the environment says, under the words of rosgraph."""

from __future__ import annotations

from minirospy.environment import DEFAULT_MASTER_PORT, Environment

__all__ = [
    "DEFAULT_MASTER_PORT",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_MASTER_URI",
    "ROS_NAMESPACE",
    "get_master_uri",
]

ROS_MASTER_URI = "ROS_MASTER_URI"
ROS_IP = "ROS_IP"
ROS_HOSTNAME = "ROS_HOSTNAME"
ROS_NAMESPACE = "ROS_NAMESPACE"


def get_master_uri(env: dict[str, str] | None = None, argv: list[str] | None = None) -> str:
    """The URI of the master that the environment names."""
    return Environment.read(env, host="localhost").master_uri
