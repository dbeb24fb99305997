"""`rostopic list -b`, `rostopic echo -b`, `rosmsg show -b`, without a master."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from minirospy.ros.rostopic.commands import rostopic
from tests.core.bag.bags import Given, connection, make_bag

from .conftest import Command

HEADER = "uint32 seq\ntime stamp\nstring frame_id\n"
STAMPED = f"Header header\nint32[] ids\n{'=' * 80}\nMSG: std_msgs/Header\n{HEADER}"


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return a bag with strings on /chatter, and with a type that is not installed on a relative topic."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    stamped = connection(1, "far/ids", type="far_msgs/Ids", message_definition=STAMPED, md5sum="0")
    body = bytes(4) + (7).to_bytes(4, "little") + bytes(4) + bytes(4) + (2).to_bytes(4, "little") + bytes(8)
    given = [Given(0, each * 10**9, b"\x01\0\0\0" + b"%d" % each) for each in range(4)]
    Path("a.bag").write_bytes(
        make_bag([[*given, Given(1, 5 * 10**9, body)]], [connection(0, "/chatter"), stamped])
    )
    return "a.bag"


def test_list_prints_the_topics_or_how_many_messages(command: Command, bag: str) -> None:
    assert command("rostopic", "list", "-b", bag) == (0, "/chatter\nfar/ids\n", "")
    first, last = (time.strftime("%d %b %Y %H:%M:%S", time.localtime(each)) for each in (0, 3))
    assert command("rostopic", "list", "-b", bag, "chatter").out == f"4 message(s) from {first} to {last}\n"
    assert command("rostopic", "list", "-b", bag, "/nothing").out == "0 message(s)\n"


def test_echo_prints_messages_fields_and_rows(command: Command, bag: str) -> None:
    assert command("rostopic", "echo", "-b", bag, "/chatter", "-n", "2") == (
        0, 'data: "0"\n---\ndata: "1"\n---\n', ""
    )  # fmt: skip
    assert (
        command("rostopic", "echo", "-b", bag, "chatter/data").out
        == '"0"\n---\n"1"\n---\n"2"\n---\n"3"\n---\n'
    )
    assert command("rostopic", "echo", "-b", bag, "-p", "/far/ids").out == (
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.ids0,field.ids1\n"
        "5000000000,0,7000000000,,0,0\n"
    )
    assert command("rostopic", "echo", "-b", bag, "/far/ids/header/stamp/secs").out == "7\n---\n"
    assert (
        command("rostopic", "echo", "-b", bag, "-a", "--filter", "topic == 'far/ids'").out.count("---") == 1
    )
    assert command("rostopic", "echo", "-b", bag, "-a").out.count("---") == 5
    # ROS only looks up message types, not the type of this field.
    assert command("rostopic", "echo", "-b", bag, "--noarr", "/far/ids/ids").out == "[0, 0]\n---\n"
    assert command("rostopic", "echo", "-b", bag, "--nostr", "-n", "1", "/chatter/data").out == '"0"\n---\n'
    assert "<array type" in command("rostopic", "echo", "-b", bag, "--noarr", "/far/ids").out
    plotted = command("rostopic", "echo", "-b", bag, "-p", "--noarr", "/far/ids/ids").out
    assert plotted == "%time,field0,field1\n5000000000,0,0\n"
    assert command("rostopic", "echo", "-b", bag, "/nothing") == (0, "", "")
    assert command("rostopic", "echo", "-b", bag, "-n", "0", "/chatter") == (0, "", "")


def test_show_prints_the_definition_in_the_bag(command: Command, bag: str) -> None:
    assert command("rosmsg", "show", "-b", bag, "far_msgs/Ids").out == (
        "std_msgs/Header header\n  uint32 seq\n  time stamp\n  string frame_id\nint32[] ids\n\n"
    )
    assert command("rosmsg", "show", "-r", "-b", bag, "far_msgs/Ids").out == STAMPED + "\n"
    status, _, err = command("rosmsg", "show", "-b", bag, "far_msgs/Id")
    assert (status, err) == (
        1, "rosmsg: ERROR: message type [far_msgs/Id] not found; did you mean far_msgs/Ids? "
        "(the bag a.bag has no such message)\n",
    )  # fmt: skip


@pytest.mark.parametrize("words", [("rostopic", "list"), ("rostopic", "echo"), ("rosmsg", "show")])
def test_file_that_is_not_a_bag_gives_a_one_line_error(
    command: Command, bag: str, words: tuple[str, str]
) -> None:
    Path("no.bag").write_bytes(b"hello")
    name, verb = words
    argument = [] if verb == "list" else ["std_msgs/String"]
    assert command(name, verb, "-b", "no.bag", *argument) == (
        1, "", f"{name}: ERROR: no.bag: This does not appear to be a bag file\n"
    )  # fmt: skip
    assert command(name, verb, "-b", "missing.bag", *argument).err.startswith(
        f"{name}: ERROR: bag file [missing.bag] not found"
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("list -b a.bag -p", "-p option is not valid with bags"),
        ("list -b a.bag -s", "-s option is not valid with bags"),
        ("list -b a.bag --host", "--host option is not valid with bags"),
        ("echo -b a.bag", "topic must be specified"),
        ("echo -b a.bag --offset /a", "offset time option is not valid with bag files"),
        ("echo -a /a", "Display all option is only valid when echoing from bag files"),
    ],
)
def test_usage_errors_are_those_of_ros(
    bag: str, capsys: pytest.CaptureFixture[str], words: str, said: str
) -> None:
    assert rostopic.main(words.split()) == 2
    assert f"rostopic: error: {said}\n" in capsys.readouterr().err
