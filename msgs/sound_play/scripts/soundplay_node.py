#!/usr/bin/env python3
"""`rosrun sound_play soundplay_node.py`; see http://wiki.ros.org/sound_play."""

import sys

from minirospy.ros.sound_play.sound_play.node import main

sys.exit(main())
