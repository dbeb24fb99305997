"""The client for sound_play: plays files and sounds, and speaks text, through a topic or an action.

Source: http://wiki.ros.org/sound_play.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypedDict

from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from sound_play.msg import SoundRequest, SoundRequestAction, SoundRequestGoal

from minirospy import client as rospy
from minirospy.base import times
from minirospy.ros.actionlib.actionlib.simple_client import SimpleActionClient
from minirospy.ros.rospkg.rospkg.rospack import RosPack

if TYPE_CHECKING:
    from typing_extensions import Unpack

__all__ = ["Sound", "SoundClient"]


class Options(TypedDict, total=False):
    """Optional arguments of all methods that play a sound."""

    blocking: bool
    replace: bool
    server_timeout: times.Duration | None
    result_timeout: times.Duration | None


class Sound:
    """A sound that can be played, repeated and stopped."""

    def __init__(self, client: SoundClient, snd: int, arg: str, volume: float = 1.0) -> None:
        self.client = client
        self.snd = snd
        self.arg = arg
        self.vol = volume

    def play(self, **kwargs: Unpack[Options]) -> None:
        """Play the sound once."""
        self.client.sendMsg(self.snd, SoundRequest.PLAY_ONCE, self.arg, vol=self.vol, **kwargs)

    def repeat(self, **kwargs: Unpack[Options]) -> None:
        """Play the sound repeatedly."""
        self.client.sendMsg(self.snd, SoundRequest.PLAY_START, self.arg, vol=self.vol, **kwargs)

    def stop(self) -> None:
        """Stop the sound."""
        self.client.sendMsg(self.snd, SoundRequest.PLAY_STOP, self.arg)


class SoundClient:
    """Sends requests to soundplay_node.

    Each method that plays a sound accepts ``blocking`` (True: wait until the sound has ended), ``replace`` (False: wait
    until no other sound is playing), ``server_timeout`` and ``result_timeout``. Files are on soundplay_node's machine;
    relative paths refer to the package's sound folder.
    """

    def __init__(
        self, blocking: bool = False, sound_action: str = "sound_play", sound_topic: str = "robotsound"
    ) -> None:
        self._blocking = blocking
        self._playing = False
        self.actionclient = SimpleActionClient(sound_action, SoundRequestAction)
        self.pub: rospy.Publisher[SoundRequest] = rospy.Publisher(sound_topic, SoundRequest, queue_size=5)
        self.sub = rospy.Subscriber(f"{sound_action}/status", GoalStatusArray, self._action_status_cb)

    def voiceSound(self, s: str, volume: float = 1.0) -> Sound:
        """Return a sound that speaks the text ``s``."""
        return Sound(self, SoundRequest.SAY, s, volume=volume)

    def waveSound(self, sound: str, volume: float = 1.0) -> Sound:
        """Return a sound that plays a sound file."""
        return Sound(self, SoundRequest.PLAY_FILE, _place(sound), volume=volume)

    def builtinSound(self, id: int, volume: float = 1.0) -> Sound:
        """Return one of the package's built-in sounds."""
        return Sound(self, id, "", volume)

    def say(self, text: str, voice: str = "", volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Speak ``text``."""
        self.sendMsg(SoundRequest.SAY, SoundRequest.PLAY_ONCE, text, voice, volume, **kwargs)

    def repeat(self, text: str, volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Speak ``text`` repeatedly."""
        self.sendMsg(SoundRequest.SAY, SoundRequest.PLAY_START, text, vol=volume, **kwargs)

    def stopSaying(self, text: str) -> None:
        """Stop speaking ``text``."""
        self.sendMsg(SoundRequest.SAY, SoundRequest.PLAY_STOP, text)

    def playWave(self, sound: str, volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Play a sound file once."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_ONCE, _place(sound), vol=volume, **kwargs)

    def startWave(self, sound: str, volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Play a sound file repeatedly."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_START, _place(sound), vol=volume, **kwargs)

    def stopWave(self, sound: str) -> None:
        """Stop playing a sound file."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_STOP, _place(sound))

    def playWaveFromPkg(
        self, package: str, sound: str, volume: float = 1.0, **kwargs: Unpack[Options]
    ) -> None:
        """Play a sound file from a package once."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_ONCE, sound, package, volume, **kwargs)

    def startWaveFromPkg(
        self, package: str, sound: str, volume: float = 1.0, **kwargs: Unpack[Options]
    ) -> None:
        """Play a sound file from a package repeatedly."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_START, sound, package, volume, **kwargs)

    def stopWaveFromPkg(self, sound: str, package: str) -> None:
        """Stop playing a sound file from a package."""
        self.sendMsg(SoundRequest.PLAY_FILE, SoundRequest.PLAY_STOP, sound, package)

    def play(self, sound: int, volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Play a built-in sound once, for example SoundRequest.BACKINGUP."""
        self.sendMsg(sound, SoundRequest.PLAY_ONCE, "", vol=volume, **kwargs)

    def start(self, sound: int, volume: float = 1.0, **kwargs: Unpack[Options]) -> None:
        """Play a built-in sound repeatedly."""
        self.sendMsg(sound, SoundRequest.PLAY_START, "", vol=volume, **kwargs)

    def stop(self, sound: int) -> None:
        """Stop a built-in sound."""
        self.sendMsg(sound, SoundRequest.PLAY_STOP, "")

    def stopAll(self) -> None:
        """Stop all sounds."""
        self.stop(SoundRequest.ALL)

    def sendMsg(
        self,
        snd: int,
        cmd: int,
        s: str,
        arg2: str = "",
        vol: float = 1.0,
        replace: bool = True,
        server_timeout: times.Duration | None = None,
        result_timeout: times.Duration | None = None,
        blocking: bool | None = None,
        **kwargs: object,
    ) -> None:
        """Send a request to soundplay_node. A timeout of None waits indefinitely for the server, or for the sound to end."""
        request = SoundRequest(sound=snd, command=cmd, volume=max(0, min(1, vol)), arg=s, arg2=arg2)
        if not (self._blocking if blocking is None else blocking):
            self.pub.publish(request)
            if self.pub.get_num_connections() < 1:
                rospy.logwarn(
                    "Sound command issued, but no node is subscribed to the topic. Perhaps you forgot to run "
                    "soundplay_node.py?"
                )
            return

        if _waits(server_timeout) and not self.actionclient.wait_for_server(
            server_timeout or rospy.Duration()
        ):
            return
        while not replace and self._playing:
            rospy.sleep(0.1)
        self.actionclient.send_goal(SoundRequestGoal(sound_request=request))
        if _waits(result_timeout):
            self.actionclient.wait_for_result(result_timeout or rospy.Duration())

    def _action_status_cb(self, msg: GoalStatusArray) -> None:
        self._playing = any(each.status == GoalStatus.ACTIVE for each in msg.status_list)


def _waits(timeout: times.Duration | None) -> bool:
    return timeout is None or timeout > rospy.Duration(0)


def _place(sound: str) -> str:
    """Return the absolute path of a sound file; a relative path starts in the package's sound folder."""
    if sound.startswith("/") or Path(sound).is_absolute():
        return sound
    return f"{RosPack().get_path('sound_play')}/sounds/{sound}"
