#!/usr/bin/env python3
"""`rosrun sound_play playpackage.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.programs import playpackage

sys.exit(playpackage())
