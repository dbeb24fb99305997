"""rospy.numpy_msg: message classes whose arrays are numpy arrays."""

from minirospy.core.idl.numpy_class import numpy_class as numpy_msg

__all__ = ["numpy_msg"]
