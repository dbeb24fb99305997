"""sound_play: its client's requests, and its node, with players that record their calls."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import wave
from pathlib import Path

import pytest

from minirospy.base.environment import Environment
from minirospy.ros.roslaunch.launcher.load import load_files
from minirospy.ros.sound_play.sound_play.players import PLAYERS, SPEAKERS, play_command, say_command
from minirospy.ros.sound_play.sound_play.tones import BUILTIN, wav_of
from minirospy.workspace.packages import Packages
from tests.waiting import wait_until

SCRIPTS = Path(__file__).parents[3] / "msgs" / "sound_play" / "scripts"

CLIENT = """
import queue
import rospy
from sound_play.libsoundplay import SoundClient
from sound_play.msg import SoundRequest

rospy.init_node("client")
requests = queue.Queue()
subscriber = rospy.Subscriber("robotsound", SoundRequest, requests.put)
client = SoundClient()
while not (subscriber.get_num_connections() and client.pub.get_num_connections()):
    rospy.sleep(0.02)
client.say("hello", "voice", 0.5)
client.repeat("hello")
client.stopSaying("hello")
client.playWave("/a/b.wav", 7)
client.startWave("beep.wav")
client.stopWave("/a/b.wav")
client.playWaveFromPkg("sound_play", "sounds/x.wav", -1)
client.startWaveFromPkg("sound_play", "sounds/x.wav")
client.stopWaveFromPkg("sounds/x.wav", "sound_play")
client.play(SoundRequest.BACKINGUP)
client.start(SoundRequest.NEEDS_PLUGGING)
client.stop(SoundRequest.NEEDS_PLUGGING)
client.stopAll()
sounds = client.voiceSound("text", 0.25), client.waveSound("/c.wav"), client.builtinSound(3)
for sound in sounds:
    sound.play()
    sound.repeat()
    sound.stop()
for _ in range(22):
    request = requests.get(timeout=30)
    arg = request.arg.rpartition("sound_play/")[2]
    print(request.sound, request.command, round(request.volume, 2), arg, request.arg2)
"""
REQUESTS = """\
-3 1 0.5 hello voice
-3 2 1.0 hello
-3 0 1.0 hello
-2 1 1.0 /a/b.wav
-2 2 1.0 sounds/beep.wav
-2 0 1.0 /a/b.wav
-2 1 0.0 sounds/x.wav sound_play
-2 2 1.0 sounds/x.wav sound_play
-2 0 1.0 sounds/x.wav sound_play
1 1 1.0
3 2 1.0
3 0 1.0
-1 0 1.0
-3 1 0.25 text
-3 2 0.25 text
-3 0 1.0 text
-2 1 1.0 /c.wav
-2 2 1.0 /c.wav
-2 0 1.0 /c.wav
3 1 1.0
3 2 1.0
3 0 1.0
"""


def run(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
        stdin=subprocess.DEVNULL,
        env={**os.environ, **environment},
    )


def test_launch_file_takes_the_args_of_ross() -> None:
    args = {"device": "hw:1", "loop_rate": "50", "default_voice": "voice_kal_diphone"}
    spec = load_files([str(SCRIPTS.parent / "soundplay_node.launch")], args, Packages(Environment.read({})))
    assert spec.params == {
        "/soundplay_node/device": "hw:1",
        "/soundplay_node/loop_rate": 50,
        "/soundplay_node/default_voice": "voice_kal_diphone",
    }


def test_client_sends_the_documented_requests(master: str) -> None:
    done = run("-c", CLIENT)
    assert [line.rstrip() for line in done.stdout.splitlines()] == REQUESTS.splitlines(), done.stderr


def test_players_get_file_and_volume() -> None:
    for name in PLAYERS:
        command = play_command("/a/b c.wav", 0.5, lambda other, name=name: other if other == name else None)
        assert command is not None
        assert command.words[0] == name
        assert any("/a/b c.wav" in word for word in command.words)
    assert play_command("/a.wav", 1, lambda name: None) is None


def test_a_device_of_alsa_is_given_to_aplay() -> None:
    command = play_command("/a.wav", 0.5, lambda name: name, "plughw:1,0")
    assert command is not None
    assert list(command.words) == ["aplay", "-D", "plughw:1,0", "-q", "/a.wav"]
    without_aplay = play_command("/a.wav", 0.5, lambda name: name if name == "ffplay" else None, "plughw:1,0")
    assert without_aplay is not None
    assert without_aplay.variables == {
        "ALSA_CARD": "1",
        "AUDIODEV": "plughw:1,0",
        "SDL_AUDIODRIVER": "alsa",
    }
    spoken = say_command("a", "", 1, lambda name: name, "sysdefault:CARD=Device")
    assert spoken is not None
    assert spoken.variables["ALSA_CARD"] == "Device"


def test_another_device_is_one_of_the_sound_server() -> None:
    command = play_command("/a.wav", 0.5, lambda name: name, "alsa_output.usb")
    assert command is not None
    assert list(command.words) == ["paplay", "--device=alsa_output.usb", "--volume=32768", "/a.wav"]
    assert command.variables == {"PULSE_SINK": "alsa_output.usb"}
    for name in ("", "default"):
        default = play_command("/a.wav", 0.5, lambda name: name, name)
        assert default is not None
        assert list(default.words) == ["paplay", "--volume=32768", "/a.wav"]
        assert default.variables == {}


def test_speakers_get_a_text_as_no_option() -> None:
    for name in SPEAKERS:
        command = say_command("-x; rm", "v", 0.5, lambda other, name=name: other if other == name else None)
        assert command is not None
        assert command.text == "-x; rm" or list(command.words) == ["flite", "-t", "-x; rm"]
    assert say_command("a", "", 1, lambda name: None) is None


def test_quotes_in_a_file_name_stay_a_name() -> None:
    command = play_command("C:\\a'; b.wav", 1, lambda name: name if name == "powershell" else None)
    assert command is not None
    assert "'C:\\a''; b.wav'" in command.words[-1]


def test_voices_of_festival_are_not_given_to_espeak() -> None:
    command = say_command("a", "voice_kal_diphone", 1, lambda name: name if name == "espeak" else None)
    assert command is not None
    assert "-v" not in command.words


def test_builtin_sounds_are_wav_files() -> None:
    for notes in BUILTIN.values():
        with wave.open(io.BytesIO(wav_of(notes))) as sound:
            assert (sound.getnchannels(), sound.getsampwidth()) == (1, 2)
            assert sound.getnframes() / sound.getframerate() == pytest.approx(0.18 * len(notes))


DRIVE = """
import sys
import rospy, actionlib
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from sound_play.libsoundplay import SoundClient
from sound_play.msg import SoundRequest, SoundRequestAction, SoundRequestGoal

log = sys.argv[1]
rospy.init_node("drive", log_level=rospy.ERROR)
client = SoundClient()


def wait_for(condition):
    for _ in range(1500):
        if condition():
            return True
        rospy.sleep(0.02)
    return False


def called():
    return open(log).read().splitlines()


def active(count):
    return wait_for(lambda: rospy.wait_for_message("/diagnostics", DiagnosticArray).status[0].message
                    == f"{count} sounds playing")


print(wait_for(client.pub.get_num_connections))
client.say("hello there", blocking=True)
print(called()[-1])
client.play(SoundRequest.BACKINGUP, 0.5, blocking=True)
print(called()[-1].replace(called()[-1].split()[-1], "FILE"), called()[-1].endswith("/1.wav"))
client.start(SoundRequest.NEEDS_PLUGGING)
print(wait_for(lambda: len(called()) >= 5), active(1))
client.stopAll()
print(active(0))

action = actionlib.SimpleActionClient("sound_play", SoundRequestAction)
print(action.wait_for_server(rospy.Duration(30)))


def do(cancels=False, plays=True, **fields):
    seen = []
    action.send_goal(SoundRequestGoal(SoundRequest(**fields)), feedback_cb=lambda each: seen.append(each.playing))
    if cancels:
        # Feedback may come before the status.
        wait_for(lambda: seen and action.get_state() == GoalStatus.ACTIVE)
        action.cancel_goal()
    action.wait_for_result(rospy.Duration(30))
    if plays:
        # Feedback comes on another connection than the result.
        wait_for(lambda: seen)
    print(action.get_state(), action.get_goal_status_text(), bool(seen) or None)


do(sound=SoundRequest.SAY, command=SoundRequest.PLAY_ONCE, arg="once")
do(sound=SoundRequest.NEEDS_UNPLUGGING, command=SoundRequest.PLAY_START, cancels=True)
do(sound=SoundRequest.PLAY_FILE, command=SoundRequest.PLAY_ONCE, arg="/no/such.wav", plays=False)
do(sound=SoundRequest.PLAY_FILE, command=SoundRequest.PLAY_ONCE, arg="x.wav", arg2="no_such_package", plays=False)
do(sound=77, command=SoundRequest.PLAY_ONCE, plays=False)
do(sound=SoundRequest.SAY, command=9, plays=False)
do(sound=SoundRequest.ALL, command=SoundRequest.PLAY_STOP, plays=False)
"""
PRINTED = """\
True
espeak --stdin -a 100 | hello there
paplay --volume=32768 FILE True
True True
True
True
3  True
2  True
4 Error setting up to play "/no/such.wav". Does this file exist on the machine on which sound_play is running? None
4 package no_such_package is not found None
4 77 is not a sound of SoundRequest None
4 9 is not a command of SoundRequest None
3  None
"""


@pytest.fixture
def players(tmp_path: Path) -> tuple[Path, Path]:
    """Return a folder with players that write a line for each call, and the file that they write."""
    log = tmp_path / "log"
    log.touch()
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in ("paplay", "espeak"):
        program = folder / name
        text = "sys.stdin.read()" if name == "espeak" else "''"
        program.write_text(
            f"#!{sys.executable}\nimport sys, time\nsaid = {text}\n"
            f"open({str(log)!r}, 'a').write(' '.join([{name!r}, *sys.argv[1:]]) + (' | ' + said if said else '') + chr(10))\n"
            # The last player sends feedback while it plays.
            "time.sleep(2 if said == 'once' else 0.1)\n"
        )
        program.chmod(0o755)
    return folder, log


@pytest.mark.skipif(sys.platform == "win32", reason="the players are scripts")
def test_node_plays_by_the_players_of_this_machine(players: tuple[Path, Path], master: str) -> None:
    folder, log = players
    node = subprocess.Popen(
        [sys.executable, str(SCRIPTS / "soundplay_node.py")],
        env={**os.environ, "PATH": str(folder)},
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    try:
        done = run("-c", DRIVE, str(log))
        assert done.stdout == PRINTED, done.stderr
        for words, line in (
            (("say.py", "one two"), "espeak --stdin -a 100 | one two"),
            (("playbuiltin.py", "1", "0.25"), "paplay --volume=16384"),
        ):
            before = len(log.read_text().splitlines())
            script = run(str(SCRIPTS / words[0]), *words[1:])
            assert script.returncode == 0, script.stderr
            wait_until(lambda n=before: len(log.read_text().splitlines()) > n or node.poll() is not None)
            assert node.poll() is None
            assert log.read_text().splitlines()[before].startswith(line)
    finally:
        node.terminate()
        node.wait(30)


def test_node_without_players_says_what_to_install(tmp_path: Path, master: str) -> None:
    node = subprocess.Popen(
        [sys.executable, str(SCRIPTS / "soundplay_node.py")],
        env={**os.environ, "PATH": str(tmp_path)},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        done = run(
            "-c",
            "import rospy, sys\n"
            "from sound_play.libsoundplay import SoundClient\n"
            "rospy.init_node('c')\n"
            "c = SoundClient()\n"
            "c.say('x', blocking=True)\n"
            "print(c.actionclient.get_state(), c.actionclient.get_goal_status_text())\n",
        )
    finally:
        node.terminate()
        _, said = node.communicate(timeout=30)
    assert done.stdout.startswith("4 no program that says texts is installed: one of espeak-ng,"), done.stderr
    assert ("powershell" in done.stdout + said) == (sys.platform == "win32")
    assert "no program that plays sounds is installed: one of paplay," in said


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["say.py", "--help"], 255, "Usage: say.py"),
        (["say.py", "a", "b", "loud"], 1, "ERROR: the volume is not a number: loud"),
        (["play.py"], 1, "Usage: play.py"),
        (["playbuiltin.py", "one"], 1, "Usage: playbuiltin.py"),
        (["playpackage.py", "a"], 1, "Usage: playpackage.py"),
    ],
)
def test_wrong_words_are_refused(words: list[str], status: int, text: str) -> None:
    done = run(str(SCRIPTS / words[0]), *words[1:])
    assert done.returncode == status
    assert text in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
