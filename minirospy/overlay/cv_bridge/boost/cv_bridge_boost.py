"""cv_bridge.boost.cv_bridge_boost, provided by minirospy: what programs import of it. Source: http://wiki.ros.org/cv_bridge."""

from minirospy.ros.cv_bridge.cv_bridge.boost.cv_bridge_boost import (
    CV_MAT_CNWrap,
    CV_MAT_DEPTHWrap,
    cvtColor2,
    getCvType,
)

__all__ = ["CV_MAT_CNWrap", "CV_MAT_DEPTHWrap", "cvtColor2", "getCvType"]
