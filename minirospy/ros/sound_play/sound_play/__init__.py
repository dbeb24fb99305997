"""sound_play: plays sounds and speech on request. Source: http://wiki.ros.org/sound_play."""
