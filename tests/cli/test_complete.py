"""cli/complete: completions with a graph, without a master, and for arbitrary input."""

from __future__ import annotations

import inspect
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.metadata import distribution
from pathlib import Path
from types import FunctionType

import pytest
import yaml

from minirospy.base.environment import Environment
from minirospy.base.yaml_text import safe_load
from minirospy.cli.completion import completers
from minirospy.cli.completion.complete import candidates, main
from minirospy.cli.registry import COMMANDS, console_scripts
from minirospy.command.parser import completer_of
from minirospy.command.verbs import Command, Family, Verb
from minirospy.core.idl.load import Catalogue, message_class
from minirospy.introspect.messages import fill, serialize
from minirospy.introspect.prototype import prototype
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.workspace.packages import Packages

from .conftest import Robot


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a workspace with the package ``my_robot``; the current folder is empty."""
    package = tmp_path / "src" / "my_robot"
    for folder in ("scripts", "launch", "config/deep", "msg", ".git"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_robot</name></package>")
    (package / "scripts" / "talker.py").write_text("#!/usr/bin/env python3\n")
    (package / "scripts" / "notes.txt").touch()
    (package / "config" / "deep" / "my map.yaml").touch()
    (package / "msg" / "Leds.msg").write_text("Led[] leds\nbool on\n")
    (package / "msg" / "Led.msg").write_text("string name\nfloat32[2] place\n")
    (package / "launch" / "all.launch").write_text(
        '<launch><arg name="rate" default="10"/><arg name="fake" default="true"/><arg name="port"/>'
        '<arg name="name" default="a robot"/><arg name="place" default="$(env HOME)"/>'
        '<node name="talker" pkg="my_robot" type="talker.py" args="$(arg port)"/></launch>'
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time limits for a busy machine."""
    monkeypatch.setattr(completers, "LIVE_SECONDS", 30.0)


def tab(line: str) -> list[str]:
    """Return the completions at the end of ``line``."""
    words = line.split(" ")
    return candidates(len(words) - 1, words)


# --- verbs and options


def test_verbs() -> None:
    assert tab("rostopic ") == ["bw", "delay", "echo", "find", "hz", "info", "list", "pub", "type"]
    assert tab("rosnode k") == ["kill"]
    assert tab("rossrv p") == ["package", "packages"]
    assert tab("rosparam x") == []
    assert tab("/opt/bin/rosservice u") == ["uri"]


def test_verbs_of_minirospy_itself() -> None:
    found = tab("minirospy ")
    assert {"demo", "topic", "run", "board"} <= set(found)
    assert "complete" not in found
    assert tab("minirospy topic p") == ["pub"]
    assert tab("minirospy board rel") == ["release"]
    assert tab("minirospy demo ") == []
    assert tab("minirospy nothing ") == []


def test_options_of_a_verb() -> None:
    assert set(tab("rostopic pub -")) >= {"-r", "--rate", "-1", "--once", "-f", "-h", "--latch"}
    assert tab("rostopic pub --f") == ["--file"]
    assert "-n" in tab("rosservice list -")
    assert tab("rosrun --p") == ["--prefix"]
    assert "--screen" in tab("roslaunch --")
    assert {"-p", "--port"} <= set(tab("roscore -"))
    assert tab("minirospy demo --p") == ["--presses"]


def test_asking_a_command_leaves_it_as_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    from minirospy.ros.rostopic.commands import rostopic

    tab("rostopic pub -")
    assert rostopic.main(["-h"]) == 64
    assert "rostopic pub" in capsys.readouterr().out


def test_the_small_commands(workspace: Path) -> None:
    assert tab("rosclean p") == ["purge"]
    assert set(tab("rosclean purge --")) == {"--help", "--size"}
    assert tab("minirospy clean c") == ["check"]
    assert tab("rosconsole set n rosout w") == ["warn"]
    assert tab("rosversion my_") == ["my_robot"]
    assert tab("rosgraph --o") == ["--once"]
    assert tab("rosmsg-proto msg std_msgs/Boo") == ["std_msgs/Bool"]


def test_console_scripts_that_are_installed_are_those_of_the_registry() -> None:
    installed = distribution("minirospy").entry_points.select(group="console_scripts")
    assert {each.name: each.value for each in installed} == console_scripts()


def leaves(grammar: Command | Family | Verb, typed: str) -> Iterator[tuple[str, Command | Verb]]:
    """Yield every verb, or the command itself, with its words."""
    if not isinstance(grammar, Family):
        yield typed, grammar
        return
    for verb in grammar.verbs:
        yield from leaves(verb, f"{typed} {grammar.verb_name(verb)}")


LEAVES = [
    leaf
    for entry in COMMANDS
    if (grammar := entry.load_grammar())
    for leaf in leaves(grammar, entry.script or f"minirospy {entry.verb}")
]


def test_every_command_is_completed() -> None:
    """A command has a grammar or a completer for its words; only `minirospy` and `complete` have neither."""
    for entry in COMMANDS:
        grammar = entry.load_grammar()
        assert callable(entry.load_main()), entry
        assert grammar is None or isinstance(grammar, Command | Family), entry
        assert (
            grammar
            or entry.completer
            or entry.target
            in (
                "minirospy.cli.main:main",
                "minirospy.cli.completion.complete:main",
            )
        ), entry
        assert not entry.completer or callable(getattr(completers, entry.completer)), entry


def test_functions_accept_the_arguments_of_their_parsers() -> None:
    for typed, leaf in LEAVES:
        parser = leaf.parser()
        names = {
            action.dest
            for action in parser._actions
            if action.dest != "help" and type(action).__name__ != "_Accepted"
        }
        parameters = inspect.signature(leaf.body).parameters.values()
        if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
            continue
        taken = {parameter.name for parameter in parameters}
        # Launch arguments and words for CMake are separated from the other words.
        assert names <= taken, typed
        assert taken - names <= {"arguments", "args", "variables", "cmake_words"}, typed


def test_functions_with_many_arguments_take_a_record() -> None:
    for typed in ("roslaunch", "rosbag play", "rosbag record", "minirospy bridge"):
        body = dict(LEAVES)[typed].body
        parameters = inspect.signature(body).parameters.values()
        assert len(parameters) > 20
        assert {parameter.kind for parameter in parameters} == {inspect.Parameter.POSITIONAL_OR_KEYWORD}, (
            typed
        )


def test_every_verb_and_option_is_completed() -> None:
    """A new argument that takes a value must name its completer (``nothing`` for none)."""
    for typed, leaf in LEAVES:
        parser = leaf.parser()
        options = [option for action in parser._actions for option in action.option_strings]
        assert tab(f"{typed} -") == options, typed
        for action in parser._actions:
            is_number = action.type in (int, float) or isinstance(action.type, FunctionType)
            if action.nargs == 0 or action.choices is not None or is_number:
                continue
            name = completer_of(action)
            assert name, f"{typed}: what completes {action.option_strings or action.dest}?"
            assert callable(getattr(completers, name)), typed


def test_choices_of_an_argument() -> None:
    assert tab("minirospy board set 7 ") == ["0", "1"]
    assert tab("minirospy board press ") == ["11", "12"]
    assert tab("minirospy shell f") == ["fish"]


def test_tools_of_a_workspace(workspace: Path) -> None:
    assert tab("rospack f") == ["find"]
    assert tab("rospack find my_") == ["my_robot"]
    assert tab("rospack find my_robot ") == []
    assert tab("rospack list-names ") == []
    assert tab("rospack depends-why --target=my_") == ["--target=my_robot"]
    assert "--target=" in tab("rospack depends-why my_robot -")
    assert "build" in tab("catkin b")
    assert tab("catkin build my_") == ["my_robot"]
    assert tab("catkin build -j 4 my_") == tab("catkin build -j my_") == ["my_robot"]
    assert tab("catkin create ") == ["pkg"]
    assert tab("catkin create pkg x my_") == tab("catkin_create_pkg x --catkin-deps my_") == ["my_robot"]
    assert tab("catkin_make run_tests_my") == ["run_tests_my_robot"]
    assert tab("catkin_make --pkg my_") == ["my_robot"]


# --- packages and files


def test_programs(workspace: Path) -> None:
    assert tab("rosrun my_") == ["my_robot"]
    assert tab("rosrun my_robot ") == ["talker.py"]
    assert tab("minirospy run my_robot ta") == ["talker.py"]
    assert tab("rosrun --prefix gdb my_robot ") == ["talker.py"]
    assert tab("rosrun my_robot talker.py __n") == ["__name:=", "__ns:="]
    assert tab("rosrun nobody ") == []
    assert tab("rosrun my_robot talker.py _rate:=") == []


def test_launch_files_and_their_args(workspace: Path) -> None:
    assert tab("roslaunch my_robot ") == ["all.launch"]
    assert tab("roslaunch --screen my_robot a") == ["all.launch"]
    assert tab("roslaunch my_robot all.launch ") == ["rate:=", "fake:=", "port:=", "name:=", "place:="]
    assert tab("roslaunch my_robot all.launch rate:=5 f") == ["fake:="]
    assert tab("roslaunch my_robot all.launch rate:=") == ["rate:=10"]
    assert tab("roslaunch my_robot all.launch fake:=") == ["fake:=true", "fake:=false"]
    assert tab("roslaunch my_robot all.launch port:=") == tab("roslaunch my_robot all.launch place:=") == []
    assert tab("roslaunch my_robot all.launch --args ") == ["/talker"]
    assert tab("roslaunch my_robot all.launch --find-node t") == ["talker"]
    assert tab("roslaunch --args ") == []


def test_launch_files_by_path(workspace: Path) -> None:
    folder = workspace / "src" / "my_robot" / "launch"
    assert tab(f"roslaunch {folder}/") == [f"{folder}/all.launch"]
    assert tab(f"roslaunch {folder}/all.launch po") == ["port:="]


def test_folders_of_packages(workspace: Path) -> None:
    assert tab("roscd my_") == ["my_robot/"]
    assert tab("roscd my_robot/c") == ["my_robot/config/"]
    assert tab("rospd my_robot/config/") == ["my_robot/config/deep/"]
    assert tab("rosls -l my_robot/s") == ["my_robot/scripts/"]
    assert tab("roscd my_robot my") == []
    assert tab("roscd my_robot/.") == ["my_robot/.git/"]


def test_folders_of_logs_and_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "log" / "latest").mkdir(parents=True)
    (tmp_path / "test_results" / "my_robot").mkdir(parents=True)
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.delenv("ROS_LOG_DIR", raising=False)
    assert tab("roscd lo") == ["log/"]
    assert tab("roscd log/") == ["log/latest/"]
    assert tab("rosls test_results/") == ["test_results/my_robot/"]


def test_files_of_packages(workspace: Path) -> None:
    assert tab("rosed my_robot t") == ["talker.py"]
    assert tab("rosed my_robot scripts/") == ["scripts/notes.txt", "scripts/talker.py"]
    assert tab("rosed my_robot c") == []
    assert tab("rosed my_robot config/") == ["config/deep/"]
    assert tab("rosed my_robot talker.py ") == []
    assert tab("catkin_find my_robot l") == ["launch/"]
    Path("copy.txt").touch()
    assert tab("roscp my_robot notes.txt ") == ["copy.txt"]


def test_files_of_this_computer(workspace: Path) -> None:
    Path("params.yaml").touch()
    Path("folder").mkdir()
    assert tab("rosparam load ") == ["folder/", "params.yaml"]
    assert tab("rosparam load ./p") == ["./params.yaml"]
    assert tab("rostopic pub -f ") == ["folder/", "params.yaml"]
    assert tab("rostopic pub --file=p") == ["--file=params.yaml"]
    assert tab("rostopic pub --rate=") == []
    assert tab("catkin_make --source ") == ["folder/"]


# --- types and texts


def test_types(workspace: Path) -> None:
    assert tab("rosmsg show std_m") == ["std_msgs/"]
    assert tab("rosmsg show std_msgs/Bo") == ["std_msgs/Bool"]
    assert tab("rosmsg md5 my_robot/L") == ["my_robot/Led", "my_robot/Leds"]
    assert tab("rosmsg package my_") == ["my_robot"]
    assert tab("rossrv show std_srvs/Set") == ["std_srvs/SetBool"]
    assert tab("rosservice find std_s") == ["std_srvs/"]
    assert tab("rostopic pub /new std_msgs/Boo") == ["std_msgs/Bool"]
    assert tab("rosmsg show nobody/") == []
    # A type's name without its package is completed, too.
    assert tab("rosmsg show PoseWithCov") == ["PoseWithCovariance", "PoseWithCovarianceStamped"]
    assert tab("rossrv md5 SetB") == ["SetBool"]
    assert tab("rostopic find PoseW") == []
    assert tab("rosmsg-proto ") == ["msg", "srv"]
    assert tab("rosmsg-proto srv std_srvs/Set") == ["std_srvs/SetBool"]


def test_a_message_to_be_changed(workspace: Path) -> None:
    assert tab("rostopic pub /t std_msgs/Bool ") == ['"data: false"']
    assert tab("rostopic pub -r 10 /t std_msgs/Bool ") == ['"data: false"']
    assert tab("rostopic pub /t std_msgs/String ") == ["\"data: ''\""]
    assert tab("rostopic pub /t std_msgs/Empty ") == ['"{}"']
    assert tab("rostopic pub /t std_msgs/Bool true ") == []
    assert tab("rostopic pub /t std_msgs/Nothing ") == []
    # A vertical tab represents a line feed, because each candidate is one line.
    assert tab("rostopic pub /t geometry_msgs/Point ") == ['"x: 0.0\vy: 0.0\vz: 0.0"']
    assert tab("rostopic pub /t my_robot/Leds ") == [
        "\"leds:\v- name: ''\v  place:\v  - 0.0\v  - 0.0\von: false\""
    ]


def test_a_message_on_one_line() -> None:
    words = ["rostopic", "pub", "/t", "geometry_msgs/Point", ""]
    assert candidates(4, words, one_line=True) == ['"{x: 0.0, y: 0.0, z: 0.0}"']


def test_names_stay_on_one_line(workspace: Path) -> None:
    words = ["rostopic", "pub", "/t", "my_robot/Leds", ""]
    # YAML reads the name `on` as a boolean.
    assert candidates(4, words, one_line=True) == ["\"{leds: [{name: '', place: [0.0, 0.0]}], on: false}\""]


def test_quotes_that_are_open_stay(workspace: Path) -> None:
    assert candidates(4, ["rostopic", "pub", "/t", "std_msgs/Bool", "'da"]) == ["'data: false'"]
    assert candidates(4, ["rostopic", "pub", '"/t"', "std_msgs/Bool", '"']) == ['"data: false"']
    assert candidates(2, ["rosed", "my_robot", '"my '], one_line=True) == ['"my map.yaml"']
    assert candidates(2, ["rosed", "my_robot", "config/deep/my\\ "]) == ["config/deep/my\\ map.yaml"]
    # A shell interprets nothing inside single quotes, so close them before the apostrophe.
    assert candidates(4, ["rostopic", "pub", "/t", "std_msgs/String", "'"]) == [r"'data: '\'''\'''"]
    words = ["roslaunch", "my_robot", "all.launch"]
    assert candidates(3, [*words, "name:="]) == [r"name:=a\ robot"]
    assert candidates(3, [*words, 'name:="a']) == ['name:="a robot"']


def test_folders_in_quotes_go_on(workspace: Path) -> None:
    Path("my folder").mkdir()
    assert candidates(1, ["roslaunch", '"my ']) == ['"my folder/']
    assert candidates(1, ["roslaunch", "my\\ f"]) == ["my\\ folder/"]


def test_variables_and_home(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = workspace / "src" / "my_robot" / "launch"
    monkeypatch.setenv("HOME", str(folder))
    assert tab("roslaunch $HOME/a") == tab("roslaunch ${HOME}/a") == [f"{folder}/all.launch"]
    assert tab("roslaunch '$HOME/a") == tab("roslaunch $NOBODY/a") == []
    assert tab("roslaunch ~/") == ["~/all.launch"]
    assert tab("roslaunch ~/all.launch po") == ["port:="]


def test_nothing_in_a_text_is_history(robot: Robot) -> None:
    """bash and zsh at a terminal replace !! with the previous command, even within double quotes."""
    from minirospy.ros.rosparam.commands import rosparam

    assert rosparam.main(["set", "/greeting", "it's you!"]) == 0
    (text,) = tab("rosparam set /greeting ")
    assert text == '"it\'s you"\'!\'""'
    assert shlex.split(text) == ["it's you!"]
    assert tab("rostopic pub /t std_msgs/UInt8MultiArray ")[0].endswith('data: []"')


_FROM_ROS = {
    "std_msgs/Header": "seq: 0\nstamp:\n  secs: 0\n  nsecs: 0\nframe_id: ''",
    "std_msgs/Float64MultiArray": "layout:\n  dim:\n  - label: ''\n    size: 0\n    stride: 0\n  data_offset: 0\ndata:\n- 0",
    "sensor_msgs/RegionOfInterest": "{x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false}",
    "sensor_msgs/NavSatFix": (
        "header:\n  seq: 0\n  stamp: {secs: 0, nsecs: 0}\n  frame_id: ''\nstatus: {status: 0, service: 0}\n"
        "latitude: 0.0\nlongitude: 0.0\naltitude: 0.0\n"
        "position_covariance: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]\nposition_covariance_type: 0"
    ),
    "geometry_msgs/Polygon": "points:\n- x: 0.0\n  y: 0.0\n  z: 0.0",
}
"""The output of ROS 1's rosmsg-proto."""


@pytest.mark.parametrize("type_", _FROM_ROS)
def test_the_text_is_that_of_ros(type_: str) -> None:
    catalogue = Catalogue(Packages(Environment.read(host="localhost")).folders())
    assert prototype(catalogue.message(type_), catalogue) == _FROM_ROS[type_]


def test_every_text_is_a_message() -> None:
    catalogue = Catalogue(Packages(Environment.read(host="localhost")).folders())
    for package in ("std_msgs", "geometry_msgs", "sensor_msgs", "nav_msgs", "visualization_msgs"):
        for spec in catalogue.messages(package):
            text = prototype(spec, catalogue)
            message = message_class(spec.full_name)()
            serialize(fill(message, [safe_load(text)]))


# --- the graph


def test_topics(robot: Robot) -> None:
    assert {"/button_state", "/listen", "/ns/chatter", "/poly"} <= set(tab("rostopic echo "))
    assert tab("rostopic hz /button_state /po") == ["/poly"]
    assert tab("rostopic info ns/") == ["ns/chatter"]
    assert tab("minirospy topic bw /but") == ["/button_state"]
    assert tab("rostopic echo -n 3 /but") == ["/button_state"]
    # Complete the right side of a remapping.
    assert tab("rosrun rospy_tutorials talker chatter:=/but") == ["chatter:=/button_state"]


def test_fields_of_a_topic(robot: Robot) -> None:
    assert tab("rostopic echo /poly/") == ["/poly/header/", "/poly/polygon/"]
    assert tab("rostopic echo /poly/header/s") == ["/poly/header/seq", "/poly/header/stamp"]
    assert tab("rostopic echo /poly/header/stamp/") == ["/poly/header/stamp/secs", "/poly/header/stamp/nsecs"]
    # Shells interpret brackets as a pattern.
    assert tab("rostopic echo /poly/polygon/points[0]/y") == [r"/poly/polygon/points\[0\]/y"]
    assert tab("rostopic echo /poly/nothing/") == []
    assert tab("rostopic hz /poly/") == []


def test_the_type_that_a_topic_has(robot: Robot) -> None:
    assert tab("rostopic pub /button_state ") == ["std_msgs/Bool"]
    assert tab("rostopic pub listen ") == ["std_msgs/Bool"]
    assert "std_msgs/" in tab("rostopic pub /other ")


def test_nodes_and_machines(robot: Robot) -> None:
    assert tab("rosnode info ") == ["/robot"]
    assert tab("rosnode kill /robot ") == []
    assert tab("rosnode machine ") == ["localhost"]


def test_services_and_a_request(robot: Robot) -> None:
    assert "/set_led_state" in tab("rosservice call /set")
    assert tab("rosservice call /set_led_state ") == ['"data: false"']
    assert tab("rosservice call /fail ") == ['"{}"']
    assert tab("rosservice info se") == ["set_led_state"]


def test_parameters(robot: Robot, command: object) -> None:
    from minirospy.ros.rosparam.commands import rosparam

    assert rosparam.main(["set", "/robot/speed", "3"]) == 0
    assert tab("rosparam get /robot/") == ["/robot/speed"]
    assert tab("rosparam delete rob") == ["robot/speed"]
    assert tab("rosparam list /ro") == ["/robot/speed"]


def test_the_value_that_a_parameter_has(robot: Robot) -> None:
    from minirospy.ros.rosparam.commands import rosparam

    assert rosparam.main(["set", "/speed", "3.5"]) == 0
    assert rosparam.main(["set", "/gains", "{p: 1, i: [2, 3]}"]) == 0
    assert tab("rosparam set /speed ") == ["3.5"]
    assert tab("rosparam set speed ") == ["3.5"]
    assert tab("rosparam set /gains ") == ['"{i: [2, 3], p: 1}"']
    assert tab("rosparam set /none ") == []
    assert rosparam.main(["set", "/text", "'one\n\ntwo: \u00fc'"]) == 0
    assert [yaml.safe_load(shlex.split(text)[0]) for text in tab("rosparam set /text ")] == [
        "one\ntwo: \u00fc"
    ]
    assert "\v" not in tab("rosparam set /text ")[0]
    assert rosparam.main(["set", "/robot_description", "x" * 2000]) == 0
    assert tab("rosparam set /robot_description ") == []


def test_a_thousand_topics(master: str) -> None:
    proxy = MasterProxy(master, "/many")
    for number in range(1000):
        proxy.call("registerPublisher", f"/many/topic_{number:04}", "std_msgs/Bool", "http://localhost:1")
    proxy.close()
    assert len(tab("rostopic echo ")) == 1000
    assert tab("rostopic echo /many/topic_0999") == ["/many/topic_0999"]
    assert tab("rostopic pub /many/topic_0999 ") == ["std_msgs/Bool"]


# --- any state of the system


@pytest.mark.parametrize("verb", ["rostopic echo ", "rosnode info ", "rosservice call ", "rosparam get "])
def test_without_a_master_there_is_nothing(verb: str) -> None:
    assert tab(verb) == []


def test_a_master_that_does_not_answer_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    import socket

    with socket.create_server(("localhost", 0)) as silent:
        monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{silent.getsockname()[1]}")
        monkeypatch.setattr(completers, "LIVE_SECONDS", 0.2)
        took: list[float] = []
        # A call gives up after five seconds. Try it up to three times, in case the machine stalls.
        while len(took) < 3 and min(took, default=9.0) > 4:
            start = time.monotonic()
            assert tab("rostopic echo ") == []
            took.append(time.monotonic() - start)
        assert min(took) < 4


def test_nodes_that_have_died_are_not_waited_for(master: str) -> None:
    proxy = MasterProxy(master, "/dead")
    proxy.call("registerService", "/dead/get_loggers", "rosrpc://localhost:1", "http://localhost:1")
    proxy.close()
    assert tab("rosservice call /dead/get_") == ["/dead/get_loggers"]
    assert tab("rosservice call /dead/get_loggers ") == []
    assert tab("rosconsole get /dead ") == []


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_folders_that_cannot_be_read(workspace: Path) -> None:
    Path("itself").symlink_to("itself")
    Path("gone").symlink_to("nowhere")
    Path("a.launch").touch()
    assert tab("rosparam load ") == ["a.launch", "gone", "itself"]
    assert tab("rosparam load itself/") == tab("rosparam load a.launch/") == []
    (workspace / "src" / "my_robot" / "scripts" / "itself").symlink_to("itself")
    assert tab("rosrun my_robot ") == ["talker.py"]
    assert "itself" in tab("rosed my_robot scripts/i")[0]


def test_packages_are_found_with_a_bad_master_uri(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "nonsense")
    assert tab("roscd std_m") == ["std_msgs/"]
    assert tab("rostopic echo ") == []


@pytest.mark.parametrize(
    "argv",
    [
        [],
        ["x"],
        ["-1", "rostopic"],
        ["99", "rostopic", "echo"],
        ["1"],
        ["1", "rostopic"],
        ["1", "unknown", ""],
        ["0", "rostopic"],
        ["2", "rosmsg", "show", "a/b/c"],
        ["1", "roscd", "nobody/x/"],
        ["2", "roslaunch", "nobody", "x.launch", ""],
        ["3", "roslaunch", "nobody", "x.launch", "a:="],
        ["2", "rostopic", "nothing", ""],
        ["3", "rostopic", "pub", "'", "\\"],
        ["--one-line"],
        ["--powershell"],
    ],
)
def test_nothing_is_an_error(argv: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(argv) == 0
    out, err = capsys.readouterr()
    assert not err
    assert "Traceback" not in out


def test_the_command(workspace: Path) -> None:
    words = [sys.executable, "-m", "minirospy", "complete", "2", "rosrun", "my_robot", "-weird"]
    assert subprocess.run(words, capture_output=True, check=True, timeout=30).stdout == b""
    done = subprocess.run([*words[:-1], ""], capture_output=True, check=True, timeout=30)
    assert done.stdout == b"talker.py"
    assert done.stderr == b""


@pytest.mark.skipif(sys.platform == "win32", reason="no such file names")
def test_names_with_control_characters_are_not_offered(workspace: Path) -> None:
    folder = workspace / "src" / "my_robot" / "config"
    (folder / "evil\x1b]0;t\x07.yaml").touch()
    (folder / "good.yaml").touch()
    found = candidates(2, ["roscat", "my_robot", ""])
    assert "good.yaml" in " ".join(found)
    assert "evil" not in " ".join(found)
