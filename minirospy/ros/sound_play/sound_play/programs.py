"""The programs say.py, play.py and others. Each sends a request to soundplay_node.

Source: http://wiki.ros.org/sound_play.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress

from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from std_msgs.msg import Bool

from minirospy import client as rospy
from minirospy.ros.sound_play.sound_play.libsoundplay import SoundClient

__all__ = ["is_speaking", "play", "playbuiltin", "playpackage", "say", "shutup"]

_CONNECT_SECONDS = 5.0
_VOICE = "voice_kal_diphone"


def say() -> int:
    """Speak the text from the command line or stdin; return the exit status."""
    words = rospy.myargv()[1:]
    if words[:1] == ["--help"] or len(words) > 3:
        return _usage(
            "say.py ['String to say.' [voice [volume]]]", "Says a string, or the standard input.", 255
        )
    volume = _volume(words[2:])
    if volume is None:
        return 1
    if not words:
        print("Awaiting something to say on standard input.")
    text = words[0] if words else sys.stdin.read()
    voice = words[1] if len(words) > 1 else _VOICE

    def request(client: SoundClient) -> None:
        rospy.loginfo(f"Saying: {text}")
        rospy.loginfo(f"Voice: {voice}")
        rospy.loginfo(f"Volume: {volume}")
        client.say(text, voice, volume)

    return _request("say", request)


def play() -> int:
    """Play a file; return the exit status."""

    def request(client: SoundClient, words: list[str], volume: float) -> None:
        rospy.loginfo(f'Playing "{words[0]}".')
        client.playWave(words[0], volume)

    return _play(
        "play.py sound_to_play.(ogg|wav) [volume]", "Plays a file, by its absolute path.", 1, request
    )


def playbuiltin() -> int:
    """Play a built-in sound, given by its number; return the exit status."""

    def request(client: SoundClient, words: list[str], volume: float) -> None:
        rospy.loginfo(f"Playing sound {words[0]}.")
        client.play(int(words[0]), volume)

    return _play(
        "playbuiltin.py <sound_id> [volume]",
        "Plays a sound of sound_play/SoundRequest.",
        1,
        request,
        str.isdecimal,
    )


def playpackage() -> int:
    """Play a file from a package; return the exit status."""

    def request(client: SoundClient, words: list[str], volume: float) -> None:
        rospy.loginfo(f'Playing "{words[1]}" from pkg "{words[0]}".')
        client.playWaveFromPkg(words[0], words[1], volume)

    return _play(
        "playpackage.py package sound_to_play.(ogg|wav) [volume]", "Plays a file of a package.", 2, request
    )


def shutup() -> int:
    """Send "stop all sounds" every 100 ms until Ctrl-C; return the exit status."""
    rospy.init_node("shutup", anonymous=True)
    client = SoundClient()
    _connect(client)
    rospy.loginfo("Sending stopAll commande every 100 ms.")
    rospy.loginfo("Note: This will not prevent a node that is continuing to issue commands")
    rospy.loginfo("from producing sound.")
    rospy.loginfo("Press Ctrl+C to exit.")
    with suppress(rospy.ROSInterruptException):
        while not rospy.is_shutdown():
            client.stopAll()
            rospy.sleep(0.1)
    return 0


def is_speaking() -> int:
    """Publish on ~output/is_speaking whether the action on ~robotsound has an active goal; return the exit status."""
    rospy.init_node("is_speaking")
    active = {GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING}
    state = {"is_speaking": False}

    def received(message: GoalStatusArray) -> None:
        state["is_speaking"] = any(each.status in active for each in message.status_list)

    publisher: rospy.Publisher[Bool] = rospy.Publisher("~output/is_speaking", Bool, queue_size=1)
    subscriber = rospy.Subscriber("~robotsound", GoalStatusArray, received, queue_size=1)
    timer = rospy.Timer(rospy.Duration(0.01), lambda event: publisher.publish(state["is_speaking"]))
    rospy.spin()
    del subscriber, timer
    return 0


def _play(
    usage: str,
    text: str,
    count: int,
    request: Callable[[SoundClient, list[str], float], object],
    is_right: Callable[[str], bool] = lambda word: word != "--help",
) -> int:
    """Send a request built from ``count`` command-line arguments and an optional volume; return the exit status."""
    words = rospy.myargv()[1:]
    if not count <= len(words) <= count + 1 or not is_right(words[0]):
        return _usage(usage, text)
    volume = _volume(words[count:])
    if volume is None:
        return 1
    return _request("play", lambda client: request(client, words, volume))


def _request(name: str, request: Callable[[SoundClient], object]) -> int:
    rospy.init_node(name, anonymous=True)
    client = SoundClient()
    with suppress(rospy.ROSInterruptException):
        _connect(client)
        request(client)
        # The node exits next, so give the message time to be sent.
        rospy.sleep(0.2)
    return 0


def _connect(client: SoundClient) -> None:
    end = rospy.Time.now() + rospy.Duration.from_sec(_CONNECT_SECONDS)
    while not client.pub.get_num_connections() and rospy.Time.now() < end:
        rospy.sleep(0.02)


def _volume(words: list[str]) -> float | None:
    """Return the volume argument, or 1.0 if it is missing; print an error and return None if it is not a number."""
    try:
        return float(words[0]) if words else 1.0
    except ValueError:
        print(f"ERROR: the volume is not a number: {words[0]}", file=sys.stderr)
        return None


def _usage(line: str, text: str, status: int = 1) -> int:
    print(f"Usage: {line}\n\n{text}\nThe volume is a number from 0 to 1.")
    return status
