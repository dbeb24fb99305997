"""The bags that the page may open: no path leads out of the folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from minirospy.base.errors import BagError, UsageError
from minirospy.web.dashboard.bag_folder import BagFolder


@pytest.fixture
def folder(tmp_path: Path) -> BagFolder:
    inside = tmp_path / "inside"
    (inside / "deep" / "er").mkdir(parents=True)
    (inside / ".hidden").mkdir()
    for name in (
        "inside/a.bag",
        "inside/deep/er/b.mcap",
        "inside/.hidden/c.bag",
        "inside/d.txt",
        "outside.bag",
    ):
        (tmp_path / name).write_bytes(b"x" * 5)
    os.utime(inside / "a.bag", (1, 1))
    return BagFolder(inside, [tmp_path / "outside.bag"])


def test_bags_of_the_folder_and_below_are_listed_the_newest_first(folder: BagFolder) -> None:
    names = [bag.name for bag in folder.bags()]
    assert names[-1] == "a.bag"
    assert sorted(names) == sorted([*folder.given, "a.bag", "deep/er/b.mcap"])
    assert {bag.size for bag in folder.bags()} == {5}


def test_names_of_the_list_are_opened(folder: BagFolder) -> None:
    for bag in folder.bags():
        assert folder.path_of(bag.name).read_bytes() == b"xxxxx"


@pytest.mark.parametrize(
    "name",
    [
        "../outside.bag",
        "deep/../../outside.bag",
        "deep/../a.bag",
        "./a.bag",
        "//a.bag",
        "",
        "a.bag/",
        "/etc/passwd",
        "d.txt",
        ".hidden/c.bag",
        "deep\\er\\b.mcap",
        "C:/a.bag",
        "a.bag:stream.bag",
        "a\0.bag",
        "missing.bag",
        "deep",
        "x" * 5000 + ".bag",
    ],
)
def test_other_names_are_refused_with_one_line(folder: BagFolder, name: str) -> None:
    with pytest.raises(BagError) as caught:
        folder.path_of(name)
    assert "\n" not in str(caught.value)


def test_absolute_path_is_refused(folder: BagFolder, tmp_path: Path) -> None:
    (tmp_path / "other.bag").write_bytes(b"x")
    with pytest.raises(BagError, match="not the name of a bag"):
        folder.path_of(str(tmp_path / "other.bag"))


@pytest.mark.skipif(sys.platform == "win32", reason="links need a right of Windows")
def test_links_are_neither_listed_nor_followed(folder: BagFolder, tmp_path: Path) -> None:
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "s.bag").write_bytes(b"x")
    (folder.root / "file.bag").symlink_to(tmp_path / "secret" / "s.bag")
    (folder.root / "away").symlink_to(tmp_path / "secret")
    assert not {"file.bag", "away/s.bag"} & {bag.name for bag in folder.bags()}
    for name in ("file.bag", "away/s.bag"):
        with pytest.raises(BagError, match="is a link"):
            folder.path_of(name)


@pytest.mark.parametrize("name", ["run", "run.bag", "2026-01-02-03-04-05", "a b+c"])
def test_recordings_are_in_the_folder(folder: BagFolder, name: str) -> None:
    path = folder.new_file(name, ".bag")
    assert path.parent == folder.root
    assert path.suffix == ".bag"


@pytest.mark.parametrize(
    "name", ["", "../a", "/a", "a/b", ".a", "a\\b", "con", "a.", "x" * 101, "a\n", "a", "deep/../a"]
)
def test_names_of_recordings_that_are_none_or_in_use_are_refused(folder: BagFolder, name: str) -> None:
    with pytest.raises(UsageError):
        folder.new_file(name, ".bag")


def test_large_trees_and_missing_folders_are_no_fault(tmp_path: Path) -> None:
    assert BagFolder(tmp_path / "missing").bags() == []
