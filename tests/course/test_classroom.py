"""`minirospy check --class`: students at a master, from parameters and from the topics that a fleet forwards."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.core.idl.load import message_class
from minirospy.course.classroom import (
    MAX_EXERCISES,
    MAX_MESSAGE,
    MAX_STUDENTS,
    Student,
    class_table,
    gather,
    merge,
    read_shared,
)
from minirospy.introspect.streams import ToolNode
from minirospy.runtime.rpc.master_proxy import MasterProxy

CASES = json.loads((Path(__file__).parent / "classes.json").read_text(encoding="utf-8"))
PASSED = {"passed": True, "ever": True, "time": 1}
LONG = 60.0  # seconds that a loaded machine does not need for a message
Publish = Callable[..., None]


def rows(students: list[Student]) -> list[object]:
    return [
        [
            student.name,
            student.robot,
            {
                name: [result.passed, result.ever, result.time, list(result.failures)]
                for name, result in student.results.items()
            },
        ]
        for student in students
    ]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["about"])
def test_sources_are_merged_as_on_the_page(case: dict[str, Any]) -> None:
    texts = [
        (topic, value if isinstance(value, str) else json.dumps(value)) for topic, value in case["topics"]
    ]
    read = [(topic, read_shared(text)) for topic, text in texts]
    assert [topic for topic, found in read if not found] == case.get("unreadable", [])
    students = merge(case["parameters"], [(topic, found) for topic, found in read if found])
    assert rows(students) == case["students"]


@pytest.mark.parametrize(
    "text",
    ["[" * 50_000, json.dumps({"key": "a", "student": "x" * MAX_MESSAGE}), '{"key": "%s"}' % ("a" * 65)],
    ids=["deep", "long", "long key"],
)
def test_message_beyond_a_limit_is_refused(text: str) -> None:
    assert read_shared(text) is None


def test_students_exercises_and_texts_have_a_limit() -> None:
    exercises = {f"e{index}": {**PASSED, "failures": ["x" * 5000] * 100} for index in range(500)}
    parameters = {
        f"s{index}": {"student": "x" * 5000, "exercises": {f"f{index}": PASSED, **exercises}}
        for index in range(500)
    }
    students = merge(parameters, [])
    assert len(students) == MAX_STUDENTS
    assert len({name for student in students for name in student.results}) == MAX_EXERCISES
    assert len(students[0].name) == 60
    [long] = {len(result.failures) for result in students[0].results.values() if result.failures}
    assert long == 5
    assert len(students[0].results["e1"].failures[0]) == 300
    found = read_shared(json.dumps({"key": "a", "exercises": {f"e{index}": PASSED for index in range(500)}}))
    assert found
    assert len(found.results) == MAX_EXERCISES


def test_half_a_character_in_a_name_can_be_printed() -> None:
    found = read_shared('{"key": "a", "student": "Eve\\ud800", "exercises": {}}')
    assert found
    assert found.student.encode() == b"Eve?"


def test_computers_of_one_name_have_their_own_cells() -> None:
    texts = {"robot1": {"count": PASSED}, "robot2": {}}
    shared = [
        (f"/{robot}/minirospy_class", read_shared(json.dumps({"key": "pi", "exercises": exercises})))
        for robot, exercises in texts.items()
    ]
    students = merge({}, [(topic, found) for topic, found in shared if found])
    assert class_table(students, ["count"]) == [["", "count"], ["pi (robot1)", "yes"], ["pi (robot2)", ""]]


@pytest.fixture
def publish(master: str) -> Iterator[Publish]:
    """Return a function that publishes a latched text on a topic, from a node with the given name."""
    with contextlib.ExitStack() as stack:
        nodes: dict[str, ToolNode] = {}

        def do(
            topic: str, text: str | None, *, name: str = "control", type_: str = "std_msgs/String"
        ) -> None:
            if name not in nodes:
                nodes[name] = stack.enter_context(ToolNode(Environment.read(), "test", name=name))
            message: Any = message_class(type_)
            publisher = nodes[name].publisher(topic, message, latch=True)
            if text is not None:
                publisher.publish(message(text))

        yield do


def text_of(key: str, **results: object) -> str:
    return json.dumps({"key": key, "student": key.title(), "exercises": results})


def test_topics_at_a_master_are_gathered_with_its_parameters(master: str, publish: Publish) -> None:
    with contextlib.closing(MasterProxy(master, "/test")) as proxy:
        proxy.set_param("/minirospy_class/ben", {"student": "Ben", "exercises": {"led": PASSED}})
    publish("/robot1/minirospy_class", text_of("anna", count=PASSED))
    # With one master, all computers publish on the same topic.
    publish("/minirospy_class", text_of("mia"), name="mia")
    publish("/minirospy_class", text_of("tom", led=PASSED), name="tom")
    publish("/my_minirospy_class", text_of("eve"))
    found = gather(master, Environment.read(), LONG)
    assert [(student.title, *student.results) for student in found.students] == [
        ("Anna (robot1)", "count"),
        ("Ben", "led"),
        ("Mia",),
        ("Tom", "led"),
    ]
    assert not found.unreadable


def test_computer_with_two_publishers_has_one_row(master: str, publish: Publish) -> None:
    with contextlib.closing(MasterProxy(master, "/test")) as proxy:
        proxy.set_param("/minirospy_class/anna", {"student": "Anna", "exercises": {"led": PASSED}})
    for name in ("first", "second"):
        publish("/minirospy_class", text_of("anna", count=PASSED), name=name)
    [student] = gather(master, Environment.read(), LONG).students
    assert (student.title, *student.results) == ("Anna", "led", "count")


def test_class_has_another_master_than_the_environment(
    master: str, publish: Publish, monkeypatch: pytest.MonkeyPatch
) -> None:
    publish("/robot1/minirospy_class", text_of("anna"))
    monkeypatch.setenv("ROS_MASTER_URI", "http://localhost:1")
    assert [student.name for student in gather(master, Environment.read(), LONG).students] == ["Anna"]


def test_topics_that_cannot_be_read_are_named(master: str, publish: Publish) -> None:
    publish("/eve/minirospy_class", "{", name="eve")
    publish("/long/minirospy_class", "x" * (5 * MAX_MESSAGE), name="long")
    publish("/robot1/minirospy_class", text_of("anna"))
    found = gather(master, Environment.read(), LONG)
    assert [student.name for student in found.students] == ["Anna"]
    assert found.unreadable == [
        "/eve/minirospy_class of /eve: its message is not a student's",
        "/long/minirospy_class of /long: its message is not a student's",
    ]


def test_publisher_that_sends_nothing_is_named(master: str, publish: Publish) -> None:
    publish("/robot2/minirospy_class", None, name="silent")
    with contextlib.closing(MasterProxy(master, "/gone")) as proxy:
        proxy.register_publisher("/robot3/minirospy_class", "std_msgs/String", "http://localhost:1")
    found = gather(master, Environment.read(), 0.0)
    assert found.unreadable == [
        "/robot2/minirospy_class of /silent: it sent no message",
        "/robot3/minirospy_class of /gone: it sent no message",
    ]


def test_publishers_beyond_the_limit_are_named(master: str) -> None:
    with contextlib.closing(MasterProxy(master, "/gone")) as proxy:
        for index in range(MAX_STUDENTS + 1):
            proxy.register_publisher(f"/r{index}/minirospy_class", "std_msgs/String", "http://localhost:1")
    found = gather(master, Environment.read(), 0.0)
    assert found.unreadable[0] == "more than 200 publishers"
    assert len(found.unreadable) == MAX_STUDENTS + 1


def test_topic_of_another_type_is_ignored(master: str, publish: Publish) -> None:
    publish("/robot1/minirospy_class", None, type_="std_msgs/Int32")
    assert gather(master, Environment.read(), LONG) == ([], [])
