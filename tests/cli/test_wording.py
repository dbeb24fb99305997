"""ROS's own messages for commands, printed before minirospy's own line: scripts and ROS's tests match them.

The messages are ROS's; tests/interop compares them with the real commands' output.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from importlib import import_module

import pytest

from minirospy.cli.registry import find_script

USAGE = "Usage: rostopic list [/namespace]\n\n"


def main_of(script: str) -> Callable[[Sequence[str] | None], int]:
    entry = find_script(script)
    assert entry
    return entry.load_main()


@pytest.mark.usefixtures("master")
@pytest.mark.parametrize(
    ("line", "status", "text"),
    [
        ("rostopic list --hots", 2, f"{USAGE}rostopic: error: no such option: --hots\n"),
        ("rostopic list a b", 2, f"{USAGE}rostopic: error: you may only specify one input topic\n"),
        ("rostopic list -p -s", 2, f"{USAGE}rostopic: error: you may only specify one of -p, -s\n"),
        (
            "rostopic find",
            2,
            "Usage: rostopic find msg-type\n\nrostopic: error: please specify a message type\n",
        ),
        (
            "rostopic bw -w",
            2,
            "Usage: rostopic bw /topic\n\nrostopic: error: -w option requires 1 argument\n",
        ),
        ("rostopic info /nope", 1, "ERROR: Unknown topic /nope\n"),
        ("rostopic type /nope", 1, "unknown topic type [/nope]\n"),
        ("rosnode ping nope", 0, "cannot ping [/nope]: unknown node\n"),
        ("rosnode info nope", 0, "cannot contact [/nope]: unknown node\n"),
        ("rosnode kill nope nada", 1, "ERROR: Unknown node(s):\n * /nope\n * /nada\n"),
        ("rosservice type nope", 1, "Unknown service [/nope]\n"),
        ("rosservice node nope", 1, "Unknown service: /nope\n"),
        (
            "rosservice node",
            2,
            "Usage: rosservice node /service\n\nrosservice: error: service must be specified\n",
        ),
        ("rosservice call nope", 2, "ERROR: Service [/nope] is not available.\n"),
        ("rosparam get nope", 1, "ERROR: Parameter [/nope] is not set\n"),
        ("rosparam delete nope", 1, "ERROR: parameter [/nope] is not set\n"),
        ("rosmsg md5 std_msgs/Nope", 1, "Cannot locate [std_msgs/Nope]\n"),
        ("rosmsg show nope", 1, "Could not find msg 'nope'\n"),
        ("rosmsg show a/b/c", 1, "Unable to load msg [a/b/c]: invalid name [a/b/c]\n"),
        ("rosrun nope nope", 2, "[rospack] Error: package 'nope' not found\n"),
        ("roslaunch nope.launch", 1, "RLException: [nope.launch] is not a launch file name\n"),
        ("rostopic list -b nope.bag", 1, "ERROR: bag file [nope.bag] does not exist\n"),
        (
            "rostopic delay",
            2,
            "usage: rostopic delay [options] /topic\n"
            "rostopic: error: the following arguments are required: topic\n",
        ),
        ("rostopic pub -f nope.yaml /t std_msgs/Bool", 1, "ERROR: file does not exist: nope.yaml\n"),
        (
            "rostopic pub /t geometry_msgs/Point 1 2",
            1,
            "ERROR: Not enough arguments:\n * Given: [1, 2]\n * Expected: ['x', 'y', 'z']\n\nArgs are: [x y z]\n",
        ),
    ],
)
def test_error_begins_with_ros_words(
    line: str, status: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    name, *words = line.split()
    assert main_of(name)(words) == status
    ros, own = capsys.readouterr().err.partition(f"{name}: ERROR: ")[::2]

    assert ros == text
    assert own


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("rostopic list", 1),
        ("rostopic hz /a", 1),
        ("rosnode list", 1),
        ("rosnode info /a", 1),
        ("rosservice list", 2),
        ("rosparam list", 1),
        ("rosgraph", 0),
        ("rosservice node /a", 2),
        ("rosservice call /a", 2),
    ],
)
def test_no_master_in_ros_words(
    line: str, status: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Scripts that read stderr find only ROS's line; a terminal also shows minirospy's line."""
    name, *words = line.split()
    assert main_of(name)(words) == status
    assert capsys.readouterr().err == "ERROR: Unable to communicate with master!\n"

    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main_of(name)(words) == status
    first, second = capsys.readouterr().err.splitlines()
    assert first == "ERROR: Unable to communicate with master!"
    assert second.startswith(f"{name}: ERROR: no ROS master answers at ")


def test_help_begins_with_that_of_ros(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from minirospy.ros.rosnode.commands.rosnode import main

    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main(["info", "-h"])
    assert capsys.readouterr().out.startswith(
        "Usage: rosnode info [options] node1 [node2...]\n"
        "\n"
        "Options:\n"
        "  -h, --help   show this help message and exit\n"
        "  -q, --quiet  Prints only basic information such as pubs/subs and does not\n"
        "               contact nodes for more information\n"
    )


@pytest.mark.parametrize(
    ("name", "statuses"),
    [
        ("rostopic", (64, 64, 64, 64)),
        ("rosnode", (64, 64, 0, 64)),
        ("rosservice", (64, 64, 64, 64)),
        # Real ROS exits with 0 for an unknown verb of rosparam, which hides the error from scripts.
        ("rosparam", (0, 0, 0, 64)),
        ("rosmsg", (0, 64, 0, 64)),
    ],
)
def test_exit_status_of_help_is_that_of_ros(
    name: str, statuses: tuple[int, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    main = main_of(name)
    assert tuple(main(words) for words in ([], ["-h"], ["--help"], ["nope"])) == statuses
    assert f"Commands:\n\t{name} " in capsys.readouterr().out


@pytest.mark.parametrize("command", ["main", "main_srv"])
def test_unknown_package_of_a_type_names_how_many_were_searched(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main = getattr(import_module("minirospy.ros.rosmsg.commands.rosmsg"), command)
    assert main(["show", "nope/Nope"]) == 1
    text, _, searched = capsys.readouterr().err.splitlines()[0].partition(" on search path ")
    assert text.endswith("Cannot locate message [Nope]: unknown package [nope]")
    # ROS prints the folder of each package, which are thousands of characters.
    assert re.fullmatch(r"\[\{\d+ packages: rospack list\}\]", searched)
