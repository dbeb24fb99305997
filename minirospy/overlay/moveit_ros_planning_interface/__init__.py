"""moveit_ros_planning_interface, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import moveit_ros_planning_interface as moveit_ros_planning_interface
