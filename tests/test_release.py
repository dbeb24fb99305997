"""`make release`: which wheels are refused."""

from __future__ import annotations

import pytest

from tools.release import MOST_BYTES, faults_of_wheel

SOURCES = [
    "pyproject.toml",
    "minirospy_overlay.pth",
    "minirospy/__init__.py",
    "minirospy/dashboard/page/vendor/versions.json",
    "minirospy/dashboard/page/vendor/uplot/LICENSE.txt",
    "minirospy/dashboard/page/vendor/uplot/uPlot.js",
    "msgs/std_msgs/package.xml",
    "msgs/std_msgs/msg/Bool.msg",
    "tests/test_release.py",
]


@pytest.fixture
def contents() -> dict[str, int]:
    """Return the files of a wheel that has all that it needs, with their sizes."""
    names = [
        "minirospy_overlay.pth",
        "minirospy/__init__.py",
        "minirospy/dashboard/page/vendor/versions.json",
        "minirospy/dashboard/page/vendor/uplot/LICENSE.txt",
        "minirospy/dashboard/page/vendor/uplot/uPlot.js",
        "minirospy/overlay/std_msgs/msg/_Bool.py",
        "minirospy/overlay/std_msgs/msg/__init__.pyi",
        "minirospy/overlay/std_msgs/py.typed",
        "minirospy/share/msgs/std_msgs/package.xml",
        "minirospy/share/msgs/std_msgs/msg/Bool.msg",
        "minirospy-0.1.0.dist-info/licenses/LICENSE",
        "minirospy-0.1.0.dist-info/RECORD",
    ]
    return dict.fromkeys(names, 100)


def test_whole_wheel_has_no_faults(contents: dict[str, int]) -> None:
    assert faults_of_wheel(contents, MOST_BYTES - 1, SOURCES) == []


def test_large_wheel_names_its_largest_files(contents: dict[str, int]) -> None:
    contents["minirospy/__init__.py"] = 4_000_000
    (fault,) = faults_of_wheel(contents, 3_000_000, SOURCES)
    assert fault.startswith(
        "has 3,000,000 bytes, not under 3,000,000; the largest files: minirospy/__init__.py, "
    )


@pytest.mark.parametrize(
    "name",
    [
        "tests/test_release.py/x",
        "minirospy/notes.txt",
        "minirospy/__pycache__/__init__.cpython-311.pyc",
        "minirospy/overlay/std_msgs/msg/_Bool.py.orig",
        "minirospy/overlay/my_msgs/msg/_Mine.py",
        "minirospy/share/msgs/std_msgs/msg/Mine.msg",
    ],
)
def test_stray_file_is_named(contents: dict[str, int], name: str) -> None:
    contents[name] = 100
    assert faults_of_wheel(contents, 1000, SOURCES) == [f"{name}: not from a file of the sources"]


def test_file_that_is_left_out_is_named(contents: dict[str, int]) -> None:
    del contents["minirospy/__init__.py"]
    assert faults_of_wheel(contents, 1000, SOURCES) == ["minirospy/__init__.py: missing"]


def test_licences_are_required(contents: dict[str, int]) -> None:
    contents["minirospy/dashboard/page/vendor/uplot/LICENSE.txt"] = 0
    del contents["minirospy-0.1.0.dist-info/licenses/LICENSE"]
    assert faults_of_wheel(contents, 1000, SOURCES) == [
        "minirospy/dashboard/page/vendor/uplot: its LICENSE.txt is missing or empty",
        "the licence of minirospy is missing",
    ]
