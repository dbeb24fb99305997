"""The search for models, worlds and media, with folders and packages made by the tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.errors import NotFoundError
from minirospy.ros.gazebo_ros.paths import exported_paths, resource_paths


def touch(path: Path) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("", encoding="utf-8")
    return str(path)


def package(folder: Path, export: str) -> Path:
    folder.mkdir(parents=True)
    text = f"<package><name>{folder.name}</name><export>{export}</export></package>"
    (folder / "package.xml").write_text(text, encoding="utf-8")
    return folder


def test_models_are_searched_in_the_order_of_the_variable(tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    touch(second / "robot" / "model.sdf")
    paths = resource_paths({"GAZEBO_MODEL_PATH": f"{first}|{second}|"}, separator="|")
    assert paths.resolve("model://robot/model.sdf") == str(second / "robot" / "model.sdf")
    touch(first / "robot" / "model.sdf")
    assert paths.resolve("model://robot") == str(first / "robot")
    assert paths.resolve("model://other") is None


def test_exported_folders_come_after_the_variable(tmp_path: Path) -> None:
    folder = package(tmp_path / "robots", '<gazebo_ros gazebo_model_path="${prefix}/models"/>')
    touch(folder / "models" / "robot" / "model.sdf")
    paths = resource_paths({}, [folder])
    assert paths.resolve("model://robot/model.sdf") == str(folder / "models" / "robot" / "model.sdf")
    touch(tmp_path / "own" / "robot" / "model.sdf")
    paths = resource_paths({"GAZEBO_MODEL_PATH": str(tmp_path / "own")}, [folder])
    assert paths.resolve("model://robot") == str(tmp_path / "own" / "robot")


def test_exports_that_cannot_be_read_are_passed_over(tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "package.xml").write_text("<package><gazebo_ros", encoding="utf-8")
    good = package(tmp_path / "good", '<gazebo_ros gazebo_media_path="${prefix}/a|${prefix}/b"/>')
    found = exported_paths([broken, tmp_path / "missing", good], "gazebo_media_path", "|")
    assert found == [str(good / "a"), str(good / "b")]


def test_the_own_library_comes_last(tmp_path: Path) -> None:
    own = resource_paths({}).resolve("model://sun")
    assert own is not None
    assert own.endswith("sun")
    touch(tmp_path / "sun" / "model.sdf")
    assert resource_paths({"GAZEBO_MODEL_PATH": str(tmp_path)}).resolve("model://sun") == str(
        tmp_path / "sun"
    )


def test_downloaded_models_are_found(tmp_path: Path) -> None:
    touch(tmp_path / ".gazebo" / "models" / "robot" / "model.sdf")
    assert resource_paths({"HOME": str(tmp_path)}).resolve("model://robot") == str(
        tmp_path / ".gazebo" / "models" / "robot"
    )


@pytest.mark.parametrize("scheme", ["package", "model"])
def test_packages_are_found(tmp_path: Path, scheme: str) -> None:
    mesh = touch(tmp_path / "robots" / "meshes" / "a b.stl")

    def find(name: str) -> Path:
        if name != "robots":
            raise NotFoundError("package", name)
        return tmp_path / "robots"

    paths = resource_paths({}, (), find)
    assert paths.resolve(f"{scheme}://robots/meshes/a b.stl") == mesh
    assert paths.resolve(f"{scheme}://robots/meshes/a%20b.stl") == mesh
    assert paths.resolve(f"{scheme}://robots/meshes/other.stl") is None
    assert paths.resolve(f"{scheme}://unknown/a.stl") is None


def test_files_are_absolute_or_below_a_media_folder(tmp_path: Path) -> None:
    file = touch(tmp_path / "media" / "a.png")
    paths = resource_paths({"GAZEBO_RESOURCE_PATH": str(tmp_path)})
    assert paths.resolve(f"file://{file}") == file
    assert paths.resolve(file) == file
    assert paths.resolve("file://media/a.png") == file
    assert paths.resolve("media/a.png") == file
    assert paths.resolve("https://fuel.example/model") is None
    assert paths.resolve("") is None


def test_worlds_are_found_below_media_folders(tmp_path: Path) -> None:
    world = touch(tmp_path / "worlds" / "mine.world")
    paths = resource_paths({"GAZEBO_RESOURCE_PATH": str(tmp_path)})
    assert paths.find_world("worlds/mine.world") == world
    assert paths.find_world("mine.world") == world
    assert paths.find_world(world) == world
    assert paths.find_world("worlds") is None
    empty = paths.find_world("worlds/empty.world")
    assert empty is not None
    assert Path(empty).is_file()
