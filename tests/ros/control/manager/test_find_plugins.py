"""Controllers found in packages' XML files and by entry points."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import pytest
from controller_interface import Controller

from minirospy.ros.controller_manager.plugins import PluginError, find_plugins
from tests.conftest import write_files
from tests.ros.control.manager.conftest import MANIFEST


class Mine:
    """A namespace of controllers."""

    class Inner(Controller):
        """A controller that an entry point names."""


def test_entry_points(monkeypatch: pytest.MonkeyPatch) -> None:
    point = metadata.EntryPoint("mine/Mine", f"{__name__}:Mine.Inner", "controller_interface.controllers")
    monkeypatch.setattr(metadata, "entry_points", lambda group: [point] if group == point.group else [])
    plugin = find_plugins()["mine/Mine"]
    assert plugin.load().__qualname__ == "Mine.Inner"
    assert plugin.origin == f"entry point of {__name__}"


def test_files_of_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    several = """<class_libraries>
      <library path="a"><class name="first/A" type="first.A" base_class_type="controller_interface::ControllerBase"/></library>
      <library path="b"><class type="first.B"/><class name="first/Plan" type="x" base_class_type="nav_core::Base"/></library>
    </class_libraries>"""
    write_files(
        tmp_path,
        {
            "first/package.xml": MANIFEST.format(name="first"),
            "first/plugins.xml": several,
            "wrong/package.xml": MANIFEST.format(name="wrong"),
            "wrong/plugins.xml": "<library>",
            "without/package.xml": MANIFEST.format(name="without"),
        },
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    warnings: list[str] = []
    plugins = find_plugins(warnings.append)
    found = {name: plugin for name, plugin in plugins.items() if plugin.folder == tmp_path / "first"}
    assert {name: plugin.python for name, plugin in found.items()} == {
        "first/A": "first.A",
        "first.B": "first.B",
    }
    assert found["first/A"].origin == f"{tmp_path / 'first' / 'plugins.xml'}:2"
    assert [line.partition("]")[0] for line in warnings] == [
        "controllers of package [without",
        "controllers of package [wrong",
    ]
    with pytest.raises(
        PluginError, match=r"cannot import first\.A \(.*: ModuleNotFoundError: No module named 'first'$"
    ):
        found["first/A"].load()
