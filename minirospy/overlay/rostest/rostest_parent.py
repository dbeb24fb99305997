"""rostest.rostest_parent, provided by minirospy: a launch file's nodes for its tests."""

from minirospy.ros.rostest.rostest.rostest_parent import ROSTestLaunchParent

__all__ = ["ROSTestLaunchParent"]
