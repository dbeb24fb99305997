"""README.md, docs/tour.md and docs/bag_to_plot.md are correct: each command, typed into a terminal, prints what they show."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest
import rosbag
import rospy
from std_msgs.msg import Bool

from tests.test_course import record

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not Path("/bin/bash").exists(), reason="the pages show Linux and bash"
)


@pytest.fixture
def player(tmp_path: Path) -> Any:
    assert record is not None
    board = {name: os.environ[name] for name in ("MINIROSPY_BOARD", "MINIROSPY_RUNTIME_DIR")}
    return record.Player(tmp_path, board)


@pytest.mark.timeout(600)
def test_tour_shows_the_output_of_its_commands(player: Any) -> None:
    player.play(ROOT / "docs" / "tour.md")


def test_bag_to_plot_shows_the_output_of_its_commands(player: Any, tmp_path: Path) -> None:
    with rosbag.Bag(str(tmp_path / "button.bag"), "w") as bag:
        for second in range(4):
            bag.write("/button_state", Bool(second % 2 == 1), rospy.Time(100 + second))
    player.play(ROOT / "docs" / "bag_to_plot.md")


def test_readme_shows_the_output_of_its_commands(player: Any) -> None:
    assert record is not None
    # The reader leaves the programs running.
    with pytest.raises(
        record.CourseError, match=r"at its end a program still runs in the terminals \[1, 2, 3\]"
    ):
        player.play(ROOT / "README.md")
