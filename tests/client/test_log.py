"""Improvements of minirospy's logging over rospy's; tests/referee compares the common behaviour."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.usefixtures("master")


def run(program: str, *arguments: str, **environment: str) -> tuple[str, str]:
    """Return the stdout and stderr of a program that exits with 0, without the times in its lines."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env={**os.environ, "ROSCONSOLE_FORMAT": "[${severity}] ${message}", **environment},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


LINES = """
import rospy
rospy.init_node("case")
rospy.loginfo("info")
rospy.logwarn("warn")
"""


def test_root_handlers_of_the_program_stay_without_duplicate_lines() -> None:
    program = f"""
import logging
logging.basicConfig(level=logging.INFO, format="MINE %(message)s")
{LINES}
logging.getLogger("mine").info("mine")
"""
    assert run(program) == ("[INFO] info\n", "[WARN] warn\nMINE mine\n")


def test_a_handler_of_the_programs_own_at_rosout_stays() -> None:
    program = f"""
import logging, sys
logging.getLogger("rosout").addHandler(logging.StreamHandler(sys.stdout))
{LINES}
"""
    assert run(program) == ("info\n[INFO] info\nwarn\n", "[WARN] warn\n")


def test_a_log_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    folder = tmp_path / "file" / "log"
    out, err = run(LINES, ROS_LOG_DIR=str(folder))
    assert out == "[INFO] info\n"
    warning = (
        f"WARNING: cannot create log directory [{folder}]. Please set ROS_LOG_DIR to a writable location.\n"
    )
    assert err == warning + "[WARN] warn\n"


def test_a_log_file_that_cannot_be_written(tmp_path: Path) -> None:
    out, err = run(LINES.replace('"case"', f'"case", argv=["__log:={tmp_path.as_posix()}"]'))
    assert out == "[INFO] info\n"
    first, second = err.splitlines()
    assert first.startswith(f"WARNING: cannot write the log file [{tmp_path}]: ")
    assert second == "[WARN] warn"


@pytest.mark.parametrize(
    ("name", "text"), [("a.conf", "garbage"), ("a.yaml", "a: b: c"), ("none.conf", None)]
)
def test_a_broken_configuration_is_one_line(tmp_path: Path, name: str, text: str | None) -> None:
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    out, err = run(LINES, ROS_PYTHON_LOG_CONFIG_FILE=str(path))
    assert out == "[INFO] info\n"
    first, second = err.splitlines()
    assert first.startswith(
        f"WARNING: cannot load logging configuration file [{path}], the usual one is used: "
    )
    assert second == "[WARN] warn"


def test_a_message_that_looks_like_a_format_is_left_alone() -> None:
    out, _ = run("import rospy\nrospy.init_node('case')\nrospy.loginfo('${node} ${message}')")
    assert out == "[INFO] ${node} ${message}\n"


def test_levels() -> None:
    program = """
import rospy
try:
    rospy.init_node("case", log_level=20)
except ValueError as error:
    print(error)
"""
    text = "log_level [20] is not one of rospy.DEBUG (1), INFO (2), WARN (4), ERROR (8), FATAL (16)\n"
    assert run(program) == (text, "")
    program = """
import rospy
rospy.init_node("case", log_level=rospy.WARN, disable_rosout=True)
rospy.loginfo("info")
rospy.logwarn("warn")
"""
    assert run(program) == ("", "[WARN] warn\n")


def test_throttles_before_init_node_and_for_a_duration() -> None:
    program = """
import rospy
for _ in range(2):
    rospy.logwarn_throttle(10, "before")
rospy.init_node("case")
for _ in range(2):
    rospy.logwarn_throttle(rospy.Duration(10), "after")
"""
    assert run(program) == ("", "before\n[WARN] after\n")


def test_python_loggers_name_their_own_place() -> None:
    program = """
import logging
import rospy
rospy.init_node("case")
class Robot:
    def drive(self):
        logging.getLogger("rosout.x").warning("python")
Robot().drive()
logging.getLogger("rosout").log(35, "between two levels")
"""
    _, err = run(program, ROSCONSOLE_FORMAT="${severity} ${message} ${function} ${line}")
    assert err == "WARN python drive 7\nLevel 35 between two levels <module> 9\n"


def test_logging_never_calls_the_master() -> None:
    program = """
import rospy
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.client import RpcClient
rospy.init_node("case")
rospy.loginfo("first")
calls = []
RpcClient.call = AsyncRpcClient.call = lambda *args: calls.append(args)
for _ in range(100):
    rospy.logdebug("x")
    rospy.logwarn_throttle(100, "once")
    rospy.logerr_once("once")
print(calls)
import os
os._exit(0)
"""
    assert run(program) == ("[INFO] first\n[]\n", "[WARN] once\n[ERROR] once\n")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals of this sort")
def test_colours_only_on_a_terminal() -> None:
    import pty

    program = """
import rospy
rospy.init_node("case", argv=[])
rospy.loginfo("info")
rospy.logwarn("warn")
rospy.logerr("error")
rospy.logfatal("fatal")
"""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "ROSCONSOLE_FORMAT": "${message}"}
    subprocess.run(
        [sys.executable, "-c", program], stdout=theirs, stderr=theirs, env=environment, timeout=30, check=True
    )
    os.close(theirs)
    written = b""
    # Linux raises an error when the terminal is closed.
    with contextlib.suppress(OSError):
        while data := os.read(ours, 10_000):
            written += data
    os.close(ours)
    lines = written.decode().splitlines()
    assert lines == ["info", "\033[33mwarn\033[0m", "\033[31merror\033[0m", "\033[31mfatal\033[0m"]
    assert "\033" not in "".join(run(program))


def test_a_terminal_that_has_gone() -> None:
    program = """
import sys
import rospy
rospy.init_node("case")
sys.stdout.close()
rospy.loginfo("info")
sys.stdout = None
rospy.loginfo("info")
"""
    assert run(program) == ("", "")


NO_NUMBER = "%d format: a real number is required, not str"


@pytest.mark.parametrize(
    ("call", "text", "fault"),
    [
        ("rospy.loginfo('%d', 'x')", "%d", NO_NUMBER),
        ("rospy.loginfo('x', 'y')", "x", "not all arguments converted during string formatting"),
        ("rospy.loginfo('%s %s', 1)", "%s %s", "not enough arguments for format string"),
        ("rospy.loginfo('%(a)s', {'b': 1})", "%(a)s", "'a'"),
        ("rospy.loginfo('100%', 5)", "100%", "incomplete format"),
        ("rospy.loginfo_once('%d', 'x')", "%d", NO_NUMBER),
        ("rospy.loginfo_throttle(1, '%d', 'x')", "%d", NO_NUMBER),
        ("rospy.loginfo(type('Odd', (), {'__str__': lambda self: 1 / 0})())", "<Odd>", "division by zero"),
        ("logging.getLogger('rosout').info('%d', 'x')", "%d", NO_NUMBER),
    ],
)
def test_faulty_log_line_is_printed_and_the_node_continues(call: str, text: str, fault: str) -> None:
    """Real rospy raises TypeError, which ends a node whose error message has a fault."""
    program = f"import logging, rospy; rospy.init_node('case')\n\n{call}\nrospy.loginfo('after')"
    line = f"[INFO] {text} (at <string>:3: the arguments do not fit: {fault})"
    assert run(program) == (f"{line}\n[INFO] after\n", "")
