"""rospkg: packages and their dependencies, the environment."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import rospkg
import rospkg.common
import rospkg.distro
import rospkg.environment

PACKAGES = {
    "a": "<depend>b</depend><depend>c</depend>",
    "b": "<depend>d</depend><build_depend>boost</build_depend>",
    "c": "<buildtool_depend>catkin</buildtool_depend><test_depend>d</test_depend><doc_depend>a</doc_depend>",
    "d": '<export><lib plugin="${prefix}/p.xml"/><lib plugin="second.xml"/></export>',
    "circle1": "<depend>circle2</depend>",
    "circle2": "<depend>circle1</depend>",
    "meta": "<exec_depend>a</exec_depend><exec_depend>c</exec_depend><export><metapackage/></export>",
}


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name, body in PACKAGES.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.xml").write_text(
            f'<package format="2"><name>{name}</name><version>1.2.3</version><description>It is {name}.</description>'
            '<maintainer email="a@b.org">Ann</maintainer><author>Bob</author><license>BSD</license>'
            f"<license>MIT</license><url>http://w</url>{body}</package>"
        )
    return tmp_path


@pytest.fixture
def rospack(tree: Path) -> rospkg.RosPack:
    return rospkg.RosPack([str(tree)])


def test_packages(rospack: rospkg.RosPack, tree: Path) -> None:
    assert rospack.list() == ["a", "b", "c", "circle1", "circle2", "d"]
    assert rospack.get_path("a") == str(tree / "a")
    assert rospack.ros_paths == rospack.get_ros_paths() == [str(tree)]
    assert rospack.stack_of("a") is None


def test_missing_names_raise(rospack: rospkg.RosPack, tree: Path) -> None:
    for ask in (
        rospack.get_path,
        rospack.get_manifest,
        rospack.get_depends,
        rospack.get_rosdeps,
        rospack.stack_of,
    ):
        with pytest.raises(rospkg.ResourceNotFound) as caught:
            ask("nope")
        assert caught.value.args == ("nope",)
        assert str(caught.value) == f"nope\nROS path [0]={tree}"
    assert rospack.get_depends_on("nope") == []
    with pytest.raises(rospkg.common.ResourceNotFound, match=r"circle \(did you mean circle1 or circle2"):
        rospack.get_path("circle")


def test_dependencies(rospack: rospkg.RosPack) -> None:
    assert rospack.get_depends("a", implicit=False) == ["b", "c"]
    assert rospack.get_depends("a") == ["d", "b", "c"]
    assert rospack.get_depends("circle1") == ["circle2"]
    assert rospack.get_depends_on("d", implicit=False) == ["b", "c"]
    assert rospack.get_depends_on("d") == ["a", "b", "c"]
    assert rospack.get_rosdeps("a", implicit=False) == []
    assert rospack.get_rosdeps("a") == ["boost", "catkin"]


def test_manifests(rospack: rospkg.RosPack, tree: Path) -> None:
    manifest = rospack.get_manifest("b")
    assert (manifest.version, manifest.description, manifest.license) == ("1.2.3", "It is b.", "BSD, MIT")
    assert manifest.author == "Maintainer: Ann <a@b.org>, Bob"
    assert (manifest.url, manifest.type, manifest.is_catkin) == ("http://w", "package", True)
    assert [(each.name, each.type) for each in manifest.depends] == [("d", "package")]
    assert [each.name for each in manifest.rosdeps] == ["boost"]
    assert rospack.get_manifest("d").get_export("lib", "plugin") == [f"{tree}/d/p.xml", "second.xml"]
    assert rospack.get_manifest("d").get_export("lib", "plugin", convert=False)[0] == "${prefix}/p.xml"
    assert rospack.get_manifest("d").exports[0].get("plugin") == "${prefix}/p.xml"


def test_a_manifest_that_does_not_read(rospack: rospkg.RosPack, tree: Path) -> None:
    (tree / "d" / "package.xml").write_text("<package><name>d</name>")
    with pytest.raises(rospkg.InvalidManifest, match="not XML"):
        rospack.get_manifest("d")
    assert rospack.get_depends_on("c", implicit=False) == ["a"]


def test_metapackages_are_stacks(tree: Path) -> None:
    stacks = rospkg.RosStack([str(tree)])
    assert stacks.list() == ["meta"]
    assert stacks.get_path("meta") == str(tree / "meta")
    assert stacks.packages_of("meta") == ["a", "c"]
    assert stacks.get_stack_version("meta") == "1.2.3"
    assert rospkg.expand_to_packages(["meta", "d", "x"], rospkg.RosPack([str(tree)]), stacks) == (
        ["a", "c", "d"],
        ["x"],
    )


def test_the_environment_names_the_folders(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tree))
    assert {"a", "std_msgs", "rpi_feros"} <= set(rospkg.RosPack().list())
    assert rospkg.RosPack.get_instance() is rospkg.RosPack.get_instance()
    assert rospkg.RosPack.get_instance() is not rospkg.RosStack.get_instance()
    assert rospkg.get_ros_package_path() == str(tree)
    assert rospkg.get_ros_paths()[0] == str(tree)
    assert rospkg.on_ros_path(str(tree / "a"))
    assert not rospkg.on_ros_path(f"{tree}_not")
    assert rospkg.get_package_name(str(tree / "a" / "src")) == "a"
    assert rospkg.get_package_name("/") is None


def test_storage_locations() -> None:
    home = {"ROS_HOME": "/x"}
    assert rospkg.get_ros_home(home) == "/x"
    assert rospkg.get_ros_home({}) == os.path.join(os.path.expanduser("~"), ".ros")
    assert rospkg.get_log_dir(home) == os.path.join("/x", "log")
    assert rospkg.get_log_dir({"ROS_LOG_DIR": "/y"}) == "/y"
    assert rospkg.get_test_results_dir(home) == os.path.join("/x", "test_results")
    assert rospkg.get_etc_ros_dir({"ROS_ETC_DIR": "/e"}) == "/e"
    assert rospkg.get_ros_root({}) is None
    assert rospkg.environment.ROS_PACKAGE_PATH == "ROS_PACKAGE_PATH"
    assert rospkg.distro.current_distro_codename({"ROS_DISTRO": "melodic"}) == "melodic"
    assert rospkg.distro.current_distro_codename({}) == "noetic"


def test_custom_cache_stores_values(rospack: rospkg.RosPack) -> None:
    assert rospack.get_custom_cache("k", 1) == 1
    rospack.set_custom_cache("k", 2)
    assert rospack.get_custom_cache("k") == 2
