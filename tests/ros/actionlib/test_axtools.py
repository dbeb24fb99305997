"""axclient.py and axserver.py with pipes: a form for the goal's type, the progress, and the final state."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from minirospy.base.errors import MessageException
from minirospy.command.form import ask_for, fields
from minirospy.ros.actionlib.commands.axclient import progress
from minirospy.workspace.packages import Packages

SERVER = """
import actionlib, rospy, sys
from actionlib.msg import TestAction, TestFeedback, TestResult
rospy.init_node("server", argv=[])
def execute(goal):
    for number in range(1, goal.goal + 1):
        server.publish_feedback(TestFeedback(number))
        if goal.goal > 10:
            while not server.is_preempt_requested():
                rospy.sleep(0.01)
            server.set_preempted(TestResult(number), "stopped")
            return
    # Feedback and result have separate connections: the test signals when the feedback has arrived.
    sys.stdin.readline()
    server.set_succeeded(TestResult(goal.goal))
server = actionlib.SimpleActionServer("count", TestAction, execute, False)
server.start()
print("ready", flush=True)
rospy.spin()
"""


@pytest.fixture
def server(master: str) -> Iterator[subprocess.Popen[str]]:
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout
    assert process.stdout.readline() == "ready\n"
    yield process
    process.terminate()
    process.communicate(timeout=30)


def command(name: str) -> list[str]:
    return Packages().find_executable("actionlib", f"{name}.py")


def ask(answers: str, *words: str) -> tuple[str, str, int]:
    done = subprocess.run(
        [*command("axclient"), *words],
        input=answers,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    return done.stdout, done.stderr, done.returncode


def ask_server(server: subprocess.Popen[str], answers: str, *words: str, until: str) -> tuple[str, str, int]:
    """Run axclient; the server succeeds after the client has printed a line that contains ``until``."""
    process = subprocess.Popen(
        [*command("axclient"), *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdin
    assert process.stdout
    assert server.stdin
    process.stdin.write(answers)
    process.stdin.flush()
    said = ""

    while until not in said:
        line = process.stdout.readline()
        assert line, said + process.communicate(timeout=30)[1]
        said += line

    server.stdin.write("succeed\n")
    server.stdin.flush()
    rest, errors = process.communicate(timeout=100)
    # A busy machine takes longer to connect.
    waiting = re.compile(r"Waiting for an action server at \S+ \.\.\.\n")
    return waiting.sub("", said + rest), errors, process.returncode


class TestClient:
    def test_form_has_the_fields_of_the_servers_type(self, server: subprocess.Popen[str]) -> None:
        assert ask_server(server, "2\n", "/count", until="100%") == (
            "goal (int32) [0]: Sent\nActive\n"
            "Feedback: feedback: 1  [###############...............] 50%\n"
            "Feedback: feedback: 2  [##############################] 100%\n"
            "Succeeded\nresult: 2\n",
            "",
            0,
        )

    def test_goal_as_yaml_and_type_by_name(self, server: subprocess.Popen[str]) -> None:
        said, errors, status = ask_server(server, "", "count", "actionlib/Test", "{goal: 0}", until="Active")
        assert (said, errors, status) == ("Sent\nActive\nSucceeded\nresult: 0\n", "", 0)

    @pytest.mark.usefixtures("server")
    def test_wrong_answers_and_names(self) -> None:
        for answers, words, wrong in [
            ("x\n", ["/count"], "field goal must be an integer type"),
            ("", ["/count", "{goals: 1}"], "goals"),
            ("", ["/count", "actionlib/Tes"], "message type [actionlib/TesAction] not found"),
            ("", ["-t", "0.2", "/nobody"], "no action server at /nobody"),
            ("", ["-t", "0.2", "/nobody", "actionlib/Test", "{}"], "no action server at /nobody"),
        ]:
            _, errors, status = ask(answers, *words)
            assert wrong in errors
            assert errors.count("\n") == 1, errors
            assert status == 1

    @pytest.mark.usefixtures("server")
    @pytest.mark.skipif(os.name != "posix", reason="Ctrl-C of a single process")
    def test_ctrl_c_cancels_the_goal(self) -> None:
        process = subprocess.Popen(
            [*command("axclient"), "/count", "{goal: 20}"], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout
        assert any("Feedback: feedback: 1" in line for line in process.stdout)
        os.kill(process.pid, signal.SIGINT)
        output, _ = process.communicate(timeout=30)
        assert output == "Cancelling (Ctrl-C again: leave)\nPreempted: stopped\nresult: 1\n"
        assert process.returncode == 1


def test_a_person_serves(master: str) -> None:
    process = subprocess.Popen(
        [*command("axserver"), "/ask", "actionlib/Test"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdin
    assert process.stdout
    assert process.stdout.readline() == "Serving /ask (actionlib/TestAction)\n"

    process.stdin.write("s\n7\nwell done\n")
    process.stdin.flush()
    said, _, status = ask("", "/ask", "{goal: 5}")

    assert said.endswith("Succeeded: well done\nresult: 7\n")
    assert status == 0
    process.stdin.close()
    # There is no user input for the next goal.
    said, _, status = ask("", "/ask", "{goal: 6}")

    assert "Aborted: the person who answered has left\n" in said
    assert process.wait(30) == 0
    assert "Goal:\ngoal: 5\n" in process.stdout.read()

    process.stdout.close()
    assert process.stderr
    process.stderr.close()


def test_form_prompts_for_each_field_until_the_answer_fits() -> None:
    from geometry_msgs.msg import PoseStamped

    message = PoseStamped()
    assert [field.path for field in fields(message)][:4] == [
        "header.seq",
        "header.stamp",
        "header.frame_id",
        "pose.position.x",
    ]
    answers = iter(["", "{secs: 3}", "yes", "far", "1.5"])
    asked: list[str] = []
    wrong: list[Exception] = []

    def answer(question: str) -> str:
        asked.append(question)
        return next(answers, "")

    ask_for(message, answer, wrong.append)
    assert asked[3:5] == ["pose.position.x (float64) [0.0]: "] * 2
    assert [type(error) for error in wrong] == [MessageException]
    assert (message.header.stamp.secs, message.header.frame_id, message.pose.position.x) == (3, "yes", 1.5)


def test_progress_with_equal_numbers() -> None:
    from actionlib.msg import TestFeedback, TestGoal
    from std_msgs.msg import String

    assert progress(TestGoal(4), TestFeedback(1)) == 0.25
    assert progress(TestGoal(4), TestFeedback(5)) is None
    assert progress(TestGoal(0), TestFeedback(0)) is None
    assert progress(TestGoal(4), String("x")) is None
