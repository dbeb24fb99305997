"""rostopic: output as in real ROS, exit statuses, and streams that are closed quietly."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

import genpy
import pytest
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool, String

from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import modules_loaded_by
from tests.waiting import wait_until

from .conftest import own_lines

Start = Callable[[Sequence[str]], "subprocess.Popen[str]"]


def test_list(robot: Any, command: Any) -> None:
    assert command("rostopic", "list") == (0, "/any\n/button_state\n/listen\n/ns/chatter\n/poly\n", "")
    assert command("rostopic", "list", "-p").out == "/button_state\n/ns/chatter\n/poly\n"
    assert command("rostopic", "list", "-s").out == "/any\n/listen\n"
    assert command("rostopic", "list", "/ns").out == "/ns/chatter\n"
    assert command("rostopic", "list", "ns").out == "/ns/chatter\n"
    assert command("rostopic", "list", "/nope").out == "\n"
    assert command("rostopic", "list", "-v").out == (
        "\nPublished topics:\n * /button_state [std_msgs/Bool] 1 publisher\n"
        " * /ns/chatter [std_msgs/String] 1 publisher\n * /poly [geometry_msgs/PolygonStamped] 1 publisher\n"
        "\nSubscribed topics:\n * /listen [std_msgs/Bool] 1 subscriber\n * /any [unknown type] 1 subscriber\n\n"
    )
    assert command("rostopic", "list", "-v", "-p", "ns").out == (
        "\nPublished topics:\n * /ns/chatter [std_msgs/String] 1 publisher\n\n"
    )
    assert command("rostopic", "list", "-v", "-s", "/listen").out == (
        "\nSubscribed topics:\n * /listen [std_msgs/Bool] 1 subscriber\n\n"
    )
    assert command("rostopic", "list", "--host", "/ns").out == "Host [localhost]:\n  /ns/chatter\n"
    assert command("rostopic", "list", "-p", "-s").status == 2


def test_info_and_type(robot: Any, command: Any) -> None:
    uri = robot.node.uri
    assert command("rostopic", "info", "button_state") == (
        0,
        f"Type: std_msgs/Bool\n\nPublishers: \n * /robot ({uri})\n\nSubscribers: None\n\n\n",
        "",
    )
    assert (
        f"Publishers: None\n\nSubscribers: \n * /robot ({uri})\n\n\n"
        in command("rostopic", "info", "/any").out
    )
    assert command("rostopic", "type", "/button_state").out == "std_msgs/Bool\n"
    field = command("rostopic", "type", "/poly/header/stamp")
    assert field.out == "geometry_msgs/PolygonStamped header/stamp time\n"
    assert command("rostopic", "find", "std_msgs/Bool").out == "/button_state\n/listen\n"
    assert command("rostopic", "find", "std_msgs/Nope") == (0, "\n", "")


def test_names_that_are_not_there(robot: Any, command: Any) -> None:
    for verb in ("info", "type"):
        status, out, err = command("rostopic", verb, "/button_stat")
        assert (status, out) == (1, "")
        assert err == "rostopic: ERROR: topic [/button_stat] not found; did you mean /button_state?\n"
    assert command("rostopic", "type", "/poly/heder").err.startswith(
        "rostopic: ERROR: field [heder] not found; did you mean header?"
    )
    assert "type of topic [/any] not found" in command("rostopic", "type", "/any").err


def test_help_and_wrong_words(command: Any) -> None:
    status, out, _ = command("rostopic", "-h")
    assert status == 64
    assert "\trostopic echo\tprint messages to screen\n" in out
    overview = out
    assert command("rostopic") == (64, overview, "")
    for verb in ("bw", "delay", "echo", "find", "hz", "info", "list", "pub", "type"):
        status, out, _ = command("rostopic", verb, "-h")
        assert status == 0
        assert out.lower().startswith(f"usage: rostopic {verb}")
        assert f"\trostopic {verb}\t" in command("rostopic", "-h").out
    status, out, err = command("rostopic", "lst")
    assert (status, out) == (64, overview)
    assert (
        err
        == "rostopic: ERROR: unknown command `rostopic lst`; did you mean list? (`rostopic -h` shows what there is)\n"
    )
    assert command("rostopic", "list", "--bad").status == 2


@pytest.mark.parametrize(
    "argv",
    [
        ["list"], ["list", "-v"], ["info", "/a"], ["type", "/a"], ["find", "std_msgs/Bool"], ["echo", "/a"],
        ["hz", "/a"], ["bw", "/a"], ["delay", "/a"], ["pub", "-1", "/a", "std_msgs/Bool", "True"],
    ],
)  # fmt: skip
def test_without_a_master_it_says_so(command: Any, argv: list[str]) -> None:
    status, out, err = command("rostopic", *argv)
    assert (status, out) == (1, "")
    assert err == "ERROR: Unable to communicate with master!\n"


def test_echo(robot: Any, command: Any) -> None:
    assert command("rostopic", "echo", "-n1", "/button_state") == (0, "data: True\n---\n", "")
    assert command("rostopic", "echo", "/ns/chatter", "-n", "1").out == 'data: "hello"\n---\n'
    assert command("rostopic", "echo", "-n1", "/ns/chatter/data").out == '"hello"\n---\n'
    assert command("rostopic", "echo", "-n1", "/poly/polygon/points[0]/x").out == "1.0\n---\n"
    assert command("rostopic", "echo", "-n1", "/poly/polygon/points[:]/y").out == "[2.0, 5.0]\n---\n"
    assert command("rostopic", "echo", "-c", "-n1", "/button_state").out == "\033[2J\033[;Hdata: True\n---\n"
    assert command("rostopic", "echo", "-p", "-n1", "/poly/polygon").out.startswith("%time,field.points0.x,")
    assert command("rostopic", "echo", "--nostr", "-n1", "/ns/chatter").out == (
        'data: "<string length: 5>"\n---\n'
    )
    assert command("rostopic", "echo", "--filter", "m.data", "-n1", "/button_state").status == 0


def test_echo_that_cannot_be(robot: Any, command: Any) -> None:
    status, out, err = command("rostopic", "echo", "/button_state/dta")
    assert (status, out) == (1, "")
    assert "did you mean data?" in err
    assert command("rostopic", "echo", "--filter", "m.(", "/button_state").status == 2
    assert "AttributeError" in command("rostopic", "echo", "--filter", "m.x", "/button_state").err
    assert command("rostopic", "echo", "-n", "x", "/button_state").status == 2
    assert command("rostopic", "delay", "/button_state").err.startswith("rostopic: ERROR: header")


def test_echo_waits_for_a_publisher_and_follows_it(robot: Any, program: Start) -> None:
    echo = program(["rostopic", "echo", "-n2", "/late"])
    assert echo.stderr is not None
    assert echo.stderr.readline() == "WARNING: topic [/late] does not appear to be published yet\n"
    pub = program(["rostopic", "pub", "-r", "10", "/late", "std_msgs/Bool", "data: True"])
    out, _ = echo.communicate(timeout=30)
    assert (echo.returncode, out) == (0, "data: True\n---\ndata: True\n---\n")
    _interrupt(pub)
    assert pub.communicate(timeout=30) == ("", "")
    assert pub.returncode == 0


def test_pub_the_workshops_way(robot: Any, program: Start) -> None:
    """`rostopic pub /t type "data: True"` latches the message, until Ctrl-C."""
    pub = program(["rostopic", "pub", "/listen", "std_msgs/Bool", "data: True"])
    assert pub.stdout is not None
    assert pub.stdout.readline() == "publishing and latching message. Press ctrl-C to terminate\n"
    wait_until(lambda: robot.heard == [b"\x01"])
    _interrupt(pub)
    assert pub.communicate(timeout=30) == ("", "")
    assert pub.returncode == 0


def test_pub_once(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[float] = []

    def wait(_: ToolNode, seconds: float) -> bool:
        # On a busy machine, a subscriber may take longer.
        waits.append(seconds)
        wait_until(lambda: len(robot.heard) == len(waits))
        return False

    with monkeypatch.context() as patched:
        patched.setattr(ToolNode, "wait", wait)
        words = ("std_msgs/Bool", "data: True")
        assert command("rostopic", "pub", "-1", "/listen", *words).out == (
            "publishing and latching message for 3.0 seconds\n"
        )
        verbose = command("rostopic", "pub", "/listen", "-v", "std_msgs/Bool", "False", "--once")
        assert verbose.out == "publishing and latching [data: False] for 3.0 seconds\n"
    assert waits == [3.0, 3.0]
    assert robot.heard == [b"\x01", b"\x00"]
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.1)
    for words in (
        ("geometry_msgs/Point", "1", "-2.5", "-3"),
        ("std_msgs/Float32", "-0.5"),
        ("std_msgs/Empty",),
    ):
        assert command("rostopic", "pub", "-1", "/other", *words).status == 0


def test_pub_from_standard_input_and_file(
    robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.REGISTERED_CONNECT_SECONDS", 60.0)
    file = tmp_path / "messages.yaml"
    file.write_text("data: True\n---\ndata: False\n---\n")
    pub = ("pub", "-r", "50", "/listen", "std_msgs/Bool")
    assert command("rostopic", *pub, "-f", str(file)).status == 0
    monkeypatch.setattr(sys, "stdin", io.StringIO("data: True\n"))
    assert command("rostopic", *pub).status == 0
    wait_until(lambda: robot.heard == [b"\x01", b"\x00", b"\x01"])
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    assert "please specify message values: data" in command("rostopic", *pub).err
    assert "file [nope.yaml] not found" in command("rostopic", *pub, "-f", "nope.yaml").err


@pytest.mark.parametrize(
    ("argv", "status", "why"),
    [
        (["/t", "std_msgs/Bol", "True"], 1, "did you mean std_msgs/Bool"),
        (["/t", "Bool", "True"], 1, "did you mean std_msgs/Bool"),
        (["/t", "std_msgs/Bool", "datum: True"], 1, "No field name [datum] ([std_msgs/Bool] has bool data)"),
        (["/t", "std_msgs/Bool", "data: [1"], 2, "'data: [1': "),
        (["/t", "std_msgs/Int32", "hi"], 1, "([std_msgs/Int32] has int32 data)"),
        (
            ["/t", "std_msgs/Bool", "data:True"],
            1,
            'behind the colon of "data:" belongs a blank ([std_msgs/Bool]',
        ),
        (["/t", "geometry_msgs/Twist", "linear:{x: 1}"], 1, 'behind the colon of "linear:" belongs a blank'),
        (["/t", "std_msgs/Bool", "data:", "True"], 1, "quotes belong around the whole of a message"),
        (["/t", "/Bool", "True"], 1, "did you mean std_msgs/Bool?"),
        (["-5", "/t", "std_msgs/Bool", "True"], 1, "message type [/t] not found"),
        (["/t", "std_msgs/String", "5"], 1, "needs its own quotes: \"'5'\""),
        (["/t", "std_msgs/Float64", "1e-3"], 1, "numbers like 1.0e-3"),
        (["/b-ad", "std_msgs/Bool", "True"], 2, "topic [/b-ad]: that is not a legal name"),
        (["/t"], 2, "arguments are required"),
        (["-r", "0", "/t", "std_msgs/Bool", "True"], 2, "greater than zero"),
        (["-r", "-5", "/t", "std_msgs/Bool", "True"], 2, "greater than zero"),
        (["-r", "-1", "/t", "std_msgs/Bool", "True"], 2, "greater than zero"),
        (["-r", "fast", "/t", "std_msgs/Bool", "True"], 2, "must be a number"),
    ],
)
def test_pub_that_cannot_be(master: str, command: Any, argv: list[str], status: int, why: str) -> None:
    result = command("rostopic", "pub", *argv)
    assert (result.status, result.out) == (status, "")
    assert why in result.err
    assert len(own_lines(result.err)) == 1


def test_pub_of_another_type_is_warned_of(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.1)
    result = command("rostopic", "pub", "-1", "/listen", "std_msgs/String", "x")
    assert (
        "WARNING: topic [/listen] is of type [std_msgs/Bool] already, not [std_msgs/String]\n" in result.err
    )


def test_pub_without_subscribers_suggests_a_similar_topic(
    robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.1)
    misspelt = command("rostopic", "pub", "-1", "/lisen", "std_msgs/Bool", "true")
    assert misspelt.status == 0
    assert misspelt.err == "WARNING: topic [/lisen] has no subscribers yet; did you mean /listen?\n"
    for topic in ("/late", "/listen2"):
        assert command("rostopic", "pub", "-1", topic, "std_msgs/Bool", "true").err == ""


def test_hz_and_bw(robot: Any, program: Start) -> None:
    rate = program(["rostopic", "hz", "/ns/chatter"])
    width = program(["rostopic", "bw", "/ns/chatter"])
    for stream in (rate, width):
        assert stream.stdout is not None
        assert stream.stdout.readline() == "subscribed to [/ns/chatter]\n"
    assert rate.stdout is not None
    assert width.stdout is not None
    heard = threading.Event()

    def publish_until_heard() -> None:
        while not heard.wait(0.05):
            robot.publish("/ns/chatter", String("hello"))

    feeder = threading.Thread(target=publish_until_heard)
    feeder.start()
    try:
        average = 0.0
        # A stall of the machine distorts an average only briefly.
        while not 5.0 < average < 40.0:
            line = rate.stdout.readline()
            while not line.startswith("average rate: "):
                assert line == "no new messages\n"
                line = rate.stdout.readline()
            average = float(line.split()[-1])
            spread = rate.stdout.readline()
        assert spread.startswith("\tmin: 0.")
        line = width.stdout.readline()
        while line == "no new messages\n":
            line = width.stdout.readline()
        assert line.startswith("average: ")
        assert width.stdout.readline().startswith("\tmean: 9.00B min: 9.00B max: 9.00B window: ")
    finally:
        heard.set()
        feeder.join()
    for stream in (rate, width):
        _interrupt(stream)
        assert stream.communicate(timeout=30)[1] == ""
        assert stream.returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="needs a Unix pipe")
def test_a_closed_pipe_is_quiet(robot: Any, program: Start) -> None:
    """The reader closes the pipe, as in `rostopic echo | head -1`."""
    echo = program(["rostopic", "echo", "/button_state"])
    assert echo.stdout is not None
    assert echo.stderr is not None
    assert echo.stdout.readline() == "data: True\n"
    echo.stdout.close()

    def has_ended() -> bool:
        robot.publish("/button_state", Bool(True))
        return echo.poll() is not None

    wait_until(has_ended, pause=0.02)
    assert echo.returncode == 0
    assert echo.stderr.read() == ""
    echo.stdout = None


def test_rosnode_kill_ends_a_stream(robot: Any, program: Start, command: Any) -> None:
    echo = program(["rostopic", "echo", "/button_state"])
    assert echo.stdout is not None
    assert echo.stdout.readline() == "data: True\n"
    (name,) = [each for each in command("rosnode", "list").out.split() if each.startswith("/rostopic_")]
    assert command("rosnode", "kill", name).status == 0
    assert echo.wait(30) == 0


def test_list_imports_little(robot: Any) -> None:
    heavy = {"asyncio", "yaml", "numpy", "logging", "std_msgs", "genpy", "xmlrpc"}
    others = {f"minirospy.ros.rostopic.commands.rostopic_{verb}" for verb in ("pub", "rates")}
    code = "from minirospy.ros.rostopic.commands.rostopic import main; assert main(['list']) == 0"
    assert not (heavy | others) & modules_loaded_by(code)


def _interrupt(process: subprocess.Popen[str]) -> None:
    """Send Ctrl-C."""
    process.send_signal(signal.SIGINT if sys.platform != "win32" else signal.SIGTERM)


def test_echo_options_that_cannot_be(master: str, command: Any) -> None:
    for words, why in (
        (["-w", "1", "/t"], "the fixed width of numbers is at least 2"),
        (["-a", "/t"], "it needs -b"),
        ([], "a topic is missing"),
        (["--fliter", "m.data", "/t"], "did you mean --filter?"),
    ):
        result = command("rostopic", "echo", *words)
        assert (result.status, result.out) == (2, "")
        assert why in result.err
    assert command("rostopic", "echo", "-n", "0", "/t") == (0, "", "")


def test_pub_options_that_exclude_each_other(master: str, command: Any) -> None:
    for words in (["-1", "-r", "5", "/t", "std_msgs/Bool", "1"], ["-f", "x", "/t", "std_msgs/Bool", "1"]):
        result = command("rostopic", "pub", *words)
        assert (result.status, result.out) == (2, "")
        assert "exclude each other" in result.err


def test_pub_of_the_empty_text(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.1)
    result = command("rostopic", "pub", "-1", "-v", "/t", "std_msgs/String", "")
    assert result == (0, "publishing and latching [data: ''] for 0.1 seconds\n", "")


@pytest.mark.skipif(sys.platform == "win32", reason="needs a Unix pipe")
def test_pub_of_a_pipe_that_stays_open(robot: Any, program: Start) -> None:
    """In `rostopic echo /a | rostopic pub /b TYPE`, each message is published when it arrives, not at the end of the input."""
    pub = program(["rostopic", "pub", "/listen", "std_msgs/Bool"])
    assert pub.stdin is not None
    for text, heard in (("data: True\n---\n", [b"\x01"]), ("data: False\n---\n", [b"\x01", b"\x00"])):
        pub.stdin.write(text)
        pub.stdin.flush()
        wait_until(lambda expected=heard: robot.heard == expected)  # type: ignore[misc]


@pytest.mark.skipif(sys.platform == "win32", reason="SIGTERM ends a process there immediately")
def test_a_killed_tool_does_not_stay_registered(robot: Any, program: Start, command: Any) -> None:
    pub = program(["rostopic", "pub", "/listen", "std_msgs/Bool", "True"])
    wait_until(lambda: robot.heard == [b"\x01"])
    pub.terminate()
    assert pub.wait(30) == 0
    assert command("rosnode", "list").out == "/robot\n"


def test_time_by_the_clock_topic(robot: Any, program: Start) -> None:
    """With /use_sim_time, `now` and the arrival time are read from /clock."""
    with closing(MasterProxy(robot.node.environment.master_uri, "/test")) as master:
        master.set_param("/use_sim_time", True)
    type_ = InterfaceType(Clock._type, Clock._md5sum, Clock._full_text)
    robot.loop.run(robot.node.advertise(Publication("/clock", type_, latch=True)))
    robot.publish("/clock", Clock(genpy.Time(100)))
    row = program(["rostopic", "echo", "-p", "-n1", "/button_state"])
    now = program(["rostopic", "pub", "-1", "-v", "--use-rostime", "/t", "std_msgs/Time", "now"])
    # This node uses and echoes /clock with a single subscription.
    clock = program(["rostopic", "echo", "-n1", "/clock"])

    assert clock.communicate(timeout=30)[0] == "clock: \n  secs: 100\n  nsecs:         0\n---\n"
    out, err = row.communicate(timeout=30)
    # The message may arrive before the first time on /clock.
    assert re.fullmatch(r"%time,field.data\n(100000000000|0),1\n", out)
    assert err == "WARNING: may be using simulated time\n"
    assert now.stdout is not None
    assert [now.stdout.readline() for _ in range(3)] == [
        "publishing and latching [data: \n", "  secs: 100\n", "  nsecs:         0] for 3.0 seconds\n"
    ]  # fmt: skip


def test_hz_of_a_field_and_bw_of_several_topics(robot: Any, program: Start) -> None:
    rate = program(["rostopic", "hz", "/poly/header"])
    width = program(["rostopic", "bw", "/poly", "/ns/chatter"])
    assert rate.stdout is not None
    assert width.stdout is not None
    assert rate.stdout.readline() == "subscribed to [/poly]\n"
    assert [width.stdout.readline() for _ in range(2)] == [
        "subscribed to [/poly]\n", "subscribed to [/ns/chatter]\n"
    ]  # fmt: skip
    line = "no new messages\n"
    while line == "no new messages\n":
        for _ in range(3):
            robot.publish("/ns/chatter", String("hello"))
        line = width.stdout.readline()
    assert line.split() == ["topic", "bandwidth", "mean", "min", "max", "window"]


def test_the_words_that_a_launch_file_adds(robot: Any, command: Any, program: Start) -> None:
    """For `<node pkg="rostopic" type="rostopic" args="pub ..."/>` these are __name:=, __ns:=, __log:= and remappings."""
    everything = command("rostopic", "list").out
    assert command("rostopic", "list", "__name:=x", "__log:=/x.log", "_p:=1").out == everything
    assert command("rostopic", "type", "chatter", "__ns:=ns").out == "std_msgs/String\n"
    assert command("rostopic", "type", "a", "a:=/ns/chatter").out == "std_msgs/String\n"
    assert command("rostopic", "echo", "-n1", "a", "a:=button_state") == (0, "data: True\n---\n", "")
    assert command("rostopic", "list", "__master:=http://localhost:1").status == 1
    assert command("rosservice", "type", "b", "b:=/fail", "__name:=x").out == "std_srvs/Trigger\n"
    pub = program(
        ["rosrun", "rostopic", "rostopic", "pub", "a", "std_msgs/Bool", "True", "a:=/listen", "__name:=fake"]
    )
    wait_until(lambda: robot.heard == [b"\x01"])
    assert command("rosnode", "list").out == "/fake\n/robot\n"
    _interrupt(pub)
    assert pub.wait(30) == 0


def test_a_value_is_no_remapping(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.1)
    result = command("rostopic", "pub", "-1", "-v", "/t", "std_msgs/String", "data: 'x:=1'")
    assert result == (0, 'publishing and latching [data: "x:=1"] for 0.1 seconds\n', "")


@pytest.mark.parametrize(
    "text", ["[" * 20_000, "[" * 20_000 + "]" * 20_000, "2001-99-99"], ids=["open", "closed", "no date"]
)
def test_argument_that_yaml_cannot_hold_is_misuse(master: str, command: Any, text: str) -> None:
    done = command("rostopic", "pub", "-1", "/f", "std_msgs/String", text)
    assert done.status == 2
    assert len(own_lines(done.err)) == 1


@pytest.mark.skipif(os.name == "nt", reason="select() supports only sockets on Windows")
def test_documents_on_stdin_are_read_as_soon_as_they_arrive() -> None:
    """Several lines in one write do not wait in a buffer until the next write."""
    program = "import rostopic\nfor document in rostopic.stdin_yaml_arg():\n    print(document, flush=True)\n"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdin
        assert process.stdout
        process.stdin.write("a: \xe4\n---\nb: 1\n---\nc: ".encode())
        process.stdin.flush()
        assert process.stdout.readline().decode() == "{'a': '\xe4'}\n"
        assert process.stdout.readline() == b"{'b': 1}\n"
        process.stdin.write(b"2\n---\nd: 1\n")
        process.stdin.close()
        assert process.stdout.read() == b"{'c': 2}\n"
