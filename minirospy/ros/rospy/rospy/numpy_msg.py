"""rospy.numpy_msg: message classes whose arrays are numpy arrays."""

from minirospy.core.idl.numpy_class import numpy_class as numpy_msg
from minirospy.ros.submodules import modules_on_first_use

__all__ = ["numpy_msg"]

__getattr__ = modules_on_first_use("rospy.numpy_msg", "numpy")
