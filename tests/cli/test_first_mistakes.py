"""Mistakes of a first week with ROS: each is answered by a line that names the cause and what to do."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from minirospy.client.type_advice import advice_for_message_class, advice_for_service_class
from minirospy.workspace.hidden_modules import hiding_files
from minirospy.workspace.stale import stale_definitions
from tests.conftest import write_files

BIN = Path(sys.executable).parent
HAS_NOTES = sys.version_info >= (3, 11)

MANIFEST = (
    '<package format="2"><name>my_pkg</name><version>0.0.0</version><description>x</description>'
    '<maintainer email="a@b.c">a</maintainer><license>BSD</license><buildtool_depend>catkin</buildtool_depend>'
    "<depend>std_msgs</depend><depend>geometry_msgs</depend><build_depend>message_generation</build_depend></package>"
)
CMAKE = (
    "cmake_minimum_required(VERSION 3.0.2)\nproject(my_pkg)\n"
    "find_package(catkin REQUIRED COMPONENTS std_msgs geometry_msgs message_generation)\n"
    "add_message_files(FILES A.msg)\ngenerate_messages(DEPENDENCIES std_msgs geometry_msgs)\ncatkin_package()\n"
)


def typed(*words: str | Path, folder: Path | None = None, **environ: str) -> subprocess.CompletedProcess[str]:
    """Run one of minirospy's commands, or `python`; return its output."""
    name, *others = map(str, words)
    program = sys.executable if name == "python" else str(BIN / name)
    return subprocess.run(
        [program, *others],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        cwd=folder,
        env={**os.environ, **environ},
        stdin=subprocess.DEVNULL,
    )


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """Return a workspace with a built package, my_pkg."""
    write_files(
        tmp_path / "ws" / "src" / "my_pkg",
        {"package.xml": MANIFEST, "CMakeLists.txt": CMAKE, "msg/A.msg": "int8 x\n"},
    )
    done = typed("catkin_make", folder=tmp_path / "ws")
    assert done.returncode == 0, done.stderr
    return tmp_path / "ws"


def package_path(workspace: Path) -> dict[str, str]:
    return {
        "ROS_PACKAGE_PATH": str(workspace / "src"),
        "PYTHONPATH": str(workspace / "devel" / "lib" / "python3" / "dist-packages"),
    }


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (
            ("rosmsg", "show", "std_srvs/SetBool"),
            "rosmsg: ERROR: message type [std_srvs/SetBool] not found: it is a service type: `rossrv show std_srvs/SetBool`",
        ),
        (
            ("rosmsg", "show", "SetBool"),
            "rosmsg: ERROR: message type [SetBool] not found: it is a service type: `rossrv show SetBool`",
        ),
        (
            ("rossrv", "show", "std_msgs/Bool"),
            "rossrv: ERROR: service type [std_msgs/Bool] not found: it is a message type: `rosmsg show std_msgs/Bool`",
        ),
        (("rosmsg", "show", "nope_msgs/X"), "rosmsg: ERROR: message type [nope_msgs/X] not found"),
    ],
)
def test_type_of_the_other_kind_and_unknown_package(words: tuple[str, ...], answer: str) -> None:
    done = typed(*words)
    assert done.stderr.splitlines()[-1] == answer
    assert len(done.stdout + done.stderr) < 400


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("from std_msgs import Bool", "did you mean `from std_msgs.msg import Bool`?"),
        ("from std_srvs import SetBoolRequest", "did you mean `from std_srvs.srv import SetBoolRequest`?"),
        ("from gazebo_msgs import ModelStates", "did you mean `from gazebo_msgs.msg import ModelStates`?"),
    ],
)
def test_class_imported_from_the_package(line: str, hint: str) -> None:
    done = typed("python", "-c", line)
    assert done.stderr.splitlines()[-1].startswith("ImportError: cannot import name")
    assert done.stderr.splitlines()[-1].endswith(hint)


def test_other_names_of_a_package_are_attribute_errors() -> None:
    import std_msgs

    assert not hasattr(std_msgs, "nothing")
    assert not hasattr(std_msgs, "__nothing__")


def test_advice_for_classes_of_the_wrong_kind() -> None:
    import std_msgs.msg
    import std_srvs.srv

    message, service = std_msgs.msg.Bool, std_srvs.srv.SetBool
    assert advice_for_message_class(service).startswith("std_srvs/SetBool is a service type")
    assert advice_for_message_class(std_msgs.msg).startswith("std_msgs.msg is a module")
    assert advice_for_message_class("std_msgs/Bool").startswith("'std_msgs/Bool' is a string")
    assert advice_for_message_class(message()) == "this is a message; pass its class: Bool, not Bool()"
    assert advice_for_message_class(int).startswith("it must be a class from a .msg module")
    assert advice_for_service_class(message).startswith("std_msgs/Bool is a message type")
    assert (
        advice_for_service_class(std_srvs.srv.SetBoolRequest)
        == "SetBoolRequest is half of a service; pass SetBool"
    )
    assert advice_for_service_class(std_srvs.srv).startswith("std_srvs.srv is a module")
    assert advice_for_service_class("x").startswith("'x' is a string")
    assert advice_for_service_class(int).startswith("it must be a class from a .srv module")


@pytest.mark.skipif(not HAS_NOTES, reason="Python 3.10 has no notes")
@pytest.mark.parametrize(
    ("call", "error", "note"),
    [
        (
            'rospy.Service("/s", Bool, print)',
            "has no attribute '_request_class'",
            "a service needs a service type",
        ),
        (
            'rospy.ServiceProxy("/s", Bool)',
            "has no attribute '_request_class'",
            "a service needs a service type",
        ),
        ('rospy.Publisher("/s", SetBool, queue_size=1)', "is not a message data class", "is a service type"),
        ('rospy.Subscriber("/s", "std_msgs/Bool", print)', "is not a class", "is a string"),
        ('rospy.Subscriber("/s", None, print)', "is not initialized", "the second argument is the type"),
    ],
)
def test_class_of_the_wrong_kind(call: str, error: str, note: str) -> None:
    code = f"import rospy; from std_msgs.msg import Bool; from std_srvs.srv import SetBool; {call}"
    done = typed("python", "-c", code)
    *_, text, advice = done.stderr.splitlines()
    assert error in text
    assert advice.startswith("minirospy: ")
    assert note in advice


def test_service_without_spin(master: str) -> None:
    code = "import rospy; from std_srvs.srv import SetBool; rospy.init_node('x'); rospy.Service('/s', SetBool, print)"
    done = typed("python", "-c", code)
    assert "the program ends while it offers the service /s, before any call. rospy.spin()" in done.stderr
    done = typed("python", "-c", code + "; rospy.sleep(0.01)")
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("text", "answer"),
    [
        (
            '<launch>\n <node name="a" pkg="b" type="c">\n</launch>\n',
            "mismatched tag (column 2): <node> of line 2 is not closed, by /> or </node>",
        ),
        (
            "<launch>\n <group>\n",
            "no element found (column 0): <group> of line 2 is not closed, by /> or </group>",
        ),
        (
            '<launch>\n <node name="x" pkg=rpi_feros type="c"/>\n</launch>\n',
            'not well-formed (invalid token) (column 20): a value is written in quotes: pkg="rpi_feros"',
        ),
        ("", "no element found (column 0): the file is empty"),
        (" \n", "no element found (column 0): the file is empty"),
    ],
)
def test_launch_file_that_is_no_xml(text: str, answer: str, tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    file.write_text(text)
    done = typed("roslaunch", file)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(f"Invalid roslaunch XML syntax: {answer}")


def test_include_with_the_dollar_outside_of_the_parentheses(tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    file.write_text("<launch><include file='$find(rpi_feros_bringup)/launch/x.launch'/></launch>")
    done = typed("roslaunch", file)
    assert done.returncode == 1
    assert done.stderr.endswith(": $find(rpi_feros_bringup) is written $(find rpi_feros_bringup)\n")


@pytest.mark.parametrize(
    ("value", "answer"),
    [
        ("[1, 2", "a [ is not closed, or a comma is missing"),
        ("{a: 1", "a { is not closed, or a comma is missing"),
        ("a: b: c", "a value that contains a colon and a blank is written in quotes"),
        ("a: 1\n\tb: 2", "YAML is indented with blanks, not with tabs"),
    ],
)
def test_value_that_is_no_yaml(value: str, answer: str, master: str) -> None:
    done = typed("rosparam", "set", "/a", value)
    (line,) = done.stderr.splitlines()
    assert line.endswith(answer)


@pytest.mark.parametrize(
    ("files", "answer"),
    [
        (
            {"msg/A.msg": "Twist t\n"},
            "message type [my_pkg/Twist] not found: did you mean geometry_msgs/Twist?",
        ),
        (
            {"msg/B.msg": "int8 x\n", "CMakeLists.txt": CMAKE.replace("A.msg", "A.msg, B.msg")},
            "[A.msg,] does not end in .msg: CMake separates names by blanks, write A.msg",
        ),
    ],
)
def test_catkin_make_names_the_mistake(files: dict[str, str], answer: str, workspace: Path) -> None:
    write_files(workspace / "src" / "my_pkg", files)
    done = typed("catkin_make", folder=workspace)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(answer)


def test_program_in_cpp_is_named_as_such(workspace: Path) -> None:
    write_files(
        workspace / "src" / "my_pkg",
        {"CMakeLists.txt": f"{CMAKE}add_executable(talker src/talker.cpp)\n", "src/talker.cpp": ""},
    )
    done = typed("rosrun", "my_pkg", "talker", **package_path(workspace))
    assert done.returncode == 3
    assert "executable [talker] not found: it is a C++ program, which catkin_make skips" in done.stderr


def test_definition_changed_after_catkin_make(workspace: Path) -> None:
    package = workspace / "src" / "my_pkg"
    module = workspace / "devel" / "lib" / "python3" / "dist-packages" / "my_pkg" / "msg" / "_A.py"
    write_files(package, {"scripts/use.py": "#!/usr/bin/env python3\nprint(1)\n"}, {"scripts/use.py"})
    os.utime(module, (1e9, 1e9))
    assert stale_definitions(package) == []

    write_files(package, {"msg/A.msg": "int8 x\nint8 y\n"})
    assert stale_definitions(package) == [package / "msg" / "A.msg"]
    warning = f"my_pkg/msg/A.msg: changed since the last catkin_make; run it in {workspace}"
    done = typed("rosrun", "my_pkg", "use.py", **package_path(workspace))
    assert (done.stdout, done.stderr) == ("1\n", f"WARNING: {warning}\n")
    assert warning in typed("minirospy", "doctor", **package_path(workspace)).stdout

    assert typed("catkin_make", folder=workspace).returncode == 0
    assert stale_definitions(package) == []


@pytest.mark.parametrize(
    ("text", "is_stale"),
    [
        ('int8 x  # don\'t "x"\nHeader header\n\nint8 y2\n', False),
        ('int8 x  # don\'t "x"\nHeader header\n', True),
        ('Header header\nint8 x  # don\'t "x"\nint8 y2\n', True),
        ('int8 x  # don\'t "x"\nHeader header\nint8 y\n', True),
    ],
)
def test_fields_that_are_removed_moved_or_renamed_make_classes_stale(
    workspace: Path, text: str, is_stale: bool
) -> None:
    package = workspace / "src" / "my_pkg"
    definition = package / "msg" / "A.msg"
    write_files(package, {"msg/A.msg": 'int8 x  # don\'t "x"\nHeader header\nint8 y2\n'})
    assert typed("catkin_make", folder=workspace).returncode == 0
    write_files(package, {"msg/A.msg": text})
    os.utime(definition, (4e9, 4e9))
    assert stale_definitions(package) == ([definition] if is_stale else [])


def test_package_with_a_name_that_exists(tmp_path: Path) -> None:
    write_files(tmp_path, {"src/.keep": ""})
    done = typed("catkin_create_pkg", "std_msgs", folder=tmp_path / "src")
    assert "WARNING: std_msgs exists already, in " in done.stderr
    done = typed("catkin_make", folder=tmp_path)
    assert "it hides the package std_msgs in " in done.stderr
    done = typed("catkin_create_pkg", "led_demo", folder=tmp_path / "src")
    assert done.stderr == ""


def test_file_that_hides_a_module(tmp_path: Path) -> None:
    write_files(tmp_path, {"std_msgs.py": "", "RPi/__init__.py": "", "mine.py": "", "more/__init__.py": ""})
    assert hiding_files(tmp_path) == [tmp_path / "RPi", tmp_path / "std_msgs.py"]
    done = typed("minirospy", "python", "mine.py", folder=tmp_path)
    assert (
        done.stderr
        == f"WARNING: {tmp_path / 'RPi'} hides the module RPi from `import RPi`: give it another name\n"
    )
    assert (
        f"{tmp_path / 'std_msgs.py'} hides the module std_msgs"
        in typed("minirospy", "doctor", folder=tmp_path).stdout
    )


def test_type_that_a_wrong_publisher_left_behind(master: str) -> None:
    wrong = typed("rostopic", "pub", "-1", "/b", "std_msgs/String", "hello")
    assert wrong.returncode == 0
    with subprocess.Popen(
        [str(BIN / "rostopic"), "echo", "/b"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as echo:
        assert echo.stderr
        line = echo.stderr.readline()
        echo.terminate()
    assert line.startswith(
        "WARNING: nothing publishes [/b] now; messages of its last type [std_msgs/String] are awaited."
    )


@pytest.mark.parametrize(
    ("callback", "note"),
    [
        ("lambda: 1", "minirospy: a callback gets the message: def <lambda>(message)"),
        ("lambda m: m + 1", "minirospy: the value of a std_msgs/Int32 is its field: message.data"),
        ("lambda m: m.dta", "minirospy: a std_msgs/Int32 has the fields data"),
        ("lambda m: [].dta", ""),
        ("lambda m: 1 / 0", ""),
    ],
)
def test_callback_that_fails(callback: str, note: str, master: str) -> None:
    # The second callback of the message is called once the first one's error and its note are printed.
    code = (
        "import threading, rospy; from std_msgs.msg import Int32; rospy.init_node('x'); called = threading.Event()\n"
        f"rospy.Subscriber('/a', Int32, {callback}); rospy.Subscriber('/a', Int32, lambda message: called.set())\n"
        "publisher = rospy.Publisher('/a', Int32, queue_size=1); publisher.wait_for_subscribers()\n"
        "publisher.publish(5); called.wait()\n"
    )
    done = typed("python", "-c", code)
    lines = [line for line in done.stderr.splitlines() if line]
    assert "bad callback" in lines[0]
    assert (lines[-1] == note) if note else not lines[-1].startswith("minirospy:")


@pytest.mark.parametrize("value", ["'5'", "5.5"])
def test_message_that_does_not_fit_and_that_nobody_gets(value: str, master: str) -> None:
    code = (
        "import rospy; from std_msgs.msg import Int32; rospy.init_node('x')\n"
        f"p = rospy.Publisher('/a', Int32, queue_size=1); p.publish({value}); p.publish({value})\n"
    )
    done = typed("python", "-c", code)
    (line,) = done.stderr.splitlines()
    assert "a message on /a does not fit std_msgs/Int32: field data must be an integer type" in line


@pytest.mark.skipif(not HAS_NOTES, reason="Python 3.10 has no notes")
@pytest.mark.parametrize(
    ("code", "note"),
    [
        ("import rospy; rospy.init_node('x'); rospy.Rate(0)", "rospy.Rate(10)"),
        (
            "import RPi.GPIO as GPIO; GPIO.setmode('BCM')",
            "the modes are GPIO.BCM and GPIO.BOARD, without quotes",
        ),
        ("import rospy; rospy.init_node('x'); rospy.Rate('10')", "rospy.Rate(10)"),
        ("import rospy; rospy.init_node('x'); rospy.sleep('1')", "rospy.sleep(0.5)"),
        (
            "import rospy; rospy.init_node('x'); rospy.get_param('~led')",
            "it is not set; a default: rospy.get_param('~led', DEFAULT)",
        ),
        (
            "import rospy; from std_msgs.msg import Bool; rospy.Subscriber(Bool, '/a', print)",
            "the first argument is the topic's name, the second one its type",
        ),
        ("from std_msgs.msg import Bool; Bool(dat=True)", "a std_msgs/Bool has the fields data"),
    ],
)
def test_wrong_number_or_mode(code: str, note: str, master: str) -> None:
    assert typed("python", "-c", code).stderr.splitlines()[-1].endswith(note)


@pytest.mark.skipif(not HAS_NOTES, reason="Python 3.10 has no notes")
@pytest.mark.parametrize(
    ("call", "note"),
    [
        ("setup(11, 'IN')", "the directions are GPIO.IN and GPIO.OUT, without quotes"),
        ("setup('7', GPIO.OUT)", "it is '7'; write the number without quotes"),
        ("output(7, 'on')", "it is 'on'; write GPIO.HIGH or GPIO.LOW, without quotes"),
        ("PWM(5, 50)", "channel 5: call GPIO.setup(5, GPIO.OUT) before"),
    ],
)
def test_wrong_argument_of_a_pin(call: str, note: str) -> None:
    code = "import RPi.GPIO as GPIO; GPIO.setmode(GPIO.BCM); GPIO.setup(7, GPIO.OUT)\n"
    done = typed("python", "-c", f"{code}GPIO.{call}")
    assert done.stderr.splitlines()[-1] == f"minirospy: {note}"


def test_callback_in_quotes(master: str) -> None:
    code = "import rospy; from std_msgs.msg import Bool; rospy.init_node('x')\n"
    done = typed("python", "-c", f"{code}rospy.Subscriber('/a', Bool, 'on_a')")
    assert (
        "UserWarning: the callback 'on_a' for /a is not a function: pass its name, without quotes"
        in done.stderr
    )
    assert "UserWarning" not in typed("python", "-c", f"{code}rospy.Subscriber('/a', Bool, print)").stderr


def test_wait_for_a_message_on_a_misspelled_topic(master: str) -> None:
    code = (
        "import rospy; from minirospy.client import subscriber; from std_msgs.msg import Bool\n"
        "rospy.init_node('x'); setattr(subscriber, '_SILENT_SECONDS', 0.01)\n"
        "rospy.wait_for_message('/nope', Bool, 1)\n"
    )
    done = typed("python", "-c", code)
    assert done.stderr.count("wait_for_message(/nope): nothing publishes it, waiting...") == 1
    assert not done.stdout
    assert "timeout exceeded while waiting for message on topic /nope" in done.stderr


# Mistakes that are typed without a running node, and a part of the last line of the answer.
TYPED = [
    ("rosrun", "type rosrun PACKAGE EXECUTABLE"),
    ("rosrun rpi_feros", "[rpi_feros] has button_publisher.py"),
    ("rosrun rpi_feros led_actuator", "did you mean led_actuator.py?"),
    ("rosrun led_actuator.py", "as `rosrun rpi_feros led_actuator.py`"),
    ("rosrun turtlesim turtle", "did you mean turtle_teleop_key or turtlesim_node?"),
    ("rosrun nope x", "package [nope] not found"),
    ("roslaunch rpi_led.launch", "did you mean `roslaunch rpi_feros_bringup rpi_led.launch`?"),
    ("roslaunch rpi_feros rpi_led.launch", "did you mean `roslaunch rpi_feros_bringup rpi_led.launch`"),
    ("roslaunch nope.launch", "[nope.launch] is not a launch file name"),
    (
        "roslaunch rpi_led.launch rpi_feros_bringup",
        "did you mean `roslaunch rpi_feros_bringup rpi_led.launch`?",
    ),
    (
        "roslaunch rpi_feros_bringup/rpi_led.launch",
        "did you mean `roslaunch rpi_feros_bringup rpi_led.launch`?",
    ),
    ("roslaunch rpi_feros_bringup rpi_led.lauch", "did you mean rpi_led.launch?"),
    ("roslaunch rpi_feros_bringup rpi_lde", "did you mean rpi_led.launch?"),
    ("rosrun led_actuator.py rpi_feros", "the package comes first: `rosrun rpi_feros led_actuator.py`"),
    ("rostopic pub std_msgs/Bool /a True", "the topic comes first: rostopic pub /a std_msgs/Bool"),
    ("minirospy launch", "specify what to launch"),
    ("rostopic ehco /a", "did you mean echo?"),
    ("rostopic pub /a std_msgs/Int32", "please specify message values: data"),
    ("rostopic pub -1 /a std_msgs/Int32 five", "[std_msgs/Int32] has int32 data"),
    ("rostopic pub -1 /a Int32 5", "did you mean std_msgs/Int32?"),
    ("rostopic pub -1 /a std_msgs/Int33 5", "did you mean std_msgs/Int32"),
    ("rostopic pub -r x /a std_msgs/Int32 5", "rate must be a number"),
    ("rostopic info /nope", "topic [/nope] not found"),
    ("rosservice call /nope", "service [/nope] not found"),
    ("rosservice args", "the following arguments are required: service"),
    ("rosnode kill /nope", "node [/nope] not found"),
    ("rosnode info nope", "node [/nope] not found"),
    ("rosnode lsit", "did you mean list?"),
    ("rosparam get nope", "parameter [/nope] not found"),
    ("rosparam set", "the following arguments are required: parameter"),
    ("rosparam load nope.yaml", "nope.yaml"),
    ("rosbag play nope.bag", "bag [nope.bag] not found"),
    ("rosbag record", "You must specify a topic name"),
    ("rosbag inof x.bag", "did you mean info?"),
    ("rosmsg show geometry_msgs/Twits", "did you mean geometry_msgs/Twist?"),
    ("rosmsg show geometry_msgs", "it is a package: `rosmsg package geometry_msgs`"),
    ("rossrv show std_srvs/Setbool", "did you mean std_srvs/SetBool?"),
    ("rospack find rpi_fero", "did you mean rpi_feros"),
    ("catkin_make", "The specified source space does not exist"),
    ("catkin_create_pkg My,Package", "is not a name for a package"),
    ("catkin_create_pkg", "the following arguments are required: name"),
    ("roscore", "another roscore/master is already running"),
    ("minirospy demoo", "did you mean demo?"),
    ("minirospy board press 99", "pin 99 does not exist: BCM numbers are 0 to 53"),
    ("minirospy board press", "the following arguments are required: pin"),
    ("minirospy board prss 11", "did you mean press?"),
    ("xacro nope.xacro", "nope.xacro"),
    ("minirospy python nope.py", "nope.py"),
]


@pytest.mark.parametrize(("line", "answer"), TYPED, ids=[line for line, _ in TYPED])
def test_typed_mistake_is_answered_in_its_last_line(
    line: str, answer: str, tmp_path: Path, master: str
) -> None:
    done = typed(*line.split(), folder=tmp_path)
    text = done.stdout + done.stderr
    assert "Traceback" not in text
    assert answer in text.splitlines()[-1]
