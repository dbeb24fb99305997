"""The table of types in docs/ros2.md matches the rules and the definitions."""

from __future__ import annotations

from pathlib import Path

from tests.ros2.ros2_table import table

PAGE = Path(__file__).parents[2] / "docs" / "ros2.md"


def test_the_table_of_types_is_as_the_page_has_it() -> None:
    text = PAGE.read_text(encoding="utf-8")
    written = text.partition("compares it -->\n")[2].partition("\n<!-- end of the table -->")[0]
    assert written == table(), "write into docs/ros2.md what tests/ros2/ros2_table.py returns"
