"""Perform an exercise's steps in order, and check that the student's programs start, do not crash, and stop."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from minirospy.base.errors import BoardError, MessageException, MinirospyError, ServiceException, UsageError
from minirospy.base.log_levels import LEVEL_NAMES
from minirospy.course import expectations
from minirospy.course.exercise import GRAPH_KINDS, Exercise, ExerciseError, Step
from minirospy.course.expectations import Trial, expect
from minirospy.course.programs import Program
from minirospy.course.wording import action_phrase, sentence
from minirospy.course.world import World

__all__ = ["Finding", "Report", "check", "words_of"]

START_SECONDS = 15.0  # timeout for a node to register, on a slow laptop with a virus scanner
OWN_START_SECONDS = 60.0  # timeout for a program of the exercise itself, without which the check fails
EXIT_SECONDS = 1.0  # time between a failed program's traceback and its exit
_LAST_LINES = 8  # number of lines of a program's output in a report
_PRESS_SECONDS = 0.25  # time that `click` holds a button: more than two periods of 10 Hz polling
_REPEAT_HERTZ = 10.0  # rate of published messages, unless the exercise specifies one


class Finding(NamedTuple):
    """One line of a report. ``holds`` is None if the step was skipped."""

    sentence: str
    holds: bool | None
    observed: str = ""
    hint: str = ""

    def __str__(self) -> str:
        if self.holds is None:
            return f"{self.sentence}: not tried"
        if self.holds:
            return f"{self.sentence}: yes"
        observed = f", {self.observed}" if self.observed else ""
        text = f"{self.sentence}: no{observed}"
        return (
            f"{text if text.endswith(('.', '?', '!')) else text + '.'}{f' {self.hint}' if self.hint else ''}"
        )


@dataclass
class Report:
    """The result of a check. ``output`` maps the name of each failed program to its last lines."""

    exercise: Exercise
    findings: list[Finding] = field(default_factory=list)
    output: dict[str, list[str]] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Return whether every finding holds: none has failed or was skipped."""
        return bool(self.findings) and all(finding.holds for finding in self.findings)

    @property
    def failures(self) -> list[Finding]:
        """Return the findings that have failed."""
        return [finding for finding in self.findings if finding.holds is False]


def words_of(exercise: Exercise, words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Split the words after an exercise's name into programs and answers. Without words, use the programs on its course page.

    Raise UsageError if there are too many words, or if there is no program and the page names none.
    """
    if not exercise.work:
        if len(words) > exercise.questions:
            number = exercise.questions
            what = f"{number} answer{'s' if number > 1 else ''}" if number else "no file"
            raise UsageError(f"{exercise.name} takes {what}: {exercise.task}")
        return [], list(words)
    if len(words) > len(exercise.work):
        raise UsageError(f"{exercise.name} takes {_programs(exercise)}")
    if words:
        return list(words), []
    defaults = [work.default for work in exercise.work if work.default]
    if not defaults:
        raise UsageError(
            f"{exercise.name} takes {_programs(exercise)}: "
            f"minirospy check {exercise.name} {' '.join(['PACKAGE/PROGRAM'] * len(exercise.work))}"
        )
    return defaults, []


def check(
    exercise: Exercise,
    programs: Sequence[str],
    *,
    answers: Sequence[str] = (),
    ask: Callable[[str], str] | None = None,
    patience: float = 1.0,
    tell: Callable[[Finding], object] = lambda _: None,
) -> Report:
    """Run an exercise's steps with the student's programs; return the report. Pass each finding to ``tell`` immediately.

    All time limits are multiplied by ``patience``. Raise NotFoundError if a program does not exist, UsageError if it cannot be
    run.
    """
    report = Report(exercise)
    kinds = {step.kind for step in exercise.steps}
    needs_graph = bool(kinds & GRAPH_KINDS) or any(
        key in step.options for step in exercise.steps for key in ("rate", "host_of") if step.kind == "answer"
    )
    with World(
        live=exercise.live,
        patience=patience,
        listens=_topics(exercise.steps),
        needs_graph=needs_graph or not exercise.live,
        work_ends=exercise.ends,
    ) as world:
        _Run(exercise, list(programs), Trial(world, answers=list(answers), ask=ask), report, tell).run()
        world.stop_programs(only_work=True)
        _judge_stop(world, report, tell)
    return report


class _Run:
    """A single run through the steps of an exercise."""

    def __init__(
        self,
        exercise: Exercise,
        programs: list[str],
        trial: Trial,
        report: Report,
        tell: Callable[[Finding], object],
    ) -> None:
        self._exercise = exercise
        self._programs = programs
        self._trial = trial
        self._report = report
        self._tell = tell
        self._after = ""
        self._reported: set[str] = set()  # programs whose exit or error has already been reported

    def run(self) -> None:
        steps = list(self._exercise.steps)
        for number, step in enumerate(steps):
            if step.is_expectation:
                if not self._expect(step):
                    self._skip(steps[number:])
                    return
            elif not self._act(step) or not self._judge_programs():
                self._skip(steps[number + 1 :])
                return
        self._judge_programs()

    def _expect(self, step: Step) -> bool:
        """Check an expectation and add a finding. If it fails because a program has exited, return False and add no finding."""
        text = sentence(step, self._after, self._trial.world.patience)
        outcome = expect(self._trial, step)
        if not outcome.holds and not self._judge_programs():
            return False
        self._add(Finding(text, outcome.holds, "" if outcome.holds else outcome.observed, step.hint))
        return True

    def _act(self, step: Step) -> bool:
        trial = self._trial
        if phrase := action_phrase(step):
            self._after = phrase
        trial.since = time.monotonic()
        if step.kind == "start":
            return self._start(step)
        if step.kind == "stop":
            trial.world.stop_programs(only_work=True)
            self._after = ""
            is_fine = _judge_stop(trial.world, self._report, self._tell)
            trial.world.programs[:] = [each for each in trial.world.programs if not each.is_work]
            return is_fine
        try:
            _ACTIONS[step.kind](trial, step)
        except BoardError:
            raise
        except (MinirospyError, MessageException, ServiceException) as error:
            self._add(Finding(f"{phrase[:1].upper()}{phrase[1:]}" or step.kind, False, str(error), step.hint))
        return True

    def _start(self, step: Step) -> bool:
        """Start the student's programs, or a program of the exercise; wait until each has registered a node."""
        world = self._trial.world
        if step.subject == "work":
            words = self._programs
        elif isinstance(step.subject, int):
            words = self._programs[step.subject - 1 : step.subject]
        else:
            words = [str(step.subject)]
        for word in words:
            before = world.nodes()
            program = world.start(word, is_work=step.subject == "work" or isinstance(step.subject, int))
            # A reduced ``patience`` applies only to the student's programs: the check cannot continue without the exercise's.
            seconds = START_SECONDS if program.is_work else OWN_START_SECONDS / min(1.0, world.patience)
            has_started = partial(_has_started, world, before, program)
            runs = world.wait_until(has_started, seconds, needs_work=program.is_work)
            if not program.is_work:
                if not runs or program.status is not None:
                    program.wait_for_output()
                    last = " | ".join(program.last_lines(3))
                    raise ExerciseError(
                        self._exercise.name, 0, f"{word}, which the exercise starts, does not run: {last}"
                    )
            elif not runs:
                self._add(
                    Finding(
                        f"{program.name} starts a node",
                        False,
                        f"it runs, but no node is registered after {START_SECONDS * world.patience:g} s",
                        "Does it call rospy.init_node before it waits for anything?",
                    )
                )
                self._show_output(program)
                return False
        return True

    def _judge_programs(self) -> bool:
        """Report student programs that have exited or printed a traceback. Return False if one has exited too early."""
        is_fine = True
        ends_itself = self._exercise.ends
        for program in self._trial.work:
            if program.status is None and program.name not in self._reported and program.fault():
                # The traceback is printed before the program exits, so wait for the exit.
                self._trial.world.wait_until(partial(_has_ended, program), EXIT_SECONDS)
            status = program.status
            if status is not None:
                program.wait_for_output()
            fault = program.fault()
            if (
                status is not None
                and (status != 0 or fault or not ends_itself)
                and program.name not in self._reported
            ):
                self._reported.add(program.name)
                self._add(_ended_finding(program, status, fault, self._exercise))
                self._show_output(program)
                is_fine = False
            elif fault and program.name not in self._reported:
                self._reported.add(program.name)
                self._add(
                    Finding(
                        f"{program.name} runs without errors",
                        False,
                        f"it prints {fault}",
                        "Its last lines are below.",
                    )
                )
                self._show_output(program)
        return is_fine

    def _show_output(self, program: Program) -> None:
        self._report.output[program.name] = program.last_lines(_LAST_LINES)

    def _skip(self, steps: Iterable[Step]) -> None:
        for step in steps:
            if step.is_expectation:
                self._add(Finding(sentence(step, "", self._trial.world.patience), None))

    def _add(self, finding: Finding) -> None:
        self._report.findings.append(finding)
        self._tell(finding)


def _has_started(world: World, before: set[str], program: Program) -> bool:
    """Return whether a new node has registered, or the program has already exited."""
    return bool(world.nodes() - before) or program.status is not None


def _has_ended(program: Program) -> bool:
    """Return whether a program has exited."""
    return program.status is not None


def _ended_finding(program: Program, status: int, fault: str, exercise: Exercise) -> Finding:
    seconds = f"{program.ended_after:.1f} s"
    text = f"{program.name} keeps running" if not exercise.ends else f"{program.name} runs without errors"
    if fault:
        return Finding(text, False, f"it ended after {seconds} with {fault}", "Its last lines are below.")
    if status < 0:
        return Finding(text, False, f"it was ended by signal {-status} after {seconds}")
    if status:
        return Finding(
            text, False, f"it ended after {seconds} with status {status}", "Its last lines are below."
        )
    if not any(line.text.strip() for line in program.lines):
        return Finding(
            text,
            False,
            f"it ended by itself after {seconds} and printed nothing",
            "Is the file empty, or is rospy.spin() missing?",
        )
    return Finding(
        text,
        False,
        f"it ended by itself after {seconds}, without an error",
        "Is rospy.spin() or a loop missing at its end?",
    )


def _judge_stop(world: World, report: Report, tell: Callable[[Finding], object]) -> bool:
    """Report student programs that ignored Ctrl-C and had to be killed. Return True if no program had to be killed."""
    stubborn = [each for each in world.programs if each.is_work and each.ignored_interrupt]
    for program in stubborn:
        finding = Finding(
            f"{program.name} stops at Ctrl-C",
            False,
            "it had to be killed",
            "A loop needs `while not rospy.is_shutdown():`, and `except:` must not catch everything.",
        )
        report.findings.append(finding)
        report.output[program.name] = program.last_lines(_LAST_LINES)
        tell(finding)
    return not stubborn


def _programs(exercise: Exercise) -> str:
    parts = [work.about for work in exercise.work]
    return (
        f"up to {len(parts)} files ({'; '.join(parts)}), or one launch file"
        if len(parts) > 1
        else f"one file ({parts[0]})"
    )


def _topics(steps: Iterable[Step]) -> list[str]:
    """Return the topics to which the check subscribes at its start."""
    found = [step.subject for step in steps if step.kind in ("message", "rate", "span")]
    found += [
        step.options[key]
        for step in steps
        if step.kind == "answer"
        for key in ("rate",)
        if key in step.options
    ]
    return list(dict.fromkeys(found))


def _press(trial: Trial, step: Step) -> None:
    trial.world.board.press(step.subject)


def _release(trial: Trial, step: Step) -> None:
    trial.world.board.release(step.subject)


def _click(trial: Trial, step: Step) -> None:
    trial.world.board.press(step.subject)
    time.sleep(_PRESS_SECONDS)
    trial.world.board.release(step.subject)


def _person(trial: Trial, step: Step) -> None:
    place = step.subject
    if place == "away":
        trial.world.board.move_person(None)
    elif isinstance(place, list):
        trial.world.board.move_person((float(place[0]), float(place[1])))
    else:
        trial.world.board.move_person((float(place), 0.0))


def _publish(trial: Trial, step: Step) -> None:
    rate = float(step.options.get("rate", _REPEAT_HERTZ))
    trial.world.publish(step.subject, step.options["type"], step.options.get("message", {}), rate)


def _log(trial: Trial, step: Step) -> None:
    level = step.options.get("level", "info").upper()
    number = next(value for value, name in LEVEL_NAMES.items() if name == level)
    message = {"name": step.options.get("name", "/robot"), "level": number, "msg": str(step.subject)}
    trial.world.publish("/rosout", "rosgraph_msgs/Log", message, _REPEAT_HERTZ)


def _set_param(trial: Trial, step: Step) -> None:
    trial.world.graph.master.set_param(step.subject, step.options["value"])


def _call(trial: Trial, step: Step) -> None:
    expectations.call(trial, step)


def _wait(trial: Trial, step: Step) -> None:
    time.sleep(float(step.subject))


_ACTIONS: Mapping[str, Callable[[Trial, Step], None]] = {
    "press": _press,
    "release": _release,
    "click": _click,
    "person": _person,
    "publish": _publish,
    "log": _log,
    "set_param": _set_param,
    "call": _call,
    "wait": _wait,
}
