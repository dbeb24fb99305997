"""cv_bridge.boost, provided by minirospy. Source: http://wiki.ros.org/cv_bridge."""
