#!/usr/bin/env python3
"""`rosrun rosserial_python serial_node.py`; see http://wiki.ros.org/rosserial_python."""

import sys

from minirospy.ros.rosserial_python.devices.serial_node import main

sys.exit(main())
