"""`minirospy check`: its output, exit status, record and the class's table."""

from __future__ import annotations

import json
import os
import re
import sys
import time
from pathlib import Path

import pytest
from std_msgs.msg import String

from minirospy.base.environment import Environment
from minirospy.course import classroom
from minirospy.course.classroom import Classroom, Student, gather
from minirospy.course.exercise import built_in_names
from minirospy.course.results import CLASS_PARAMETER, SECONDS, Record
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.rpc.master_proxy import MasterProxy

from .conftest import Command

PASSES = "name: {}\ntitle: A title\nlive: true\nsteps:\n- {{answer: 'What?', equals: odom, hint: Look.}}\n"


def students_at(uri: str) -> list[Student]:
    """Return the students with results on a master."""
    return gather(uri, Environment.read()).students


@pytest.fixture
def question(tmp_path: Path) -> str:
    file = tmp_path / "question.yaml"
    file.write_text(PASSES.format("question"))
    return str(file)


def test_list_names_each_exercise_and_its_state(command: Command) -> None:
    result = command("check")
    assert result.status == 0
    assert [line.split()[:2] for line in result.out.splitlines()[:-1]] == [
        ["-", name] for name in built_in_names()
    ]
    assert result.out.splitlines()[-1].startswith(f"0 of {len(built_in_names())} passed")
    assert command("check", "missing_frame", "odom").status == 0
    result = command("check")
    assert "passed     missing_frame" in result.out
    assert f"1 of {len(built_in_names())} passed" in result.out


def test_passed_exercise_stays_passed(command: Command) -> None:
    assert command("check", "missing_frame", "laser").status == 1
    assert "not passed missing_frame" in command("check").out
    assert command("check", "missing_frame", "odom").status == 0
    assert command("check", "missing_frame", "laser").status == 1
    assert "passed     missing_frame" in command("check").out


def test_output_of_a_check(command: Command, question: str) -> None:
    assert command("check", question, "odom") == (
        0,
        "question: A title\nWhat?: yes\nPassed: all 1 points hold.\n",
        "",
    )
    assert command("check", question, "map") == (
        1,
        "question: A title\nWhat?: no, your answer is [map]. Look.\nNot passed: 1 of 1 points do not hold.\n",
        "",
    )


@pytest.mark.parametrize(
    ("words", "status", "error"),
    [
        (["nope"], 3, "exercise [nope] not found"),
        (["./nope.yaml"], 3, "there is no such file"),
        (["count", "nope.py"], 3, "nope.py"),
        (["move_light"], 2, "move_light takes up to 2 files"),
        (["count", "a.py", "b.py"], 2, "count takes one file"),
        (["count", "--patience", "0"], 2, "--patience takes a number from 0.1 to 100"),
        (["count", "--class"], 2, "--class takes no exercise"),
        (["--join", ""], 2, "--join takes the URI of a master"),
        (["--join", "", "--one-master"], 2, "--join takes the URI of a master"),
        (["--join", "http://"], 2, "is not the URI of a master"),
        (["--join", "http://localhost:1"], 1, "no ROS master answers at http://localhost:1"),
        (["--class"], 1, "no ROS master answers"),
    ],
)
def test_errors_are_one_line(words: list[str], status: int, error: str, command: Command) -> None:
    result = command("check", *words)
    assert result.status == status, result
    assert error in result.err
    assert result.err.count("\n") == 1


def test_exercise_with_a_mistake_is_not_checked(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("name: x\ntitle: y\nsteps:\n- pres: 11\n")
    result = command("check", str(file))
    assert result.status == 3
    assert result.err.startswith(f"minirospy check: ERROR: {file}: step 1: [pres] is not a kind of step")


def test_unreadable_record_counts_as_empty(command: Command) -> None:
    Record.read(Environment.read()).path.write_text("{broken")
    assert "0 of" in command("check").out
    assert command("check", "missing_frame", "odom").status == 0
    assert json.loads(Record.read(Environment.read()).path.read_text())["exercises"]["missing_frame"][
        "passed"
    ]


def test_result_is_at_the_master(command: Command, master: str, question: str) -> None:
    assert "No results" in command("check", "--class").out
    words = ("--join", master, "--name", "Anna B.")
    assert command("check", *words).out == f"Anna B.: results go to {master}\n"
    assert command("check", question, "map").status == 1
    [student] = students_at(master)
    assert student.key.startswith("Anna_B__")
    assert student.name == "Anna B."
    assert not student.results["question"].passed
    assert abs(student.results["question"].time - time.time()) < 600
    assert student.results["question"].failures == ("What?: your answer is [map]",)
    out = command("check", "--class").out.splitlines()
    assert out[:2] == ["         question", "Anna B.  no"]
    assert out[2].startswith("Anna B., question, ")
    assert command("check", question, "odom").status == 0
    assert command("check", "--class").out == "         question\nAnna B.  yes\n"


def test_students_are_told_an_address_that_their_computers_reach(
    command: Command, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = Environment.read().master_address[1]
    monkeypatch.setenv("ROS_HOSTNAME", "localhost")
    assert command("check", "--class").out == (
        f"No results at {master} yet: students type `minirospy check --join ADDRESS:{port} --name NAME` once (ADDRESS: the IP "
        "address of this computer in the classroom's network), or, in a fleet, `minirospy check --share`.\n"
    )
    monkeypatch.setenv("ROS_HOSTNAME", "192.168.65.50")
    assert f"--join http://192.168.65.50:{port} --name" in command("check", "--class").out


def test_own_master_gets_no_parameters_without_join(command: Command, master: str, question: str) -> None:
    """A student's `rosparam list` shows what the pages of the course show."""
    proxy = MasterProxy(master, "/test")
    before = proxy.get_param_names()
    stays = "Anna: results stay on this computer; --join URI sends them to the teacher\n"
    assert command("check", "--name", "Anna").out == stays
    assert command("check", question, "odom") == (
        0,
        "question: A title\nWhat?: yes\nPassed: all 1 points hold.\n",
        "",
    )
    assert proxy.get_param_names() == before
    assert command("check", "--join", master).status == 0
    assert f"{CLASS_PARAMETER}/Anna/student" in proxy.get_param_names()
    proxy.close()


def test_master_on_another_computer_gets_the_results(
    command: Command, master: str, question: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A laptop whose ROS_MASTER_URI is the teacher's master needs no --join."""
    monkeypatch.setattr("minirospy.base.environment.is_own_host", lambda host, own="": False)
    assert command("check", "--name", "Anna").out == f"Anna: results go to {master}\n"
    assert command("check", question, "odom").status == 0
    assert [student.name for student in students_at(master)] == ["Anna"]


@pytest.mark.skipif(sys.platform == "win32", reason="cmd has other lines")
@pytest.mark.parametrize("login_shell", ["/bin/dash", "/usr/bin/fish", "/usr/bin/pwsh"])
def test_one_master_is_one_command_whatever_the_login_shell_is(
    login_shell: str, command: Command, master: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHELL", login_shell)
    result = command("check", "--join", master, "--name", "Jörg", "--one-master")
    assert result.status == 0
    names = dict(line.removeprefix("export ").split("=", 1) for line in result.out.splitlines())
    assert names["ROS_MASTER_URI"] == master
    assert names["ROS_IP"] in ("127.0.0.1", "::1")
    # ROS accepts the namespace, and the shell needs no quotes.
    assert names["ROS_NAMESPACE"].startswith("J_rg_")
    assert names["ROS_NAMESPACE"].replace("_", "a").isalnum()
    assert command("check", "--one-master").status == 2


ASSIGNMENTS = {
    "bash": r"export {}='?(.+?)'?",
    "fish": r"set -gx {} '(.+)'",
    "powershell": r"\$env:{} = '(.+)'",
    "pwsh": r"\$env:{} = '(.+)'",
    "bat": r'@set "{}=(.+)"',
}


@pytest.mark.parametrize("shell", ASSIGNMENTS)
def test_one_master_prints_for_the_shell(shell: str, command: Command, master: str) -> None:
    result = command("check", "--join", master, "--name", "anna", "--one-master", shell)
    assert (result.status, result.err) == (0, "")
    values = []
    for name, line in zip(
        ("ROS_MASTER_URI", "ROS_IP", "ROS_NAMESPACE"), result.out.splitlines(), strict=True
    ):
        found = re.fullmatch(ASSIGNMENTS[shell].format(name), line)
        assert found, line
        values.append(found[1])
    assert values[0] == master
    assert values[2].startswith("anna")


def test_one_master_for_an_unknown_shell(command: Command, master: str) -> None:
    result = command("check", "--join", master, "--name", "anna", "--one-master", "tcsh")
    assert result.status == 2
    assert "there is nothing for the shell [tcsh], only for bash" in result.err
    assert not students_at(master)


def test_class_has_another_master_than_the_robot(
    command: Command, master: str, question: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With twenty masters, each laptop's own master is not the class's."""
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    assert command("check", "--join", master.removeprefix("http://"), "--name", "Ben").status == 0
    assert command("check", question, "odom").status == 0
    assert [student.name for student in students_at(master)] == ["Ben"]


def test_master_that_has_gone_does_not_fail_the_check(command: Command, question: str) -> None:
    record = Record.read(Environment.read())
    record.master = "http://localhost:1"
    record.write()
    result = command("check", question, "odom")
    assert result.status == 0
    assert result.err.startswith(
        "WARNING: the result is stored, but not sent to the teacher: no ROS master answers"
    )


def test_values_that_are_no_record_are_left_out(command: Command, master: str, question: str) -> None:
    assert command("check", "--join", master).status == 0
    assert command("check", question, "odom").status == 0
    proxy = MasterProxy(master, "/hostile")
    for key, value in {"a": 5, "b": {"student": "x"}, "c": {"student": "x", "exercises": [1]}}.items():
        proxy.set_param(f"{CLASS_PARAMETER}/{key}", value)
    proxy.set_param(f"{CLASS_PARAMETER}/d", {"student": "red\nblue", "exercises": {"e": {"passed": True}}})
    proxy.close()
    result = command("check", "--class")
    assert result.status == 0
    assert "red\\nblue" in result.out
    # Below the names b, c, d and that of this computer are students, although some have no results.
    assert len(students_at(master)) == 4


def test_class_shows_students_whose_topics_a_fleet_forwards(command: Command, master: str) -> None:
    def text(**led: object) -> str:
        return json.dumps({"key": "pi", "student": "pi", "exercises": {"led": {"time": 0, **led}}, "now": {}})

    with ToolNode(Environment.read(), "test") as node:
        for robot, data in (
            ("robot1", text(passed=True, ever=True)),
            ("robot2", text(passed=False, failures=["it stays dark"])),
            ("eve", "{"),
        ):
            publisher = node.publisher(f"/{robot}/minirospy_class", String, latch=True)
            publisher.publish(String(data))
        result = command("check", "--class", "--patience", "20")
        assert result.status == 0
        assert result.out.splitlines() == [
            "             led",
            "pi (robot1)  yes",
            "pi (robot2)  no",
            "pi (robot2), led: it stays dark",
        ]
        assert result.err == (
            f"WARNING: results may be missing: /eve/minirospy_class of {node.name}: its message is not a student's\n"
        )


def test_patience_multiplies_the_time_limit_of_the_class(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: list[float] = []

    def gather(_uri: str, _environment: Environment, patience: float) -> Classroom:
        limits.append(patience)
        return Classroom([], [])

    monkeypatch.setattr(classroom, "gather", gather)
    assert command("check", "--class", "--patience", "20").status == 0
    assert limits == [20 * SECONDS]


def test_class_names_the_remedy_for_publishers_that_were_killed(command: Command, master: str) -> None:
    proxy = MasterProxy(master, "/gone")
    proxy.register_publisher("/robot1/minirospy_class", "std_msgs/String", "http://localhost:1")
    proxy.close()
    assert command("check", "--class", "--patience", "0.1").err == (
        "WARNING: results may be missing: /robot1/minirospy_class of /gone: it sent no message. "
        "`rosnode cleanup` makes the master forget nodes that were killed.\n"
    )


@pytest.mark.parametrize("when", [1e300, float("inf"), float("nan"), -1e17, "noon", [1]])
def test_impossible_time_counts_as_unknown(when: object, command: Command, master: str) -> None:
    led = {"passed": False, "time": when, "failures": ["it stays dark"]}
    proxy = MasterProxy(master, "/hostile")
    proxy.set_param(f"{CLASS_PARAMETER}/eve", {"student": "Eve", "exercises": {"led": led}})
    proxy.close()
    result = command("check", "--class")
    assert (result.status, result.err) == (0, "")
    assert result.out.splitlines()[-1] == "Eve, led: it stays dark"


def test_environment_of_the_command_is_left_alone(command: Command, question: str) -> None:
    before = dict(os.environ)
    command("check", question, "odom")
    assert dict(os.environ) == before
