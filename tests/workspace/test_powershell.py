"""The PowerShell script as text, because most machines that run these tests have no PowerShell."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import pytest

from minirospy.cli.completion.words import POWERSHELL
from minirospy.cli.registry import COMMANDS
from minirospy.workspace.setup_files import SetUp, assignments, setup_files, shell_text

ROS_PS1 = Path(__file__).parents[2] / "minirospy" / "workspace" / "shell" / "ros.ps1"
W: Any = PureWindowsPath
P: Any = PurePosixPath

SETUP = SetUp(
    prefix=W(r"C:\my ws\devel"),
    sources=(W(r"C:\my ws\src"),),
    parents=(W(r"C:\it's\devel"), W(r"C:\base\devel")),
    programs=W(r"C:\py\Scripts"),
    share=(W(r"C:\py\share\msgs"),),
    functions=W(r"C:\py\shell"),
)
FILES = {name: text for name, text in setup_files(SETUP).items() if name.endswith(".ps1")}


def test_there_are_both() -> None:
    assert set(FILES) == {"setup.ps1", "local_setup.ps1"}


def test_workspaces_below_are_put_before_the_own() -> None:
    text = FILES["setup.ps1"]
    places = [
        text.index(line)
        for line in (
            "if ($args[0] -ne '--extend') {",
            r"    _minirospy_workspace 'C:\base\devel' put",
            r"    _minirospy_workspace 'C:\it''s\devel' put",
            "_minirospy_workspace $PSScriptRoot put",
            r"_minirospy_last ROS_PACKAGE_PATH 'C:\py\share\msgs'",
            r". 'C:\py\shell\ros.ps1'",
        )
    ]
    assert places == sorted(places)
    assert "--extend" not in FILES["local_setup.ps1"]
    assert "@" not in re.sub(r"@\(", "", text)


def test_every_function_is_defined_and_removed() -> None:
    text = FILES["setup.ps1"]
    defined = set(re.findall(r"^function (\w+)", text, re.MULTILINE))
    assert {
        f"_minirospy_{name}" for name in ("entries", "set", "take", "put", "last", "workspace")
    } == defined
    assert set(re.findall(r"_minirospy_[a-z]+", text)) <= defined
    assert "Remove-Item -Path Function:_minirospy_*" in text


@pytest.mark.parametrize("text", [*FILES.values(), ROS_PS1.read_text()])
def test_brackets_are_closed(text: str) -> None:
    code = re.sub(r"#.*|'[^']*'|\"[^\"]*\"", "", text)
    for opened, closed in ("()", "{}", "[]"):
        assert code.count(opened) == code.count(closed) > 0


ASSIGNMENTS = assignments("powershell", {"ROS_IP": "1.2.3.4", "NAME": "it's $HOME"})


def test_assignments_set_variables_of_the_environment() -> None:
    assert ASSIGNMENTS == "$env:ROS_IP = '1.2.3.4'\n$env:NAME = 'it''s $HOME'\n"


@pytest.mark.parametrize(
    "text", [*FILES.values(), ROS_PS1.read_text(), shell_text("powershell", SETUP), ASSIGNMENTS]
)
def test_grammar_of_powershell_parses_the_text(text: str) -> None:
    parsing = pytest.importorskip("tree_sitter", reason="`make interop` installs the grammar")
    powershell = pytest.importorskip("tree_sitter_powershell", reason="`make interop` installs the grammar")
    parser = parsing.Parser(parsing.Language(powershell.language()))

    assert parser.parse(b"function x { if ($a { } }").root_node.has_error
    assert not parser.parse(text.encode()).root_node.has_error


def test_variables_that_are_set_are_kept() -> None:
    text = shell_text("powershell", SETUP)
    assert "if (-not $env:ROS_DISTRO) { $env:ROS_DISTRO = 'noetic' }\n" in text
    assert "if (-not $env:ROS_MASTER_URI) { $env:ROS_MASTER_URI = 'http://localhost:11311' }\n" in text
    assert text.endswith(". 'C:\\py\\shell\\ros.ps1'\n")


def test_every_command_is_completed() -> None:
    text = ROS_PS1.read_text()
    for entry in COMMANDS:
        if entry.script:
            assert f"'{entry.script}'" in text, entry.script


def completed(*words: str, index: int | None = None) -> list[str]:
    """Return the completions of the last word, from the same call as in ros.ps1."""
    call = re.search(r"minirospy complete (\S+) \$index @words", ROS_PS1.read_text())
    assert call
    place = str(index or len(words) - 1)
    done = subprocess.run(
        [sys.executable, "-m", "minirospy.cli.completion.complete", call[1], place, *words],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def test_candidates_are_words_of_powershell() -> None:
    assert completed("rosmsg", "sho") == ["show"]
    # An empty last word is not passed on.
    assert completed("rostopic", "pub", "/t", "std_msgs/Bool", index=4) == ["'data: false'"]
    assert completed("rostopic", "pub", "'/t'", "std_msgs/String", index=4) == ["'data: '''''"]
    assert completed("rostopic", "pub", "/t", "std_msgs/String", '"da') == ["\"data: ''\""]
    assert completed("rostopic", "pub", "/t", "geometry_msgs/Point", "'{x") == ["'{x: 0.0, y: 0.0, z: 0.0}'"]
    assert completed("C:\\Scripts\\rosmsg.exe", "sho") == ["show"]
    assert "--once" in completed("rostopic", "pub", "--on")


@pytest.mark.parametrize(
    ("typed", "text", "again"),
    [
        ("a", "a b", "'a b'"),
        ("a` ", "a b", "'a b'"),
        ("'a ", "a b", "'a b'"),
        ("'a b'", "a b", "'a b'"),
        ('"a ', 'a "$x`', '"a `"`$x``"'),
        ("'it''s", "it's", "'it''s'"),
        ("a", "a,b", "'a,b'"),
        ("/a", "/a/b:=c", "/a/b:=c"),
        ("C:\\a", "C:\\a\\b", "C:\\a\\b"),
        ("", "@a", "'@a'"),
        ("", "", ""),
    ],
)
def test_words_are_read_and_written_as_in_powershell(typed: str, text: str, again: str) -> None:
    assert POWERSHELL.write(text, POWERSHELL.read(typed)) == again
    assert POWERSHELL.read(again).text == text


@pytest.mark.skipif(shutil.which("pwsh") is None, reason="no PowerShell here")
def test_sourcing_sets_the_variables(tmp_path: Path) -> None:
    (tmp_path / "src").mkdir()
    setup = SetUp(tmp_path, (tmp_path / "src",), (), tmp_path, (), ROS_PS1.parent)
    for name, text in setup_files(setup).items():
        (tmp_path / name).write_text(text)
    program = (
        f". '{tmp_path}/setup.ps1'; . '{tmp_path}/setup.ps1'; $env:CMAKE_PREFIX_PATH; $env:ROS_PACKAGE_PATH"
    )
    done = subprocess.run(
        ["pwsh", "-NoProfile", "-Command", program], capture_output=True, text=True, check=False
    )
    assert (done.stdout.splitlines(), done.stderr) == ([str(tmp_path), str(tmp_path / "src")], "")
