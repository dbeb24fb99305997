"""Each exercise of the course has a check: the page's own solution passes, an empty and a wrong program fail with a hint."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from minirospy.board.board import Board
from minirospy.course import checker
from minirospy.course.checker import Finding, Report, check, words_of
from minirospy.course.exercise import Exercise, Step, built_in_names, find_exercise

from .conftest import PAGES

EXERCISES = [find_exercise(name) for name in built_in_names()]
WITH_PROGRAM = [exercise.name for exercise in EXERCISES if not exercise.live]
PATIENCE = 8.0  # multiplies the time limits of what must happen: tests run on loaded machines
START_SECONDS = 120.0  # for a program to start or to exit
FAILURE_SECONDS = 1.0  # time limit of an expectation that must fail
MEASURED_SECONDS = 1.0  # time over which a rate is measured: 20 to 40 messages, or 3.5 to 6.5

BALL = """
import rospy
import RPi.GPIO as GPIO
from std_msgs.msg import Int32

def on_ball(message):
    {line}

rospy.init_node("my_ball_leds")
GPIO.setmode(GPIO.BCM)
GPIO.setup((2, 7), GPIO.OUT)
rospy.Subscriber("/ball", Int32, on_ball)
rospy.spin()
GPIO.cleanup()
"""

FAST = """
<launch>
  <include file="$(find {package})/{name}"><arg name="parameters" value="$(dirname)/fast.yaml"/></include>
</launch>
"""


def solution_of(exercise: Exercise, folder: Path) -> list[str]:
    """Return the page's solution as the words of a command line."""
    if exercise.name == "ball":
        page = (PAGES / exercise.page).read_text(encoding="utf-8")
        line = re.search(r"the callback is one line, `(.+?)`", page)
        assert line
        file = folder / "ball.py"
        file.write_text(BALL.format(line=line[1]))
        return [str(file)]
    assert exercise.solution
    if exercise.name == "run_parameters":
        # The page's ten runs take ten seconds.
        (folder / "fast.yaml").write_text("number_of_runs: 10\nled_frequency: 12\n")
        package, _, name = exercise.solution[0].partition("/")
        file = folder / "fast.launch"
        file.write_text(FAST.format(package=package, name=name))
        return [str(file)]
    return list(exercise.solution)


def failed(report: Report) -> str:
    return "\n".join(map(str, report.findings)) + f"\n{report.output}"


def test_each_exercise_of_the_pages_has_a_check() -> None:
    """Count the headings, so that a new exercise on a page needs a file."""
    headings = {
        page.name: len(re.findall(r"^## Exercise", page.read_text(encoding="utf-8"), re.MULTILINE))
        for page in PAGES.glob("*.md")
    }
    pages = [exercise.page for exercise in EXERCISES]
    assert {page: pages.count(page) for page in headings} == headings


def test_each_file_is_in_the_order_and_has_its_name() -> None:
    folder = Path(sys.modules[Exercise.__module__].__file__ or "").parent / "exercises"
    assert sorted(path.stem for path in folder.glob("*.yaml")) == sorted(built_in_names())
    assert [exercise.name for exercise in EXERCISES] == built_in_names()


@pytest.mark.parametrize("exercise", EXERCISES, ids=built_in_names())
def test_each_page_names_the_command(exercise: Exercise) -> None:
    text = (PAGES / exercise.page).read_text(encoding="utf-8")
    assert f"`minirospy check {exercise.name}" in text


@pytest.mark.parametrize("exercise", EXERCISES, ids=built_in_names())
def test_each_expectation_has_a_hint(exercise: Exercise) -> None:
    assert [step for step in exercise.steps if step.is_expectation and not step.hint] == []


class _FirstFailureError(Exception):
    """Ends a check at its first failure, so that a test need not wait for the others."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(str(finding))
        self.finding = finding


def first_failure(exercise: Exercise, programs: Sequence[str], patience: float = 1.0) -> Finding:
    """Run a check until its first failure, and return that."""

    def tell(finding: Finding) -> None:
        if finding.holds is False:
            raise _FirstFailureError(finding)

    try:
        report = check(exercise, programs, patience=patience, tell=tell)
    except _FirstFailureError as failure:
        return failure.finding
    pytest.fail(f"nothing fails: {failed(report)}")


def measured_quickly(step: Step) -> Step:
    """Return a step that measures a rate, or watches LEDs, for a shorter time."""
    if step.kind in ("still", "runs_along"):
        return replace(step, subject=MEASURED_SECONDS)
    return replace(step, options={**step.options, "for": MEASURED_SECONDS}) if step.kind == "rate" else step


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", WITH_PROGRAM)
def test_solution_of_the_page_passes(name: str, workspace: Path) -> None:
    exercise = find_exercise(name)
    exercise = replace(exercise, steps=tuple(map(measured_quickly, exercise.steps)))
    report = check(exercise, solution_of(exercise, workspace), patience=PATIENCE)
    assert report.passed, failed(report)


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", WITH_PROGRAM)
def test_empty_program_fails_with_a_hint(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip what the exercise starts first: an empty program uses none of it."""
    exercise = find_exercise(name)
    start = next(number for number, step in enumerate(exercise.steps) if step.subject == "work")
    exercise = replace(exercise, steps=exercise.steps[start:])
    file = tmp_path / ("empty.launch" if "launch file" in exercise.work[0].about else "empty.py")
    file.write_text("<launch/>\n" if file.suffix == ".launch" else "")
    patience = FAILURE_SECONDS / 10  # the default time limit is ten seconds
    monkeypatch.setattr(checker, "START_SECONDS", START_SECONDS / patience)
    finding = first_failure(exercise, [str(file)], patience)
    assert finding.hint, finding
    if not exercise.ends:
        assert "it ended by itself" in finding.observed


# The program's text, or a replacement in the page's solution; and the hint of the first failure.
WRONG = {
    "count": (("rospy.Rate(2)", "rospy.Rate(20)"), "rospy.Rate(2)"),
    "frequency": (('rospy.get_param("/publish_frequency", 10)', "10"), "Read the parameter"),
    "warnings": (("message.level >= Log.WARN", "True"), "The levels are numbers"),
    "square": (("math.pi / 2", "0.0"), "turn for one second"),
    "ball": (("< 80, message.data >= 80", "< 80, message.data >= 0"), "Are both pins set up"),
    "scanner_button": (("NEAR = 0.2", "NEAR = 1.0"), "The limit is 0.2 m"),
    "move_light": (("(1 if request.data else -1)", "(1)"), "False moves the light to the left"),
    "traffic_light": (('("yellow", (4, 5))', '("yellow", (4, 6))'), "The foot of a person at 0.45 m"),
    "stop_when_near": (("client.cancel_goal()", "pass"), "client.cancel_goal()"),
    "scanner_launch": (("led_actuator.py", "run_debug.py"), "Start your LED's node"),
    "run_parameters": (("fast.yaml", "other.yaml"), "number_of_runs and led_frequency"),
}


def test_there_is_a_wrong_program_for_each_exercise() -> None:
    assert sorted(WRONG) == sorted(WITH_PROGRAM)


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", WITH_PROGRAM)
def test_wrong_program_fails_with_the_hint_for_its_mistake(
    name: str, workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The expectations before the mistake hold, with long time limits; the first one that fails has its hint."""
    from minirospy.course.programs import find_command
    from minirospy.workspace.packages import Packages

    exercise = find_exercise(name)
    (before, after), hint = WRONG[name]
    words = solution_of(exercise, workspace)
    changed = 0
    for number, word in enumerate(words):
        source = Path(find_command(word, Packages())[-1])
        text = source.read_text(encoding="utf-8")
        if before in text:
            changed += 1
            file = tmp_path / source.name
            file.write_text(text.replace(before, after))
            (tmp_path / "other.yaml").write_text("number_of_runs: 2\n")
            words[number] = str(file)
    assert changed, "the solution does not contain the text to replace"
    steps = [
        replace(step, within=FAILURE_SECONDS if hint in step.hint else step.within * PATIENCE)
        for step in exercise.steps
    ]
    monkeypatch.setattr(checker, "START_SECONDS", START_SECONDS)
    finding = first_failure(replace(exercise, steps=tuple(steps)), words)
    assert hint in finding.hint, finding


def typed_while_checked(
    exercise: Exercise, first: Callable[[], object], then: Callable[[], object]
) -> Report:
    """Run a check while ``first`` happens, and ``then`` after the check has seen that."""
    seen = threading.Event()

    def type_both() -> None:
        first()
        assert seen.wait(START_SECONDS)
        then()

    thread = threading.Thread(target=type_both)
    thread.start()
    report = check(exercise, [], patience=PATIENCE, tell=lambda _: seen.set())
    thread.join()
    return report


def run_minirospy(words: str) -> None:
    subprocess.run([sys.executable, "-m", "minirospy", *words.split()], check=True)


def test_commands_of_the_page_light_the_led_of_the_own_board() -> None:
    with Board():
        report = typed_while_checked(
            find_exercise("board"),
            lambda: run_minirospy("board set 4 1"),
            lambda: run_minirospy("board set 4 0"),
        )
    assert report.passed, failed(report)


def test_nothing_typed_fails_with_the_command_to_type() -> None:
    report = check(find_exercise("board"), [], patience=0.01)
    assert [finding.holds for finding in report.findings] == [False, True]
    assert "minirospy board set 4 1" in str(report.findings[0])


def test_package_is_created_and_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    package = tmp_path / "rpi_feros_bringup_test"

    def create() -> None:
        package.mkdir()
        (package / "package.xml").write_text("<package><name>rpi_feros_bringup_test</name></package>")

    def delete() -> None:
        (package / "package.xml").unlink()
        package.rmdir()

    report = typed_while_checked(find_exercise("package"), create, delete)
    assert report.passed, failed(report)
    report = check(find_exercise("package"), [], patience=0.01)
    assert "catkin_create_pkg" in report.failures[0].hint


@pytest.mark.parametrize(
    ("answer", "holds"), [("odom", True), (" /odom\n", True), ("laser", False), ("", False)]
)
def test_answer_to_a_question_is_compared(answer: str, holds: bool) -> None:
    exercise = find_exercise("missing_frame")
    assert words_of(exercise, [answer]) == ([], [answer])
    report = check(exercise, [], answers=[answer])
    assert report.passed == holds
    assert holds or "read the exception" in report.failures[0].hint


def test_question_without_an_answer_is_asked() -> None:
    asked = []

    def ask(question: str) -> str:
        asked.append(question)
        return "odom\n"

    assert check(find_exercise("missing_frame"), [], ask=ask).passed
    assert asked == ["Which frame is missing if my_object.py starts before my_odom.py?"]
    assert not check(find_exercise("missing_frame"), []).passed


@pytest.mark.timeout(300)
def test_scanner_of_the_class_is_measured(master: str) -> None:
    """The answers are compared with the measured rate and the registered address."""
    command = [
        sys.executable,
        "-m",
        "minirospy",
        "launch",
        "sick_safetyscanners",
        "sick_safetyscanners.launch",
    ]
    exercise = find_exercise("scanner_for_all")
    # On a loaded machine, the scanner is slower for the time of the measurement.
    measured = [each for each in exercise.steps if "tolerance" in each.options]
    assert [each.options["rate"] for each in measured] == ["/sick_safetyscanners/scan"]
    steps = (
        replace(each, options={**each.options, "tolerance": 0.6}) if each in measured else each
        for each in exercise.steps
    )
    exercise = replace(exercise, steps=tuple(steps))
    launch = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        report = check(exercise, [], answers=["33", "localhost"], patience=PATIENCE)
        wrong = check(exercise, [], answers=["about 100 Hz", "192.168.65.50"])
    finally:
        launch.terminate()
        launch.wait()
    assert [finding.holds for finding in wrong.findings] == [False, False]
    assert "rostopic hz" in wrong.findings[0].hint
    assert report.passed, failed(report)
