"""The command rosbag_scripts: the programs in ROS's package rosbag, run with `rosrun rosbag NAME`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.core.bag.reader import open_bag
from minirospy.core.bag.records import Connection
from minirospy.core.idl.load import class_from_text
from minirospy.ros.rosbag.commands.rosbag_scripts import SCRIPTS, main
from minirospy.ros.rosbag.parts import migration_scripts
from tests.core.bag.bags import STRING_MD5, Given, connection, make_bag

GIVEN = [[Given(0, 5, b"\x01\0\0\0a"), Given(1, 6, b"\x01\0\0\0b")], [Given(0, 1, b"\x01\0\0\0c")]]
FOLDER = Path(__file__).parents[2] / "minirospy" / "ros" / "rosbag" / "scripts"
PROGRAMS = SCRIPTS | migration_scripts()


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.bag"
    path.write_bytes(make_bag(GIVEN, [connection(0, "/a", callerid="/me"), connection(1, "/b")]))
    return path


def messages(name: str) -> list[tuple[str, int, bytes]]:
    with open(name, "rb") as stream:
        return [(each.connection.topic, each.time, each.body[4:]) for each in open_bag(stream).messages()]


def connections(name: str) -> list[Connection]:
    with open(name, "rb") as stream:
        return list(open_bag(stream).connections.values())


def test_every_program_is_a_script_of_the_package() -> None:
    assert {path.name for path in FOLDER.glob("*.py")} == set(PROGRAMS)
    for name in PROGRAMS:
        assert f'main("{name}")' in (FOLDER / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", sorted(PROGRAMS))
def test_without_words_the_usage_is_printed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(name, [])
    out, err = capsys.readouterr()
    assert f"usage: {name}" in (out + err).replace("Usage", "usage")
    assert status == (2 if name in ("fixbag.py", "fixbag_batch.py", "savemsg.py", "makerule.py") else 0)


def test_topic_renamer(bag: Path) -> None:
    assert main("topic_renamer.py", ["/a", "a.bag", "/new", "b.bag"]) == 0
    assert messages("b.bag") == [("/new", 1, b"c"), ("/new", 5, b"a"), ("/b", 6, b"b")]
    new = next(each for each in connections("b.bag") if each.topic == "/new")
    assert (new.header["topic"], new.callerid) == (b"/new", "/me")


def test_a_bag_is_not_overwritten_while_it_is_read(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = bag.read_bytes()
    assert main("topic_renamer.py", ["/a", "a.bag", "/new", "./a.bag"]) == 1
    assert "would be overwritten" in capsys.readouterr().err
    assert bag.read_bytes() == before


@pytest.mark.parametrize("name", ["bagsort.py", "fastrebag.py"])
def test_copies_are_in_the_order_of_time(bag: Path, name: str) -> None:
    program = subprocess.run(
        [sys.executable, str(FOLDER / name), "a.bag", "b.bag"], capture_output=True, text=True, check=False
    )
    assert (program.returncode, program.stdout, program.stderr) == (0, "", "")
    with open("b.bag", "rb") as stream:
        assert [chunk.counts for chunk in open_bag(stream).chunks] == [{0: 2, 1: 1}]


def test_definitions_and_md5sums_are_made_to_fit(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = connection(0, message_definition="int8 wrong\n")
    bag.write_bytes(make_bag([[Given(0, 1, b"\0\0\0\0")]], [wrong]))

    assert main("fix_msg_defs.py", ["a.bag", "b.bag"]) == 0
    assert (
        capsys.readouterr().err
        == f"FOUND: std_msgs/String [{STRING_MD5}] was defined on your package path\n\n"
    )
    assert connections("b.bag")[0].definition == "string data\n"

    assert main("fix_md5sums.py", ["a.bag", "no.bag"]) == 0
    assert connections("a.bag")[0].md5sum == class_from_text("std_msgs/String", "int8 wrong\n")._md5sum
    assert connections("a.bag.old")[0].md5sum == STRING_MD5
    out = capsys.readouterr().out
    assert " Migration successful.  Original stored as: a.bag.old\n" in out
    assert "Trying to migrating file: no.bag\n Migration failed: [Errno 2]" in out


def test_saved_message_makes_a_rule(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main("savemsg.py", ["-b", "a.bag", "std_msgs/String"]) == 0
    assert main("savemsg.py", ["std_msgs/String"]) == 0
    out = capsys.readouterr().out
    assert out == "[std_msgs/String]:\nstring data\n\n" * 2
    Path("new.saved").write_text(out[: len(out) // 2], encoding="utf-8")
    Path("old.saved").write_text("[std_msgs/String]:\nint8 data\n", encoding="utf-8")

    assert main("makerule.py", ["new.saved", "a.bmr"]) == 0
    assert main("makerule.py", ["old.saved", "a.bmr"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Saved definition is up to date.\nThe following migrations need to occur:\n")
    assert "#Primitive type changed" in Path("a.bmr").read_text(encoding="utf-8")
    assert main("makerule.py", ["old.saved", "a.bmr"]) == 1


def test_fixbag_migrates_or_says_that_it_cannot(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main("fixbag.py", ["a.bag", "b.bag"]) == 0
    assert messages("b.bag") == messages("a.bag")
    assert main("fixbag_batch.py", ["b.bag"]) == 0
    assert Path("b.bag.old").exists()

    bag.write_bytes(
        make_bag(GIVEN, [connection(0, message_definition="int8 old\n", md5sum="1"), connection(1)])
    )
    assert main("fixbag.py", ["a.bag", "c.bag"]) == 1
    assert main("fixbag_batch.py", ["a.bag"]) == 0
    assert capsys.readouterr().out.endswith(
        "Bag could not be migrated.\nTrying to migrate: a.bag\n Migration failed.\n"
    )
    assert main("fixbag.py", ["a.bag", "c.bmr"]) == 2
