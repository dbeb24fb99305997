"""Students' programs that crash, hang, never start or do not stop: one clear sentence, and no process left."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from minirospy.base.errors import NotFoundError, UsageError
from minirospy.course import checker
from minirospy.course.checker import Report, check
from minirospy.course.exercise import Exercise, ExerciseError, parse_exercise
from minirospy.course.world import World
from tests.patience import PATIENCE

LAMP = """
name: lamp
title: A lamp with a button
work:
  - about: the node of the lamp
steps:
  - start: work
  - press: 11
  - {led: 7, is: on, within: 5, hint: 'Is the pin set up as an output?'}
  - release: 11
  - {led: 7, is: off, within: 5, hint: The LED follows both edges.}
"""
GOOD = """
import rospy
import RPi.GPIO as GPIO

rospy.init_node("lamp")
GPIO.setmode(GPIO.BCM)
GPIO.setup(11, GPIO.IN)
GPIO.setup(7, GPIO.OUT)
rate = rospy.Rate(50)
try:
    while not rospy.is_shutdown():
        GPIO.output(7, GPIO.input(11))
        rate.sleep()
except rospy.ROSInterruptException:
    pass
"""


@pytest.fixture
def lamp() -> Exercise:
    return parse_exercise(LAMP, "lamp.yaml")


def run(exercise: Exercise, folder: Path, text: str, patience: float = 5.0, name: str = "lamp.py") -> Report:
    file = folder / name
    file.write_text(text)
    report = check(exercise, [str(file)], patience=patience)
    left = [each for each in psutil.process_iter(["cmdline"]) if str(file) in (each.info["cmdline"] or ())]
    assert left == []
    return report


def lines(report: Report) -> str:
    return "\n".join(map(str, report.findings))


def test_program_that_does_it_passes(lamp: Exercise, tmp_path: Path) -> None:
    report = run(lamp, tmp_path, GOOD)
    assert report.passed, lines(report)
    assert lines(report).splitlines() == [
        "The LED at GPIO 7 lights within 25 s after button 1 (GPIO 11) is pressed: yes",
        "The LED at GPIO 7 is dark within 25 s after button 1 (GPIO 11) is released: yes",
    ]


@pytest.mark.parametrize(
    ("change", "observed"),
    [
        (("GPIO.output(7, ", "GPIO.output(6, "), "RuntimeError"),
        (("GPIO.setup(7, GPIO.OUT)", "GPIO.setup(6, GPIO.OUT)"), "RuntimeError"),
        (("GPIO.output(7, GPIO.input(11))", "pass"), "it stays dark. Is the pin set up"),
        (
            ("GPIO.setup(7, GPIO.OUT)", "GPIO.setup(6, GPIO.OUT); GPIO.output = lambda *_: None"),
            "it stays dark, and GPIO 7 is no output; the program's outputs are GPIO 6. Is the pin",
        ),
        (("GPIO.input(11)", "1"), "is released: no, it stays lit. The LED follows both edges."),
    ],
)
def test_what_does_not_hold_is_named(
    change: tuple[str, str], observed: str, lamp: Exercise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checker, "START_SECONDS", 100.0)
    assert change[0] in GOOD
    report = run(lamp, tmp_path, GOOD.replace(*change), patience=1.0)
    assert not report.passed
    assert observed in lines(report)


def test_crash_is_one_sentence_and_the_last_lines(
    lamp: Exercise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The traceback is printed before the exit, by which the program is judged.
    monkeypatch.setattr(checker, "EXIT_SECONDS", PATIENCE)
    report = run(lamp, tmp_path, "import rospy\nrospy.init_node('lamp')\nprint('almost')\nrospy.Publsher\n")
    first, *others = report.findings
    assert "lamp.py keeps running: no, it ended after" in str(first)
    assert "AttributeError: module 'rospy' has no attribute 'Publsher'" in str(first)
    assert "(lamp.py, line 4)" in str(first)
    assert [finding.holds for finding in others] == [None, None]
    assert "almost" in report.output["lamp.py"]


def test_syntax_error_is_named_with_its_line(lamp: Exercise, tmp_path: Path) -> None:
    report = run(lamp, tmp_path, "import rospy\nif True\n    pass\n")
    assert "SyntaxError" in str(report.findings[0])
    assert "(lamp.py, line 2)" in str(report.findings[0])


def test_programs_of_the_exercise_start_although_the_students_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.course.world.LAST_EFFECT_SECONDS", 0.0)
    # The student's program ends once that of the exercise has started, which registers its node after that.
    own, pid, has_started = (tmp_path / name for name in ("own.py", "pid", "has_started"))
    own.write_text(
        f"import psutil, time\nopen({str(has_started)!r}, 'w').close()\n"
        f"work = psutil.Process(int(open({str(pid)!r}).read()))\n"
        "try:\n    while work.status() != psutil.STATUS_ZOMBIE: time.sleep(0.01)\nexcept psutil.NoSuchProcess: pass\n"
        "import rospy\nrospy.init_node('own')\nrospy.spin()\n"
    )
    work = (
        f"import os, rospy, time\nopen({str(pid)!r}, 'w').write(str(os.getpid()))\nrospy.init_node('lamp')\n"
        f"while not os.path.exists({str(has_started)!r}): time.sleep(0.01)\n"
    )
    steps = f"- start: work\n- start: {own}\n- node: /own\n"
    exercise = parse_exercise(f"name: t\ntitle: t\nwork:\n- about: node\nsteps:\n{steps}", "t.yaml")
    report = run(exercise, tmp_path, work)
    assert "it ended by itself after" in lines(report)
    assert not report.passed


def test_program_that_ends_is_advised_to_spin_before_the_time_for_its_effects_has_passed(
    tmp_path: Path,
) -> None:
    patient = parse_exercise(LAMP.replace("within: 5", "within: 3600"), "lamp.yaml")
    report = run(patient, tmp_path, "import rospy\nrospy.init_node('lamp')\nprint('done')\n")
    assert "it ended by itself after" in str(report.findings[0])
    assert "rospy.spin()" in report.findings[0].hint


def test_program_without_a_node_is_advised_to_init(
    lamp: Exercise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait_until = World.wait_until

    def wait_from_output_on(
        world: World, holds: Callable[[], bool], seconds: float, *, needs_work: bool = True
    ) -> bool:
        # The time limit, which applies from the start on, may be shorter than Python takes to print.
        wait_for(lambda: all(program.lines for program in world.programs))
        return wait_until(world, holds, seconds, needs_work=needs_work)

    monkeypatch.setattr(World, "wait_until", wait_from_output_on)
    report = run(lamp, tmp_path, "import time\nprint('waiting')\ntime.sleep(100)\n", patience=0.2)
    assert "lamp.py starts a node: no, it runs, but no node is registered after 3 s" in str(
        report.findings[0]
    )
    assert "rospy.init_node" in report.findings[0].hint
    assert report.output == {"lamp.py": ["waiting"]}


def test_error_in_a_callback_is_reported_while_the_node_runs(lamp: Exercise, tmp_path: Path) -> None:
    text = GOOD.replace("try:\n", "import threading\nthreading.Thread(target=lambda: 1 / 0).start()\ntry:\n")
    report = run(lamp, tmp_path, text)
    assert not report.passed
    assert "lamp.py runs without errors: no, it prints ZeroDivisionError: division by zero (lamp.py" in lines(
        report
    )
    assert "lights within 25 s after button 1 (GPIO 11) is pressed: yes" in lines(report)


@pytest.mark.skipif(os.name != "posix", reason="CTRL_BREAK_EVENT cannot be ignored in this way")
def test_program_that_ignores_ctrl_c_is_killed_and_reported(
    lamp: Exercise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checker, "START_SECONDS", 400.0)
    # The signal is ignored before the node is registered, which the check waits for.
    text = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + GOOD.replace(
        'init_node("lamp")', 'init_node("lamp", disable_signals=True)'
    )
    report = run(lamp, tmp_path, text, patience=0.3)
    assert "lamp.py stops at Ctrl-C: no, it had to be killed" in lines(report)


@pytest.mark.skipif(os.name != "posix", reason="Windows ends the children by its job")
def test_process_that_a_program_leaves_is_ended(lamp: Exercise, tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    child = "subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(1000)'])"
    text = f"import subprocess, sys\nopen({str(pid_file)!r}, 'w').write(str({child}.pid))\n{GOOD}"
    run(lamp, tmp_path, text)
    pid = int(pid_file.read_text())
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


def test_node_of_a_launch_file_that_dies_is_named(
    lamp: Exercise, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "bad.py").write_text("import rospy\nrospy.init_node('bad')\nraise SystemExit(3)\n")
    launch = '<launch><node name="bad" pkg="x" type="bad.py"/></launch>'
    package = tmp_path / "x"
    package.mkdir()
    (package / "package.xml").write_text(
        '<package format="2"><name>x</name><version>0.0.0</version><description>x</description>'
        '<maintainer email="a@b.de">x</maintainer><license>BSD</license></package>'
    )
    (tmp_path / "bad.py").rename(package / "bad.py")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    report = run(lamp, tmp_path, launch, name="lamp.launch")
    assert "the node bad ended with status 3" in lines(report)


def test_two_checks_at_once_do_not_disturb_each_other(lamp: Exercise, tmp_path: Path) -> None:
    """Both have the same node name, and press the same button."""
    code = (
        "import sys; from minirospy.course.checker import check; from minirospy.course.exercise import parse_exercise\n"
        f"report = check(parse_exercise({LAMP!r}, 'lamp.yaml'), [sys.argv[1]], patience=5.0)\n"
        "sys.exit(not report.passed)\n"
    )
    file = tmp_path / "lamp.py"
    file.write_text(GOOD)
    both = [subprocess.Popen([sys.executable, "-c", code, str(file)]) for _ in range(2)]
    assert [each.wait() for each in both] == [0, 0]


@pytest.mark.parametrize("number", ["SIGKILL", "SIGTERM"])
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_killed_check_leaves_no_process(number: str, tmp_path: Path) -> None:
    exercise, file = tmp_path / "lamp.yaml", tmp_path / "lamp.py"
    exercise.write_text(LAMP.replace("- press: 11", "- wait: 600"))
    pid_file = tmp_path / "pid"
    file.write_text(
        f"import os\n{GOOD}".replace(
            "rate =", f"open({str(pid_file)!r}, 'w').write(str(os.getpid()))\nrate ="
        )
    )
    running = subprocess.Popen([sys.executable, "-m", "minirospy", "check", str(exercise), str(file)])
    wait_for(pid_file.exists)
    wait_for(lambda: pid_file.read_text() != "")
    pid = int(pid_file.read_text())
    running.send_signal(getattr(signal, number))
    running.wait(60)
    wait_for(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)


def wait_for(holds: object, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.parametrize("word", ["missing.py", "rpi_feros/led_actuatr.py", "no_package/x.py"])
def test_program_that_does_not_exist_is_an_error_of_the_check(word: str, lamp: Exercise) -> None:
    with pytest.raises(NotFoundError):
        check(lamp, [word])


def test_file_that_is_no_program_is_a_usage_error(lamp: Exercise, tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("no program")
    with pytest.raises(UsageError, match="neither a Python program, a launch file nor an executable"):
        check(lamp, [str(file)])


def test_rostest_is_a_step(tmp_path: Path) -> None:
    text = "name: t\ntitle: t\nsteps:\n- {{rostest: rpi_feros {0}, within: 100, hint: h}}\n"
    good = check(parse_exercise(text.format("rpi_led.test"), "t.yaml"), [], patience=3.0)
    assert good.passed, lines(good)
    bad = check(parse_exercise(text.format("none.test"), "t.yaml"), [])
    assert not bad.passed
    assert "none.test" in lines(bad)


@pytest.mark.parametrize(
    ("step", "observed"),
    [
        ("{message: /chatter, field: 'x[', equals: 1}", "field path [x[]"),
        ("{response: /nothing, field: success, equals: true, within: 0.2}", "service [/nothing] not found"),
        ("{publish: /x, type: std_msgs/Nothing}", "[std_msgs/Nothing] not found"),
        ("{publish: /x, type: std_msgs/Bool, message: {dat: 1}}", "dat"),
        ("{param: /missing, within: 0.2}", "it is not set"),
    ],
)
def test_error_of_a_step_is_an_observation(step: str, observed: str, tmp_path: Path) -> None:
    """A teacher's mistake that only the graph reveals is one line, and the check goes on."""
    publisher = (
        "import rospy\nfrom std_msgs.msg import Bool\nrospy.init_node('lamp')\n"
        "p = rospy.Publisher('/chatter', Bool, queue_size=1, latch=True)\np.publish(True)\nrospy.spin()\n"
    )
    text = f"name: t\ntitle: t\nwork:\n- about: node\nsteps:\n- start: work\n- {step}\n- {{node: /lamp}}\n"
    report = run(parse_exercise(text, "t.yaml"), tmp_path, publisher)
    assert observed in lines(report)
    assert report.findings[0].holds is False
    assert report.findings[-1].holds


def test_program_of_the_exercise_that_does_not_run_is_an_error_of_the_exercise(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text("raise SystemExit('no scanner')\n")
    exercise = parse_exercise(f"name: t\ntitle: t\nsteps:\n- start: {own}\n- node: /x\n", "t.yaml")
    with pytest.raises(ExerciseError, match=r"own\.py, which the exercise starts, does not run: no scanner"):
        check(exercise, [])
