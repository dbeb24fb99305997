"""notebook/frames: a topic of a bag as a data frame."""

from __future__ import annotations

from pathlib import Path

import pytest
import rosbag
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header, String

from minirospy.base.errors import MinirospyError, NotFoundError
from minirospy.notebook import frame

pandas = pytest.importorskip("pandas", reason="pandas is not installed")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a bag of ten seconds, with joint states at 1 Hz, and a topic with messages of two types."""
    path = tmp_path_factory.mktemp("bags") / "arm.bag"
    with rosbag.Bag(str(path), "w") as bag:
        for second in range(10):
            time = rospy.Time(1_700_000_000 + second, 5)
            message = JointState(header=Header(stamp=time), name=["elbow"], position=[0.1 * second])
            bag.write("/joint_states", message, time)
        bag.write("/mixed", String("text"), rospy.Time(1_700_000_000))
        bag.write("/mixed", Header(), rospy.Time(1_700_000_001))
    return path


def test_each_message_is_a_row_at_its_time_of_receipt(bag: Path) -> None:
    table = frame(bag, "/joint_states")
    assert len(table) == 10
    assert table.index.name == "time"
    assert table.index[3] == pandas.Timestamp(1_700_000_003_000_000_005, tz="UTC")
    assert table["header.stamp"].iloc[3] == table.index[3]
    assert table["position[elbow]"].tolist() == pytest.approx([0.1 * second for second in range(10)])


def test_times_and_an_open_bag(bag: Path) -> None:
    with rosbag.Bag(str(bag)) as opened:
        table = frame(
            opened, "joint_states", start=rospy.Time(1_700_000_002, 5), end=rospy.Time(1_700_000_004, 5)
        )
    assert table["header.seq"].size == 3


def test_wrong_topics_types_and_libraries_are_named(bag: Path) -> None:
    with pytest.raises(
        NotFoundError, match=r"topic \[/joint_state\] not found; did you mean /joint_states\?"
    ):
        frame(bag, "/joint_state")
    with pytest.raises(
        MinirospyError, match="/mixed has messages of several types: std_msgs/Header, std_msgs/String"
    ):
        frame(bag, "/mixed")
    with pytest.raises(MinirospyError, match="library is 'panda': it must be 'pandas' or 'polars'"):
        frame(bag, "/joint_states", library="panda")  # type: ignore[arg-type]


def test_missing_library_is_named_with_its_command(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MinirospyError, match=r"a data frame needs pandas: .*install pandas"):
        frame(bag, "/joint_states")


def test_polars_has_the_time_as_a_column(bag: Path) -> None:
    polars = pytest.importorskip("polars", reason="polars is not installed")
    table = frame(bag, "/joint_states", library="polars")
    assert table.shape[0] == 10
    assert table["time"].dtype == polars.Datetime("ns", "UTC")
    assert table["position[elbow]"][9] == pytest.approx(0.9)
