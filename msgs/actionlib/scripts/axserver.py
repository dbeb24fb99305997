#!/usr/bin/env python3
"""axserver.py of actionlib: see `rosrun actionlib axserver.py -h`."""

import sys

from minirospy.ros.actionlib.commands.axserver import main

if __name__ == "__main__":
    sys.exit(main())
