"""The version of rospy that packaging tools report."""

from __future__ import annotations

import importlib.metadata

from minirospy.base.environment import ROS_VERSION


def test_distribution_rospy_has_the_version_of_rosversion() -> None:
    """ROS packages select by pkg_resources.get_distribution("rospy").version, which reads the same file."""
    assert importlib.metadata.version("rospy") == ROS_VERSION.strip()
