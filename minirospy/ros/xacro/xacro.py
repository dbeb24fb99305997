#!/usr/bin/env python3
"""`rosrun xacro xacro`, and `command="$(find xacro)/xacro ..."` in launch files; see http://wiki.ros.org/xacro."""

import os
import sys

# Make sure that this folder does not shadow the package xacro.
_HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:] = [folder for folder in sys.path if os.path.abspath(folder) != _HERE]

from minirospy.ros.xacro.commands.xacro import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
