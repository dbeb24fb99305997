#!/usr/bin/env python3
"""`rosrun sound_play shutup.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.programs import shutup

sys.exit(shutup())
