"""rospkg.environment, provided by minirospy: the names of variables, and what they are set to."""

from minirospy.ros.rospkg.rospkg.environment import (
    ROS_ETC_DIR,
    ROS_HOME,
    ROS_LOG_DIR,
    ROS_PACKAGE_PATH,
    ROS_ROOT,
    ROS_TEST_RESULTS_DIR,
    _compute_package_paths,
    _resolve_path,
    _resolve_paths,
    get_etc_ros_dir,
    get_log_dir,
    get_ros_home,
    get_ros_package_path,
    get_ros_paths,
    get_ros_root,
    get_test_results_dir,
    on_ros_path,
)

__all__ = [
    "ROS_ETC_DIR",
    "ROS_HOME",
    "ROS_LOG_DIR",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROS_TEST_RESULTS_DIR",
    "get_etc_ros_dir",
    "get_log_dir",
    "get_ros_home",
    "get_ros_package_path",
    "get_ros_paths",
    "get_ros_root",
    "get_test_results_dir",
    "on_ros_path",
]
