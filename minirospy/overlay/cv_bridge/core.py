"""cv_bridge.core, provided by minirospy: CvBridge. Source: http://wiki.ros.org/cv_bridge."""

from minirospy.ros.cv_bridge.cv_bridge.core import CvBridge, CvBridgeError

__all__ = ["CvBridge", "CvBridgeError"]
