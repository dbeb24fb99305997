"""Conversions between actuators and joints: ``from transmission_interface import DifferentialTransmission``.

In ROS, these classes exist only in C++. Source: http://wiki.ros.org/transmission_interface.
"""

from minirospy.core.control.transmission_maps import (
    DifferentialTransmission,
    FourBarLinkageTransmission,
    SimpleTransmission,
    TransmissionMap,
    load_transmissions,
)

__all__ = [
    "DifferentialTransmission",
    "FourBarLinkageTransmission",
    "SimpleTransmission",
    "TransmissionMap",
    "load_transmissions",
]
