"""The results of all students at a master.

There are two sources: the parameters that checks set, and the topics that `minirospy check --share` publishes on the students'
own masters, which a fleet forwards. The page's classroom.js merges them by the same rules, and adds the boards;
tests/course/classes.json has cases for both.
"""

from __future__ import annotations

import functools
import json
import os
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from minirospy.base.environment import Environment
from minirospy.base.errors import DeserializationError, RpcRefused
from minirospy.core.idl.load import message_class
from minirospy.core.wire.framing import Frame
from minirospy.core.wire.header import Header
from minirospy.course.results import CLASS_PARAMETER, MAX_KEY, MAX_NAME, SECONDS, Result, printable, result_of
from minirospy.introspect.messages import Received
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["NO_MESSAGE", "Classroom", "Shared", "Student", "class_table", "gather", "merge", "read_shared"]

NO_MESSAGE = "it sent no message"  # why a publisher is unreadable
MAX_STUDENTS = 200  # rows, and publishers of topics
MAX_EXERCISES = 100  # columns: the course has 15
MAX_MESSAGE = 150_000  # characters: 15 exercises with 5 failures of 300 characters, each as \u0000
_MAX_BYTES = 4 + 4 * MAX_MESSAGE  # a length, and at most four bytes for a character
_TYPE = "std_msgs/String"
_TOOL = "check_class"
_RESULT = {"passed", "ever", "time", "number", "failures"}  # fields of an exercise
_NOW = {"leds", "buttons", "nodes", "beat"}  # fields of the board's state, which only the page shows
_NAME = re.compile(rf"[A-Za-z0-9_]{{1,{MAX_KEY}}}")


@dataclass
class Student:
    """A row of the class's table: one computer's results.

    ``key`` is the last part of the computer's parameter name. ``robot`` is its name in a fleet, or empty.
    """

    key: str
    name: str
    results: dict[str, Result] = field(default_factory=dict)
    robot: str = ""

    @property
    def title(self) -> str:
        """Return the name, with the robot's if it differs: fresh computers share a name."""
        return f"{self.name} ({self.robot})" if self.robot not in ("", self.name) else self.name


class Shared(NamedTuple):
    """The results in a message of a student's computer. ``student`` may be empty."""

    key: str
    student: str
    results: dict[str, Result]


class Classroom(NamedTuple):
    """The students, sorted by name, and for what could not be read a phrase with the reason, such as a topic."""

    students: list[Student]
    unreadable: list[str]


def gather(uri: str, environment: Environment, patience: float = SECONDS) -> Classroom:
    """Return the students with results on a master. Wait ``patience`` seconds at most for the messages of topics.

    Raise MasterUnreachableError if the master does not respond.
    """
    master = MasterProxy(uri, f"/class_{os.getpid()}", timeout=SECONDS)
    try:
        try:
            parameters = master.get_param(CLASS_PARAMETER)
        except RpcRefused:
            parameters = {}
        types = master.get_topic_types()
        publishers = master.get_system_state().publishers
    finally:
        master.close()
    sources = [
        (topic, publisher)
        for topic in sorted(publishers)
        if topic.endswith(CLASS_PARAMETER) and types.get(topic) == _TYPE
        for publisher in sorted(publishers[topic])
    ]
    beyond = [f"more than {MAX_STUDENTS} publishers"] if len(sources) > MAX_STUDENTS else []
    sources = sources[:MAX_STUDENTS]
    received = _receive(sources, environment._replace(master_uri=uri), patience) if sources else {}
    shared: list[tuple[str, Shared]] = []
    unreadable = []
    for source in sources:
        topic, publisher = source
        found = _read(received[source]) if source in received else None
        if found:
            shared.append((topic, found))
        else:
            why = "its message is not a student's" if source in received else NO_MESSAGE
            unreadable.append(f"{topic} of {publisher}: {why}")
    return Classroom(merge(parameters, shared), beyond + unreadable)


def read_shared(text: str) -> Shared | None:
    """Return the results in a message's text, or None if it is not a student's."""
    if len(text) > MAX_MESSAGE:
        return None
    try:
        found = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        return None
    key = found.get("key") if isinstance(found, dict) else None
    if not isinstance(key, str) or not _NAME.fullmatch(key):
        return None
    student = found.get("student")
    name = printable(student, MAX_NAME) if isinstance(student, str) else ""
    return Shared(key, name, dict(_results(found.get("exercises"))[:MAX_EXERCISES]))


def merge(parameters: object, shared: Iterable[tuple[str, Shared]]) -> list[Student]:
    """Return the students, sorted by name, from the value of the class's parameter and from (topic, results) of messages.

    A student with a parameter and a topic has one row, with the later result of each exercise; an exercise stays passed.
    Values of other kinds, which any node may set, are left out.
    """
    rows: dict[str, Student] = {}
    columns: set[str] = set()

    def row(name: str, key: str) -> Student | None:
        if name not in rows and len(rows) < MAX_STUDENTS:
            rows[name] = Student(key, key)
        return rows.get(name)

    def add(student: Student, results: Iterable[tuple[str, Result]]) -> None:
        for name, result in results:
            if name not in columns and len(columns) >= MAX_EXERCISES:
                continue
            columns.add(name)
            old = student.results.get(name)
            latest = old if old and old.time > result.time else result
            student.results[name] = replace(latest, ever=result.ever or bool(old and old.ever))

    for key, value in parameters.items() if isinstance(parameters, dict) else ():
        if not _NAME.fullmatch(key) or not isinstance(value, dict):
            continue
        own_name, results = value.get("student"), _results(value.get("exercises"))
        is_shown = isinstance(own_name, str) or results or _has_any(_NOW, value.get("now"))
        if is_shown and (student := row(key, key)):
            if isinstance(own_name, str):
                student.name = printable(own_name, MAX_NAME)
            add(student, results)

    with_topics: dict[str, str] = {}  # the row's name -> its topic
    for topic, found in shared:
        robot = topic[1 : -len(CLASS_PARAMETER)]
        # Computers of one name, which have no parameters, have a row each. One computer may have two publishers of its topic.
        is_known = found.key in rows and with_topics.get(found.key, topic) == topic
        name = found.key if is_known else f"{robot}/{found.key}"
        if student := row(name, found.key):
            with_topics[name] = topic
            student.robot = printable(robot, MAX_NAME)
            student.name = found.student or student.name
            add(student, found.results.items())
    in_order = sorted(rows, key=lambda name: (_letters(rows[name].name), rows[name].robot, name))
    return [rows[name] for name in in_order]


def class_table(students: list[Student], names: list[str]) -> list[list[str]]:
    """Return the class's table, including its header. Cells are "yes", "no" (not passed yet), or empty (not tried)."""
    used = [name for name in names if any(name in student.results for student in students)]
    used += sorted({name for student in students for name in student.results} - set(names))
    rows = [[student.title, *(_mark(student.results.get(name)) for name in used)] for student in students]
    return [["", *used], *rows]


def _receive(
    sources: list[tuple[str, str]], environment: Environment, patience: float
) -> dict[tuple[str, str], Received]:
    """Return the latest message of each (topic, publisher), without those of publishers that send none."""
    wanted = frozenset(sources)
    missing = set(sources)
    received: dict[tuple[str, str], Received] = {}

    with ToolNode(environment, _TOOL) as node:

        def deliver(topic: str, body: Frame, header: Header) -> None:
            source = topic, header.get("callerid", "")
            if source not in wanted:
                return
            # Of a message that is too long, nothing is kept.
            kept = bytes(body) if len(body) <= _MAX_BYTES else b""
            received[source] = Received(kept, header, node.clock.now())
            missing.discard(source)
            if not missing:
                node.stop()

        for topic in dict.fromkeys(topic for topic, _ in sources):
            node.listen(topic, functools.partial(deliver, topic))
        node.wait(patience)
        return dict(received)


def _read(received: Received) -> Shared | None:
    """Return the results in a received message, or None if it is not a student's."""
    string = message_class(_TYPE)
    message: Any = string()
    if received.header.get("type") != _TYPE or received.header.get("md5sum") != string._md5sum:
        return None
    try:
        message.deserialize(received.body)
    except DeserializationError:
        return None
    return read_shared(message.data)


def _results(exercises: object) -> list[tuple[str, Result]]:
    """Return the results with their exercises' names."""
    found = exercises.items() if isinstance(exercises, Mapping) else ()
    return [
        (name, result_of(each)) for name, each in found if _NAME.fullmatch(name) and _has_any(_RESULT, each)
    ]


def _has_any(fields: set[str], found: object) -> bool:
    """Return whether a value is a dictionary with one of the fields; a field's value is no dictionary itself."""
    return isinstance(found, Mapping) and any(
        name in fields and not isinstance(each, Mapping) for name, each in found.items()
    )


def _letters(name: str) -> str:
    """Return a name's letters for sorting: in upper case, without accents."""
    parts = unicodedata.normalize("NFKD", name)
    return "".join(each for each in parts if not unicodedata.category(each).startswith("M")).upper()


def _refuse(constant: str) -> object:
    raise ValueError(f"{constant} is not JSON")


def _mark(result: Result | None) -> str:
    return "" if result is None else "yes" if result.ever else "no"
