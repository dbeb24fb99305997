#!/usr/bin/env python3
"""`rosrun rosbag fastrebag.py`, as in ROS's package rosbag; see http://wiki.ros.org/rosbag."""

import sys

from minirospy.ros.rosbag.commands.rosbag_scripts import main

sys.exit(main("fastrebag.py"))
