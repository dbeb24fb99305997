"""sound_play.libsoundplay, provided by minirospy. Source: http://wiki.ros.org/sound_play."""

from minirospy.ros.sound_play.sound_play.libsoundplay import Sound, SoundClient

__all__ = [
    "Sound",
    "SoundClient",
]
