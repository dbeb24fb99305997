"""The commands rosbag check and fix: output and files (compared with the real commands by hand: docs/commands.md)."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import pytest

from minirospy.core.bag.reader import open_bag
from minirospy.core.idl.load import class_from_text, message_class
from minirospy.ros.rosbag.commands import rosbag
from tests.core.bag.bags import Given, connection, make_bag

from .conftest import Command

OLD = "float32 r\nfloat32 g\nfloat32 b\n"
OLD_MD5 = class_from_text("std_msgs/ColorRGBA", OLD)._md5sum
NEW_MD5 = message_class("std_msgs/ColorRGBA")._md5sum
CHANGE = f" * From: std_msgs/ColorRGBA [{OLD_MD5}]\n   To:   std_msgs/ColorRGBA [{NEW_MD5}]\n"
MISSING = CHANGE + "    1 rules missing:\n" + "".join(f"    {line}\n" for line in CHANGE.splitlines())


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a bag with colors without alpha, and a string, in the working directory."""
    monkeypatch.chdir(tmp_path)
    connections = [
        connection(
            0, "/color", type="std_msgs/ColorRGBA", message_definition=OLD, md5sum=OLD_MD5, callerid="/me"
        ),
        connection(1, "/text"),
    ]
    given = [Given(0, 1, struct.pack("<3f", 1, 2, 3)), Given(1, 2, b"\x01\0\0\0a")]
    path = tmp_path / "a.bag"
    path.write_bytes(make_bag([given], connections))
    return path


def test_check_shows_what_is_missing_and_writes_the_rule(command: Command, bag: Path) -> None:
    said = f"The following migrations need to occur:\n{MISSING}"
    assert command("rosbag", "check", "a.bag") == (
        0, said + "\nTo generate rules, please run with -g <rulefile>\n", ""
    )  # fmt: skip
    assert command("rosbag", "check", "a.bag", "-g", "a.bmr") == (
        0, said + "\nThe necessary rule files have been written to: a.bmr\n", ""
    )  # fmt: skip
    text = Path("a.bmr").read_text(encoding="utf-8")
    assert f"class update_std_msgs_ColorRGBA_{OLD_MD5}(MessageUpdateRule):" in text
    assert "\tvalid = False\n" in text

    status, _, err = command("rosbag", "check", "a.bag", "a.bmr")
    assert (status, err) == (1, "rosbag: ERROR: Cannot instantiate MessageMigrator with invalid rules\n")
    Path("a.bmr").write_text(text.replace("valid = False", "valid = True"), encoding="utf-8")
    assert command("rosbag", "check", "a.bag", "a.bmr").out == (
        f"The following migrations need to occur:\n{CHANGE}\nAll rules defined.  Bag is ready to be migrated\n"
    )


def test_fix_writes_the_new_type(command: Command, bag: Path) -> None:
    status, out, err = command("rosbag", "fix", "a.bag", "b.bag")
    assert (status, err) == (1, "")
    assert out.startswith(
        f"Bag could not be migrated.  The following migrations could not be performed:\n{MISSING}"
    )
    assert [path.name for path in bag.parent.iterdir()] == ["a.bag"]

    command("rosbag", "check", "a.bag", "-g", "a.bmr")
    text = Path("a.bmr").read_text(encoding="utf-8")
    Path("a.bmr").write_text(text.replace("valid = False", "valid = True"), encoding="utf-8")
    assert command("rosbag", "fix", "a.bag", "b.bag", "a.bmr") == (0, "Bag migrated successfully.\n", "")
    found = list(open_bag(io.BytesIO(Path("b.bag").read_bytes())).messages())
    assert [each.body for each in found] == [struct.pack("<4f", 1, 2, 3, 0), b"\x01\0\0\0a"]
    assert (found[0].connection.md5sum, found[0].connection.callerid) == (NEW_MD5, "/me")
    assert command("rosbag", "check", "b.bag").out == "Bag file does not need any migrations.\n"


def test_forced_fix_copies_messages_without_a_rule(command: Command, bag: Path) -> None:
    assert command("rosbag", "fix", "--force", "a.bag", "b.bag") == (
        0,
        "Bag migrated successfully.\n",
        "WARNING: messages of type [std_msgs/ColorRGBA] are copied as they are\n",
    )
    assert len(list(open_bag(io.BytesIO(Path("b.bag").read_bytes())).messages())) == 2


def test_moved_type_prompts_for_its_new_name(
    command: Command, bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = connection(0, "/a", type="gone_msgs/Text", md5sum="x")
    bag.write_bytes(make_bag([[Given(0, 1, b"\x01\0\0\0a")]], [gone]))
    monkeypatch.setattr("sys.stdin", io.StringIO("std_msgs/Nope\nstd_msgs/String\n"))

    out = command("rosbag", "check", "a.bag", "-g", "a.bmr").out
    assert (
        "The message type gone_msgs/Text appears to have moved.  Please enter the type to migrate it to.\n>"
        in out
    )
    assert ">'std_msgs/Nope' could not be found in your system.  Please make sure it is built.\n>" in out
    assert command("rosbag", "fix", "a.bag", "b.bag", "a.bmr").out == "Bag migrated successfully.\n"
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert command("rosbag", "check", "a.bag", "-g", "b.bmr").status == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("check", "You must specify a bag file to check."),
        ("check a.bag -a", "Cannot specify -a without also specifying -g."),
        ("check a.bag -g a.bag", "The file a.bag already exists.  Include -a if you intend to append."),
        ("check a.bag -a -g no.bmr", "The file no.bmr does not exist, and so -a is invalid."),
        ("fix", "You must pass input and output bag files."),
        ("fix a.bag", "You must pass an output bag file."),
        ("fix a.bag b.bmr", "Input file should be a bag file, not a rule file."),
        ("fix a.bag b.txt", "Output file must be a bag file."),
    ],
)
def test_usage_errors_are_those_of_ros(
    bag: Path, capsys: pytest.CaptureFixture[str], words: str, said: str
) -> None:
    assert rosbag.main(words.split()) == 2
    assert f"rosbag: error: {said}\n" in capsys.readouterr().err


def test_what_cannot_be_read_or_written_is_one_line(command: Command, bag: Path) -> None:
    missing = "ERROR reading no.bag: [Errno 2] No such file or directory: 'no.bag'\n"
    assert command("rosbag", "check", "no.bag") == (1, "", missing)
    assert command("rosbag", "fix", "no.bag", "b.bag") == (1, "", missing)
    assert command("rosbag", "fix", "a.bag", "no/b.bag") == (1, "", "Cannot open no/b.bag for writing\n")
    assert [path.name for path in bag.parent.iterdir()] == ["a.bag"]
