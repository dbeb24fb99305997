#!/usr/bin/env python3
"""`rosrun sound_play play.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.programs import play

sys.exit(play())
