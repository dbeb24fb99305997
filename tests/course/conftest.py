"""A student's workspace: the files that the pages of the course tell the student to save, and some wrong programs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "docs" / "workshop"


def saved_files(page: str) -> dict[str, str]:
    """Return the files that a page tells the student to save, by their path below the home folder."""
    text = (PAGES / page).read_text(encoding="utf-8")
    found = re.findall(r"`~/([^`]+)`:\n\n```\w*\n(.*?)```\n", text, re.DOTALL)
    return dict(found)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder `src` of a workspace with the pages' package rpi_test, which ROS_PACKAGE_PATH names."""
    for page in PAGES.glob("*.md"):
        for name, text in saved_files(page.name).items():
            file = tmp_path / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
    source = tmp_path / "catkin_ws" / "src"
    for package in ("rpi_test", "my_bringup"):
        (source / package / "package.xml").write_text(
            f'<package format="2"><name>{package}</name><version>0.0.0</version><description>x</description>'
            '<maintainer email="a@b.de">x</maintainer><license>BSD</license></package>'
        )
    # The page's solution is a command that changes one line.
    button = source / "rpi_test" / "scripts" / "my_button.py"
    parameters = (PAGES / "parameters.md").read_text(encoding="utf-8")
    change = re.search(r"sed -i 's\|(.+?)\|(.+?)\|' my_button\.py", parameters)
    assert change
    text = button.read_text()
    assert change[1] in text
    button.write_text(text.replace(change[1], change[2]))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(source))
    return source
