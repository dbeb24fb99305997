"""rosdep: dependencies that are not installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.installation import install_command
from minirospy.ros.rosdep.commands.rosdep import main


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with two packages; one depends on the other and on further packages."""
    needs = {
        "lamp": "<depend>rospy</depend><depend>std_msgs</depend><buildtool_depend>catkin</buildtool_depend>"
        "<exec_depend>python3-yaml</exec_depend><exec_depend>python3-no-such-thing</exec_depend>",
        "room": "<depend>lamp</depend><exec_depend>libopencv-dev</exec_depend><doc_depend>doxygen</doc_depend>"
        "<exec_depend>python3-no-such-thing</exec_depend><build_depend>python3-setuptools</build_depend>",
    }
    for name, tags in needs.items():
        (tmp_path / "src" / name).mkdir(parents=True)
        (tmp_path / "src" / name / "package.xml").write_text(
            f'<package format="2"><name>{name}</name>{tags}</package>'
        )
    monkeypatch.chdir(tmp_path)
    return tmp_path / "src"


def test_as_tutorials_type_it(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["install", "--from-paths", "src", "--ignore-src", "-y", "--rosdistro", "noetic"]
    assert main([*words, "-r"]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == [
        "libopencv-dev (of room): no package of Python or of ROS here",
        f"python3-no-such-thing (of lamp, room): {install_command('no-such-thing')}",
    ]
    assert said.err.startswith("rosdep: not installed")
    assert main(words) == 1
    capsys.readouterr()
    assert main([*words, "--skip-keys", "libopencv-dev python3-no-such-thing"]) == 0
    assert capsys.readouterr().out == "#All required rosdeps installed successfully\n"


def test_check_and_keys(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "--from-paths", "src"]) == 1
    assert capsys.readouterr().out.startswith("System dependencies have not been satisfied:\nlibopencv-dev")
    assert main(["check", "rospy_tutorials"]) == 0
    assert capsys.readouterr().out == "All system dependencies have been satisfied\n"
    assert main(["keys", "--from-paths", "src"]) == 0
    assert capsys.readouterr().out.split() == ["libopencv-dev", "python3-no-such-thing", "python3-yaml"]


def test_there_is_no_database(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init"]) == main(["update"]) == 0
    assert capsys.readouterr().out.count("Nothing to do") == 2
    assert main(["resolve", "python3-serial", "boost"]) == 1
    said = capsys.readouterr()
    assert said.out == "#pip\npyserial\n"
    assert said.err == "rosdep: ERROR: no package of Python is known for [boost]\n"


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["install"], 2, "which packages?"),
        (["install", "--from-paths", "nowhere"], 2, "folder nowhere does not exist"),
        (["check", "lmap"], 1, "package [lmap] not found"),
        (["instal"], 2, "did you mean install?"),
    ],
)
def test_typed_wrong(
    source: Path, words: list[str], status: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == status
    error = capsys.readouterr().err
    assert error.startswith("rosdep: ERROR: ")
    assert text in error
    assert error.count("\n") == 1
