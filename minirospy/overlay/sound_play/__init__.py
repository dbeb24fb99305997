"""sound_play, provided by minirospy: sounds and speech. Source: http://wiki.ros.org/sound_play."""
