"""The command rosbag: its verbs' output, files and exit statuses."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.writer import BagWriter
from minirospy.ros.rosbag.commands import rosbag
from tests.core.bag.bags import Given, connection, make_bag
from tests.web.dashboard.bags import START, make_bag_out_of_order

from .conftest import Command

UNINDEXED = "ERROR bag unindexed: {}.  Run rosbag reindex.\n"


def string(text: str) -> bytes:
    return len(text).to_bytes(4, "little") + text.encode()


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a bag of 100 strings on two topics, in the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    path = tmp_path / "a.bag"
    with path.open("wb") as stream:
        writer = BagWriter(stream, chunk_threshold=500)
        numbers = [writer.add_connection(f"/topic{each}", connection(each).header) for each in range(2)]
        for number in range(100):
            writer.write(numbers[number % 2], number * 10**9, string(f"hello {number}"))
        writer.close()
    return path


def messages(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as stream:
        reader = open_bag(stream)
        found = [(each.connection.topic, each.time, each.body) for each in reader.messages()]
        reader.close()
        return found


def compressions(path: Path) -> set[str]:
    with path.open("rb") as stream:
        return {each.chunk.compression for each in open_bag(stream).chunk_headers().values()}


def test_help_lists_the_verbs_as_ros_does(command: Command) -> None:
    status, out, err = command("rosbag")
    assert (status, err) == (0, "")
    assert out.startswith("Usage: rosbag <subcommand> [options] [args]\n\nA bag is a file format in ROS")
    assert "   help  \n   info  \tSummarize the contents of one or more bag files.\n" in out
    assert command("rosbag", "-h") == command("rosbag", "help") == (0, out, "")
    assert command("rosbag", "help", "info") == command("rosbag", "info", "-h")


def test_unknown_verb_has_status_0_as_in_ros(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosbag.main(["inf"]) == 0
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("Unknown command: 'inf'\nAvailable subcommands:\n   check  \tDetermine")
    assert "rosbag: ERROR: unknown command `rosbag inf`; did you mean info" in err


def test_info_prints_text_yaml_and_values(command: Command, bag: Path) -> None:
    status, out, err = command("rosbag", "info", "a.bag")
    assert (status, err) == (0, "")
    assert out.startswith("path:        a.bag\nversion:     2.0\nduration:    1:39s (99s)\n")
    assert "topics:      /topic0   50 msgs    : std_msgs/String\n" in out
    assert " @ 0.5 Hz : std_msgs/String\n" in command("rosbag", "info", "--freq", "a.bag").out
    assert "messages: 100\nindexed: True\n" in command("rosbag", "info", "-y", "a.bag").out
    assert command("rosbag", "info", "-y", "-k", "messages", "a.bag", "a.bag").out == "100\n---\n100\n"
    assert command("rosbag", "info", "-y", "-k", "no", "a.bag") == (0, "", 'Error getting key "no"\n')


def test_info_warns_of_chunks_out_of_order_and_filter_writes_them_in_order(
    command: Command, bag: Path
) -> None:
    make_bag_out_of_order(bag)
    status, out, err = command("rosbag", "info", "a.bag")
    # The output is that of ROS, which uses the first and the last chunk.
    assert (status, "duration:    -1.0s\n" in out) == (0, True)
    start = START / 1e9
    assert f"the messages are from {start:.2f} to {start + 29:.2f} (29.0s)" in err
    assert len(err.splitlines()) == 1
    assert command("rosbag", "filter", "a.bag", "b.bag", "True").status == 0
    sorted_copy = command("rosbag", "info", "b.bag")
    assert (sorted_copy.err, "duration:    29.0s\n" in sorted_copy.out) == ("", True)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (None, "ERROR reading b.bag: [Errno 2] No such file or directory: 'b.bag'\n"),
        (b"", "ERROR reading b.bag: empty file\n"),
        (b"hello", "ERROR reading b.bag: This does not appear to be a bag file\n"),
        (b"#ROSBAG V1.1\n",
         "ERROR reading b.bag: unsupported bag version 101. Please convert bag to newer format.\n"),
        (b"#ROSBAG V2.0\n", UNINDEXED.format("b.bag")),
    ],
)  # fmt: skip
def test_info_reports_what_is_not_a_bag(command: Command, bag: Path, data: bytes | None, said: str) -> None:
    if data is not None:
        Path("b.bag").write_bytes(data)
    assert command("rosbag", "info", "b.bag", "a.bag") == (1, "", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("info", "You must specify at least 1 bag file."),
        ("info -k start a.bag", "You can only specify key when printing in YAML format."),
        ("info --nope", "no such option: --nope"),
        ("compress", "You must specify at least one bag file."),
        ("decrypt", "You must specify at least one bag file."),
        ("record /a -o x -O y", "Can't set both prefix and name."),
        ("filter", "You must specify an in bag, an out bag, and an expression."),
        ("filter a", "You must specify an out bag and an expression."),
        ("filter a b", "You must specify an expression."),
        ("filter a b c d", "Too many arguments."),
    ],
)
def test_usage_errors_are_those_of_ros(
    bag: Path, capsys: pytest.CaptureFixture[str], words: str, said: str
) -> None:
    assert rosbag.main(words.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"Usage: rosbag {words.split(maxsplit=1)[0]} ")
    assert f"rosbag: error: {said}\n" in err


@pytest.mark.parametrize("options", [("-j", "bz2"), ("--lz4", "lz4")])
def test_compress_keeps_the_original_and_decompress_restores_it(
    command: Command, bag: Path, options: tuple[str, str]
) -> None:
    before = bag.read_bytes()
    option, name = options

    assert command("rosbag", "compress", "-q", option, "a.bag") == (0, "", "")
    assert (bag.with_name("a.orig.bag").read_bytes(), compressions(bag)) == (before, {name})
    assert command("rosbag", "decompress", "a.bag").err == (
        "Skipping a.bag. Backup path a.orig.bag already exists.\n"
    )
    assert compressions(bag) == {name}
    status, out, err = command("rosbag", "decompress", "-f", "a.bag")
    assert (status, err) == (0, "")
    assert "\r a.bag " in out
    assert out.endswith("    \n")
    assert messages(bag) == messages(bag.with_name("a.orig.bag"))


def test_output_dir_leaves_the_bag(command: Command, bag: Path) -> None:
    Path("out").mkdir()
    assert command("rosbag", "compress", "-q", "--output-dir", "out", "a.bag") == (0, "", "")
    assert compressions(Path("out/a.bag")) == {"bz2"}
    assert not Path("a.orig.bag").exists()
    said = "ERROR writing to none/a.bag: [Errno 2] No such file or directory: 'none/a.bag'\n"
    assert command("rosbag", "compress", "-q", "--output-dir", "none", "a.bag") == (0, "", said)


def test_compress_keeps_two_publishers_and_two_types(command: Command, bag: Path) -> None:
    connections = [
        connection(0, "/mixed", callerid="/a"),
        connection(1, "/mixed", callerid="/b"),
        connection(2, "/mixed", type="std_msgs/Int32", message_definition="int32 data", md5sum="1"),
    ]
    bag.write_bytes(make_bag([[Given(number, number, bytes(4)) for number in range(3)]], connections))

    assert command("rosbag", "compress", "-q", "a.bag").status == 0
    with bag.open("rb") as stream:
        assert list(open_bag(stream).connections.values()) == connections


def test_a_file_that_cannot_be_read_does_not_stop_the_others(command: Command, bag: Path) -> None:
    said = "ERROR reading no.bag: [Errno 2] No such file or directory: 'no.bag'\n"
    assert command("rosbag", "compress", "-q", "no.bag", "a.bag") == (0, "", said)
    assert compressions(bag) == {"bz2"}


def test_full_disk_leaves_the_bag_unchanged(
    command: Command, bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: BagWriter, connection: int, time: int, body: bytes) -> None:
        raise OSError(28, "No space left on device")

    before = bag.read_bytes()
    monkeypatch.setattr(BagWriter, "write", full)
    status, _, err = command("rosbag", "compress", "-q", "a.bag")
    assert (status, err) == (0, "ERROR operating on a.bag: [Errno 28] No space left on device\n")
    assert bag.read_bytes() == before
    assert not Path("a.orig.bag").exists()


def test_reindex_makes_the_index_again(command: Command, bag: Path) -> None:
    expected = messages(bag)
    data = bag.read_bytes()
    end = data.index(b"\x04\0\0\0op=\x07", data.rindex(b"\x04\0\0\0op=\x04")) - 4
    bag.write_bytes(data[:end])

    assert command("rosbag", "info", "a.bag") == (1, "", UNINDEXED.format("a.bag"))
    assert command("rosbag", "compress", "a.bag") == (0, "", UNINDEXED.format("a.bag"))
    assert command("rosbag", "reindex", "-q", "a.bag") == (0, "", "")
    assert messages(bag) == expected
    assert bag.read_bytes() == data


def test_reindex_reports_lost_messages(command: Command, bag: Path) -> None:
    expected = messages(bag)
    bag.write_bytes(bag.read_bytes()[:6000])

    status, _, err = command("rosbag", "reindex", "-q", "a.bag")
    assert status == 0
    assert err.startswith("WARNING: a.orig.bag: chunk at byte ")
    assert messages(bag) == expected[: len(messages(bag))]
    assert len(messages(bag)) > 10


@pytest.mark.parametrize(
    ("expression", "kept"),
    [
        ("topic == '/topic1'", 50),
        ("t.secs < 10", 10),
        ("m.data.endswith('0')", 10),
        ("m._type == 'std_msgs/String' and t.to_sec() >= 99", 1),
        ("False", 0),
    ],
)
def test_filter_keeps_selected_messages(command: Command, bag: Path, expression: str, kept: int) -> None:
    status, _, err = command("rosbag", "filter", "a.bag", "b.bag", expression)
    assert (status, err) == (0, "")
    assert len(messages(Path("b.bag"))) == kept


def test_filter_prints_on_request(command: Command, bag: Path) -> None:
    out = command("rosbag", "filter", "-p", "m.data", "a.bag", "b.bag", "t.secs == 1").out
    assert "NO MATCH hello 0\nMATCH hello 1\nNO MATCH hello 2\n" in out


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("no.bag", "b.bag", "True"), 2, "Cannot locate input bag file [no.bag]\n"),
        (("a.bag", "./a.bag", "True"), 3, "Cannot use same file as input and output [a.bag]\n"),
        (("a.bag", "b.bag", "True)"), 1, "rosbag: ERROR: 'True)': not a Python expression: unmatched ')'\n"),
        (("a.bag", "b.bag", "m.no"), 1,
         "rosbag: ERROR: 'm.no': AttributeError for a message on /topic0: '_std_msgs__String' object has no attribute 'no'\n"),
        (("x.txt", "b.bag", "True"), 1, "ERROR reading x.txt: This does not appear to be a bag file\n"),
        (("a.bag", "no/b.bag", "True"), 1, "rosbag: ERROR: no/b.bag: No such file or directory\n"),
    ],
)  # fmt: skip
def test_filter_refuses_in_one_line(
    command: Command, bag: Path, words: tuple[str, str, str], status: int, said: str
) -> None:
    Path("x.txt").write_text("text", encoding="utf-8")
    found = command("rosbag", "filter", *words)
    assert (found.status, found.err) == (status, said)
    # The error is not on the same line as the progress.
    assert found.out[-1:] in ("", "\n")
    assert len(messages(bag)) == 100


@pytest.mark.parametrize("verb", ["encrypt", "decrypt"])
def test_encryption_is_refused_by_name(command: Command, bag: Path, verb: str) -> None:
    status, out, err = command("rosbag", verb, "a.bag")
    assert (status, out) == (1, "")
    assert err.startswith("rosbag: ERROR: bags are neither encrypted nor decrypted here")


def test_old_bags_become_new_ones(command: Command, bag: Path) -> None:
    from tests.core.bag.test_reader12 import make_bag12

    bag.write_bytes(make_bag12([("/a", 1, string("one")), ("/b", 2, string("two"))], indexed=False))
    assert "version: 1.2 (unindexed)\n" in command("rosbag", "info", "a.bag").out

    assert command("rosbag", "reindex", "-q", "a.bag") == (0, "", "")
    assert "version:     2.0\n" in command("rosbag", "info", "a.bag").out
    assert messages(bag) == [("/a", 1, string("one")), ("/b", 2, string("two"))]


def test_copies_are_equal(command: Command, bag: Path) -> None:
    shutil.copy(bag, "b.bag")
    assert command("rosbag", "reindex", "-q", "b.bag").status == 0
    assert Path("b.bag").read_bytes() == bag.read_bytes()


@pytest.mark.skipif(os.name == "nt", reason="no pseudo-terminals")
def test_terminal_shows_a_bar(bag: Path) -> None:
    import pty

    controller, terminal = pty.openpty()
    command = Path(sys.executable).with_name("rosbag")
    environment = {**os.environ, "TERM": "xterm"}
    with subprocess.Popen(
        [str(command), "compress", "a.bag"], stdout=terminal, stderr=terminal, env=environment
    ) as process:
        os.close(terminal)
        shown = b""
        with contextlib.suppress(OSError):  # Linux raises EIO when the other end is closed
            while data := os.read(controller, 4096):
                shown += data
    os.close(controller)

    assert process.returncode == 0
    assert b"a.bag" in shown
    assert b"\x1b[" in shown
    assert b"\\x1b" not in shown
    assert compressions(bag) == {"bz2"}


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has a disk that is full")
def test_full_disk_is_named_by_filter_and_fix(bag: Path, command: Command) -> None:
    os.symlink("/dev/full", "full.bag")
    os.symlink("/dev/full", "fixed.bag.tmp")
    wrong = "ERROR: {}: No space left on device\n"

    status, _, err = command("rosbag", "filter", "a.bag", "full.bag", "True")
    assert (status, err) == (1, "rosbag: " + wrong.format("full.bag"))
    status, _, err = command("rosbag", "fix", "a.bag", "fixed.bag")
    assert (status, err) == (1, "rosbag: " + wrong.format("fixed.bag"))


def test_convert_refuses_a_name_of_neither_format(bag: Path, command: Command) -> None:
    status, _, err = command("rosbag", "convert", "-q", "a.bag", "b.txt")
    assert (status, err) == (2, "rosbag: ERROR: b.txt must end with .bag or .mcap\n")
    assert not os.path.exists("b.txt")


@pytest.mark.parametrize("verb", ["compress", "decompress"])
def test_compress_leaves_mcap_files_as_they_are(bag: Path, command: Command, verb: str) -> None:
    assert command("rosbag", "convert", "-q", "a.bag", "r.mcap").status == 0
    before = Path("r.mcap").read_bytes()

    status, out, err = command("rosbag", verb, "-q", "r.mcap")

    assert (status, out, err.count("\n")) == (1, "", 1)
    assert err.startswith("ERROR: r.mcap is an MCAP file, and the result would be a bag: `rosbag convert")
    assert Path("r.mcap").read_bytes() == before
    assert sorted(os.listdir()) == ["a.bag", "r.mcap"]


def test_filter_writes_no_bag_named_as_an_mcap_file(bag: Path, command: Command) -> None:
    status, out, err = command("rosbag", "filter", "a.bag", "r.mcap", "True")

    assert (status, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("rosbag: ERROR: r.mcap would be a bag: ")
    assert os.listdir() == ["a.bag"]


def test_reindex_recovers_an_mcap_file_whose_end_is_missing(bag: Path, command: Command) -> None:
    assert command("rosbag", "convert", "-q", "a.bag", "r.mcap").status == 0
    whole = Path("r.mcap").read_bytes()
    Path("r.mcap.active").write_bytes(whole[:-100])
    why = "is not complete: its end is missing"
    said = f"ERROR: r.mcap.active {why}; `rosbag reindex r.mcap.active`\n"
    assert command("rosbag", "info", "r.mcap.active") == (1, "", said)
    status, _, err = command("rosbag", "convert", "-q", "r.mcap.active", "b.bag")
    assert (status, err) == (
        1,
        "rosbag: ERROR: r.mcap.active: the MCAP file is not complete: its end is missing. "
        "Run `rosbag reindex r.mcap.active`\n",
    )

    assert command("rosbag", "reindex", "-q", "r.mcap.active") == (0, "", "")
    assert Path("r.mcap.orig.active").read_bytes() == whole[:-100]
    assert command("rosbag", "info", "-y", "-k", "messages", "r.mcap.active").out == "100\n"
    assert command("rosbag", "convert", "-q", "r.mcap.active", "b.bag").status == 0
    assert messages(Path("b.bag")) == messages(bag)


def test_reindex_into_a_missing_folder_has_status_1(bag: Path, command: Command) -> None:
    Path("cut.bag").write_bytes(bag.read_bytes()[:-100])
    said = "ERROR writing to none/cut.bag: [Errno 2] No such file or directory: 'none/cut.bag'\n"
    assert command("rosbag", "reindex", "--output-dir=none", "cut.bag") == (1, "", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("a.bag a.mcap", "a.mcap exists already: remove it, or add -f"),
        ("a.bag b.txt", "b.txt must end with .bag or .mcap"),
        ("-c bz2 a.bag b.mcap", "MCAP files have one of: none, lz4, zstd"),
        ("-c zstd a.bag b.bag", "zstd"),
        ("cut.bag b.mcap", "cut.bag: Unindexed bag"),
    ],
)
def test_convert_shows_no_progress_before_an_error(
    bag: Path, command: Command, words: str, said: str
) -> None:
    assert command("rosbag", "convert", "-q", "a.bag", "a.mcap").status == 0
    Path("cut.bag").write_bytes(bag.read_bytes()[:-100])

    status, out, err = command("rosbag", "convert", *words.split())

    assert status
    assert (out, err.count("\n")) == ("", 1)
    assert said in err


def test_filter_that_is_interrupted_leaves_a_bag_of_what_it_wrote(bag: Path, command: Command) -> None:
    before = bag.read_bytes()
    interrupt = "__import__('signal').raise_signal(__import__('signal').SIGINT)"

    assert command("rosbag", "filter", "a.bag", "o.bag", f"m.data != 'hello 50' or {interrupt}").status == 130
    assert messages(Path("o.bag")) == messages(bag)[:50]
    assert bag.read_bytes() == before


@pytest.mark.parametrize("verb", ["compress", "decompress"])
def test_bag_whose_chunk_header_is_damaged_stays_as_it_is(bag: Path, command: Command, verb: str) -> None:
    damaged = bytearray(bag.read_bytes())
    at = damaged.index(b"compression=")
    damaged[at - 4 : at] = b"\xff" * 4
    bag.write_bytes(damaged)

    assert command("rosbag", verb, "-q", "a.bag") == (0, "", UNINDEXED.format("a.bag"))
    assert command("rosbag", "info", "a.bag") == (1, "", UNINDEXED.format("a.bag"))
    assert (bag.read_bytes(), sorted(os.listdir())) == (damaged, ["a.bag"])


def test_record_takes_the_size_behind_split(capsys: pytest.CaptureFixture[str]) -> None:
    """Scripts from before --size existed use this form; a later step reports the second error."""
    assert rosbag.main(["record", "/a", "--split", "5", "--lz4", "-j"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(
        'Use of "--split <MAX_SIZE>" has been deprecated.  Please use --split --size <MAX_SIZE>'
    )
    assert "Can only use one type of compression" in err
