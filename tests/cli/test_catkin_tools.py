"""The tools of catkin, compared with real catkin's output for the same folders."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from minirospy.ros.catkin.commands.find import catkin_find, catkin_find_pkg, catkin_topological_order

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a workspace with the sources of a, b and c (a needs c), and with parts of a in its devel folder."""
    for name, more in (("a", "<depend>c</depend>"), ("b", ""), ("c", "")):
        folder = tmp_path / "src" / name
        folder.mkdir(parents=True)
        (folder / "package.xml").write_text(
            f'<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>'
            f'<maintainer email="a@b.com">m</maintainer><license>BSD</license>{more}</package>'
        )
    for name in ("share/a", "lib/a", "include/a"):
        (tmp_path / "devel" / name).mkdir(parents=True)
    (tmp_path / "devel" / "share" / "a" / "x.txt").touch()
    (tmp_path / "devel" / ".catkin").write_text(str(tmp_path / "src"))
    monkeypatch.setenv("CMAKE_PREFIX_PATH", os.pathsep.join([str(tmp_path / "devel"), "/nowhere"]))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def find(capsys: Capture, root: Path, *words: str) -> list[str]:
    assert catkin_find(words) == 0
    return [os.path.relpath(line, root).replace(os.sep, "/") for line in capsys.readouterr().out.splitlines()]


def test_find(workspace: Path, capsys: Capture) -> None:
    assert find(capsys, workspace, "a") == ["devel/include/a", "devel/lib/a", "devel/share/a", "src/a"]
    assert find(capsys, workspace, "a", "x.txt") == ["devel/share/a/x.txt"]
    assert find(capsys, workspace, "a", "package.xml") == ["src/a/package.xml"]
    assert find(capsys, workspace, "--share", "a") == ["devel/share/a", "src/a"]
    assert find(capsys, workspace, "--libexec", "a") == ["devel/lib/a"]
    assert find(capsys, workspace, "--first-only", "a") == ["devel/include/a"]
    assert find(capsys, workspace, "--without-underlays", "--libexec", "--share", "b") == ["src/b"]
    assert find(capsys, workspace) == ["devel/include", "devel/lib", "devel/share"]
    assert find(capsys, workspace, "nope") == []
    assert find(capsys, workspace, "std_msgs", "msg/Bool.msg")[0].endswith("std_msgs/msg/Bool.msg")


def test_find_in_folders_without_packages(workspace: Path, capsys: Capture) -> None:
    assert catkin_find(["--lib", "a"]) == 2
    assert capsys.readouterr().err == "catkin_find: ERROR: no search for a package in lib\n"
    assert catkin_find(["--libexec"]) == 2


def test_find_pkg(workspace: Path, capsys: Capture) -> None:
    for words, said in ((["a"], "src/a"), (["a", "src"], "a"), (["a", str(workspace)], "src/a")):
        assert catkin_find_pkg(words) == 0
        assert capsys.readouterr().out.strip().replace(os.sep, "/") == said
    assert catkin_find_pkg(["nope"]) == 2
    assert capsys.readouterr().err == "Could not find package 'nope'.\n"


def test_order(workspace: Path, capsys: Capture) -> None:
    assert catkin_topological_order(["src"]) == 0
    assert capsys.readouterr().out.splitlines() == ["b b", "c c", "a a"]
    assert catkin_topological_order(["--only-names", "src"]) == 0
    assert capsys.readouterr().out.splitlines() == ["b", "c", "a"]
    assert catkin_topological_order(["nope"]) == 1
    assert capsys.readouterr().err == 'catkin_topological_order: ERROR: Workspace "nope" does not exist\n'
    manifest = workspace / "src" / "c" / "package.xml"
    manifest.write_text(manifest.read_text().replace("</package>", "<depend>a</depend></package>"))
    assert catkin_topological_order(["src"]) == 1
    assert "in a circle: a -> c -> a" in capsys.readouterr().err
