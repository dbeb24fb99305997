"""log_levels: ROS's levels and the corresponding levels of Python's logging."""

from __future__ import annotations

import logging

import pytest

from minirospy.base.log_levels import LEVEL_NAMES, PYTHON_LEVELS, logger_levels, ros_level, set_logger_level


@pytest.mark.parametrize(
    ("python", "ros"),
    [
        (0, "DEBUG"),
        (10, "DEBUG"),
        (20, "INFO"),
        (25, "INFO"),
        (30, "WARN"),
        (40, "ERROR"),
        (50, "FATAL"),
        (99, "FATAL"),
    ],
)
def test_python_level_is_the_nearest_of_ros_at_or_below(python: int, ros: str) -> None:
    assert LEVEL_NAMES[ros_level(python)] == ros


def test_each_level_of_ros_has_one_of_python() -> None:
    assert [ros_level(python) for python in PYTHON_LEVELS.values()] == [1, 2, 4, 8, 16]


def test_level_is_set_by_name_in_upper_or_lower_case() -> None:
    logger = logging.getLogger("test-log-levels")
    for given in ("debug", "WARN"):
        set_logger_level(logger.name, given)
        assert logger_levels([logger.name]) == {logger.name: given.upper()}

    with pytest.raises(
        ValueError, match=r"^\[loud\] is not one of the levels debug, info, warn, error, fatal$"
    ):
        set_logger_level(logger.name, "loud")
    assert logger.level == logging.WARNING
