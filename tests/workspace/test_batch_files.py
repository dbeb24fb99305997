"""The batch files as text. They were run in cmd.exe by hand; these checks cover the faults that were found."""

from __future__ import annotations

import re
from pathlib import Path, PureWindowsPath
from typing import Any

import pytest

from minirospy.workspace.setup_files import SetUp, assignments, setup_files

ROS_BAT = Path(__file__).parents[2] / "minirospy" / "workspace" / "shell" / "ros.bat"
W: Any = PureWindowsPath

SETUP = SetUp(
    prefix=W(r"C:\my ws\devel"),
    sources=(W(r"C:\my ws\src"),),
    parents=(W(r"C:\base\devel"),),
    programs=W(r"C:\py\Scripts"),
    share=(W(r"C:\py\share\msgs"),),
    functions=W(r"C:\py\shell"),
)
FILES = {name: text for name, text in setup_files(SETUP).items() if name.endswith(".bat")}
ALL = {**FILES, "ros.bat": ROS_BAT.read_bytes().decode()}


def test_there_are_all() -> None:
    assert set(FILES) == {"setup.bat", "local_setup.bat", "env.bat"}


@pytest.mark.parametrize("name", ALL)
def test_lines_end_as_cmd_needs_them(name: str) -> None:
    # cmd.exe does not find labels in a file with only line feeds.
    assert ALL[name].count("\r\n") == ALL[name].count("\n") > 0


@pytest.mark.parametrize("name", ALL)
def test_every_label_is_there(name: str) -> None:
    text = ALL[name]
    labels = set(re.findall(r"^:(\w+)", text, re.MULTILINE))
    called = re.findall(r"(?:goto |call :)(\w+)(?!\w*%)", text)
    assert set(called) <= labels | {"minirospy_"}
    # Some labels are built from an argument.
    if "minirospy_%~1" in text:
        assert {"minirospy_put", "minirospy_take"} <= labels


@pytest.mark.parametrize("name", ALL)
def test_nothing_before_a_redirection_is_taken_for_its_number(name: str) -> None:
    # `echo in C:\ws2>&2` writes `in C:\ws` to handle 2, so text that may end in a digit must be last.
    for line in ALL[name].splitlines():
        assert not re.search(r"[%\w]>&2", line), line


def test_the_own_folder_has_no_backslash_at_its_end() -> None:
    # %~dp0 ends in a backslash, so PYTHONPATH would contain C:\my ws\devel\\lib.
    assert "%~dp0\\" not in FILES["setup.bat"]
    assert 'in ("%~dp0.") do call :minirospy_workspace put "%%~fP"' in FILES["setup.bat"]


def test_extended_workspaces_come_first_and_the_local_file_omits_them() -> None:
    below = 'call :minirospy_workspace put "C:\\base\\devel"'
    text = FILES["setup.bat"]
    assert text.index(below) < text.index("%~dp0.")
    assert below not in FILES["local_setup.bat"]
    assert 'call :minirospy_last ROS_PACKAGE_PATH "C:\\py\\share\\msgs"' in text


def test_assignments_are_quoted_for_a_batch_file() -> None:
    assert assignments("bat", {"ROS_IP": "1.2.3.4", "NAME": "a & 50%"}) == (
        '@set "ROS_IP=1.2.3.4"\n@set "NAME=a & 50%%"\n'
    )
