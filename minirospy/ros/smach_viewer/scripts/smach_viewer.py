#!/usr/bin/env python3
"""`rosrun smach_viewer smach_viewer.py`; see docs/dashboard.md."""

import sys

from minirospy.cli.dashboard import WINDOWS, _main

if __name__ == "__main__":
    sys.exit(_main(WINDOWS["smach_viewer"]))
