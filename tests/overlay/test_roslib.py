"""roslib as old tutorials import it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import roslib
import roslib.message
import roslib.names
import roslib.packages
import roslib.rosenv
from rospkg import ResourceNotFound
from std_msgs.msg import Bool
from std_srvs.srv import Empty


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the package beginner_tutorials, with a module in src and a script."""
    folder = tmp_path / "ws" / "beginner_tutorials"
    (folder / "src" / "beginner_tutorials").mkdir(parents=True)
    (folder / "src" / "beginner_tutorials" / "__init__.py").write_text("ANSWER = 42\n")
    (folder / "scripts").mkdir()
    (folder / "scripts" / "talker.py").write_text(
        "import roslib; roslib.load_manifest('beginner_tutorials')\n"
        "import beginner_tutorials\nprint(beginner_tutorials.ANSWER)\n"
    )
    (folder / "package.xml").write_text(
        "<package><name>beginner_tutorials</name><run_depend>helper</run_depend><run_depend>boost</run_depend></package>"
    )
    helper = tmp_path / "ws" / "helper"
    (helper / "src" / "helper").mkdir(parents=True)
    (helper / "src" / "helper" / "__init__.py").touch()
    (helper / "package.xml").write_text("<package><name>helper</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ws"))
    monkeypatch.setattr(sys, "path", list(sys.path))
    return folder


def test_load_manifest_finds_sources_of_a_package_and_its_dependencies(package: Path) -> None:
    before = list(sys.path)
    roslib.load_manifest("beginner_tutorials")
    assert [each for each in sys.path if each not in before] == [
        str(package / "src"),
        str(package.parent / "helper" / "src"),
    ]
    roslib.load_manifest("beginner_tutorials")
    assert len(sys.path) == len(before) + 2
    assert sys.path[0] == before[0]


def test_load_manifest_leaves_a_built_package_as_it_is_sourced(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The devel folder has the package's messages, which its src folder lacks."""
    built = tmp_path / "devel" / "beginner_tutorials"
    (built / "msg").mkdir(parents=True)
    (built / "__init__.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path / "devel"))
    roslib.load_manifest("beginner_tutorials")
    assert str(package / "src") not in sys.path
    assert str(package.parent / "helper" / "src") in sys.path


def test_load_manifest_in_a_script(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = str(package / "scripts" / "talker.py")
    assert subprocess.check_output([sys.executable, script], text=True) == "42\n"
    # The package that contains the script is found without any variable, too.
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    assert subprocess.check_output([sys.executable, script], text=True) == "42\n"


def test_load_manifest_of_importable_and_missing_packages(package: Path) -> None:
    before = list(sys.path)
    roslib.load_manifest("std_msgs")
    roslib.load_manifest("rospy")
    assert sys.path == before
    with pytest.raises(ResourceNotFound, match=r"beginner_tutorial \(did you mean beginner_tutorials"):
        roslib.load_manifest("beginner_tutorial")


def test_folders_of_packages(package: Path) -> None:
    assert roslib.packages.get_pkg_dir("beginner_tutorials") == str(package)
    assert roslib.packages.get_pkg_dir("nope", required=False) is None
    with pytest.raises(
        roslib.packages.InvalidROSPkgException, match="Cannot locate installation of package nope"
    ):
        roslib.packages.get_pkg_dir("nope")
    assert issubclass(roslib.packages.InvalidROSPkgException, roslib.packages.ROSPkgException)
    assert roslib.packages.get_dir_pkg(str(package / "src")) == (str(package), "beginner_tutorials")
    assert roslib.packages.get_dir_pkg("/") == (None, None)
    assert roslib.packages.get_pkg_subdir("beginner_tutorials", "src") == str(package / "src")
    assert roslib.packages.get_pkg_subdir("beginner_tutorials", "no", required=False) is None
    assert roslib.packages.get_pkg_subdir("beginner_tutorials", "new") == str(package / "new")
    assert roslib.packages.resource_file("helper", "a", "b.txt") == str(
        package.parent / "helper" / "a" / "b.txt"
    )
    assert roslib.packages.list_pkgs_by_path(str(package.parent)) == ["beginner_tutorials", "helper"]


def test_files_of_packages(package: Path) -> None:
    script = str(package / "scripts" / "talker.py")
    assert roslib.packages.find_node("beginner_tutorials", "talker.py") == [script]
    assert roslib.packages.find_node("beginner_tutorials", "package.xml") == []
    assert roslib.packages.find_resource("beginner_tutorials", "package.xml") == [
        str(package / "package.xml")
    ]
    assert roslib.packages.find_resource("beginner_tutorials", "scripts/talker.py") == [script]
    assert roslib.packages.find_resource("beginner_tutorials", "nope") == []
    with pytest.raises(ResourceNotFound):
        roslib.packages.find_node("nope", "x")


def test_messages() -> None:
    assert roslib.message.get_message_class("std_msgs/Bool") is Bool
    assert roslib.message.get_service_class("std_srvs/Empty") is Empty
    assert roslib.message.strify_message(Bool(True)) == "data: True"


def test_names_of_resources() -> None:
    names = roslib.names
    assert names.resource_name("a", "b") == "a/b"
    assert names.resource_name("a", "b", my_pkg="a") == "b"
    assert (names.resource_name_base("a/b"), names.resource_name_package("a/b")) == ("b", "a")
    assert names.resource_name_package("b") is None
    assert names.package_resource_name("a/b") == ("a", "b")
    assert names.package_resource_name("b") == ("", "b")
    with pytest.raises(ValueError, match="invalid name"):
        names.package_resource_name("a/b/c")
    assert names.is_legal_resource_name("a/b")
    assert not names.is_legal_resource_name("a//b")
    assert not names.is_legal_resource_base_name("a/b")
    assert names.make_caller_id("n") == "/n/"
    assert names.ns_join("/a", "b") == "/a/b"
    assert names.load_mappings(["a:=b", "_p:=1", "__name:=n", "x"]) == {"a": "b", "__name": "n"}


def test_interactive() -> None:
    assert not roslib.is_interactive()
    roslib.set_interactive(True)
    assert roslib.is_interactive()
    roslib.set_interactive(False)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no permissions of this kind")
def test_new_folders_have_the_permissions_of_the_existing_one(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)
    before = os.umask(0o022)
    try:
        roslib.rosenv.makedirs_with_parent_perms(str(tmp_path / "a" / "b"))
    finally:
        os.umask(before)
    assert [(tmp_path / each).stat().st_mode & 0o777 for each in ("a", "a/b")] == [0o700, 0o700]
