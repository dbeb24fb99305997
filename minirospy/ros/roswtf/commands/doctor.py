"""`minirospy doctor` and `roswtf`: find problems, and print a line with a remedy for each.

Source: http://wiki.ros.org/roswtf.
"""

from __future__ import annotations

import logging
import signal
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from minirospy.base.clock import SignalSafeEvent
from minirospy.base.signal_dispatch import interrupt_signals
from minirospy.command.parser import AssignmentParser, Misuse, Parser
from minirospy.command.verbs import Command
from minirospy.introspect.doctor import Examination, Finding, Status, ok, problem

__all__ = ["DOCTOR", "ROSWTF", "main", "roswtf"]

_WORDS = {Status.OK: "ok     ", Status.WARNING: "warning", Status.PROBLEM: "PROBLEM"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command `minirospy doctor`; return its exit status."""
    return DOCTOR.main(argv)


def roswtf(argv: Sequence[str] | None = None) -> int:
    """Run the command `roswtf`; return its exit status."""
    return ROSWTF.main(argv)


_ABOUT_ROSWTF = """roswtf is a tool for verifying a ROS installation and running system. Checks
provided launchfile if provided, else current stack or package."""


def _parser(name: str) -> Parser:
    is_roswtf = name == "roswtf"
    parser = AssignmentParser(
        name,
        "Checks this machine, its network and the graph, and prints what to do. "
        "Exit status: 0 without problems, 1 with, 2 usage error.",
        "roswtf [launch file]" if is_roswtf else "",
        about=_ABOUT_ROSWTF if is_roswtf else "",
    )

    parser.add_argument(
        "others",
        nargs="*",
        metavar="HOST|FILE.launch",
        help="another machine to try too, by its name or address; a launch file to check too (with arg:=value)",
        completer="launch_files",
    )

    # ROS's roswtf has these options, which have no effect here.
    parser.accept(
        "--all", help="run roswtf against all packages" if is_roswtf else "accepted, without effect"
    )
    parser.accept("--no-plugins", help="disable roswtf plugins" if is_roswtf else "accepted, without effect")
    parser.add_argument(
        "--offline",
        action="store_true",
        help="only run offline tests" if is_roswtf else "only what needs no network",
    )

    add_own = parser.own_options().add_argument if is_roswtf else parser.add_argument
    add_own(
        "--listen", action="store_true", help="then wait for the doctors of other machines, and connect back"
    )
    add_own("--json", action="store_true", help="print the findings as JSON, one a line")
    return parser


def _doctor(others: Sequence[str], listen: bool, offline: bool, json: bool, args: dict[str, str]) -> int:
    if listen and offline:
        raise Misuse("--listen needs the network")
    machines = [word for word in others if not _is_file(word)]
    if machines and offline:
        raise Misuse(f"{machines[0]}: to try another machine needs the network")

    # Suppress the log of the node that runs the checks: the checks themselves report the errors that it logs.
    logging.getLogger("minirospy").addHandler(logging.NullHandler())
    show = _show_json if json else _show
    counts = dict.fromkeys(Status, 0)
    with Examination(machines=machines, offline=offline) as examination:
        for finding in _all(examination, list(filter(_is_file, others)), args):
            counts[finding.status] += 1
            show(finding)

        if not json:
            print(_summary(counts), flush=True)
        if listen and examination.listen(show):
            print("listening: type `minirospy doctor` on the other machine; Ctrl-C ends this", flush=True)
            _wait_for_signal()
    return 1 if counts[Status.PROBLEM] else 0


def _is_file(word: str) -> bool:
    """Return whether an argument names a file, not a machine."""
    return "/" in word or word.endswith((".launch", ".test", ".xml")) or Path(word).is_file()


def _wait_for_signal() -> None:
    """Wait for Ctrl-C or SIGTERM, so that the listener can unregister before the process exits."""
    stop = SignalSafeEvent()
    for number in (*interrupt_signals(), signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    # Wait in slices: on Windows, signals do not interrupt a wait without a timeout.
    while not stop.wait(0.5):
        pass


def _all(examination: Examination, files: Sequence[str], args: dict[str, str]) -> Iterator[Finding]:
    yield from examination.findings()
    for file in files:
        yield from _launch_findings(file, args)


def _launch_findings(file: str, args: dict[str, str]) -> Iterator[Finding]:
    """Yield findings: whether a launch file loads and its programs exist."""
    from minirospy.base.errors import MinirospyError
    from minirospy.ros.roslaunch.launcher.command import node_command
    from minirospy.ros.roslaunch.launcher.load import load_files
    from minirospy.workspace.packages import Packages

    packages = Packages()
    if not Path(file).is_file():
        yield problem("launch file", f"{file} is not a file", "give its path")
        return
    try:
        spec = load_files([file], args, packages)
    except MinirospyError as error:
        yield problem("launch file", str(error), "correct it")
        return
    found = True
    for node in spec.nodes:
        try:
            node_command(node, packages)
        except MinirospyError as error:
            found = False
            yield problem("launch file", str(error), "correct the <node>")
    if found:
        yield ok("launch file", f"{file}: {len(spec.nodes)} node(s), all programs are there")


def _show(finding: Finding) -> None:
    advice = f" -> {finding.advice}" if finding.advice else ""
    print(f"{_WORDS[finding.status]} {finding.check}: {finding.text}{advice}", flush=True)


def _show_json(finding: Finding) -> None:
    import json

    print(json.dumps({**finding._asdict(), "status": finding.status.value}), flush=True)


def _summary(counts: dict[Status, int]) -> str:
    found = [
        f"{number} {status.value}{'s' if number > 1 else ''}"
        for status, number in (
            (Status.PROBLEM, counts[Status.PROBLEM]),
            (Status.WARNING, counts[Status.WARNING]),
        )
        if number
    ]
    return " and ".join(found) if found else "all is well"


DOCTOR = Command("minirospy doctor", partial(_parser, "minirospy doctor"), _doctor)
ROSWTF = Command("roswtf", partial(_parser, "roswtf"), _doctor)


if __name__ == "__main__":
    sys.exit(main())
