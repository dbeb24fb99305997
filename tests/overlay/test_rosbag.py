"""rosbag.Bag as programs use it: modes, streams, raw messages, time, filters, info, exceptions."""

from __future__ import annotations

import io
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import genpy
import pytest
import rosbag
import rospy
from rosbag.bag import BagMessage, ROSBagEncryptNotSupportedException
from std_msgs.msg import Int32, String

from tests.core.bag.bags import Given, connection, make_bag


def at(seconds: float) -> rospy.Time:
    return rospy.Time.from_sec(seconds)


@pytest.fixture
def path(tmp_path: Path) -> str:
    """Return a bag with ten messages on /chatter, and five on /count."""
    name = str(tmp_path / "a.bag")
    with rosbag.Bag(name, "w") as bag:
        for number in range(10):
            bag.write("/chatter", String(f"hello {number}"), at(100 + number))
            if number % 2:
                bag.write("/count", Int32(number), at(100 + number))
    return name


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_messages_return_with_their_times(tmp_path: Path, compression: str) -> None:
    name = tmp_path / "a.bag"
    with rosbag.Bag(name, "w", compression=compression, chunk_threshold=100) as bag:
        for number in range(50):
            bag.write("/count", Int32(number), rospy.Time(7, number))

    with rosbag.Bag(name) as bag:
        found = list(bag.read_messages())
        assert [(topic, message.data, stamp) for topic, message, stamp in found] == [
            ("/count", number, rospy.Time(7, number)) for number in range(50)
        ]
        assert isinstance(found[0], BagMessage)
        assert isinstance(found[0].timestamp, rospy.Time)
        assert bag.get_compression_info().compression == compression


def test_topics_and_times_select(path: str) -> None:
    with rosbag.Bag(path) as bag:
        assert [each.message.data for each in bag.read_messages("/count")] == [1, 3, 5, 7, 9]
        assert [each.message.data for each in bag.read_messages(["/count/"], at(103), at(107))] == [3, 5, 7]
        assert len(list(bag.read_messages([]))) == 15
        assert not list(bag.read_messages("/nothing"))
        ints = bag.read_messages(
            connection_filter=lambda topic, kind, md5sum, text, header: kind == "std_msgs/Int32"
        )
        assert {each.topic for each in ints} == {"/count"}


def test_raw_messages_are_written_again(path: str, tmp_path: Path) -> None:
    copy = str(tmp_path / "copy.bag")
    with rosbag.Bag(path) as bag, rosbag.Bag(copy, "w") as other:
        for topic, message, stamp, header in bag.read_messages(raw=True, return_connection_header=True):
            kind, _, md5sum, position, cls = message
            assert (kind, md5sum) == (cls._type, cls._md5sum)
            assert bag._read_message(position, raw=True) == (topic, message, stamp)
            other.write(topic, message, stamp, raw=True, connection_header=header)

    assert Path(copy).read_bytes() == Path(path).read_bytes()


def test_raw_message_without_a_class_needs_an_installed_type(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        bag.write("/a", ("std_msgs/Int32", bytes(4), Int32._md5sum, None), at(1), raw=True)
        with pytest.raises(
            rosbag.ROSBagException, match=r"cannot locate message class .* for \[no_msgs/No\]"
        ):
            bag.write("/b", ("no_msgs/No", b"", "x", None), at(1), raw=True)
        with pytest.raises(ValueError, match="msg must be of length 4 or 5"):
            bag.write("/b", ("no_msgs/No", b""), raw=True)


def test_reading_needs_no_message_package() -> None:
    definition = (
        "float32 x\nstd_msgs/Header h\n"
        + "=" * 80
        + "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id"
    )
    given = connection(0, "/odd", type="far_away_msgs/Odd", message_definition=definition, md5sum="0" * 32)
    bag = rosbag.Bag(io.BytesIO(make_bag([[Given(0, 1, bytes(20))]], [given])))

    (found,) = bag.read_messages()
    assert found.message.h.frame_id == ""
    assert found.message._type == "far_away_msgs/Odd"


def test_appending_continues_the_bag(path: str) -> None:
    with rosbag.Bag(path, "a") as bag:
        bag.write("/late", String("end"), at(200))
        assert bag.get_message_count() == 16
    with rosbag.Bag(path) as bag:
        assert bag.get_end_time() == 200.0
        assert [each.topic for each in bag.read_messages(start_time=at(150))] == ["/late"]


def test_appending_to_a_file_that_does_not_exist_creates_it(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "new.bag", "a") as bag:
        bag.write("/a", Int32(1), at(1))
    with rosbag.Bag(tmp_path / "new.bag") as bag:
        assert bag.get_message_count() == 1


def test_bag_is_read_while_it_is_written(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        for number in range(20):
            bag.write("/count", Int32(number), at(number + 1))
            assert [each.message.data for each in bag.read_messages()] == list(range(number + 1))
    with rosbag.Bag(tmp_path / "a.bag") as bag:
        assert bag.get_message_count() == 20


def test_two_types_on_a_topic_keep_their_types(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        bag.write("/mixed", Int32(1), at(1))
        bag.write("/mixed", String("two"), at(2))
    with rosbag.Bag(tmp_path / "a.bag") as bag:
        assert [each.message.data for each in bag.read_messages()] == [1, "two"]
        assert bag.get_type_and_topic_info().topics["/mixed"].connections == 2


def test_info_matches_rosbag_info(path: str) -> None:
    start, end = (time.strftime("%b %d %Y %H:%M:%S.00", time.localtime(each)) for each in (100, 109))

    with rosbag.Bag(path) as bag:
        assert str(bag).splitlines() == [
            f"path:        {path}",
            "version:     2.0",
            "duration:    9.0s",
            f"start:       {start} (100.00)",
            f"end:         {end} (109.00)",
            "size:        5.9 KB",
            "messages:    15",
            "compression: none [1/1 chunks]",
            "types:       std_msgs/Int32  [da5909fbe378aeaf85e547e830cc1bb7]",
            "             std_msgs/String [992ce8a1687cec8c8bd883ec73ca41d1]",
            "topics:      /chatter   10 msgs @ 1.0 Hz : std_msgs/String",
            "             /count      5 msgs @ 0.5 Hz : std_msgs/Int32",
        ]
        info = bag.get_type_and_topic_info("/count")
        assert info.topics == {"/count": ("std_msgs/Int32", 5, 1, 0.5)}
        assert info.msg_types["std_msgs/String"] == String._md5sum
        assert (bag.get_start_time(), bag.get_end_time(), bag.get_message_count("/count")) == (
            100.0,
            109.0,
            5,
        )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("start", "100.0"),
        ("topics[1].type", "std_msgs/Int32"),
        ("topics[0]", "topic: /chatter\ntype: std_msgs/String\nmessages: 10\nfrequency: 1.0"),
        ("types", "- type: std_msgs/Int32\n  md5: da5909fbe378aeaf85e547e830cc1bb7\n"
                  "- type: std_msgs/String\n  md5: 992ce8a1687cec8c8bd883ec73ca41d1\n"),
        ("nothing", None),
        ("topics[9]", None),
        ("__class__", None),
    ],
)  # fmt: skip
def test_yaml_key(path: str, key: str, value: str | None) -> None:
    with rosbag.Bag(path) as bag:
        assert bag._get_yaml_info(key=key) == value


def test_private_entries_find_messages(path: str) -> None:
    with rosbag.Bag(path) as bag:
        connections = list(bag._get_connections("/count"))
        entries = list(bag._get_entries(connections, at(102), at(108)))
        assert [entry.time.to_sec() for entry in entries] == [103.0, 105.0, 107.0]
        assert [bag._read_message(entry.position).message.data for entry in entries] == [3, 5, 7]
        assert list(bag._get_entries_reverse(connections, at(102), at(108))) == entries[::-1]

        before, after = bag._get_entry(at(104.5), connections), bag._get_entry_after(at(104.5))
        assert before is not None
        assert after is not None
        assert (before.time, after.time) == (at(103), at(105))
        assert bag._get_entry(at(1)) is None
        assert [len(index) for index in bag._connection_indexes.values()] == [10, 5]
        assert [chunk.connection_counts for chunk in bag._chunks] == [{0: 10, 1: 5}]
        assert not bag._has_compressed_chunks


def test_unindexed_bag_is_reindexed(tmp_path: Path) -> None:
    name = tmp_path / "a.bag"
    name.write_bytes(make_bag([[Given(0, 1, b"\0\0\0\0")], [Given(1, 2, b"\0\0\0\0")]], closed=False))

    with pytest.raises(rosbag.ROSBagUnindexedException, match="Unindexed bag"):
        rosbag.Bag(name)
    with rosbag.Bag(name, allow_unindexed=True) as bag:
        assert not list(bag.read_messages())
        assert len(list(bag.reindex())) == 2
        assert len(list(bag.read_messages())) == 2
    with rosbag.Bag(name, "a", allow_unindexed=True) as bag:
        with pytest.raises(rosbag.ROSBagUnindexedException):
            bag.write("/c", Int32(1), at(3))
        list(bag.reindex())
        bag.write("/c", Int32(1), at(3))
    with rosbag.Bag(name) as bag:
        assert [each.topic for each in bag.read_messages()] == ["/topic0", "/topic1", "/c"]


@pytest.mark.parametrize(
    ("data", "kind", "what"),
    [
        (b"", rosbag.ROSBagException, "empty file"),
        (b"hello\n", rosbag.ROSBagException, "This does not appear to be a bag file"),
        (
            b"#ROSRECORD V1.1\n",
            rosbag.ROSBagException,
            "unsupported bag version 101. Please convert bag to newer format.",
        ),
        (b"#ROSBAG V2.0\n", rosbag.ROSBagUnindexedException, "Unindexed bag"),
    ],
)
def test_file_that_is_not_a_bag_is_refused_with_rosbags_text(
    tmp_path: Path, data: bytes, kind: type[Exception], what: str
) -> None:
    (tmp_path / "a.bag").write_bytes(data)
    with pytest.raises(kind) as refused:
        rosbag.Bag(tmp_path / "a.bag")
    assert (type(refused.value), str(refused.value)) == (kind, what)


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"mode": "x"}, 'mode "x" is invalid'),
        ({"compression": "zip"}, "compression must be one of: none, bz2, lz4"),
        ({"chunk_threshold": -1}, "chunk_threshold must be greater than or equal to zero"),
        ({"options": [1]}, "options must be of type dict"),
        ({"f": ""}, r"filename \(or stream\) is invalid"),
    ],
)
def test_wrong_arguments_are_refused(path: str, options: dict[str, Any], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        rosbag.Bag(**{"f": path} | options)


def test_closed_bag_refuses(path: str) -> None:
    bag = rosbag.Bag(path)
    bag.close()
    bag.close()

    for call in (bag.flush, bag.read_messages, lambda: bag.size, lambda: bag.write("/a", Int32(1))):
        with pytest.raises(ValueError, match="I/O operation on closed bag"):
            call()


def test_closed_bag_keeps_its_info(path: str) -> None:
    with rosbag.Bag(path) as bag:
        pass
    assert (bag.get_message_count(), bag.get_start_time(), bag.get_end_time()) == (15, 100.0, 109.0)
    assert bag.get_type_and_topic_info().topics["/count"] == ("std_msgs/Int32", 5, 1, 0.5)
    assert bag.get_message_count(["/count"]) == 5
    with pytest.raises(ValueError, match="I/O operation on closed bag"):
        bag.read_messages()


def test_no_topic_is_selected_by_an_empty_name_in_a_list(path: str) -> None:
    with rosbag.Bag(path) as bag:
        assert [len(list(bag.read_messages(topics))) for topics in ([""], [None], "", [])] == [0, 0, 15, 15]


@pytest.mark.parametrize("limit", [103.0, 103, "103", genpy.Duration(3)])
def test_limits_of_time_are_times(path: str, limit: Any) -> None:
    with rosbag.Bag(path) as bag:
        for name in ("start_time", "end_time"):
            with pytest.raises(TypeError, match=r"are of type rospy\.Time, not"):
                bag.read_messages(**{name: limit})


def test_classes_have_the_names_that_genpy_gives_them(path: str) -> None:
    """Programs select messages by class name, as `type(msg).__name__ == "_sensor_msgs__Image"`."""
    with rosbag.Bag(path) as bag:
        found = {type(each.message).__name__ for each in bag}
    assert found == {"_std_msgs__String", "_std_msgs__Int32"}


def test_submodules_are_there_after_import_rosbag() -> None:
    """Programs write `import rosbag` and `except rosbag.bag.ROSBagException`."""
    program = "import rosbag; print(rosbag.bag.ROSBagException is rosbag.ROSBagException, rosbag.migration.__name__)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("True rosbag.migration\n", "")


def test_missing_file_and_directory_are_the_systems_errors(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        rosbag.Bag(tmp_path / "missing.bag")
    with pytest.raises(OSError, match=r"directory|denied"):
        rosbag.Bag(tmp_path)
    with pytest.raises(rosbag.ROSBagException, match="binary mode"):
        rosbag.Bag(io.StringIO("text"))


def test_wrong_messages_are_refused(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        with pytest.raises(ValueError, match="topic is invalid"):
            bag.write("", Int32(1))
        with pytest.raises(ValueError, match="msg is invalid"):
            bag.write("/a", None)
        with pytest.raises(rosbag.ROSBagException, match="does not fit into a bag"):
            bag.write("/a", Int32(1), genpy.Time(1 << 33, 0))
        with pytest.raises(genpy.SerializationError):
            bag.write("/a", Int32("no"), at(1))
        bag.write("/a", Int32(1), at(1))
    with rosbag.Bag(tmp_path / "a.bag") as bag:
        assert bag.get_message_count() == 1


def test_raw_text_is_encoded_and_other_types_leave_the_bag_intact(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        bag.write(b"/a", Int32(1), at(1))  # type: ignore[arg-type]
        bag.write("/b", ("std_msgs/Int32", "\2\0\0\0", Int32._md5sum, Int32), at(2), raw=True)
        for body in (["x"], None, 3):
            with pytest.raises(TypeError, match="a bytes-like object is required"):
                bag.write("/c", ("std_msgs/Int32", body, Int32._md5sum, Int32), at(3), raw=True)
        bag.write("/c", Int32(4), at(4))
    with rosbag.Bag(tmp_path / "a.bag") as bag:
        assert [(topic, message.data) for topic, message, _ in bag] == [("/a", 1), ("/b", 2), ("/c", 4)]


def test_encryption_is_refused_by_name(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w") as bag:
        bag.set_encryptor()
        with pytest.raises(ROSBagEncryptNotSupportedException, match="rosbag/AesCbcEncryptor"):
            bag.set_encryptor("rosbag/AesCbcEncryptor")
        bag.write("/a", Int32(1), at(1))
        bag.flush()
        with pytest.raises(rosbag.ROSBagException, match="Cannot set encryptor after chunks are written"):
            bag.set_encryptor()


def test_options_may_change_between_chunks(tmp_path: Path) -> None:
    with rosbag.Bag(tmp_path / "a.bag", "w", options={"compression": "bz2", "chunk_threshold": 10}) as bag:
        assert bag.options == {"compression": "bz2", "chunk_threshold": 10}
        bag.write("/a", Int32(1), at(1))
        bag.compression = rosbag.Compression.LZ4
        bag.write("/a", Int32(2), at(2))
    with rosbag.Bag(tmp_path / "a.bag") as bag:
        assert {each.compression for each in bag._chunk_headers.values()} == {"bz2", "lz4"}
        assert [each.message.data for each in bag] == [1, 2]
