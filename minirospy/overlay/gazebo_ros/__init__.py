"""gazebo_ros, which is not here: the import raises ImportError with what to do."""

from minirospy.ros.elsewhere import gazebo_ros as gazebo_ros
