"""roslib.rosenv, provided by minirospy: values of the environment, with roslib's former names."""

from rosgraph.rosenv import ROS_HOSTNAME, ROS_IP, ROS_MASTER_URI, ROS_NAMESPACE

from minirospy.ros.roslib.roslib.rosenv import (
    ROS_HOME,
    ROS_LOG_DIR,
    ROS_PACKAGE_PATH,
    ROS_ROOT,
    ROSEnvException,
    get_log_dir,
    get_master_uri,
    get_ros_home,
    get_ros_package_path,
    get_ros_root,
    get_test_results_dir,
    makedirs_with_parent_perms,
)

__all__ = [
    "ROS_HOME", "ROS_HOSTNAME", "ROS_IP", "ROS_LOG_DIR", "ROS_MASTER_URI", "ROS_NAMESPACE", "ROS_PACKAGE_PATH", "ROS_ROOT",
    "ROSEnvException", "get_log_dir", "get_master_uri", "get_ros_home", "get_ros_package_path", "get_ros_root",
    "get_test_results_dir", "makedirs_with_parent_perms",
]  # fmt: skip
