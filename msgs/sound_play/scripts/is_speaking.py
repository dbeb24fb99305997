#!/usr/bin/env python3
"""`rosrun sound_play is_speaking.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.programs import is_speaking

sys.exit(is_speaking())
