#!/usr/bin/env python3
"""`rosrun rosserial_python message_info_service.py`; see http://wiki.ros.org/rosserial_python."""

import sys

from minirospy.ros.rosserial_python.devices.serial_node import message_info_service

sys.exit(message_info_service())
