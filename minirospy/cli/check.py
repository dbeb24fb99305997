"""`minirospy check`: run a student's program on a new master and a new virtual board, and print which expectations hold."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NotFoundError, SourceError
from minirospy.command.command import RosText, WordedError, warn
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command

if TYPE_CHECKING:
    from minirospy.base.environment import Environment
    from minirospy.course.checker import Finding, Report
    from minirospy.course.exercise import Exercise
    from minirospy.course.results import Record

__all__ = ["COMMAND", "main"]

NOT_PASSED = 1
NOT_CHECKED = 3
_MAX_NAMED = 5  # maximum number of topics that the warning of --class names

_EPILOG = """\
Exit status: 0 passed, 1 not passed, 2 usage error, 3 the check itself could not run (no such exercise or program, an error in
the exercise's file), 130 interrupted."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return 0 if the exercise is passed, 1 if not, 2 for a usage error, 3 if the check itself failed."""
    return COMMAND.main(argv)


def _parser() -> Parser:
    parser = Parser(
        "minirospy check",
        "Check your program for an exercise of the course. It runs on a new master and a new virtual board, so that nothing "
        "that runs is disturbed. Without arguments, list the exercises and those that you have passed.",
        epilog=_EPILOG,
    )
    add = parser.add_argument
    add(
        "exercise",
        nargs="?",
        help="the exercise, or the YAML file of your own: ./my_exercise.yaml",
        completer="exercises",
    )
    add(
        "work",
        nargs="*",
        metavar="FILE",
        help="your programs or launch file, as FILE or PACKAGE/PROGRAM (those that the page names), or your answers",
        completer="exercise_work",
    )
    add(
        "--patience",
        type=float,
        default=1.0,
        metavar="N",
        help="multiply all time limits: 3 for a slow computer",
        completer="nothing",
    )
    add(
        "--join",
        metavar="URI",
        help="send your results to the teacher's master from now on: http://192.168.65.50:11311",
        completer="nothing",
    )
    add("--name", metavar="NAME", help="your name in the teacher's table, from now on", completer="nothing")
    add(
        "--one-master",
        nargs="?",
        const="",
        metavar="SHELL",
        help='with --join: print the variables for a class with one master: eval "$(minirospy check --join URI --one-master)"; '
        "SHELL as for `minirospy shell`, such as powershell",
        completer="shells",
    )
    add(
        "--snapshot",
        metavar="FILE.zip",
        help="write the workspace, `minirospy doctor` and your results into a file, for help",
        completer="files",
    )
    add(
        "--share",
        action="store_true",
        help="show your results, board and nodes on the teacher's page until Ctrl-C",
    )
    add(
        "--class",
        dest="shows_class",
        action="store_true",
        help="print the results of all students at the master, and of those who use --share in a fleet",
    )
    return parser


def _check(
    exercise: str | None,
    work: list[str],
    patience: float,
    join: str | None,
    name: str | None,
    one_master: str | None,
    snapshot: str | None,
    share: bool,
    shows_class: bool,
) -> int:
    if not 0.1 <= patience <= 100:
        raise Misuse("--patience takes a number from 0.1 to 100")
    from minirospy.base.environment import Environment
    from minirospy.course.results import Record

    environment = Environment.read()
    record = Record.read(environment)
    if one_master is not None and join is None:
        raise Misuse("--one-master needs --join URI")
    if join == "":
        raise Misuse("--join takes the URI of a master, such as http://192.168.65.50:11311")
    if one_master is not None:
        from minirospy.cli.completion.shell import shell_name

        # Use sh's syntax by default, which all Unix shells accept: SHELL may not name the shell that evaluates the lines.
        in_cmd = sys.platform == "win32" and "SHELL" not in os.environ
        one_master = shell_name(one_master or ("bat" if in_cmd else "sh"))
    if join is not None or name is not None:
        from minirospy.course.results import class_master
        from minirospy.course.results import join as join_class

        join_class(record, join or "", name or "")
        record.write()
        if one_master is not None:
            _print_variables(record, one_master)
            return 0
        uri = class_master(record, environment)
        where = (
            f"results go to {uri}"
            if uri
            else "results stay on this computer; --join URI sends them to the teacher"
        )
        print(f"{record.to_parameter()['student']}: {where}")
        if exercise is None and not share:
            return 0
    if exercise is not None and (share or shows_class or snapshot is not None):
        raise Misuse(f"--{'share' if share else 'class' if shows_class else 'snapshot'} takes no exercise")
    if snapshot is not None:
        return _write_snapshot(snapshot, environment)
    if share:
        from minirospy.course.share import share as share_state

        print(
            "Your board and your nodes are on the teacher's page, which only shows them; Ctrl-C ends it.",
            flush=True,
        )
        with contextlib.suppress(KeyboardInterrupt):
            share_state(record, environment)
        return 0
    if shows_class:
        return _show_class(record.master or environment.master_uri, environment, patience)
    if exercise is None:
        return _list(record)
    try:
        return _run(exercise, work, patience, record, environment.master_uri)
    except (NotFoundError, SourceError) as error:
        raise WordedError(error, RosText("", NOT_CHECKED)) from error


def _run(word: str, work: list[str], patience: float, record: Record, master_uri: str) -> int:
    from minirospy.base.environment import Environment
    from minirospy.course.checker import check, words_of
    from minirospy.course.exercise import find_exercise
    from minirospy.course.results import publish

    exercise = find_exercise(word)
    programs, answers = words_of(exercise, work)
    print(f"{exercise.name}: {exercise.title}", flush=True)
    if exercise.live and exercise.task and not exercise.questions:
        print(exercise.task, flush=True)
    report = check(
        exercise,
        programs,
        answers=answers,
        ask=_ask if sys.stdin.isatty() else None,
        patience=patience,
        tell=_tell,
    )
    _conclude(report)
    record.add(report)
    record.write()
    try:
        publish(record, Environment.read())
    except MasterUnreachableError as error:
        warn(f"the result is stored, but not sent to the teacher: {error}")
    except MinirospyError as error:
        warn(f"the result is stored, but not sent to the master {master_uri}: {error}")
    return 0 if report.passed else NOT_PASSED


def _print_variables(record: Record, shell: str) -> None:
    """Print lines that select the class's master and the student's namespace when a shell evaluates them."""
    from minirospy.base.environment import split_uri
    from minirospy.introspect.doctor.reach import own_address_towards
    from minirospy.workspace.setup_files import assignments

    variables = {
        "ROS_MASTER_URI": record.master,
        # The master has just responded, so there is a route to it.
        "ROS_IP": own_address_towards(split_uri(record.master)[0]),
        "ROS_NAMESPACE": record.class_parameter.rpartition("/")[2],
    }
    sys.stdout.write(assignments(shell, variables))


def _write_snapshot(name: str, environment: Environment) -> int:
    from pathlib import Path

    from minirospy.course.snapshot import write_snapshot

    count, left_out = write_snapshot(Path(name), environment)
    for file, reason in left_out.items():
        warn(f"{file} is left out: {reason}")
    print(
        f"{name}: {count} files of the workspace, the output of minirospy doctor, your results. Read it before you send it."
    )
    return 0


def _ask(question: str) -> str:
    print(f"{question} ", end="", flush=True)
    return sys.stdin.readline()


def _tell(finding: Finding) -> None:
    from minirospy.base.escape import escaped

    # A finding may contain output from the student's program, so escape control characters.
    print(escaped(str(finding)), flush=True)


def _conclude(report: Report) -> None:
    """Print the last lines of output from failed programs, and the result."""
    from minirospy.base.escape import escaped

    for name, lines in report.output.items():
        print(f"The last lines of {name}:" if lines else f"{name} printed nothing.")
        for line in lines:
            print(f"    {escaped(line)}")
    tried = [finding for finding in report.findings if finding.holds is not None]
    if report.passed:
        print(f"Passed: all {len(tried)} points hold.")
    else:
        skipped = len(report.findings) - len(tried)
        more = f", {skipped} were not tried" if skipped else ""
        print(f"Not passed: {len(report.failures)} of {len(tried)} points do not hold{more}.")


def _list(record: Record) -> int:
    from minirospy.course.exercise import built_in_names, find_exercise

    exercises = [find_exercise(name) for name in built_in_names()]
    width = max(len(exercise.name) for exercise in exercises)
    passed = 0
    for exercise in exercises:
        result = record.results.get(exercise.name)
        passed += bool(result and result.ever)
        print(f"{_state(record, exercise):<10} {exercise.name:<{width}}  {exercise.title} ({exercise.page})")
    print(f"{passed} of {len(exercises)} passed on this computer. Check one: minirospy check EXERCISE [FILE]")
    return 0


def _state(record: Record, exercise: Exercise) -> str:
    result = record.results.get(exercise.name)
    return "-" if result is None else "passed" if result.ever else "not passed"


def _show_class(uri: str, environment: Environment, patience: float) -> int:
    from minirospy.base.escape import escaped
    from minirospy.course.classroom import NO_MESSAGE, class_table, gather
    from minirospy.course.exercise import built_in_names
    from minirospy.course.results import SECONDS

    students, unreadable = gather(uri, environment, patience * SECONDS)
    if unreadable:
        more = f", and {len(unreadable) - _MAX_NAMED} more" if len(unreadable) > _MAX_NAMED else ""
        is_silent = any(each.endswith(NO_MESSAGE) for each in unreadable)
        hint = ". `rosnode cleanup` makes the master forget nodes that were killed." if is_silent else ""
        warn(escaped(f"results may be missing: {'; '.join(unreadable[:_MAX_NAMED])}{more}{hint}"))
    if not students:
        address, meaning = _address_for_students(environment._replace(master_uri=uri))
        print(
            f"No results at {uri} yet: students type `minirospy check --join {address} --name NAME` once{meaning}, or, in a "
            "fleet, `minirospy check --share`."
        )
        return 0
    table = [[escaped(cell) for cell in row] for row in class_table(students, built_in_names())]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for row in table:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())
    for student in students:
        for name, result in student.results.items():
            if not result.passed and result.failures:
                when = time.strftime(", %H:%M", time.localtime(result.time)) if result.time else ""
                print(escaped(f"{student.title}, {name}{when}: {result.failures[0]}"))
    return 0


def _address_for_students(environment: Environment) -> tuple[str, str]:
    """Return what students pass to --join to reach the master, and a parenthesis that explains it if it is a placeholder.

    On another computer, localhost is that computer.
    """
    from minirospy.base.environment import DEFAULT_MASTER_PORT

    if not environment.master_is_local:
        return environment.master_uri, ""
    port = environment.master_address[1]
    if environment.bind_host in ("0.0.0.0", "::"):  # the address that it advertises is not localhost
        return f"http://{environment.uri_host}:{port}", ""
    address = "ADDRESS" if port == DEFAULT_MASTER_PORT else f"ADDRESS:{port}"
    return address, " (ADDRESS: the IP address of this computer in the classroom's network)"


COMMAND = Command("minirospy check", _parser, _check, interrupted=130)
