"""minirospy's recorder and player with C++ `rosbag record` and `rosbag play`: bags and messages are equal in both directions."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from rosbags.rosbag1 import Reader

from minirospy.core.bag.writer import BagWriter
from minirospy.core.wire.tcpros import InterfaceType
from tests.interop.conftest import PATIENCE, REAL_PYTHON, environment
from tests.ros.rosbag.conftest import STRING, Talker, connected, said, say
from tests.waiting import wait_until

CPP = Path("/usr/lib/rosbag")
BOOL = InterfaceType("std_msgs/Bool", "8b94c1b53db61fb6aed406028ad6332a", "bool data\n")
SECOND = 10**9
START = 1000 * SECOND

pytestmark = pytest.mark.skipif(
    not (CPP / "record").exists(), reason="real ROS 1 with rosbag is not installed: make interop"
)


class Stored(NamedTuple):
    """A bag's record of a message, without its time."""

    topic: str
    type: str
    md5sum: str
    callerid: str
    latching: bool
    body: bytes


def stored(path: Path) -> list[Stored]:
    """Return a bag's messages, sorted because two recorders receive two publishers' messages in any order."""
    with Reader(path) as reader:
        return sorted(
            Stored(
                one.topic,
                one.msgtype.replace("/msg/", "/"),
                one.digest,
                one.ext.callerid or "",  # type: ignore[union-attr]
                bool(one.ext.latching),  # type: ignore[union-attr]
                body,
            )
            for one, _, body in reader.messages()
        )


def order(path: Path) -> dict[str, list[bytes]]:
    """Return the messages on each topic in order of time, by topic."""
    found: dict[str, list[bytes]] = {}
    with Reader(path) as reader:
        for connection, _, body in reader.messages():
            found.setdefault(connection.topic, []).append(body)
    return found


Run = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def run(master: str, tmp_path: Path) -> Iterator[Run]:
    """Return a function that starts `rosbag record` or `play`, minirospy's or the C++ one, in tmp_path."""
    started: list[subprocess.Popen[str]] = []

    def run(stack: str, verb: str, *words: str) -> subprocess.Popen[str]:
        code = f"import sys; from minirospy.ros.rosbag.commands.rosbag_{verb} import main; sys.exit(main())"
        command = [sys.executable, "-c", code] if stack == "ours" else [str(CPP / verb)]
        process = subprocess.Popen(
            [*command, *words],
            cwd=tmp_path,
            env=environment(master, stack),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def talkers(master: str) -> Iterator[tuple[Talker, Talker]]:
    """Return two nodes that publish."""
    nodes = Talker("one"), Talker("two")
    yield nodes
    for node in nodes:
        node.close()


def finish(process: subprocess.Popen[str]) -> tuple[str, str]:
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    return output, errors


def holds(path: Path, text: bytes) -> None:
    """Wait until a recording with ``--chunksize 0`` contains this text."""
    active = Path(f"{path}.active")
    wait_until(lambda: active.exists() and text in active.read_bytes())


def test_both_recorders_record_the_same(talkers: tuple[Talker, Talker], run: Run, tmp_path: Path) -> None:
    one, two = talkers
    chatter = [one.advertise("/chatter"), two.advertise("/chatter")]
    latched = one.advertise("/map", latch=True)
    say(latched, "the map")
    recorders = [
        run(stack, "record", "--chunksize", "0", "-O", stack, "/chatter", "/map") for stack in ("ours", "cpp")
    ]
    for publication in (*chatter, latched):
        wait_until(lambda of=publication: len(of.links) == 2)  # type: ignore[misc]
    for i in range(50):
        say(chatter[i % 2], f"{i} " + "x" * (i * 4000))
    say(chatter[0], "the last of one")
    say(chatter[1], "the last of two")
    for stack in ("ours", "cpp"):
        for text in (b"the last of one", b"the last of two", b"the map"):
            holds(tmp_path / f"{stack}.bag", text)
    for recorder in recorders:
        finish(recorder)

    ours, theirs = stored(tmp_path / "ours.bag"), stored(tmp_path / "cpp.bag")
    assert len(ours) == 53
    assert ours == theirs


def test_a_type_that_comes_later_is_recorded(
    talkers: tuple[Talker, Talker], run: Run, tmp_path: Path
) -> None:
    """C++ rosbag does not record it, because roscpp uses the md5sum of a topic's first connection for all later ones."""
    one, two = talkers
    texts = one.advertise("/mixed")
    recorder = run("ours", "record", "--chunksize", "0", "-O", "ours", "/mixed")
    connected(texts)
    say(texts, "text")
    holds(tmp_path / "ours.bag", b"text")
    flags = two.advertise("/mixed", type_=BOOL)
    connected(flags)
    flags.publish(b"\x01\0\0\0\x01")
    say(texts, "more text")
    holds(tmp_path / "ours.bag", b"bool data")
    holds(tmp_path / "ours.bag", b"more text")
    finish(recorder)

    assert [(each.type, each.callerid, each.body[-4:]) for each in stored(tmp_path / "ours.bag")] == [
        ("std_msgs/Bool", "/two", b"\x01"),
        ("std_msgs/String", "/one", b"text"),
        ("std_msgs/String", "/one", b"text"),
    ]


@pytest.mark.parametrize("words", [(), ("-j",), ("--lz4",)], ids=["none", "bz2", "lz4"])
def test_ros_reads_the_recording(
    words: tuple[str, ...], talkers: tuple[Talker, Talker], run: Run, tmp_path: Path
) -> None:
    chatter = talkers[0].advertise("/chatter")
    recorder = run("ours", "record", *words, "-l", "100", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(100):
        say(chatter, f"{i:03}" * 5000)
    recorder.communicate(timeout=PATIENCE)

    code = "import rosbag, sys\nfor _, m, _ in rosbag.Bag(sys.argv[1]).read_messages(): print(m.data[:3], len(m.data))"
    answer = subprocess.run(
        [REAL_PYTHON, "-c", code, "out.bag"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert answer.stdout.splitlines() == [f"{i:03} 15000" for i in range(100)]


def test_split_files_are_played_by_ros(talkers: tuple[Talker, Talker], run: Run, tmp_path: Path) -> None:
    chatter = talkers[0].advertise("/chatter")
    recorder = run("ours", "record", "--split", "--size", "1", "-l", "40", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(40):
        say(chatter, f"{i:02}" + "x" * 100_000)
    recorder.communicate(timeout=PATIENCE)
    parts = sorted(path.name for path in tmp_path.glob("out_*.bag"))
    assert len(parts) >= 3

    again = run("ours", "record", "-l", "40", "-O", "again", "/again")
    assert again.stdout
    while "Subscribing" not in again.stdout.readline():
        pass
    # Keep the player running (-k): when a player exits, messages that a subscriber has not read are lost.
    player = run("cpp", "play", "-k", *parts, "--wait-for-subscribers", "/chatter:=/again")
    again.communicate(timeout=PATIENCE)
    finish(player)
    assert [one.body for one in stored(tmp_path / "again.bag")] == [
        one.body for part in parts for one in stored(tmp_path / part)
    ]


def test_ros_reindexes_a_killed_recording(talkers: tuple[Talker, Talker], run: Run, tmp_path: Path) -> None:
    chatter = talkers[0].advertise("/chatter")
    recorder = run("ours", "record", "--chunksize", "10", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(200):
        say(chatter, f"{i:03}" + "x" * 1000)
    active = tmp_path / "out.bag.active"
    wait_until(lambda: active.exists() and active.stat().st_size > 150_000)
    recorder.kill()
    recorder.wait()
    killed = active.rename(tmp_path / "killed.bag")
    # The end of a file after a power cut.
    with killed.open("r+b") as stream:
        stream.truncate(killed.stat().st_size - 5)

    subprocess.run(
        ["/usr/bin/rosbag", "reindex", "killed.bag"], cwd=tmp_path, check=True, capture_output=True
    )
    texts = [said(one.body)[:3] for one in stored(killed)]
    assert len(texts) > 100
    assert texts == [f"{i:03}" for i in range(len(texts))]


def make_bag(path: Path) -> None:
    """Write a bag with two publishers of a topic, one latched topic, and irregular times."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        numbers = [
            writer.add_connection(
                topic,
                {
                    "callerid": callerid,
                    "latching": latching,
                    "md5sum": STRING.md5sum,
                    "message_definition": STRING.definition,
                    "topic": topic,
                    "type": STRING.name,
                },
            )
            for topic, callerid, latching in (
                ("/chatter", "/a", "0"),
                ("/chatter", "/b", "0"),
                ("/map", "/a", "1"),
            )
        ]
        for i in range(60):
            text = f"{i:02}".encode() + b"x" * (i * 1000)
            number = numbers[2] if i == 30 else numbers[i % 2]
            writer.write(number, START + i * i * SECOND // 3000, len(text).to_bytes(4, "little") + text)
        writer.close()


@pytest.mark.parametrize(("player", "recorder"), [("cpp", "ours"), ("ours", "cpp"), ("ours", "ours")])
def test_played_messages_are_recorded(player: str, recorder: str, run: Run, tmp_path: Path) -> None:
    make_bag(tmp_path / "in.bag")
    recording = run(recorder, "record", "--chunksize", "0", "-O", "out", "/chatter", "/map")
    start = time.monotonic()
    # Keep the player running (-k): when a player exits, messages that a subscriber has not read are lost.
    playing = run(player, "play", "-k", "in.bag", "-d", "1", "--wait-for-subscribers")
    for text in (b"59x", b"30x"):
        holds(tmp_path / "out.bag", text)
    # A stalled machine makes the playback longer, and single intervals in the recording longer or shorter.
    assert time.monotonic() - start > 59**2 / 3000
    output, errors = finish(playing)
    assert output.replace("\r", "\n").splitlines()[-1].startswith(" [RUNNING]  Bag Time:   100")
    assert not errors
    finish(recording)

    before, after = stored(tmp_path / "in.bag"), stored(tmp_path / "out.bag")
    # One node publishes the messages of several nodes.
    assert sorted(one._replace(callerid="") for one in before) == [one._replace(callerid="") for one in after]
    assert len({one.callerid for one in after}) == 1
    assert order(tmp_path / "out.bag") == order(tmp_path / "in.bag")


@pytest.mark.parametrize("stack", ["ours", "cpp"])
def test_the_service_answers_as_ros(stack: str, run: Run, tmp_path: Path, master: str) -> None:
    make_bag(tmp_path / "in.bag")
    player = run(stack, "play", "in.bag", "--pause", "-d", "0", "-r", "0.01", "__name:=player", "-q")
    wait = ["/usr/bin/rosservice", "call", "--wait", "/player/pause_playback"]

    def call(value: str) -> str:
        return subprocess.run(
            [*wait, value],
            env=environment(master, "rospy"),
            capture_output=True,
            text=True,
            check=True,
            timeout=PATIENCE,
        ).stdout

    answers = [call(value) for value in ("true", "false", "false", "true")]
    finish(player)

    assert answers == [
        'success: False\nmessage: "Bag is already paused."\n',
        'success: True\nmessage: "Playback is now resumed"\n',
        'success: False\nmessage: "Bag is already running."\n',
        'success: True\nmessage: "Playback is now paused"\n',
    ]


@pytest.mark.parametrize("verb", ["record", "play"])
def test_help_is_that_of_ros(verb: str) -> None:
    code = f"import sys; from minirospy.ros.rosbag.commands.rosbag_{verb} import main; sys.exit(main(['-h']))"
    ours = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    theirs = subprocess.run(
        [shutil.which("rosbag", path="/usr/bin") or "rosbag", verb, "-h"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout

    assert ours.startswith(theirs)
