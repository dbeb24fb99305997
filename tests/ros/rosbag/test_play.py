"""`rosbag play` as a process: messages that subscribers receive, output, and keys."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from minirospy.base.environment import Environment
from minirospy.core.bag.writer import BagWriter
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.streams import ToolNode
from tests.ros.rosbag.conftest import GUARD, STRING, Start, Talker, connected, read_until, said
from tests.waiting import wait_until

SECOND = 10**9
START = 1000 * SECOND


class Heard(NamedTuple):
    """A received message."""

    topic: str
    body: bytes
    latching: str
    at: float

    @property
    def text(self) -> str:
        """Return the message's string."""
        return said(self.body)


class Ear:
    """A node that subscribes to any type."""

    def __init__(self) -> None:
        self.node = ToolNode(Environment.read(), "ear")
        self.heard: list[Heard] = []

    def listen(self, topic: str) -> None:
        """Record the messages of a topic."""
        self.node.measure(
            topic,
            lambda one: self.heard.append(Heard(topic, one.body, one.header.get("latching", ""), one.time)),
        )

    @property
    def texts(self) -> list[str]:
        """Return the received strings."""
        return [one.text for one in self.heard]

    def expect(self, *texts: str) -> None:
        """Assert that exactly these strings are received. The last one may arrive only after the player has exited."""
        wait_until(lambda: len(self.heard) >= len(texts))
        assert self.texts == list(texts)


@pytest.fixture
def ear(master: str) -> Iterator[Ear]:
    """Yield a node that subscribes."""
    ear = Ear()
    try:
        yield ear
    finally:
        ear.node.close()


def make_bag(
    path: Path,
    messages: list[tuple[str, float, str]],
    *,
    callerid: str = "/talker",
    latched: tuple[str, ...] = (),
    **changes: str,
) -> str:
    """Write a bag of strings (topic, seconds, string); return its name."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        numbers: dict[str, int] = {}

        for topic, seconds, text in messages:
            if topic not in numbers:
                header = {
                    "topic": topic,
                    "type": STRING.name,
                    "md5sum": STRING.md5sum,
                    "message_definition": STRING.definition,
                    "callerid": callerid,
                    "latching": "1" if topic in latched else "0",
                    **changes,
                }
                numbers[topic] = writer.add_connection(topic, header)

            data = text.encode()
            writer.write(
                numbers[topic], START + round(seconds * SECOND), len(data).to_bytes(4, "little") + data
            )

        writer.close()

    return path.name


def play(start: Start, *words: str, prelude: str = "", **kwargs: int) -> subprocess.Popen[str]:
    # Give subscribers time to connect.
    return start("play", *words, "--wait-for-subscribers", prelude=prelude, **kwargs)


def test_messages_are_played_in_the_order_of_time(ear: Ear, start: Start, tmp_path: Path) -> None:
    one = make_bag(tmp_path / "one.bag", [("/a", 0, "1"), ("/a", 0.2, "3")])
    two = make_bag(tmp_path / "two.bag", [("/a", 0.1, "2"), ("/a", 0.3, "4")])
    ear.listen("/a")
    # This plays for three seconds: if the first message arrives late, little may remain of a shorter time.
    output, errors = play(start, one, "-r", "0.1", "--bags", two).communicate(timeout=GUARD)

    assert errors == ""
    ear.expect("1", "2", "3", "4")
    assert ear.heard[-1].at - ear.heard[0].at > 0.25
    lines = output.replace("\r", "\n").splitlines()
    assert lines[:8] == [
        "Opening one.bag",
        "Opening two.bag",
        "",
        "Waiting 0.2 seconds after advertising topics... done.",
        "",
        "Hit space to toggle paused, or 's' to step.",
        "Waiting for subscribers.",
        "Finished waiting for subscribers.",
    ]
    assert any(line.startswith(" [RUNNING]  Bag Time:   1000.") for line in lines), lines
    assert lines[-1] == "Done."


def test_topics_prefix_start_and_duration(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(
        tmp_path / "b.bag", [(topic, i / 10, f"{topic}{i}") for i in range(10) for topic in ("/a", "/b")]
    )
    ear.listen("/robot/a")
    words = ["-p", "/robot", "-s", "0.3", "-u", "0.3", "-q", "--topics", "/a", "--bags", name]
    output, _ = play(start, *words).communicate(timeout=GUARD)

    assert "Using prefix '/robot'' for topics" in output
    ear.expect("/a3", "/a4", "/a5", "/a6")


def test_latched_messages_from_before_the_start_come_first(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(
        tmp_path / "b.bag",
        [("/map", 0, "old"), ("/map", 0.1, "map"), ("/a", 0.2, "no"), ("/a", 1.0, "yes")],
        latched=("/map",),
    )
    for topic in ("/map", "/a"):
        ear.listen(topic)
    play(start, name, "-s", "0.5").communicate(timeout=GUARD)

    wait_until(lambda: len(ear.heard) >= 2)
    assert sorted(ear.texts) == ["map", "yes"]
    assert {one.topic: one.latching for one in ear.heard} == {"/map": "1", "/a": "0"}


def test_late_subscribers_get_the_last_message_of_each_latched_publisher(
    ear: Ear, start: Start, tmp_path: Path
) -> None:
    names = [
        make_bag(
            tmp_path / f"{i}.bag",
            [("/tf_static", i / 10, str(i))],
            callerid=f"/n{i}",
            latched=("/tf_static",),
        )
        for i in range(2)
    ]
    process = start("play", *names, "-k", "-d", "0")
    read_until(process, "Hit space")
    ear.node.wait(0.5)
    ear.listen("/tf_static")
    wait_until(lambda: {"0", "1"} <= set(ear.texts))
    process.send_signal(signal.SIGINT)
    assert process.wait(GUARD) == 0


def test_the_clock_is_published(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", 0, "1"), ("/a", 0.5, "2")])
    ear.listen("/clock")
    ear.listen("/a")
    # This plays for five seconds: a player that stalls skips the output for the time of the stall.
    play(start, name, "--clock", "--hz", "50", "-r", "0.1").communicate(timeout=GUARD)
    wait_until(lambda: [one.topic for one in ear.heard].count("/a") == 2)

    times = [struct.unpack("<II", one.body) for one in ear.heard if one.topic == "/clock"]
    assert len(times) > 5
    assert times == sorted(times)
    assert times[0][0] == 1000
    assert times[-1] <= (1000, 500_000_000)


def test_keys_pause_and_step(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", i, str(i)) for i in range(5)])
    ear.listen("/a")
    process = play(start, name, "--pause", stdin=subprocess.PIPE)
    assert process.stdin
    read_until(process, "[PAUSED ]  Bag Time:")
    for i in range(1, 4):
        process.stdin.write("s")
        process.stdin.flush()
        wait_until(lambda count=i: len(ear.heard) == count)  # type: ignore[misc]
    process.stdin.write(" ")
    process.stdin.flush()
    process.communicate(timeout=GUARD)

    ear.expect("0", "1", "2", "3", "4")


def test_a_service_pauses(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", 0, "1"), ("/a", 0.2, "2")])
    ear.listen("/a")
    process = play(start, name, "--pause", "__name:=player")
    read_until(process, "Finished waiting")

    answers = [call("/player/pause_playback", value) for value in ("true", "false")]
    process.communicate(timeout=GUARD)

    assert answers == [
        'success: False\nmessage: "Bag is already paused."\n',
        'success: True\nmessage: "Playback is now resumed"\n',
    ]
    ear.expect("1", "2")


def call(service: str, value: str) -> str:
    code = "import sys; from minirospy.ros.rosservice.commands.rosservice import main; sys.exit(main())"
    words = [sys.executable, "-c", code, "call", service, value]
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=GUARD).stdout


def test_a_topic_controls_the_rate(ear: Ear, start: Start, talker: Talker, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", i, str(i)) for i in range(4)])
    stamped = InterfaceType("std_msgs/Header", "2176decaecbce78abc3b96ef049fabed", "Header header\n")
    done = talker.advertise("/done", type_=stamped)
    ear.listen("/a")
    process = play(
        start, name, "-r", "20", "--rate-control-topic", "/done", "--rate-control-max-delay", "0.5"
    )
    connected(done)
    read_until(process, "Finished waiting")
    wait_until(lambda: len(ear.heard) == 2)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.5)
    for seconds in (1, 2, 3):
        done.publish(struct.pack("<IIIIxxxx", 16, 0, 1000 + seconds, 0))
    process.communicate(timeout=GUARD)

    ear.expect("0", "1", "2", "3")


def test_two_types_on_a_topic_are_reported(ear: Ear, start: Start, tmp_path: Path) -> None:
    one = make_bag(tmp_path / "one.bag", [("/a", 0, "1"), ("/a", 0.2, "3")])
    two = make_bag(tmp_path / "two.bag", [("/a", 0.1, "2")], md5sum="0" * 32, type="my_msgs/Other")
    ear.listen("/a")
    _, errors = play(start, one, two).communicate(timeout=GUARD)

    ear.expect("1", "3")
    assert "Tried to advertise on topic [/a] with md5sum [" + "0" * 32 in errors


def test_it_loops_until_it_is_interrupted(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", 0, "1"), ("/a", 0.05, "2")])
    ear.listen("/a")
    process = play(start, name, "-l", "-q")
    wait_until(lambda: len(ear.heard) > 6)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=GUARD)

    assert (process.returncode, errors) == (0, "")
    assert ear.texts[:6] == ["1", "2"] * 3


def test_immediate(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", i * 100, str(i)) for i in range(50)])
    ear.listen("/a")
    output, _ = play(start, name, "-i").communicate(timeout=GUARD)

    ear.expect(*map(str, range(50)))
    assert output.endswith(
        "Bag Time:   5900.000000   Duration: 4900.000000 / 4900.000000               \nDone.\n"
    )


STALLED = "from minirospy.ros.rosbag.recording import player; player._STALLED_SECONDS = {}"
PATIENT = STALLED.format(1e9)  # with this, a wait for a subscriber ends only by the test's action


def test_slow_subscriber_gets_all_that_waits_for_it(ear: Ear, start: Start, tmp_path: Path) -> None:
    body = "x" * 1_000_000
    name = make_bag(tmp_path / "b.bag", [("/a", i, body) for i in range(30)])
    goes_on = threading.Event()
    heard: list[int] = []

    def deliver(frame: Frame, _: Header) -> None:
        goes_on.wait(GUARD)
        heard.append(len(frame))

    ear.node.listen("/a", deliver)
    process = play(start, name, "-i", "-q", prelude=PATIENT)
    read_until(process, "Done.")
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(2.0)
    goes_on.set()
    assert process.wait(GUARD) == 0
    wait_until(lambda: len(heard) >= 30)
    assert heard == [4 + len(body)] * 30


def test_subscriber_that_takes_nothing_is_not_waited_for(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", i, "x" * 1_000_000) for i in range(30)])
    ended = threading.Event()
    ear.node.listen("/a", lambda *_: ended.wait(GUARD))
    process = play(start, name, "-i", "-q", prelude=STALLED.format(0.1))
    try:
        assert process.wait(GUARD) == 0
    finally:
        ended.set()


def test_ctrl_c_ends_the_wait_for_a_slow_subscriber(ear: Ear, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", i, "x" * 1_000_000) for i in range(30)])
    goes_on = threading.Event()

    def deliver(_: Frame, __: Header) -> None:
        goes_on.wait(GUARD)

    ear.node.listen("/a", deliver)
    process = play(start, name, "-i", "-q", prelude=PATIENT)
    read_until(process, "Done.")
    process.send_signal(signal.SIGINT)
    assert process.wait(GUARD) == 0
    goes_on.set()


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        ([], 2, "You must specify at least 1 bag file to play back."),
        (["missing.bag"], 1, "bag [missing.bag] not found"),
        (["-r", "0", "b.bag"], 2, "--rate must be above 0"),
        (["-r", "1e-300", "b.bag"], 2, "--rate must be above 0"),
        (["--hz", "inf", "b.bag"], 2, "--hz must be above 0"),
        (["-s", "inf", "b.bag"], 2, "--start must be 0 or positive"),
        (["-u", "nan", "b.bag"], 2, "--duration must be 0 or positive"),
        (["-d", "-1", "b.bag"], 2, "--delay must be 0 or positive"),
        (["empty"], 1, "empty: "),
        (["."], 1, ".: "),
    ],
)
def test_wrong_words(words: list[str], status: int, text: str, start: Start, tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    process = start("play", *words)
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == status
    assert text in errors
    assert "Traceback" not in errors


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
def test_keys_of_a_terminal(ear: Ear, start: Start, tmp_path: Path) -> None:
    import pty
    import termios

    name = make_bag(tmp_path / "b.bag", [("/a", i, str(i)) for i in range(3)])
    ear.listen("/a")
    ours, theirs = pty.openpty()
    before = termios.tcgetattr(theirs)
    # Start a new session, with this terminal as the controlling terminal.
    take = "import os, fcntl, termios; os.setsid(); fcntl.ioctl(0, termios.TIOCSCTTY, 0)"
    process = start("play", name, "--pause", "--wait-for-subscribers", stdin=theirs, prelude=take)
    read_until(process, "Finished waiting")
    os.write(ours, b"s")
    wait_until(lambda: ear.texts == ["0"])
    os.write(ours, b"s")
    wait_until(lambda: ear.texts == ["0", "1"])
    os.write(ours, b"\x03")
    _, errors = process.communicate(timeout=GUARD)
    after = termios.tcgetattr(theirs)
    os.close(ours)
    os.close(theirs)

    assert (process.returncode, errors) == (0, "")
    assert after == before


@pytest.mark.parametrize("format_", ["bag", "mcap"])
@pytest.mark.parametrize(
    ("words", "length"),
    [("", "0.400000"), ("--topics /a", "0.300000"), ("-u 0.25", "0.200000")],
)
def test_the_duration_is_that_of_the_messages_that_are_played(
    master: str, start: Start, tmp_path: Path, words: str, length: str, format_: str
) -> None:
    given = [("/a", 0, "1"), ("/b", 0.1, "2"), ("/b", 0.2, "3"), ("/a", 0.3, "4"), ("/b", 0.4, "5")]
    name = make_bag(tmp_path / "one.bag", given)
    if format_ == "mcap":
        from minirospy.introspect.bag_convert import convert

        name = str(tmp_path / "one.mcap")
        convert(str(tmp_path / "one.bag"), name, compression="none", force=False, step=lambda _: None)
    output, errors = start("play", name, "-i", *words.split()).communicate(timeout=GUARD)

    assert errors == ""
    assert f" / {length} " in output


def test_ctrl_c_while_it_waits_for_subscribers_ends_it(master: str, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "one.bag", [("/a", 0, "1")])
    process = start("play", name, "--wait-for-subscribers")
    read_until(process, "Waiting for subscribers.")
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=GUARD)

    assert (process.returncode, errors) == (0, "")
    assert "Finished waiting" not in output


def test_an_unindexed_bag_is_named(master: str, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", 0, "1")])
    os.truncate(tmp_path / name, (tmp_path / name).stat().st_size - 10)
    _, errors = start("play", name).communicate(timeout=GUARD)

    assert "b.bag: Unindexed bag. Run `rosbag reindex b.bag`" in errors


def test_no_messages(master: str, start: Start, tmp_path: Path) -> None:
    name = make_bag(tmp_path / "b.bag", [("/a", 0, "1")])
    process = start("play", name, "--topics", "/b")
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 0
    assert errors == "No messages to play on specified topics.  Exiting.\n"
