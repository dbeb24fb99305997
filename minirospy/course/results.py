"""The results of this computer: a file in ROS_HOME, and a parameter on the class's master.

The parameter ``/minirospy_class/STUDENT`` is a dictionary with the student's name and the exercises. It stays on the master after
the check has exited, so that the teacher's page can show it later.
"""

from __future__ import annotations

import json
import os
import re
import socket
import tempfile
import time
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.base.environment import Environment, split_uri
from minirospy.base.errors import MasterUnreachableError, MinirospyError, UsageError
from minirospy.base.escape import escaped
from minirospy.base.private_files import replace_file
from minirospy.course.exercise import built_in_names
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    from minirospy.course.checker import Report

__all__ = [
    "CLASS_PARAMETER",
    "MAX_KEY",
    "MAX_NAME",
    "SECONDS",
    "Record",
    "Result",
    "class_master",
    "join",
    "printable",
    "publish",
    "result_of",
]

CLASS_PARAMETER = "/minirospy_class"
_MAX_FAILURES = 5  # maximum number of sentences about a failed check that the teacher sees
_MAX_LETTERS = 300  # maximum length of such a sentence, in characters
MAX_NAME = 60  # maximum length of a student's name, in characters
MAX_KEY = 64  # maximum length of a parameter name's last part; the page's classroom.js ignores longer ones
_MAX_TIME = 4e9  # year 2096 in Unix time: time.localtime rejects far larger values
SECONDS = 3.0  # timeout in seconds for the class's master, whose computer may have been shut down


@dataclass(frozen=True)
class Result:
    """The latest result of one exercise.

    ``time``: seconds since 1970 (0: unknown). ``failures``: the sentences of the expectations that failed. ``ever``: whether the
    exercise has ever been passed.
    """

    passed: bool
    time: float
    ever: bool = False
    failures: tuple[str, ...] = ()


@dataclass
class Record:
    """This computer's results, the student's name, and the URI of the class's master (if empty, `class_master` chooses it)."""

    path: Path
    student: str = ""
    master: str = ""
    results: dict[str, Result] = field(default_factory=dict)

    @classmethod
    def read(cls, environment: Environment) -> Record:
        """Read the record. An unreadable file counts as empty, so that the check itself does not fail."""
        record = cls(environment.home / "minirospy_class.json")
        try:
            found = json.loads(record.path.read_text(encoding="utf-8"))
            record.student = str(found.get("student", ""))
            record.master = str(found.get("master", ""))
            record.results = {
                str(name): result_of(each) for name, each in dict(found.get("exercises", {})).items()
            }
        except (OSError, ValueError, TypeError, AttributeError, KeyError):
            pass
        return record

    @property
    def class_parameter(self) -> str:
        """Return the name of the parameter for this computer on the class's master."""
        return f"{CLASS_PARAMETER}/{parameter_key(self.student or default_name())}"

    def add(self, report: Report) -> None:
        """Add the result of a check."""
        name = report.exercise.name
        before = self.results.get(name)
        # A student program's output may contain control characters, which XML-RPC cannot transmit.
        failures = tuple(
            escaped(f"{each.sentence}: {each.observed}")[:_MAX_LETTERS] for each in report.failures
        )
        self.results[name] = Result(
            report.passed,
            time.time(),
            report.passed or bool(before and before.ever),
            failures[:_MAX_FAILURES],
        )

    def write(self) -> None:
        """Write the record to its file atomically. Raise MinirospyError if that fails."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.path.parent, prefix=self.path.name)
            with os.fdopen(handle, "w", encoding="utf-8") as stream:
                json.dump({**self.to_parameter(), "master": self.master}, stream, indent=1)
            replace_file(name, self.path)
        except OSError as error:
            raise MinirospyError(f"{self.path} cannot be written: {error.strerror}") from error

    def to_parameter(self) -> dict[str, object]:
        """Return the record as a parameter value. ``number`` is the exercise's position in the course."""
        numbers = {name: number for number, name in enumerate(built_in_names())}
        return {
            "student": self.student or default_name(),
            "exercises": {
                name: {
                    "passed": each.passed,
                    "ever": each.ever,
                    "time": each.time,
                    "failures": list(each.failures),
                    "number": numbers.get(name, len(numbers)),
                }
                for name, each in self.results.items()
            },
        }


def default_name() -> str:
    """Return a default for the student's name in the class's table: the name of the board or the computer."""
    return os.environ.get("MINIROSPY_BOARD") or socket.gethostname().partition(".")[0]


def join(record: Record, uri: str, name: str) -> None:
    """Set the class's master and the student's name in the record; send the record to that master if ``uri`` is given.

    Raise UsageError if the URI is invalid, MasterUnreachableError if no master responds there.
    """
    if uri:
        if "://" not in uri:
            uri = f"http://{uri}" if ":" in uri else f"http://{uri}:11311"
        try:
            split_uri(uri)
        except ValueError:
            raise UsageError(
                f"[{uri}] is not the URI of a master, such as http://192.168.65.50:11311"
            ) from None
        record.master = uri
    if name:
        record.student = escaped(name)[:MAX_NAME]
    if uri:
        send(record, uri)


def class_master(record: Record, environment: Environment) -> str:
    """Return the URI of the class's master: given by `--join`, or ROS_MASTER_URI if that is on another computer.

    Return an empty string if there is none. A master on this computer belongs to the student, and the results must not appear
    there: `rosparam list` would show parameters that the pages of the course do not mention.
    """
    if record.master:
        return record.master
    return "" if environment.master_is_local else environment.master_uri


def publish(record: Record, environment: Environment) -> str:
    """Send the record to the class's master; return the master's URI, or an empty string if there is none.

    Raise MasterUnreachableError only if the student has joined a class whose master does not respond.
    """
    uri = class_master(record, environment)
    if not uri:
        return ""
    try:
        send(record, uri)
    except MasterUnreachableError:
        if record.master:
            raise
        return ""
    return uri


def send(record: Record, uri: str) -> None:
    """Send the record to the master at ``uri``. Raise MasterUnreachableError if it does not respond."""
    master = MasterProxy(uri, f"/check_{os.getpid()}", timeout=SECONDS)
    try:
        # Set each part separately, to preserve the state that share.py stores under the same parameter.
        for part, value in record.to_parameter().items():
            master.set_param(f"{record.class_parameter}/{part}", value)
    finally:
        master.close()


def parameter_key(name: str) -> str:
    """Convert a name to a parameter name's last part: letters, digits and underscores, starting with a letter.

    It has at most ``MAX_KEY`` characters. A checksum keeps names apart that differ only in other characters, such as Jörg
    and Jürg, or after the cut.
    """
    text = re.sub(r"\W", "_", name, flags=re.ASCII)
    prefix = "" if text[:1].isalpha() else "c_"
    room = MAX_KEY - len(prefix)
    if text != name or len(text) > room:
        checksum = f"_{zlib.crc32(name.encode()):08x}"
        text = text[: room - len(checksum)] + checksum
    return prefix + text


def result_of(found: Mapping[str, object]) -> Result:
    """Return the result of an exercise. Parts of other kinds are left out, because any node may have set the parameter."""
    passed = found.get("passed") is True
    failures = found.get("failures")
    texts = [each for each in failures if isinstance(each, str)] if isinstance(failures, list) else []
    return Result(
        passed,
        _time_of(found.get("time")),
        passed or found.get("ever") is True,
        tuple(printable(each, _MAX_LETTERS) for each in texts[:_MAX_FAILURES]),
    )


def printable(text: str, limit: int) -> str:
    """Return the first ``limit`` characters of a text. Replace each unpaired surrogate, which JSON can contain, by "?"."""
    return text[:limit].encode("utf-8", "replace").decode("utf-8")


def _time_of(found: object) -> float:
    """Return the time, or 0 (unknown) if the value is invalid, because any node may have set the parameter."""
    if isinstance(found, bool) or not isinstance(found, int | float) or not 0 <= found < _MAX_TIME:
        return 0.0
    return float(found)
