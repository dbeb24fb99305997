"""soundplay_node.py: plays the sounds requested through the topic robotsound or the action sound_play.

Parameters: ~default_voice, ~device, ~loop_rate (100 Hz, for the action's feedback). Source: http://wiki.ros.org/sound_play.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterable
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sound_play.msg import (
    SoundRequest,
    SoundRequestAction,
    SoundRequestFeedback,
    SoundRequestGoal,
    SoundRequestResult,
)

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.ros.actionlib.actionlib.simple_server import SimpleActionServer
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rospkg.rospkg.rospack import RosPack
from minirospy.ros.sound_play.sound_play.players import (
    PLAYERS,
    SPEAKERS,
    Command,
    installable,
    play_command,
    say_command,
)
from minirospy.ros.sound_play.sound_play.tones import BUILTIN, wav_of

__all__ = ["SoundError", "SoundNode", "main"]

Key = tuple[int, str, str]


class SoundError(Exception):
    """Raised if a sound cannot be played. The message states the reason and a fix."""


class PlayingSound:
    """A player process that plays a sound once or repeatedly, controlled by a separate thread."""

    def __init__(self, command: Command, repeats: bool) -> None:
        self._command = command
        self._repeats = repeats
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._is_stopped = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def is_playing(self) -> bool:
        """Return whether the sound is still playing."""
        return self._thread.is_alive()

    def stop(self) -> None:
        """Stop the sound."""
        with self._lock:
            self._is_stopped = True
            if self._process is not None:
                self._process.terminate()

    def _run(self) -> None:
        while True:
            with self._lock:
                if self._is_stopped:
                    return
                try:
                    self._process = subprocess.Popen(
                        list(self._command.words),
                        env={**os.environ, **self._command.variables},
                        stdin=subprocess.PIPE,
                        stdout=subprocess.DEVNULL,
                        stderr=subprocess.PIPE,
                    )
                except OSError as error:
                    rospy.logerr(f"{self._command.words[0]} cannot be started: {error}")
                    return
            text = (self._command.text or "").encode("utf-8", "replace")
            _, said = self._process.communicate(text)
            if self._is_stopped:
                return
            if self._process.returncode:
                lines = said.decode("utf-8", "replace").strip().splitlines() or ["no reason given"]
                rospy.logerr(
                    f"{self._command.words[0]} failed with status {self._process.returncode}: {lines[-1]}"
                )
                return
            if not self._repeats:
                return


class SoundNode:
    """The sound node. Holds the playing sounds, keyed by request."""

    def __init__(self, folder: Path) -> None:
        """Create the node. ``folder`` contains the package's sound files."""
        self._folder = folder
        self._default_voice = str(rospy.get_param("~default_voice", "") or "")
        self._device = str(rospy.get_param("~device", "") or "")
        self._feedback_pause = 1.0 / max(1.0, float(rospy.get_param("~loop_rate", 100)))
        self._lock = threading.Lock()
        self._sounds: dict[Key, PlayingSound] = {}
        self._diagnostics: rospy.Publisher[DiagnosticArray] = rospy.Publisher(
            "/diagnostics", DiagnosticArray, queue_size=1
        )
        self._subscriber = rospy.Subscriber("robotsound", SoundRequest, self._requested)
        self._server = SimpleActionServer(
            "sound_play", SoundRequestAction, execute_cb=self._execute, auto_start=False
        )
        self._server.start()

    def handle(self, request: SoundRequest) -> PlayingSound | None:
        """Play or stop the requested sound; return the playing sound. Raise SoundError if the sound cannot be played."""
        with self._lock:
            key = (request.sound, request.arg, request.arg2)
            if request.command == SoundRequest.PLAY_STOP:
                self._stop(None if request.sound == SoundRequest.ALL else key)
                return None
            if request.command not in (SoundRequest.PLAY_ONCE, SoundRequest.PLAY_START):
                raise SoundError(f"{request.command} is not a command of SoundRequest")
            command = self._command(request)
            self._stop(key)
            sound = self._sounds[key] = PlayingSound(command, request.command == SoundRequest.PLAY_START)
            return sound

    def close(self) -> None:
        """Stop all sounds."""
        with self._lock:
            self._stop(None)

    def _stop(self, key: Key | None) -> None:
        for each in list(self._sounds) if key is None else [key]:
            sound = self._sounds.pop(each, None)
            if sound is not None:
                sound.stop()

    def _command(self, request: SoundRequest) -> Command:
        volume = max(0.0, min(1.0, float(request.volume)))
        if request.sound == SoundRequest.SAY:
            voice = request.arg2 or self._default_voice
            command = say_command(request.arg, voice, volume, shutil.which, self._device)
            if command is None:
                raise SoundError(_missing(SPEAKERS, "says texts"))
            return command
        command = play_command(str(self._file(request)), volume, shutil.which, self._device)
        if command is None:
            raise SoundError(_missing(PLAYERS, "plays sounds"))
        return command

    def _file(self, request: SoundRequest) -> Path:
        if request.sound != SoundRequest.PLAY_FILE:
            if request.sound not in BUILTIN:
                raise SoundError(f"{request.sound} is not a sound of SoundRequest")
            file = self._folder / f"{request.sound}.wav"
            if not file.exists():
                file.write_bytes(wav_of(BUILTIN[request.sound]))
            return file
        file = Path(request.arg)
        if request.arg2:
            try:
                file = Path(RosPack().get_path(request.arg2)) / request.arg
            except ResourceNotFound as error:
                raise SoundError(f"package {request.arg2} is not found") from error
        if not file.is_file():
            place = f' from package "{request.arg2}"' if request.arg2 else ""
            raise SoundError(
                f'Error setting up to play "{request.arg}"{place}. Does this file exist on the machine on which '
                "sound_play is running?"
            )
        return file.resolve()

    def _requested(self, request: SoundRequest) -> None:
        try:
            self.handle(request)
        except SoundError as error:
            rospy.logerr(str(error))

    def _execute(self, goal: SoundRequestGoal) -> None:
        """Stop all other sounds, play the requested sound to its end, and publish feedback meanwhile."""
        self.close()
        start = rospy.Time.now()
        feedback = SoundRequestFeedback()
        try:
            sound = self.handle(goal.sound_request)
        except SoundError as error:
            rospy.logerr(str(error))
            self._server.set_aborted(text=str(error))
            return
        pause = SignalSafeEvent()
        while sound is not None and sound.is_playing and not rospy.is_shutdown():
            if self._server.is_preempt_requested():
                rospy.loginfo("sound_play action: Preempted")
                sound.stop()
                self._server.set_preempted()
                return
            feedback.playing, feedback.stamp = True, _time_since(start)
            self._server.publish_feedback(feedback)
            pause.wait(self._feedback_pause)
        rospy.loginfo("sound_play action: Succeeded")
        self._server.set_succeeded(SoundRequestResult(playing=False, stamp=_time_since(start)))

    def publish_state(self) -> None:
        """Publish the number of playing sounds."""
        with self._lock:
            self._sounds = {key: sound for key, sound in self._sounds.items() if sound.is_playing}
            count = len(self._sounds)
        status = DiagnosticStatus(
            name=f"{rospy.get_name().lstrip('/')}: Node State",
            message=f"{count} sounds playing",
            values=[KeyValue("Active sounds", str(count))],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.get_rostime()
        self._diagnostics.publish(array)


def _time_since(start: rospy.Time) -> rospy.Time:
    return rospy.Time.from_sec(max(0.0, (rospy.Time.now() - start).to_sec()))


def _missing(programs: Iterable[str], what: str) -> str:
    return f"no program that {what} is installed: one of {', '.join(installable(programs, sys.platform))}"


def main() -> int:
    """Run the node; return the exit status."""
    rospy.init_node("sound_play")
    with tempfile.TemporaryDirectory(prefix="sound_play") as folder:
        node = SoundNode(Path(folder))
        for programs, what in ((PLAYERS, "plays sounds"), (SPEAKERS, "says texts")):
            if not any(map(shutil.which, programs)):
                rospy.logwarn(_missing(programs, what))
        rospy.loginfo("sound_play node is ready to play sound")
        try:
            while not rospy.is_shutdown():
                node.publish_state()
                rospy.sleep(1.0)
        except rospy.ROSInterruptException:
            pass
        finally:
            node.close()
    return 0
