"""Topics of bags as tables: columns, missing values, files that exist, a library that is missing."""

from __future__ import annotations

import csv
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from mcap.writer import Writer as McapWriter
from rospy import Duration
from sensor_msgs.msg import Image, JointState, LaserScan
from std_msgs.msg import Bool, String, UInt64
from std_msgs.msg import Duration as DurationMessage
from tf2_msgs.msg import TFMessage

from minirospy.base.errors import BagError, NotFoundError, UsageError
from minirospy.core.bag.writer import BagWriter
from minirospy.core.idl.load import class_from_text
from minirospy.introspect import bag_export
from minirospy.introspect.bag_export import export, file_name
from minirospy.introspect.columns import columns

SECOND = 10**9


def write(path: Path, rows: dict[str, list[Any]]) -> str:
    """Write messages by topic, one per second; return the path."""
    with path.open("wb") as stream:
        writer = BagWriter(stream)
        for topic, messages in rows.items():
            for second, message in enumerate(messages):
                kind = type(message)
                number = writer.add_connection(
                    topic, {"type": kind._type, "md5sum": kind._md5sum, "message_definition": kind._full_text}
                )
                buffer = BytesIO()
                message.serialize(buffer)
                writer.write(number, second * SECOND + 5, buffer.getvalue())
        writer.close()
    return str(path)


def table(path: Path, messages: list[Any]) -> list[dict[str, str]]:
    """Return the rows of the CSV file for messages on one topic."""
    [found] = export(write(path / "a.bag", {"/t": messages}), [], str(path), "csv")
    with open(found.path, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert found.rows == len(rows) == len(messages)
    assert not rows or found.columns == len(rows[0])
    return rows


def test_scalars_times_and_texts_have_a_cell_each(tmp_path: Path) -> None:
    assert table(tmp_path, [String('a,"b"\nc'), String("ż")]) == [
        {"time": "0.000000005", "data": 'a,"b"\nc'},
        {"time": "1.000000005", "data": "ż"},
    ]
    (tmp_path / "a_t.csv").unlink()
    assert [row["data"] for row in table(tmp_path, [Bool(True), Bool(False)])] == ["true", "false"]
    (tmp_path / "a_t.csv").unlink()
    durations = [DurationMessage(Duration(-1, 0)), DurationMessage(Duration(0, 5))]
    assert [row["data"] for row in table(tmp_path, durations)] == ["-1.000000000", "0.000000005"]


def test_joints_have_columns_by_name_and_rows_without_them_are_empty(tmp_path: Path) -> None:
    messages = [
        JointState(name=["elbow"], position=[1.5]),
        JointState(name=["wrist", "elbow"], position=[2.5, 3.5]),
    ]
    rows = table(tmp_path, messages)
    assert [(row["position[elbow]"], row["position[wrist]"]) for row in rows] == [("1.5", ""), ("3.5", "2.5")]
    assert [row["name[1]"] for row in rows] == ["", "elbow"]
    assert "velocity" not in rows[0]


def test_one_message_with_another_number_of_names_changes_no_cell_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bag_export, "MAX_BATCH", 2)
    messages = [JointState(name=["elbow"], position=[float(at)]) for at in range(5)]
    messages[2].position = [7.0, 8.0]
    rows = table(tmp_path, messages)
    assert [row["position[elbow]"] for row in rows] == ["0.0", "1.0", "", "3.0", "4.0"]
    assert [row["position[1]"] for row in rows] == ["", "", "8.0", "", ""]


def test_elements_of_arrays_have_columns_also_in_messages_in_arrays(tmp_path: Path) -> None:
    first, second = TransformStamped(child_frame_id="a"), TransformStamped(child_frame_id="b")
    second.transform.translation.x = 2.5
    rows = table(tmp_path, [TFMessage([first]), TFMessage([first, second]), TFMessage([])])
    assert [row["transforms[1].child_frame_id"] for row in rows] == ["", "b", ""]
    assert [row["transforms[1].transform.translation.x"] for row in rows] == ["", "2.5", ""]
    assert rows[0]["transforms[0].header.stamp"] == "0.000000000"


def test_batches_with_other_columns_are_one_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_export, "MAX_BATCH", 2)
    messages = [LaserScan(ranges=[1.0] * count) for count in (1, 0, 3, 2, 0)]
    rows = table(tmp_path, messages)
    assert [sum(row[f"ranges[{index}]"] != "" for index in range(3)) for row in rows] == [1, 0, 3, 2, 0]
    assert list(rows[0])[-3:] == ["ranges[0]", "ranges[1]", "ranges[2]"]


def test_table_with_too_many_columns_is_refused(tmp_path: Path) -> None:
    wide = [TFMessage([])] * 3 + [TFMessage([TransformStamped()] * 2_500)]
    names = [JointState(name=[f"{second}_{each}" for each in range(5_001)]) for second in range(5)]
    for message in names:
        message.position = [0.0] * len(message.name)
    bag = write(tmp_path / "a.bag", {"/tf": wide, "/joints": names})
    for topic, text in (("/tf", "topic /tf has too many columns"), ("/joints", "position has values for")):
        with pytest.raises(BagError, match=f"{text}.*more than 20,000|{text} more than 20,000 names"):
            export(bag, [topic], str(tmp_path), "csv")
    assert [each.name for each in tmp_path.iterdir()] == ["a.bag"]


def test_batches_have_a_limited_number_of_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_export, "MAX_CELLS", 800)
    rows: list[int] = []
    monkeypatch.setattr(
        bag_export, "columns", lambda messages: rows.append(len(messages)) or columns(messages)
    )
    scans = [LaserScan(ranges=[1.0] * count) for count in (1, 1, 1, 100, 1)]
    assert [row["ranges[99]"] for row in table(tmp_path, scans)] == ["", "", "", "1.0", ""]
    assert rows[:3] == [3, 1, 1]  # none beside the long one in the first pass


def test_bytes_are_left_out_and_named(tmp_path: Path) -> None:
    bag = write(tmp_path / "a.bag", {"/camera/image": [Image(width=2, data=b"12")]})
    [found] = export(bag, ["camera/image"], str(tmp_path), "csv")
    assert (Path(found.path).name, found.left_out) == ("a_camera_image.csv", ["data"])
    assert "data" not in Path(found.path).read_text(encoding="utf-8").splitlines()[0].split(",")


def test_mistakes_are_refused_before_anything_is_written(tmp_path: Path) -> None:
    bag = write(
        tmp_path / "a.bag",
        {"/a/b": [String("x")], "/a_b": [String("x")], "/c": [String("x"), Bool(True)], "/C": [String("x")]},
    )
    (tmp_path / "a_c.csv").write_text("kept", encoding="utf-8")
    folder = str(tmp_path)
    with pytest.raises(UsageError, match="csv or parquet"):
        export(bag, [], folder, "xls")
    with pytest.raises(NotFoundError, match="/d"):
        export(bag, ["/a/b", "/d"], folder, "csv")
    with pytest.raises(UsageError, match="same file name"):
        export(bag, ["/a/b", "/a_b"], folder, "csv")
    with pytest.raises(UsageError, match="same file name"):
        export(bag, ["/c", "/C"], folder, "csv", force=True)
    with pytest.raises(UsageError, match="exists already"):
        export(bag, ["/a/b", "/c"], folder, "csv")
    with pytest.raises(BagError, match="several types"):
        export(bag, ["/c"], folder, "csv", force=True)
    assert (tmp_path / "a_c.csv").read_text(encoding="utf-8") == "kept"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.bag", "a_c.csv"]


def test_topic_with_several_definitions_of_its_type_is_refused(tmp_path: Path) -> None:
    kinds = [class_from_text("my_msgs/P", f"float64 {one}\nfloat64 {two}\n") for one, two in ("xy", "yx")]
    bag = write(tmp_path / "a.bag", {"/p": [kind() for kind in kinds]})
    with pytest.raises(BagError, match="several definitions of my_msgs/P"):
        export(bag, [], str(tmp_path), "csv")
    assert [each.name for each in tmp_path.iterdir()] == ["a.bag"]


def test_interrupted_export_leaves_no_file(tmp_path: Path) -> None:
    bag = write(tmp_path / "a.bag", {"/t": [String("x")]})

    def interrupt(done: int) -> None:
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(bag, [], str(tmp_path), "csv", step=interrupt)
    assert [each.name for each in tmp_path.iterdir()] == ["a.bag"]


def test_parquet_without_its_library_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    bag = write(tmp_path / "a.bag", {"/t": [String("x")]})
    with pytest.raises(BagError, match=r"needs the library pyarrow: .*install pyarrow"):
        export(bag, [], str(tmp_path), "parquet")


def test_parquet_has_typed_columns(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    scans = [LaserScan(ranges=[1.0]), LaserScan(ranges=[1.0, 2.0])]
    scans[0].header.frame_id = "laser"
    bag = write(
        tmp_path / "a.bag",
        {
            "/scan": scans,
            "/n": [UInt64(2**64 - 1)],
            "/b": [Bool(True)],
            "/d": [DurationMessage(Duration(1, 2))],
        },
    )
    paths = {Path(each.path).stem: each.path for each in export(bag, [], str(tmp_path), "parquet")}
    scan = parquet.read_table(paths["a_scan"])
    assert str(scan.schema.field("time").type) == "timestamp[ns, tz=UTC]"
    assert scan["ranges[1]"].to_pylist() == [None, 2.0]
    assert scan["header.frame_id"].to_pylist() == ["laser", ""]
    assert parquet.read_table(paths["a_n"])["data"].to_pylist() == [2**64 - 1]
    assert parquet.read_table(paths["a_b"])["data"].to_pylist() == [True]
    assert str(parquet.read_table(paths["a_d"]).schema.field("data").type) == "duration[ns]"


def test_time_that_parquet_does_not_have_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow.parquet")
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = McapWriter(stream)
        writer.start("ros1", "test")
        schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data\n")
        channel = writer.register_channel("/s", "ros1", schema, {"md5sum": String._md5sum})
        writer.add_message(channel, log_time=2**63, publish_time=0, data=b"\1\0\0\0x")
        writer.finish()
    with pytest.raises(BagError, match="9,223,372,036,854,775,808 ns, is too late for Parquet"):
        export(str(tmp_path / "a.mcap"), [], str(tmp_path), "parquet")
    assert [each.name for each in tmp_path.iterdir()] == ["a.mcap"]
    [found] = export(str(tmp_path / "a.mcap"), [], str(tmp_path), "csv")
    assert "9223372036.854775808,x" in Path(found.path).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("topic", "name"),
    [("/camera/info", "run_camera_info.csv"), ("/", "run_topic.csv"), ("a-b", "run_a_b.csv")],
)
def test_file_is_named_after_bag_and_topic(topic: str, name: str) -> None:
    assert file_name("/tmp/run.bag", topic, "csv") == name
