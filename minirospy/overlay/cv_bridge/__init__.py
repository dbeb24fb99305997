"""cv_bridge, provided by minirospy: images as numpy arrays. Source: http://wiki.ros.org/cv_bridge."""

from cv_bridge import core as core
from minirospy.ros.cv_bridge.cv_bridge import CvBridge, CvBridgeError, getCvType

__all__ = ["CvBridge", "CvBridgeError", "getCvType"]
