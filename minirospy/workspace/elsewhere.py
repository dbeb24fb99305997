"""A table of ROS 1 packages and modules that minirospy does not include, such as those in C++ or Qt, and their replacements.

The table is used only if a package, program or module is not found, so packages in a workspace or an installation take
precedence.
"""

from __future__ import annotations

from minirospy.base.installation import install_command

__all__ = ["IMPORTED", "SUBMODULES", "advice"]

_RUN_IT_THERE = (
    "install it by RoboStack (`conda install -c conda-forge -c robostack-noetic ros-noetic-{conda}`) or on a machine with ROS 1, "
    "and run it there with the same ROS_MASTER_URI: it works with minirospy's nodes"
)
_DEFINITIONS = "it holds definitions: `git clone {repository}` in a workspace's src, `catkin_make`, and source devel/setup.bash"
_QT = "{command}, clone {repository} into a workspace's src, `catkin_make`, and source devel/setup.bash"

_NAVIGATION = "localization and navigation, in C++"
CPP = {
    # navigation and maps
    "amcl": _NAVIGATION,
    "base_local_planner": _NAVIGATION,
    "carrot_planner": _NAVIGATION,
    "cartographer_ros": "SLAM, in C++",
    "clear_costmap_recovery": _NAVIGATION,
    "costmap_2d": _NAVIGATION,
    "dwa_local_planner": _NAVIGATION,
    "explore_lite": _NAVIGATION,
    "fake_localization": _NAVIGATION,
    "global_planner": _NAVIGATION,
    "gmapping": "SLAM, in C++",
    "hector_mapping": "SLAM, in C++",
    "karto_slam": "SLAM, in C++",
    "slam_karto": "SLAM, in C++",
    "laser_scan_matcher": "odometry of laser scans, in C++",
    "move_base": _NAVIGATION,
    "move_slow_and_clear": _NAVIGATION,
    "nav_core": _NAVIGATION,
    "navfn": _NAVIGATION,
    "octomap_server": "maps in three dimensions, in C++",
    "rf2o_laser_odometry": "odometry of laser scans, in C++",
    "robot_localization": "filters of poses, in C++",
    "robot_pose_ekf": "filters of poses, in C++",
    "rotate_recovery": _NAVIGATION,
    "rtabmap_ros": "SLAM, in C++",
    "slam_toolbox": "SLAM, in C++",
    "teb_local_planner": _NAVIGATION,
    "voxel_grid": _NAVIGATION,
    # arms and controllers
    "moveit_commander": "MoveIt, in C++",
    "moveit_core": "MoveIt, in C++",
    "moveit_fake_controller_manager": "MoveIt, in C++",
    "moveit_planners_ompl": "MoveIt, in C++",
    "moveit_ros_move_group": "MoveIt, in C++",
    "moveit_ros_planning_interface": "MoveIt, in C++",
    "moveit_ros_visualization": "MoveIt, in C++",
    "moveit_ros_warehouse": "MoveIt, in C++",
    "moveit_servo": "MoveIt, in C++",
    "moveit_setup_assistant": "MoveIt, in C++",
    "moveit_simple_controller_manager": "MoveIt, in C++",
    "trac_ik_kinematics_plugin": "inverse kinematics, in C++",
    # Simulators.
    "stage_ros": "the simulator Stage, in C++",
    # images, point clouds and sensors
    "apriltag_ros": "a detector in images, in C++",
    "aruco_ros": "a detector in images, in C++",
    "ar_track_alvar": "a detector in images, in C++",
    "cv_camera": "a camera's driver, in C++",
    "depth_image_proc": "nodelets on images, in C++",
    "depthimage_to_laserscan": "nodelets on images, in C++",
    "freenect_launch": "a camera's driver, in C++",
    "hokuyo_node": "a laser scanner's driver, in C++",
    "image_proc": "nodelets on images, in C++",
    "image_view": "windows with images, in C++",
    "laser_filters": "filters of laser scans, in C++",
    "libuvc_camera": "a camera's driver, in C++",
    "opencv_apps": "nodelets on images, in C++",
    "openni_launch": "a camera's driver, in C++",
    "openni2_launch": "a camera's driver, in C++",
    "pcl_ros": "nodelets on point clouds, in C++",
    "pointcloud_to_laserscan": "nodelets on point clouds, in C++",
    "realsense2_camera": "a camera's driver, in C++",
    "rplidar_ros": "a laser scanner's driver, in C++",
    "stereo_image_proc": "nodelets on images, in C++",
    "urg_node": "a laser scanner's driver, in C++",
    "usb_cam": "a camera's driver, in C++",
    "raspicam_node": "a camera's driver, in C++",
    "realsense_camera": "a camera's driver, in C++",
    "astra_camera": "a camera's driver, in C++",
    "hls_lfcd_lds_driver": "a laser scanner's driver, in C++",
    "ld08_driver": "a laser scanner's driver, in C++",
    "ydlidar_ros_driver": "a laser scanner's driver, in C++",
    "aruco_detect": "finds markers in images, in C++",
    "fiducial_slam": "SLAM, in C++",
    "velodyne_driver": "a laser scanner's driver, in C++",
    "velodyne_pointcloud": "a laser scanner's driver, in C++",
    # inputs, plug-ins and tools
    "imu_complementary_filter": "filters of an IMU, in C++",
    "imu_filter_madgwick": "filters of an IMU, in C++",
    "interactive_marker_twist_server": "interactive markers, in C++",
    "nodelet": "plug-ins of C++ programs in one process",
    "nodelet_topic_tools": "plug-ins of C++ programs in one process",
    "eigen_conversions": "a C++ library",
    "pluginlib": "plug-ins of C++ programs",
    "class_loader": "plug-ins of C++ programs",
    "rviz": "RViz as a library, in C++",
    "spacenav_node": "an input device's driver, in C++",
    "twist_mux": "a node in C++",
    "ps3joy": "an input device's driver",
    "wiimote": "an input device's driver, in C++",
    "yocs_cmd_vel_mux": "nodelets, in C++",
    "yocs_velocity_smoother": "nodelets, in C++",
}
"""Dict from package with compiled programs to its description."""

_MUX = "`rosrun topic_tools mux /cmd_vel IN1 IN2` passes one of several topics on; services choose which"
INSTEAD = {
    "rviz": "`rviz -d FILE` shows the same in a browser",
    "twist_mux": _MUX,
    "yocs_cmd_vel_mux": _MUX,
    "rosserial_server": "`rosrun rosserial_python serial_node.py` serves the same devices",
    "ps3joy": "pair the pad with the system's Bluetooth settings, then `rosrun joy joy_node`",
}
"""Dict from package, in CPP or not, to minirospy's replacement."""

_QT_REPOSITORIES = (
    "ros-visualization's python_qt_binding, qt_gui_core (branch melodic-devel of both), rqt (kinetic-devel) and {plugin} "
    "(master)"
)
QT_PLUGINS = (
    "rqt_action",
    "rqt_dep",
    "rqt_msg",
    "rqt_nav_view",
    "rqt_pose_view",
    "rqt_py_console",
    "rqt_shell",
    "rqt_srv",
    "rqt_web",
)
QT_LIBRARIES = (
    "python_qt_binding",
    "qt_dotgraph",
    "qt_gui",
    "qt_gui_py_common",
    "rqt_gui",
    "rqt_gui_py",
    "rqt_py_common",
)

MESSAGES = {
    "costmap_converter": "https://github.com/rst-tu-dortmund/costmap_converter",
}
"""Message packages, each with the arguments with which `git clone` gets its ROS 1 version."""

IMPORTED = frozenset(
    {
        "moveit_commander",
        "moveit_ros_planning_interface",
        "nodelet",
        "rviz",
        "rqt_graph",
        *QT_LIBRARIES,
    }
)
"""Modules that Python programs import from packages that minirospy lacks. In `overlay/`, each raises ImportError."""

SUBMODULES = {
    "roslaunch.child": "roslaunch.parent.ROSLaunchParent launches files, on other machines by ssh, too",
    "roslaunch.remoteprocess": "roslaunch.parent.ROSLaunchParent starts nodes on other machines by ssh",
    "roslaunch.netapi": "`rosnode list` lists the nodes; a roslaunch does not serve its list of processes",
}
"""Submodules that minirospy's version of a ROS package lacks, with their replacements. `overlay/` has a module for each."""


def advice(name: str) -> str:
    """Return one line about a ROS 1 package or module that minirospy lacks, and its replacement; "" if the name is unknown."""
    if name in CPP:
        what = f"{CPP[name]}, which minirospy does not have"
        there = _RUN_IT_THERE.format(conda=name.replace("_", "-"))
        return f"{what}: {INSTEAD.get(name, there)}"
    if name in INSTEAD:
        return f"minirospy does not have it: {INSTEAD[name]}"
    if name in QT_PLUGINS or name in QT_LIBRARIES or name == "rqt":
        plugin = name if name in QT_PLUGINS else "the plug-in"
        command = install_command("PyQt5", "pydot", "catkin_pkg")
        how = _QT.format(command=command, repository=_QT_REPOSITORIES.format(plugin=plugin))
        return f"a window of Qt, from its source: {how}"
    if name in MESSAGES:
        return f"minirospy does not bring it: {_DEFINITIONS.format(repository=MESSAGES[name])}"
    return ""
