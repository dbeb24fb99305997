"""catkin_create_pkg, catkin_init_workspace and catkin."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from minirospy.ros.catkin.commands.create import catkin_create_pkg, catkin_init_workspace
from minirospy.ros.catkin.commands.tool import catkin
from minirospy.workspace.manifest import Kind, read_manifest
from minirospy.workspace.plan import read_plan

if TYPE_CHECKING:
    from conftest import Scene


def test_a_new_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin_create_pkg(["rpi_test", "rospy", "std_msgs"]) == 0
    assert capsys.readouterr().out == (
        "Created file rpi_test/package.xml\nCreated file rpi_test/CMakeLists.txt\nCreated folder rpi_test/src\n"
        f"Successfully created files in {tmp_path / 'rpi_test'}. Please adjust the values in package.xml.\n"
    )
    manifest = read_manifest(tmp_path / "rpi_test")
    assert manifest.problems == ()
    assert (manifest.name, manifest.version, manifest.licenses) == ("rpi_test", "0.0.0", ("TODO",))
    assert manifest.depends(Kind.BUILD) == manifest.depends(Kind.EXEC) == ("rospy", "std_msgs")
    assert [name for name, _ in read_plan(tmp_path / "rpi_test").needs] == ["rospy", "std_msgs"]


def test_name_against_the_conventions_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """catkin_create_pkg prints the same text."""
    monkeypatch.chdir(tmp_path)
    assert catkin_create_pkg(["MyPkg"]) == 0
    assert capsys.readouterr().err.startswith(
        'WARNING: Package name "MyPkg" does not follow the naming conventions.'
    )


def test_package_created_outside_src_warns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The package is in the workspace's folder, where catkin_make would never find it."""
    for folder in ("src", "devel"):
        (tmp_path / folder).mkdir()
    for folder, warning in (
        (tmp_path / "src", ""),
        (tmp_path, f"WARNING: catkin_make builds what is in {tmp_path / 'src'} alone: `mv p src`\n"),
    ):
        monkeypatch.chdir(folder)
        assert catkin_create_pkg(["p", "rospy"]) == 0
        assert capsys.readouterr().err == warning


def test_all_that_can_be_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = [
        "x",
        "roscpp",
        "-V",
        "1.2.3",
        "-D",
        "a & b < c",
        "-l",
        "MIT",
        "-a",
        "Ann",
        "-m",
        'Bob "B" <b@c.org>',
    ]
    assert catkin_create_pkg(words) == 0

    manifest = read_manifest(tmp_path / "x")
    assert manifest.problems == ()
    assert (manifest.version, manifest.description, manifest.licenses) == ("1.2.3", "a & b < c", ("MIT",))
    assert [tuple(person) for person in (*manifest.authors, *manifest.maintainers)] == [
        ("Ann", ""),
        ('Bob "B"', "b@c.org"),
    ]
    assert (tmp_path / "x" / "include" / "x").is_dir()


def test_a_metapackage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin_create_pkg(["all_of_it", "rospy", "--meta"]) == 0
    manifest = read_manifest(tmp_path / "all_of_it")
    assert manifest.is_metapackage
    assert manifest.depends(Kind.EXEC) == ("rospy",)
    assert not (tmp_path / "all_of_it" / "src").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ([], "the following arguments are required: name"),
        (["_x"], "[_x] is not a name for a package"),
        (["../x"], "[../x] is not a name for a package"),
        (["x", "a b"], "[a b] is not the name of a package to depend on"),
        (["x", "-V", "1"], "[1] is not a version: three numbers, as in 0.1.0"),
        (["there"], "is a package already"),
    ],
)
def test_typed_wrong(
    words: list[str],
    text: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    catkin_create_pkg(["there"])
    capsys.readouterr()

    assert catkin_create_pkg(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("catkin_create_pkg: ERROR: ")
    assert text in error
    assert error.count("\n") == 1


def test_init_workspace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin_init_workspace([]) == 0
    assert "catkin_workspace()" in (tmp_path / "CMakeLists.txt").read_text()
    assert catkin_init_workspace([]) == 2
    assert "already exists" in capsys.readouterr().err
    assert catkin_init_workspace(["nowhere"]) == 2


def test_catkin(scene: Scene, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    folder = scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.messages("other_msgs", {"msg/Other.msg": "int64 number\n"})
    monkeypatch.chdir(folder / "msg")
    assert catkin(["build", "--this"]) == 0
    said = capsys.readouterr().out
    assert "[100%] led_msgs: 1 message\n" in said
    assert "other_msgs" not in said
    assert catkin(["build"]) == 0
    assert "[100%] other_msgs: 1 message\n" in capsys.readouterr().out
    assert catkin(["list"]) == 0
    assert capsys.readouterr().out == "- led_msgs\n- other_msgs\n"
    assert catkin(["locate", "led_msgs"]) == 0
    assert catkin(["locate", "-d"]) == 0
    assert capsys.readouterr().out == f"{folder}\n{scene.devel}\n"
    assert catkin(["clean", "-y"]) == 0
    assert not scene.devel.exists()
    assert folder.is_dir()


def test_catkin_config_is_kept(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scene.messages("led_msgs", {"msg/Led.msg": "int64 number\n"})
    scene.package("lamp", "if(NOT LAMP)\ncatkin_python_setup()\nendif()")
    scene.package("wall", "catkin_python_setup()")
    monkeypatch.chdir(scene.root)

    assert catkin(["config", "--install", "--cmake-args", "-DLAMP=ON", "-DX=1"]) == 0
    assert catkin(["config", "--blacklist", "wall"]) == 0
    said = capsys.readouterr().out

    assert said.endswith(
        "Install:         yes\nBlacklist:       wall\nWhitelist:       none\nCmake args:      -DLAMP=ON -DX=1\n"
    )
    assert catkin(["build", "--dry-run"]) == 0
    assert capsys.readouterr().out == "- lamp\n- led_msgs\n"
    assert catkin(["build", "-j", "2", "--no-status", "--make-args", "x"]) == 0
    assert f"[build] Done: source {scene.root / 'install' / 'setup.bash'}\n" in capsys.readouterr().out
    assert (scene.root / "install" / "share" / "led_msgs" / "package.xml").is_file()
    assert catkin(["build", "--cmake-args", "-DLAMP=OFF"]) == 1
    assert "catkin_python_setup() needs a setup.py" in capsys.readouterr().err
    assert catkin(["config", "--no-blacklist", "--no-install", "--no-cmake-args"]) == 0
    assert capsys.readouterr().out.count("none\n") == 4
    assert catkin(["build"]) == 1


def test_catkin_outside_of_a_workspace(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert catkin(["build"]) == 1
    assert "not in a workspace" in capsys.readouterr().err
    assert catkin(["buidl"]) == 2
    assert "did you mean build?" in capsys.readouterr().err
    (tmp_path / "src").mkdir()
    assert catkin(["clean"]) == 1
    assert catkin(["init"]) == 0
    assert catkin(["create", "pkg", "x"]) == 0
    assert (tmp_path / "x" / "package.xml").is_file()
