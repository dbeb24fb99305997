"""The example launch files of package roslaunch load as those of ROS do."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import rospkg
from roslaunch.config import load_config_default

FOLDER = Path(rospkg.RosPack().get_path("roslaunch")) / "resources"
ARGUMENTS = {"example-args.launch": ["test_foo:=1"]}


@pytest.mark.parametrize("name", sorted(os.listdir(FOLDER)))
def test_example_loads(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VALUE", "5")
    config = load_config_default([(str(FOLDER / name), ARGUMENTS.get(name, []))], None, assign_machines=False)
    assert config.config_errors == []


def test_groups_and_includes() -> None:
    config = load_config_default([str(FOLDER / "example.launch")], None)
    names = [node.namespace + node.name for node in config.nodes]
    assert names[:4] == ["/wg/listener", "/wg/talker1", "/wg/talker2", "/included/talker"]
    assert [tuple(pair) for pair in config.nodes[1].remap_args] == [("chatter", "hello"), ("foo", "bar")]
    assert config.params["/wg/talker1/talker_param"].value == "a value"
    assert config.params["/somestring2"].value == "10"
    assert config.params["/included2/wg2/param4"].value == 4
    assert config.params["/configfile"].value == (FOLDER / "example.launch").read_text()


def test_example_of_rosparam() -> None:
    config = load_config_default([str(FOLDER / "example-params.launch")], None)
    assert config.params["/rosparam/list2"].value == [1, 1, 2, 3, 5, 8]
    assert config.params["/rosparam/float2"].value == 1234.5
