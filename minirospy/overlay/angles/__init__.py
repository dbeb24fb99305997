"""angles, provided by minirospy: distances on the circle. Source: http://wiki.ros.org/angles."""

from math import fabs, fmod, pi

from minirospy.ros.angles.angles import (
    _find_min_max_delta,
    normalize_angle,
    normalize_angle_positive,
    shortest_angular_distance,
    shortest_angular_distance_with_large_limits,
    shortest_angular_distance_with_limits,
    two_pi_complement,
)

__all__ = [
    "fabs",
    "fmod",
    "normalize_angle",
    "normalize_angle_positive",
    "pi",
    "shortest_angular_distance",
    "shortest_angular_distance_with_large_limits",
    "shortest_angular_distance_with_limits",
    "two_pi_complement",
]
