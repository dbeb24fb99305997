#!/usr/bin/env python3
"""axclient.py of actionlib: see `rosrun actionlib axclient.py -h`."""

import sys

from minirospy.ros.actionlib.commands.axclient import main

if __name__ == "__main__":
    sys.exit(main())
