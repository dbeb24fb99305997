"""The command rosversion."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.environment import ROS_VERSION

from .conftest import Command


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "src" / "my"
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(
        "<package><name>my</name><version>1.2.3</version><description/></package>"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))


def test_of_a_package(command: Command) -> None:
    assert command("rosversion", "my") == (0, "1.2.3\n", "")
    assert command("rosversion", "-s", "my") == (0, "1.2.3", "")


def test_of_all(command: Command) -> None:
    lines = command("rosversion", "-a").out.splitlines()
    assert "my: 1.2.3" in lines
    names = [line.partition(":")[0] for line in lines]
    assert names == sorted(names)


def test_version_of_included_packages(command: Command) -> None:
    """The version is that of the ROS release that the definitions come from, not minirospy's."""
    for package, version in (
        ("std_msgs", "0.5.13"),
        ("sensor_msgs", "1.13.1"),
        ("roscpp", ROS_VERSION.strip()),
    ):
        assert command("rosversion", package) == (0, f"{version}\n", "")
    own = {"minirospy_msgs", "rpi_msgs", "teleop_twist_keyboard"}
    for line in command("rosversion", "-a").out.splitlines():
        name, _, version = line.partition(": ")
        assert version != "1.0.0" or name in own, line


def test_of_the_distribution(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    assert command("rosversion", "-d") == (0, "noetic\n", "")
    monkeypatch.setenv("ROS_DISTRO", "melodic")
    assert command("rosversion", "-ds") == (0, "melodic", "")


def test_what_cannot_be_told(command: Command) -> None:
    status, out, err = command("rosversion", "mi")
    assert (status, out) == (1, "Cannot locate [mi]\n")
    assert err.startswith("rosversion: ERROR: package [mi] not found: ROS_PACKAGE_PATH names")
    assert command("rosversion").status == 2
    assert command("rosversion", "-d", "my").status == 2
