"""smach: hierarchical state machines for tasks, without ROS. Source: http://wiki.ros.org/smach.

The texts of logs and errors are the real package's. What hangs or is left locked there (a child of a Concurrence that
returns nothing, a container whose construction raised) is an error here.
"""
