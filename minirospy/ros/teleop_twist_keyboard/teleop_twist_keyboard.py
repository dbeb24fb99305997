#!/usr/bin/env python3
"""`rosrun teleop_twist_keyboard teleop_twist_keyboard.py`; see http://wiki.ros.org/teleop_twist_keyboard."""

import sys

from minirospy.ros.teleop_twist_keyboard.twist_keyboard import main

sys.exit(main())
