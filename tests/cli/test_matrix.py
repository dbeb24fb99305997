"""Every command and verb with every kind of failure: one clear line, the documented status, no traceback, no hang.

The rows are the commands' own lists (pyproject.toml, and each command's help), so a verb without a row in ``ROWS`` fails.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
import signal
import socket
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from roscpp.srv import GetLoggers, GetLoggersResponse
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from minirospy.cli.registry import console_scripts
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.rpc import master_proxy
from minirospy.runtime.rpc.client import RpcClient
from minirospy.runtime.rpc.master_proxy import MasterProxy

from .conftest import Result, Robot, without_ros_words

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(sys.platform == "win32", reason="pipes, signals and devices of Unix")


class Row(NamedTuple):
    """The words that follow a verb in each case.

    ``good``: works on the graph of the fixture ``graph``; None if the command starts a program or a
    master. ``unknown``: a name that does not exist; "" if the verb takes no name. ``dead``: refers to the node that does
    not respond. ``uses_master``: the verb needs a master. ``streams``: the verb runs until Ctrl-C. ``quiet``: an unknown name
    gives an empty result, as in a search. ``waits``: the verb waits for the name, with a warning.
    """

    good: str | None = ""
    unknown: str = ""
    dead: str = ""
    uses_master: bool = True
    streams: bool = False
    quiet: bool = False
    waits: bool = False


class Kind(NamedTuple):
    """A kind of definition, and the types that its rows use."""

    known: str
    unknown: str


ROWS = {
    "rostopic bw": Row("/button_state", "/nope", streams=True, waits=True),
    "rostopic delay": Row("/poly", "/nope", streams=True, waits=True),
    "rostopic echo": Row("-n1 /button_state", "/nope", waits=True),
    "rostopic find": Row("std_msgs/Bool", "std_msgs/Nope", quiet=True),
    "rostopic hz": Row("/button_state", "/nope", streams=True, waits=True),
    "rostopic info": Row("/button_state", "/nope"),
    "rostopic list": Row("-v"),
    "rostopic pub": Row("-1 /t std_msgs/Bool 1", "-1 /t std_msgs/Nope 1"),
    "rostopic type": Row("/button_state", "/nope"),
    "rosnode ping": Row("-c1 /robot", "/nope", "-c1 /ghost"),
    "rosnode list": Row(""),
    "rosnode info": Row("/robot", "/nope", "/ghost"),
    "rosnode machine": Row("", "nope.invalid"),
    "rosnode kill": Row("/robot", "/nope"),
    "rosnode cleanup": Row(""),
    "rosservice args": Row("/set_led_state", "/nope", "/haunt"),
    "rosservice call": Row("/set_led_state 1", "/nope 1", "/haunt"),
    "rosservice find": Row("std_srvs/SetBool", "std_srvs/Nope", quiet=True),
    "rosservice info": Row("/set_led_state", "/nope", "/haunt"),
    "rosservice list": Row(""),
    "rosservice type": Row("/set_led_state", "/nope", "/haunt"),
    "rosservice uri": Row("/set_led_state", "/nope"),
    "rosparam set": Row("-v /p 1", "-t /nope.txt /p"),
    "rosparam get": Row("/text", "/nope"),
    "rosparam load": Row("- /q", "/nope.yaml"),
    "rosparam dump": Row("", "- /nope"),
    "rosparam delete": Row("-v /text", "/nope"),
    "rosparam list": Row(""),
    "rosconsole get": Row("/robot rosout", "/nope rosout", "/ghost rosout"),
    "rosconsole list": Row("/robot", "/nope", "/ghost"),
    "rosconsole set": Row(None, "/nope rosout info", "/ghost rosout info"),
    "rosconsole echo": Row("-l debug", "/nope", streams=True, waits=True),
    "rosgraph": Row("", streams=True),
    "rosmsg-proto": Row("msg std_msgs/Bool", "msg std_msgs/Nope", uses_master=False),
    "rosclean check": Row("", uses_master=False),
    "rosclean purge": Row("", uses_master=False),
    "rosversion": Row("rospy", "nope", uses_master=False),
    "rosrun": Row(None, "std_msgs nope", uses_master=False),
    "roscore": Row(None, uses_master=False),
    "rosmaster": Row(None, uses_master=False),
    "minirospy": Row("-V", "nope", uses_master=False),
    **{
        f"{command} {verb}": row
        for command, kind in (
            ("rosmsg", Kind("std_msgs/Bool", "std_msgs/Nope")),
            ("rossrv", Kind("std_srvs/SetBool", "std_srvs/Nope")),
        )
        for verb, row in {
            "show": Row(kind.known, kind.unknown, uses_master=False),
            "info": Row(kind.known, kind.unknown, uses_master=False),
            "list": Row("", uses_master=False),
            "md5": Row(kind.known, kind.unknown, uses_master=False),
            "package": Row(kind.known.partition("/")[0], "nope", uses_master=False),
            "packages": Row("", uses_master=False),
        }.items()
    },
}

ELSEWHERE = re.compile(
    r"ros(bag|dep|pack|stack|launch|wtf|test|unit)|catkin|xacro|check_urdf|urdf_to|rqt|rviz|smach_viewer"
)
"""Commands that have matrices or tests of their own."""

# exit status without a master, if it is not 1; the same as in ROS
MASTERLESS_STATUS = {"rosservice": 2, "rosgraph": 0}

USAGE_ERROR = 2
EX_USAGE = 64  # ROS's exit status for an unknown verb

# Exit status for a name that does not exist, if it is not 1; the same as in ROS.
ROS_STATUS = {
    "minirospy": USAGE_ERROR,
    "rosservice args": 2,
    "rosservice call": 2,
    "rosparam set": USAGE_ERROR,
    "rosnode ping": 0,
    "rosnode info": 0,
    "rosrun": 3,
    "rosmsg package": EX_USAGE,
    "rossrv package": EX_USAGE,
}

# Stderr of commands that succeed: the nodes that do not respond.
REPORTED_BY_ROS = {"rosnode cleanup": "ERROR: connection refused to [http://localhost:1/]\n"}

# exit status of a usage error, if it is not 2; the same as in ROS
USAGE_STATUS = {"rosbag": 0, "rosgraph": 255}

GRAPH = [name for name, row in ROWS.items() if row.uses_master]


def scripts() -> dict[str, tuple[str, str]]:
    """Return the installed commands, as a dict from name to module and function."""
    found = {name: target.partition(":") for name, target in console_scripts().items()}
    return {name: (module, function) for name, (module, _, function) in found.items()}


class Recorded(io.StringIO):
    """Records a command's output; ``on_text`` is called with each string."""

    def __init__(self, on_text: Callable[[], object] = lambda: None) -> None:
        super().__init__()
        self._on_text = on_text

    def write(self, text: str) -> int:
        count = super().write(text)
        self._on_text()
        return count


class Terminal(Recorded):
    """Records the output on a terminal, where commands print more than ROS if there is no master."""

    def isatty(self) -> bool:
        return True


def run(line: str, **streams: Any) -> Result:
    """Run a command in this process; ``stdin``, ``stdout`` and ``stderr`` replace its own."""
    words = line.split()
    module, function = scripts()[words[0]]
    main = getattr(importlib.import_module(module), function)
    put = {"stdin": io.StringIO("d: 1\n"), "stdout": Recorded(), "stderr": Recorded(), **streams}
    before = {name: getattr(sys, name) for name in put}
    for name, stream in put.items():
        setattr(sys, name, stream)

    try:
        status = main(words[1:])
    except SystemExit as ended:
        status = ended.code
    finally:
        for name, stream in before.items():
            if getattr(sys, name) is not put[name]:
                getattr(sys, name).close()  # the command's own stream, which replaced a closed one
            setattr(sys, name, stream)

    return Result(
        status,
        *(put[name].getvalue() if isinstance(put[name], Recorded) else "" for name in ("stdout", "stderr")),
    )


def usage_out(line: str) -> str:
    """Return the stdout of a usage error, which is empty except for rosgraph."""
    return run("rosgraph -h").out.partition("usage: ")[0] if line == "rosgraph" else ""


def one_line(result: Result, line: str) -> str:
    """Return the command's own line on stderr, without its start; only ROS's usage and error may precede it."""
    name = line.split(maxsplit=1)[0]
    match = re.fullmatch(rf"{name}: ERROR: ([^\n]*)\n", without_ros_words(result.err))
    assert match, (line, result)
    return match[1]


def verbs(name: str) -> list[str]:
    """Return the verbs in a command's help."""
    return re.findall(rf"^\t{name} (\S+)\t", run(f"{name} -h").out, re.M)


@pytest.fixture(scope="module")
def lines() -> list[str]:
    """Return the commands and their verbs, as the help lists them."""
    found = []
    for name in scripts():
        if not ELSEWHERE.match(name):
            found += [f"{name} {verb}" for verb in verbs(name)] or [name]
    return found


@pytest.fixture
def graph(robot: Robot, master: str, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Return the robot, with loggers and a parameter. /ghost exists only as registrations of services and topics."""
    loggers = GetLoggersResponse()
    loggers.loggers.append(importlib.import_module("roscpp.msg").Logger("rosout", "info"))
    answer = io.BytesIO()
    loggers.serialize(answer)
    server = robot.node.make_service(
        "/robot/get_loggers", InterfaceType(GetLoggers._type, GetLoggers._md5sum), lambda *_: answer.getvalue(),
        request_type=GetLoggers._request_class._type, response_type=GetLoggers._response_class._type,
    )  # fmt: skip
    robot.loop.run(robot.node.serve(server))
    log = InterfaceType(Log._type, Log._md5sum, Log._full_text)
    robot.loop.run(robot.node.advertise(Publication("/rosout", log, latch=True)))
    robot.publish("/rosout", Log(level=Log.ERROR, name="/robot", msg="it hurts"))

    with contextlib.closing(MasterProxy(master, "/ghost")) as ghost:
        ghost.register_publisher("/boo", "std_msgs/Bool", "http://localhost:1/")
        for service in ("/haunt", "/ghost/get_loggers"):
            ghost.register_service(service, "rosrpc://localhost:1", "http://localhost:1/")
        ghost.set_param("/text", "日本")

    monkeypatch.setattr("minirospy.ros.rostopic.commands.rostopic_pub.LATCH_SECONDS", 0.02)
    return robot


def _no_such_host(*_: object, **__: object) -> None:
    raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the time limits for calls to a master or node that does not respond."""
    monkeypatch.setattr(master_proxy, "RpcClient", lambda uri, *_, **__: RpcClient(uri, 0.05))


# --- usage errors


def test_every_verb_has_a_row(lines: list[str]) -> None:
    assert sorted(lines) == sorted(ROWS), "a new command needs a row in ROWS, or its name in ELSEWHERE"


def test_a_typo_in_the_verb(lines: list[str]) -> None:
    for name in {line.split()[0] for line in lines if " " in line}:
        for verb in verbs(name):
            result = run(f"{name} {verb[:-1]}x")
            assert result.status in (USAGE_ERROR, EX_USAGE)
            assert result.out == (run(f"{name} -h").out if result.status == EX_USAGE else "")
            assert re.search(rf"did you mean .*\b{verb}\b", one_line(result, name)) or len(verb) < 4


def test_a_typo_in_an_option(lines: list[str]) -> None:
    for line in lines:
        options = set(re.findall(r"(?<![\w-])--[a-z][\w-]+", run(f"{line} -h").out)) - {"--help"}
        for option in ("--nonsense", *sorted(options)):
            result = run(f"{line} {option}x")
            assert (result.status, result.out) == (USAGE_STATUS.get(line, USAGE_ERROR), usage_out(line)), line
            said = one_line(result, line)
            assert f"{option}x" in said
            assert (
                f"did you mean {option}?" in said or option == "--nonsense" or line in ("rosrun", "minirospy")
            )


def test_an_option_that_no_command_has() -> None:
    """Every installed command refuses an option that does not exist."""
    # xacro's errors about options are those of the xacro package.
    for name in scripts().keys() - {"xacro"}:
        result = run(f"{name} --nonsense")
        usage = USAGE_STATUS.get(name, 1 if name in ("rospack", "rosstack") else USAGE_ERROR)
        assert result.status in (usage, EX_USAGE), name
        assert result.status == EX_USAGE or result.out == usage_out(name)
        own = without_ros_words(result.err)
        assert re.fullmatch(rf"({name}: ERROR|\[{name}\] Error): [^\n]*--nonsense[^\n]*\n", own)


def test_a_missing_argument(lines: list[str]) -> None:
    """Arguments that the usage does not put in brackets are required."""
    for line in lines:
        usage = run(f"{line} -h").out.partition("\n\n")[0].partition(line)[2]
        while "[" in usage:
            usage = re.sub(r"\[[^][]*\](\.\.\.)?", "", usage)

        # These arguments are optional, although they are not in brackets in ROS's usage.
        if usage.split() and line not in (
            "minirospy",
            "rosgraph",
            "rosparam dump",
            *(
                f"{name} {verb}"
                for name in ("rosmsg", "rossrv")
                for verb in ("show", "info", "md5", "package")
            ),
        ):
            result = run(line)
            out = run("rosrun -h").out.partition("\n\n")[0] + "\n" if line == "rosrun" else ""
            assert (result.status, result.out) == (USAGE_ERROR, out), line
            one_line(result, line)


def test_the_other_name_of_each_command() -> None:
    """`minirospy topic` is the same as `rostopic`."""
    twins = {
        "master": "roscore",
        "make": "catkin_make",
        "demo": "",
        "board": "",
        "check": "",
        "shell": "",
        "complete": "",
        "doctor": "",
        "bridge": "",
        "fleet": "",
        "dashboard": "",
        "python": "",
    }
    for noun in re.findall(r"^  minirospy (\w+) ", run("minirospy -h").out, re.M):
        name = twins.get(noun, "ros" + noun)
        if name and not ELSEWHERE.match(name):
            ours, theirs = run(f"minirospy {noun} --nonsense"), run(f"{name} --nonsense")
            assert ours.status == theirs.status
            assert theirs.status in (USAGE_STATUS.get(name, USAGE_ERROR), EX_USAGE)
            assert name == "roscore" or ours == theirs


# --- what is not there

RULE = "-" * 80 + "\n"
ROS_OUTPUT = {
    "rosnode ping": "rosnode: node is [/nope]\n",
    "rosnode info": f"{RULE}Node [/nope]\nPublications: None\n\nSubscriptions: None\n\nServices: None\n\n",
    "rosversion": "Cannot locate [nope]\n",
    "rosrun": f"[rosrun] Couldn't find executable named nope below {ROOT / 'msgs' / 'std_msgs'}\n",
}
"""The real commands' stdout for a name that does not exist."""


@pytest.mark.parametrize("line", [name for name, row in ROWS.items() if row.unknown and not row.waits])
def test_unknown_name(line: str, graph: Robot) -> None:
    row = ROWS[line]
    result = run(f"{line} {row.unknown}")
    if row.quiet:
        assert result == (0, "\n", "")
    elif line == "rosmsg-proto":
        assert (result.status, result.err.count("\n")) == (1, 2)
    else:
        assert result.status == ROS_STATUS.get(line, 1)
        assert result.out == ROS_OUTPUT.get(line, "")
        assert "nope" in one_line(result, line).lower()


@pytest.mark.parametrize(
    ("uri", "status", "says"),
    [
        ("http://localhost:1", 1, "start one with `roscore`"),
        ("http://no-such-host.invalid:11311", 1, "the name [no-such-host.invalid] has no address here"),
        ("nonsense", 2, "is not of the form http://host:port"),
        ("http://localhost", 2, "is not of the form http://host:port"),
        ("http://localhost:99999", 2, "is not of the form http://host:port"),
        ("https://localhost:11311", 2, "is not of the form http://host:port"),
    ],
)
def test_no_master(uri: str, status: int, says: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    if "invalid" in uri:
        # A real lookup takes seconds without a network.
        monkeypatch.setattr(socket, "getaddrinfo", _no_such_host)

    for line in GRAPH:
        result = run(f"{line} {ROWS[line].good or ROWS[line].unknown}", stderr=Terminal())
        assert result.status == (MASTERLESS_STATUS.get(line.split()[0], 1) if status == 1 else 2), line
        ros_output = {"rosnode ping": "rosnode: node is [/robot]\n", "rosnode info": RULE}

        assert result.out == (ros_output.get(line, "") if status == 1 else ""), line
        said = one_line(result, line)
        assert uri in said
        assert says in said


@pytest.mark.usefixtures("impatient")
def test_a_master_that_accepts_and_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{silent.getsockname()[1]}")
        for line in GRAPH:
            result = run(f"{line} {ROWS[line].good or ROWS[line].unknown}", stderr=Terminal())
            assert result.status == MASTERLESS_STATUS.get(line.split()[0], 1), line
            assert "no ROS master answers" in one_line(result, line)


def test_a_web_server_in_the_place_of_the_master(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{server.getsockname()[1]}")

        def serve() -> None:
            while True:
                try:
                    peer, _ = server.accept()
                except OSError:
                    return
                with peer:
                    peer.recv(4096)
                    peer.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 6\r\n\r\nnothing"[:-1])

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            for line in GRAPH:
                result = run(f"{line} {ROWS[line].good or ROWS[line].unknown}")
                assert result.status == 1, line
                one_line(result, line)
        finally:
            server.shutdown(socket.SHUT_RDWR)
            thread.join()


@pytest.mark.parametrize("line", [name for name, row in ROWS.items() if row.dead])
def test_a_node_that_does_not_answer(line: str, graph: Robot) -> None:
    result = run(f"{line} {ROWS[line].dead}")
    assert result.status == {"rosnode ping": 0}.get(line, 2 if line.startswith("rosservice") else 1)
    said = one_line(result, line)
    assert "does not answer at" in said
    assert "`rosnode cleanup` forgets nodes that have ended" in said


# --- streams that are closed, full, or cannot encode


PRINTING = [name for name, row in ROWS.items() if row.good is not None]


@posix
@pytest.mark.parametrize("line", PRINTING)
def test_a_closed_pipe(line: str, graph: Robot) -> None:
    """The reader closes the pipe, as `| head -1` does."""
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w", encoding="utf-8") as pipe:
        result = run(f"{line} {ROWS[line].good}", stdout=pipe)
    assert (result.status, result.err) == (0, REPORTED_BY_ROS.get(line, ""))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="Linux has it")
@pytest.mark.parametrize("line", PRINTING)
def test_a_full_disk(line: str, graph: Robot) -> None:
    full = open("/dev/full", "w", encoding="utf-8")  # noqa: SIM115 to close it fails, too
    try:
        result = run(f"{line} {ROWS[line].good}", stdout=full)
    finally:
        with contextlib.suppress(OSError):
            full.close()
    if result.status:
        assert (result.status, "No space left on device" in one_line(result, line)) == (1, True)
    else:
        assert not run(f"{line} {ROWS[line].good}").out


@pytest.mark.parametrize("line", [name for name in PRINTING if not ROWS[name].streams])
def test_closed_streams(line: str, graph: Robot) -> None:
    """The streams are closed, as by `<&- >&- 2>&-`, or in a Windows program without a console."""
    words = f"{line} {ROWS[line].good}"
    assert run(words, stdin=None, stdout=None).err == REPORTED_BY_ROS.get(line, "")
    assert run(words, stdin=None, stdout=None, stderr=None).status in (0, 1)


def test_an_output_that_cannot_encode(graph: Robot) -> None:
    graph.publish("/ns/chatter", String("日本"))
    for line, shown in (
        ("rosparam get /text", rb'"\u65E5\u672C"'),
        ("rosparam get -p /text", rb"\u65e5\u672c"),
        ("rosparam dump", rb'text: "\u65E5\u672C"'),
        ("rostopic echo -n1 /ns/chatter", rb'data: "\u65E5\u672C"'),
        ("rostopic echo -n1 -p /ns/chatter", rb"\u65e5\u672c"),
        ("rostopic pub -1 -v /t std_msgs/String 日本", rb'[data: "\u65E5\u672C"]'),
    ):
        raw = io.BytesIO()
        stdout = io.TextIOWrapper(raw, encoding="ascii", write_through=True)
        result = run(line, stdout=stdout)
        assert (result.status, result.err) == (0, ""), line
        assert shown in raw.getvalue(), line


@posix
@pytest.mark.parametrize(
    "line",
    [
        "rosparam get",
        "rosparam set /p",
        "rosnode info",
        "rosservice call",
        "rostopic pub -1 /t std_msgs/String",
    ],
)
def test_words_that_are_no_text(line: str, graph: Robot) -> None:
    """An argument contains a byte that is not UTF-8, as Python's surrogate."""
    result = run(f"{line} \udcff")
    assert (result.status, result.out) == (USAGE_ERROR, RULE if line == "rosnode info" else "")
    assert "not UTF-8 text" in one_line(result, line)


# --- Ctrl-C


def _until_ctrl_c(line: str, text: str = "") -> Result:
    """Run a command; send Ctrl-C once it has printed something, or ``text`` in its errors."""
    main = threading.main_thread().ident
    assert main is not None
    once = partial(next, iter([True]), False)

    def interrupt() -> None:
        if text in errors.getvalue() and once():
            timer = threading.Timer(0.05, signal.pthread_kill, (main, signal.SIGINT))
            timer.start()

    errors = Recorded(interrupt)
    return run(line, stdout=Recorded(interrupt), stderr=errors)


@posix
@pytest.mark.parametrize(
    "line",
    [f"{name} {row.good}" for name, row in ROWS.items() if row.streams]
    + [f"{name} {row.unknown}" for name, row in ROWS.items() if row.waits]
    + ["rosservice call --wait /nope", "rosnode ping /robot", "rostopic pub /t std_msgs/Bool 1"],
)
def test_ctrl_c(line: str, graph: Robot) -> None:
    """The command exits with 0, and prints at most a warning."""
    result = _until_ctrl_c(line)
    assert result.status == 0
    assert re.fullmatch(r"(WARNING: [^\n]*\n)*", result.err)
    assert run("rosnode list").out == "/ghost\n/robot\n"


@posix
@pytest.mark.parametrize("line", ["rostopic echo", "rostopic hz", "rostopic bw", "rostopic delay"])
def test_the_nearest_of_a_topic_that_is_waited_for(line: str, graph: Robot) -> None:
    """The suggestion follows real ROS's own warning, which scripts may read."""
    assert _until_ctrl_c(f"{line} /buton_state", "did you mean").err == (
        "WARNING: topic [/buton_state] does not appear to be published yet\ndid you mean /button_state?\n"
    )


@posix
def test_suggestions_for_other_waits(graph: Robot) -> None:
    assert _until_ctrl_c("rosservice call --wait /set_led_stat", "did you mean").err == (
        "WARNING: service [/set_led_stat] is not there yet\ndid you mean /set_led_state?\n"
    )
    # A service that is registered but does not respond has no suggestions.
    assert (
        _until_ctrl_c("rosservice call --wait /haunt").err == "WARNING: service [/haunt] is not there yet\n"
    )
