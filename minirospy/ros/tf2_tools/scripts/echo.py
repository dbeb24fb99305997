#!/usr/bin/env python3
"""`rosrun tf2_tools echo.py`; see http://wiki.ros.org/tf2_tools."""

import sys

from minirospy.ros.tf2_ros.tools.echo import main_tf2 as main

sys.exit(main())
