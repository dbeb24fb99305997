"""Exercise files: what is accepted, and the one line that says what is wrong in them."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.errors import NotFoundError, UsageError
from minirospy.course.checker import words_of
from minirospy.course.exercise import ExerciseError, find_exercise, parse_exercise, read_exercise
from minirospy.course.wording import action_phrase, sentence

HEAD = "name: lamp\ntitle: A lamp\n"


def parse(steps: str, head: str = HEAD) -> str:
    """Parse an exercise with these steps; return the error, or an empty string."""
    try:
        parse_exercise(f"{head}steps:\n{steps}", "lamp.yaml")
    except ExerciseError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("steps", "error"),
    [
        ("- press: 11\n- leds: [2]\n", ""),
        ("- {led: 7, is: on, within: 1}\n", ""),
        ("- led: 70\n  is: on\n", "lamp.yaml: step 1 (led): [70] is not a pin: BCM numbers are 0 to 53"),
        ("- led: 7\n", "lamp.yaml: step 1 (led): `is` is missing"),
        ("- {led: 7, is: maybe}\n", "lamp.yaml: step 1 (led): is [maybe]: on or off"),
        ("- {led: 7, is: on, whithin: 1}\n", "[whithin] is unknown; did you mean within?"),
        ("- pres: 11\n", "[pres] is not a kind of step; did you mean press?"),
        ("- {press: 11, release: 12}\n", "step 1: press and release are two steps"),
        ("- press\n", "step 1: a step is as {press: 11}"),
        ("- {led: 7, is: on, within: -1}\n", "within: [-1] is not a number of seconds"),
        ("- {led: 7, is: on, within: .nan}\n", "within: [nan] is not a number of seconds"),
        ("- {rate: /x, between: [9, 1]}\n", "is not two numbers such as [8, 12]"),
        ("- {message: /x, field: data}\n", "one of `equals` and `between`"),
        ("- {message: 5, field: data, equals: 1}\n", "[5] is not a name such as /button_state"),
        ("- {logs: x, apart: 3}\n", "apart [3] is not two numbers of seconds"),
        ("- {publish: /x, type: std_msgs/Int32, rate: fast}\n", "rate [fast] is not a number from 0 to 1000"),
        ("- {publish: /x, type: std_msgs/Int32, rate: -1}\n", "rate [-1] is not a number"),
        ("- {set_param: 5, value: 5}\n", "[5] is not a name"),
        ("- {answer: Why, equals: x, tolerance: y}\n", "tolerance [y] is not a number"),
        ("- {person: near}\n", "[near] is not a distance in metres"),
        ("- {answer: Why}\n", "one of `equals`, `rate`"),
        ("- [\n", "lamp.yaml:5: this is not YAML"),
        ("- {log: x, level: loud}\n", "level [loud]: debug, info, warn, error or fatal"),
        ("- {runs_along: 3, between: {param: /x}}\n", "needs `says`"),
        ("- {runs_along: 3, between: {param: /x}, says: y}\n", ""),
        ("- {message: /x, field: data, between: {param: /y}, says: z}\n", ""),
        (
            "- {rate: /x, between: {param: /y}, says: z}\n",
            "step 1 (rate): between [{'param': '/y'}]: only message",
        ),
        ("- {span: /x, field: x, between: {param: /y}, says: z}\n", "step 1 (span): between"),
        ("- {topic: /x, type: [1]}\n", "step 1 (topic): type [[1]] is not a name such as std_msgs/Int32"),
        ("- {publish: /x, type: 5}\n", "step 1 (publish): type [5] is not a name such as std_msgs/Int32"),
        ("- {message: /x, field: 5, equals: 1}\n", "step 1 (message): field [5] is not a name such as data"),
        ("- {message: /x, field: '', equals: 1}\n", "step 1 (message): field [] is not a name such as data"),
        ("- {response: /x, field: on, equals: 1}\n", "step 1 (response): field [True] is not a name"),
        ("- {answer: Why, rate: 5}\n", "step 1 (answer): rate [5] is not a name such as /scan"),
        ("- {answer: Why, host_of: [/x]}\n", "step 1 (answer): host_of [['/x']] is not a name such as /scan"),
        ("- {answer: Why, rate: /x}\n", ""),
        ("- {package: [1], is: true}\n", "step 1 (package): [[1]] is not a name"),
        ("- press: 11\n", "lamp.yaml: steps: none is an expectation such as {led: 7, is: on}"),
    ],
)
def test_mistake_in_a_step_is_named(steps: str, error: str) -> None:
    found = parse(steps)
    assert error in found
    assert bool(error) == bool(found)
    assert "\n" not in found


@pytest.mark.parametrize(
    ("head", "error"),
    [
        ("title: A lamp\n", "`name` is missing"),
        ("name: a b\ntitle: A lamp\n", "name [a b]: letters, digits and `_` only"),
        ("name: lamp\ntitle: 5\n", "title: [5] is not a text; put it in quotes"),
        (f"{HEAD}live: often\n", "live [often]: true or false"),
        (f"{HEAD}lvie: true\n", "the exercise: [lvie] is unknown; did you mean live?"),
        (f"{HEAD}work: [button]\n", "each item in `work` is as {about:"),
    ],
)
def test_mistake_in_the_head_is_named(head: str, error: str) -> None:
    assert error in parse("- press: 11\n", head)


@pytest.mark.parametrize("text", ["", "- 1\n", "lamp\n", "name: x\ntitle: y\nsteps: []\n"])
def test_text_without_an_exercise_is_refused(text: str) -> None:
    with pytest.raises(ExerciseError):
        parse_exercise(text, "lamp.yaml")


def test_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "lamp.yaml"
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(ExerciseError, match="it is not UTF-8 text"):
        read_exercise(file)


def test_unknown_exercise_has_similar_names(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="did you mean count"):
        find_exercise("cuont")
    with pytest.raises(NotFoundError, match="there is no such file"):
        find_exercise(str(tmp_path / "none.yaml"))


def test_words_are_programs_or_answers() -> None:
    count, light, frame = map(find_exercise, ("count", "move_light", "missing_frame"))
    assert words_of(count, []) == (["rpi_test/count.py"], [])
    assert words_of(light, ["a.py", "b.py"]) == (["a.py", "b.py"], [])
    assert words_of(frame, ["odom"]) == ([], ["odom"])
    with pytest.raises(UsageError, match=r"minirospy check move_light PACKAGE/PROGRAM PACKAGE/PROGRAM"):
        words_of(light, [])
    with pytest.raises(UsageError, match="takes one file"):
        words_of(count, ["a.py", "b.py"])
    with pytest.raises(UsageError, match="takes 1 answer"):
        words_of(frame, ["odom", "map"])
    with pytest.raises(UsageError, match="takes no file"):
        words_of(find_exercise("board"), ["a.py"])


def test_sentence_names_the_action_before_it() -> None:
    exercise = parse_exercise(
        f"{HEAD}steps:\n- press: 12\n- {{led: 7, is: on, within: 1}}\n- {{leds: []}}\n- {{led: 7, is: off, says: It is dark}}\n",
        "lamp.yaml",
    )
    press, lights, none, own = exercise.steps
    after = action_phrase(press)
    assert (
        sentence(lights, after) == "The LED at GPIO 7 lights within 1 s after button 2 (GPIO 12) is pressed"
    )
    assert sentence(lights, after, patience=3.0).startswith("The LED at GPIO 7 lights within 3 s")
    assert sentence(none) == "No LED is lit"
    assert sentence(own, after) == "It is dark"
