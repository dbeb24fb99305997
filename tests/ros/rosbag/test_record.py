"""`rosbag record` as a process: the bag's contents, and how the process exits."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.base.installation import install_command
from minirospy.core.bag import records
from minirospy.core.bag.writer import BagWriter
from minirospy.core.wire.framing import LargeFrame
from tests.ros.rosbag.conftest import (
    GUARD,
    STRING,
    Start,
    Talker,
    connected,
    messages,
    read_until,
    said,
    say,
    wait_until,
)

POSIX_ONLY = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals and limits")


def written(path: Path, text: bytes) -> None:
    """Wait until a recording with ``--chunksize 0`` contains this text."""
    active = Path(f"{path}.active")
    wait_until(lambda: active.exists() and text in active.read_bytes())


def end(process: subprocess.Popen[str], number: int = signal.SIGINT) -> tuple[int, str, str]:
    process.send_signal(number)
    output, errors = process.communicate(timeout=GUARD)
    return process.returncode, output, errors


def test_messages_are_recorded_as_they_came(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter, latched = talker.advertise("/chatter"), talker.advertise("/map", latch=True)
    say(latched, "before")
    large = b"x" * 300_000

    process = start("record", "--chunksize", "0", "-O", "out", "/chatter", "map")
    connected(chatter)
    for text in (b"one", large, b"two"):
        say(chatter, text)
    say(chatter, "last")
    written(tmp_path / "out.bag", b"before")
    written(tmp_path / "out.bag", b"last")
    status, output, errors = end(process)

    assert (status, errors) == (0, "")
    assert "Recording to 'out.bag'." in output
    assert "Subscribing to /chatter" in output
    assert "Closing 'out.bag'." in output
    assert not (tmp_path / "out.bag.active").exists()
    found = messages(tmp_path / "out.bag")
    assert [said(one.body) for one in found if one.topic == "/map"] == ["before"]
    assert [one.body[4:] for one in found if one.topic == "/chatter"] == [b"one", large, b"two", b"last"]
    assert {one.callerid for one in found} == {"/talker"}


def test_messages_in_parts_are_recorded_whole_and_repeated(
    talker: Talker, start: Start, tmp_path: Path
) -> None:
    latched = talker.advertise("/map", latch=True)
    data = bytes(range(256)) * 4000
    body = len(data).to_bytes(4, "little") + data + b"rest"
    frame = LargeFrame((body[:4], data, body[-4:]), len(body), len(data))
    process = start(
        "record", "--split", "--size", "1", "--repeat-latched", "--chunksize", "0", "-O", "s", "/map"
    )
    connected(latched)
    for _ in range(3):
        latched.publish(frame)
    wait_until((tmp_path / "s_1.bag.active").exists)
    assert end(process)[0] == 0
    found = [messages(tmp_path / f"s_{number}.bag") for number in (0, 1)]
    assert all(file and all(one.body == body for one in file) for file in found)


def test_all_topics_are_found_while_it_runs(talker: Talker, start: Start, tmp_path: Path) -> None:
    process = start("record", "-a", "-x", "/rosout.*|/secret", "-O", "out.bag", "--chunksize", "0")
    read_until(process, "Recording to")
    later, secret = talker.advertise("/later"), talker.advertise("/secret", latch=True)
    say(secret, "no")
    connected(later)
    say(later, "yes")
    written(tmp_path / "out.bag", b"yes")
    end(process)

    assert [(one.topic, said(one.body)) for one in messages(tmp_path / "out.bag")] == [("/later", "yes")]


def test_a_node_s_topics_are_recorded(talker: Talker, start: Start, tmp_path: Path) -> None:
    listened, other = talker.advertise("/listened"), talker.advertise("/other")
    talker.loop.run(
        talker.node.subscribe(talker.node.make_subscription("/listened", listened.type, lambda *_: None))
    )
    process = start("record", "--node", "talker", "-O", "out", "--chunksize", "0")
    wait_until(lambda: len(listened.links) == 2)
    say(listened, "one")
    say(other, "two")
    written(tmp_path / "out.bag", b"one")
    _, output, _ = end(process)

    assert output.startswith("Recording from: talker\n")
    assert [said(one.body) for one in messages(tmp_path / "out.bag")] == ["one"]


def test_two_publishers_are_two_connections(talker: Talker, start: Start, tmp_path: Path) -> None:
    second = Talker("second")
    try:
        process = start("record", "--chunksize", "0", "-O", "out", "/chatter")
        for one in (talker, second):
            publication = one.advertise("/chatter")
            connected(publication)
            say(publication, f"from {one.node.name}")
            written(tmp_path / "out.bag", f"from {one.node.name}".encode())
        end(process)
    finally:
        second.close()

    assert [(one.callerid, said(one.body)) for one in messages(tmp_path / "out.bag")] == [
        ("/talker", "from /talker"),
        ("/second", "from /second"),
    ]


def test_limit_ends_the_recording(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    process = start("record", "-l", "3", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(10):
        say(chatter, str(i))

    assert process.wait(GUARD) == 0
    assert [said(one.body) for one in messages(tmp_path / "out.bag")] == ["0", "1", "2"]


def test_compressed_message_reaches_the_disk_without_another(
    talker: Talker, start: Start, tmp_path: Path
) -> None:
    chatter = talker.advertise("/chatter")
    # One message fills the buffer; a recorder that waited would record nothing else.
    process = start("record", "-j", "-b", "1", "--chunksize", "0", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(3):
        say(chatter, f"{i}" + "x" * 1_000_000)
        wait_until(lambda: (tmp_path / "out.bag.active").read_bytes().count(b"BZh9") == i + 1)  # noqa: B023
    status, _, errors = end(process)

    assert (status, errors) == (0, "")
    assert [said(one.body)[0] for one in messages(tmp_path / "out.bag")] == ["0", "1", "2"]


def test_split_by_size_repeats_the_latest_latched_message(
    talker: Talker, start: Start, tmp_path: Path
) -> None:
    chatter, latched = talker.advertise("/chatter"), talker.advertise("/map", latch=True)
    words = ["--split", "--size", "1", "--max-splits", "2", "--repeat-latched", "--chunksize", "0", "-O", "s"]
    process = start("record", *words, "/chatter", "/map")
    connected(chatter)
    connected(latched)
    say(latched, "old")
    say(latched, "new")
    written(tmp_path / "s_0.bag", b"new")
    for i in range(45):
        say(chatter, f"{i:02}" + "x" * 100_000)
    written(tmp_path / "s_4.bag", b"44xxx")
    end(process)

    assert sorted(path.name for path in tmp_path.glob("*.bag")) == ["s_2.bag", "s_3.bag", "s_4.bag"]
    found = [messages(tmp_path / f"s_{i}.bag") for i in (2, 3, 4)]
    assert [said(file[0].body) for file in found] == ["new"] * 3
    numbers = [int(said(one.body)[:2]) for file in found for one in file[1:]]
    assert numbers == list(range(numbers[0], 45))


@pytest.mark.parametrize("words", [("--split=1",), ("--split", "1")])
def test_split_with_a_size_is_deprecated(
    words: tuple[str, ...], talker: Talker, start: Start, tmp_path: Path
) -> None:
    chatter = talker.advertise("/chatter")
    process = start("record", *words, "-l", "15", "-O", "s", "/chatter")
    connected(chatter)
    for _ in range(15):
        say(chatter, "x" * 100_000)
    _, errors = process.communicate(timeout=GUARD)

    assert errors.startswith('Use of "--split <MAX_SIZE>" has been deprecated.')
    assert sorted(path.name for path in tmp_path.glob("*.bag")) == ["s_0.bag", "s_1.bag"]


def test_split_by_duration(talker: Talker, start: Start, tmp_path: Path) -> None:
    process = start("record", "--split", "--duration", "0.3", "-O", "d", "/chatter")
    read_until(process, "Recording to 'd_2.bag'")
    end(process)

    assert len(list(tmp_path.glob("d_*.bag"))) >= 3


def test_duration_ends_the_recording(talker: Talker, start: Start, tmp_path: Path) -> None:
    process = start("record", "--duration", "0.3", "-O", "d", "/chatter")

    assert process.wait(GUARD) == 0
    assert messages(tmp_path / "d.bag") == []


def test_begin_write_names_the_file(talker: Talker, start: Start, tmp_path: Path) -> None:
    heard: list[bytes] = []
    subscription = talker.node.make_subscription(
        "/begin_write", talker.advertise("/x").type, lambda body, _: heard.append(bytes(body))
    )
    talker.loop.run(talker.node.subscribe(subscription))
    process = start("record", "-p", "-O", "out", "/chatter")
    wait_until(lambda: heard)
    end(process)

    assert said(heard[0]) == "out.bag"


@POSIX_ONLY
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_signals_finish_the_file(name: str, talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    process = start("record", "--chunksize", "0", "-O", "out", "/chatter")
    connected(chatter)
    say(chatter, "one")
    written(tmp_path / "out.bag", b"one")
    status, _, errors = end(process, getattr(signal, name))

    assert (status, errors) == (0, "")
    assert [said(one.body) for one in messages(tmp_path / "out.bag")] == ["one"]


@POSIX_ONLY
def test_sigkill_leaves_whole_chunks(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    process = start("record", "--chunksize", "1", "-O", "out", "/chatter")
    connected(chatter)
    for i in range(100):
        say(chatter, f"{i:04}" + "x" * 100)
    active = tmp_path / "out.bag.active"
    wait_until(lambda: active.stat().st_size > 12_000)
    process.kill()
    process.wait()

    found = []
    with active.open("rb") as stream:
        size = active.stat().st_size
        stream.readline()
        while stream.tell() < size:
            record = records.read_record(stream, size)
            data = stream.read(record.data_size)
            if record.op == records.OP_CHUNK:
                found += [
                    said(data[one.data_position : one.end])[:4]
                    for one in records.parse_records(data)
                    if one.op == records.OP_MESSAGE_DATA
                ]
    assert len(found) > 40
    assert found == [f"{i:04}" for i in range(len(found))]


@POSIX_ONLY
def test_a_full_disk_leaves_a_readable_bag(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))"
    process = start("record", "--chunksize", "10", "-O", "out", "/chatter", prelude=limit)
    connected(chatter)
    for i in range(400):
        say(chatter, f"{i:04}" + "x" * 1000)
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert len(errors.splitlines()) == 1, errors
    assert "Error writing: out.bag: File too large. Recording ends;" in errors
    found = [said(one.body)[:4] for one in messages(tmp_path / "out.bag")]
    assert len(found) > 200
    assert found == [f"{i:04}" for i in range(len(found))]


@POSIX_ONLY
def test_a_full_disk_leaves_a_readable_mcap_file(talker: Talker, start: Start, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    chatter = talker.advertise("/chatter")
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))"
    process = start("record", "--mcap", "--chunksize", "10", "-O", "out", "/chatter", prelude=limit)
    connected(chatter)
    for i in range(400):
        say(chatter, f"{i:04}" + "x" * 1000)
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert len(errors.splitlines()) == 1, errors
    assert "Error writing: out.mcap: File too large. Recording ends;" in errors
    with (tmp_path / "out.mcap").open("rb") as stream:
        found = [said(one.data)[:4] for _, _, one in make_reader(stream).iter_messages()]
    assert len(found) > 200
    assert found == [f"{i:04}" for i in range(len(found))]


@pytest.mark.parametrize("chunk", ["10", "4096"])
def test_a_chunk_that_cannot_be_compressed_leaves_a_readable_bag(
    talker: Talker, start: Start, tmp_path: Path, chunk: str
) -> None:
    """A 10 KB chunk fails during recording, and a 4 MB chunk when the file is completed."""
    chatter = talker.advertise("/chatter")
    no_memory = (
        "from minirospy.core.bag import writer\n"
        "compress = writer.compress\n"
        "def refuse(name, data):\n"
        "    if b'0100x' in data:\n"
        "        raise MemoryError\n"
        "    return compress(name, data)\n"
        "writer.compress = refuse\n"
    )
    process = start(
        "record", "--lz4", "--chunksize", chunk, "-l", "300", "-O", "out", "/chatter", prelude=no_memory
    )
    connected(chatter)
    for i in range(300):
        say(chatter, f"{i:04}" + "x" * 1000)
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert len(errors.splitlines()) == 1, errors
    assert "Error writing: out.bag: MemoryError. Recording ends; " in errors
    found = [said(one.body)[:4] for one in messages(tmp_path / "out.bag")]
    assert (85 < len(found) <= 100) if chunk == "10" else not found
    assert found == [f"{i:04}" for i in range(len(found))]


def test_dropped_messages_are_counted(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    # Simulate a disk that blocks until stdin is closed.
    slow = (
        "from minirospy.ros.rosbag.recording.disk import QueuedFile\n"
        "write = QueuedFile._write_all\n"
        "QueuedFile._write_all = lambda self, data: (sys.stdin.read(), write(self, data))\n"
        "from minirospy.ros.rosbag.recording import recorder\n"
        "from minirospy.ros.rosbag.recording.recorder import Recorder\n"
        "recorder._REPORT_SECONDS = 0.5\n"
        "receive, received = Recorder._receive, []\n"
        "def count(*args):\n"
        "    receive(*args)\n"
        "    received.append(1)\n"
        "    if len(received) == 30:\n"
        "        print('all have come', flush=True)\n"
        "Recorder._receive = count\n"
    )
    process = start(
        "record",
        "-b",
        "1",
        "--chunksize",
        "100",
        "-O",
        "out",
        "/chatter",
        prelude=slow,
        stdin=subprocess.PIPE,
    )
    connected(chatter)
    for i in range(30):
        say(chatter, f"{i:02}" + "x" * 99_998)
    read_until(process, "all have come")
    read_until(process, "rosbag record buffer exceeded.  Dropped messages: /chatter", process.stderr)
    process.send_signal(signal.SIGINT)
    assert process.stdin
    process.stdin.close()
    process.stdin = None
    _, errors = process.communicate(timeout=GUARD)

    kept = len(messages(tmp_path / "out.bag"))
    assert 9 <= kept <= 12
    assert f"The bag lacks messages that were dropped: /chatter {30 - kept}" in errors


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        ([], 2, "You must specify a topic name or else use the '-a' option."),
        (["--split", "/a"], 2, "Split specified without giving a maximum duration or size"),
        (["a topic"], 2, "'a topic' is not a legal name of a topic: letters, digits, _ and /"),
        (["-L", "5X", "/a"], 2, "the size '5X' must be a number with G, M or k behind it"),
        (["-b", "-1", "/a"], 2, "Buffer size must be 0 or positive"),
        (["-a", "-l", "2"], 2, "Specifying a count is not valid with automatic topic subscription."),
        (["-j", "--lz4", "/a"], 2, "Can only use one type of compression"),
        (["-e", "/(a"], 2, "the regular expression '/(a' is wrong"),
        (["--mcap", "-j", "/a"], 1, "MCAP files have lz4 (--lz4) and Zstandard (--zstd)"),
        (["--duration", "5x", "/a"], 2, "Duration unit must be s, m, or h"),
    ],
)
def test_wrong_words(words: list[str], status: int, text: str, start: Start) -> None:
    process = start("record", *words)
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == status
    assert text in errors
    assert "Traceback" not in errors


def test_a_file_that_cannot_be_made_is_named(master: str, start: Start) -> None:
    process = start("record", "-O", "missing/out", "/chatter")
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert errors.splitlines() == [
        "Error writing: Error opening file: missing/out.bag.active (No such file or directory)"
    ]


def test_too_little_space_is_refused(master: str, start: Start) -> None:
    process = start("record", "-L", "90000000G", "-O", "out", "/chatter")
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert errors.splitlines() == [
        "Less than 90000000G of space free on disk with out.bag.active. Disabling recording."
    ]


def test_simulated_time_is_waited_for(talker: Talker, start: Start, tmp_path: Path) -> None:
    from minirospy.core.wire.tcpros import InterfaceType
    from minirospy.runtime.rpc.master_proxy import MasterProxy

    proxy = MasterProxy(talker.node.environment.master_uri, "/test")
    proxy.set_param("/use_sim_time", True)
    proxy.close()
    clock = talker.advertise(
        "/clock",
        type_=InterfaceType("rosgraph_msgs/Clock", "a9c97c1d230cfc112e270351a944ee47", "time clock\n"),
    )
    chatter = talker.advertise("/chatter")
    process = start("record", "--chunksize", "0", "-O", "out", "/chatter")
    connected(clock)
    assert not (tmp_path / "out.bag.active").exists()
    clock.publish((8).to_bytes(4, "little") + (1000).to_bytes(4, "little") + (7).to_bytes(4, "little"))
    connected(chatter)
    say(chatter, "one")
    written(tmp_path / "out.bag", b"one")
    end(process)

    assert [one.time for one in messages(tmp_path / "out.bag")] == [1000 * 10**9 + 7]


def test_mcap_files_are_recorded_and_played(talker: Talker, start: Start, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    chatter = talker.advertise("/chatter")
    large = b"x" * 300_000
    process = start("record", "--mcap", "--zstd", "-l", "3", "-O", "out", "/chatter")
    connected(chatter)
    for text in (b"one", large, b"two"):
        say(chatter, text)

    assert process.wait(GUARD) == 0
    with (tmp_path / "out.mcap").open("rb") as stream:
        found = list(make_reader(stream, validate_crcs=True).iter_messages())
    assert [message.data[4:] for _, _, message in found] == [b"one", large, b"two"]
    assert found[0][1].metadata["callerid"] == "/talker"

    again = start("record", "-l", "3", "-O", "again", "/chatter2")
    read_until(again, "Subscribing")
    player = start("play", "out.mcap", "-p", "/x", "--wait-for-subscribers", "/x/chatter:=/chatter2", "-i")
    assert again.wait(GUARD) == 0
    player.communicate(timeout=GUARD)
    assert [one.body[4:] for one in messages(tmp_path / "again.bag")] == [b"one", large, b"two"]


def test_a_missing_extra_is_named(start: Start) -> None:
    process = start("record", "--mcap", "/a", prelude="sys.modules['mcap'] = None")
    _, errors = process.communicate(timeout=GUARD)

    assert process.returncode == 1
    assert install_command("minirospy[mcap]") in errors


def test_launch_files_start_both_programs(talker: Talker, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    (tmp_path / "bags.launch").write_text(
        f"""<launch>
          <node pkg="rosbag" type="record" name="recorder" output="screen" args="-l 1 -O {tmp_path}/out heard">
            <remap from="heard" to="/chatter"/>
          </node>
          <node pkg="rosbag" type="play" name="player" output="screen" args="--wait-for-subscribers -k {tmp_path}/in.bag"/>
        </launch>""",
        encoding="utf-8",
    )
    with (tmp_path / "in.bag").open("wb") as stream:
        writer = BagWriter(stream)
        header = {"type": STRING.name, "md5sum": STRING.md5sum, "message_definition": STRING.definition}
        writer.write(writer.add_connection("/played", header), 1, b"\x02\0\0\0ok")
        writer.close()
    heard: list[bytes] = []
    subscription = talker.node.make_subscription("/played", STRING, lambda body, _: heard.append(bytes(body)))
    talker.loop.run(talker.node.subscribe(subscription))

    code = "import sys; from minirospy.ros.roslaunch.commands.roslaunch import main; sys.exit(main())"
    launch = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path / "bags.launch")], stdout=subprocess.DEVNULL
    )
    try:
        connected(chatter)
        say(chatter, "one")
        wait_until((tmp_path / "out.bag").exists)
        wait_until(lambda: heard)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(GUARD)

    assert [said(one.body) for one in messages(tmp_path / "out.bag")] == ["one"]
    assert said(heard[0]) == "ok"


@POSIX_ONLY
def test_a_second_ctrl_c_does_not_cost_the_file(talker: Talker, start: Start, tmp_path: Path) -> None:
    chatter = talker.advertise("/chatter")
    slow = (
        "from minirospy.ros.rosbag.recording.disk import QueuedFile\n"
        "write = QueuedFile._write_all\n"
        "QueuedFile._write_all = lambda self, data: (sys.stdin.read(), write(self, data))\n"
    )
    process = start("record", "-O", "out", "/chatter", prelude=slow, stdin=subprocess.PIPE)
    connected(chatter)
    for i in range(20):
        say(chatter, f"{i:02}" + "x" * 999_998)
    process.send_signal(signal.SIGINT)
    read_until(process, "Closing 'out.bag'.")
    process.send_signal(signal.SIGINT)
    # If the signal arrives while the node is still unregistering, this line is printed after two seconds.
    read_until(process, " MB are still to be written", process.stderr)
    assert process.stdin
    process.stdin.close()
    process.stdin = None
    process.communicate(timeout=GUARD)

    assert process.returncode == 0
    found = [said(one.body)[:2] for one in messages(tmp_path / "out.bag")]
    assert found == [f"{i:02}" for i in range(len(found))]
