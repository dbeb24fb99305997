#!/usr/bin/env python3
"""`rosrun sound_play playbuiltin.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.programs import playbuiltin

sys.exit(playbuiltin())
