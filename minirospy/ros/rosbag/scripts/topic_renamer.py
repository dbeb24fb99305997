#!/usr/bin/env python3
"""`rosrun rosbag topic_renamer.py`, as ROS's package has it; see http://wiki.ros.org/rosbag."""

import sys

from minirospy.ros.rosbag.commands.rosbag_scripts import main

sys.exit(main("topic_renamer.py"))
