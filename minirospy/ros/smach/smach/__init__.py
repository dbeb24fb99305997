"""smach: hierarchical state machines for tasks, without ROS. Source: http://wiki.ros.org/smach.

The messages of logs and errors are those of the real package. Two cases in which the real one hangs or stays locked are
errors here: a child of a Concurrence that returns nothing, and a container whose construction raised.
"""
