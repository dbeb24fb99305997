"""Exercises: read and check the YAML file of an exercise. Pure, except for the functions that read files.

An exercise lists the student's programs (``work``) and the steps. Each step is an action or an expectation. One of its keys is
its kind, the others are options: ``{press: 11}``, ``{led: 7, is: on, within: 1, hint: Is the pin an output?}``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from minirospy.base import yaml_text
from minirospy.base.errors import NotFoundError, SourceError
from minirospy.base.suggestions import did_you_mean

__all__ = [
    "ACTIONS",
    "EXPECTATIONS",
    "GRAPH_KINDS",
    "Exercise",
    "ExerciseError",
    "Step",
    "Work",
    "built_in_names",
    "find_exercise",
    "parse_exercise",
    "read_exercise",
]

FOLDER = Path(__file__).parent / "exercises"

# Kinds of step that need a ROS master.
GRAPH_KINDS = frozenset(
    {
        "node",
        "topic",
        "subscribes",
        "message",
        "rate",
        "span",
        "service",
        "response",
        "param",
        "set_param",
        "publish",
        "call",
        "log",
    }
)
_NAMED_KINDS = GRAPH_KINDS - {"log"} | {"package"}  # kinds of step whose subject is a ROS name

# Default time limit of an expectation in seconds, enough to start a program on a slow laptop.
DEFAULT_SECONDS = 10.0
MAX_HERTZ = 1000.0  # maximum publishing rate of messages, in Hz
MAX_SECONDS = 3600.0  # maximum time limit of a step, in seconds

# Dict from each kind of step to its options, in addition to _OPTIONS, which all kinds accept.
ACTIONS: Mapping[str, frozenset[str]] = {
    "start": frozenset(),
    "stop": frozenset(),
    "press": frozenset(),
    "release": frozenset(),
    "click": frozenset(),
    "person": frozenset(),
    "publish": frozenset({"type", "message", "rate"}),
    "log": frozenset({"level", "name"}),
    "set_param": frozenset({"value"}),
    "call": frozenset({"request"}),
    "wait": frozenset(),
}
EXPECTATIONS: Mapping[str, frozenset[str]] = {
    "led": frozenset({"is"}),
    "leds": frozenset(),
    "still": frozenset(),
    "runs_along": frozenset({"between"}),
    "node": frozenset(),
    "topic": frozenset({"type"}),
    "subscribes": frozenset({"type"}),
    "message": frozenset({"field", "equals", "between"}),
    "rate": frozenset({"between", "for"}),
    "span": frozenset({"field", "between"}),
    "service": frozenset({"type"}),
    "response": frozenset({"request", "field", "equals"}),
    "param": frozenset({"is"}),
    "logs": frozenset({"apart"}),
    "prints": frozenset(),
    "prints_not": frozenset(),
    "exits": frozenset(),
    "package": frozenset({"is"}),
    "answer": frozenset({"equals", "rate", "host_of", "tolerance"}),
    "rostest": frozenset(),
}
_PARAMETER_RANGES = ("message", "runs_along")  # kinds of step that accept `between: {param: /name}`
_NAMES = {"type": "std_msgs/Int32", "field": "data", "rate": "/scan", "host_of": "/scan"}  # shown in errors
_LEVELS = ("debug", "info", "warn", "error", "fatal")
_OPTIONS = frozenset({"within", "hint", "says"})
_TOP = frozenset({"name", "title", "page", "task", "work", "solution", "live", "ends", "steps"})
_REQUIRED = {
    "publish": ("type",),
    "set_param": ("value",),
    "message": ("field",),
    "rate": ("between",),
    "span": ("field", "between"),
    "response": ("field", "equals"),
    "runs_along": ("between",),
    "led": ("is",),
    "package": ("is",),
}


class ExerciseError(SourceError):
    """Raised if an exercise's file is unreadable or invalid; ``file`` is its path."""


@dataclass(frozen=True)
class Step:
    """One step of an exercise: an action or an expectation.

    ``kind`` is a key of ACTIONS or EXPECTATIONS, and ``subject`` is its value. ``options`` are the step's other options.
    ``within`` is the time limit in seconds. ``hint`` is printed if the expectation fails. ``says`` replaces the generated
    sentence.
    """

    kind: str
    subject: Any
    options: Mapping[str, Any] = field(default_factory=dict)
    within: float = DEFAULT_SECONDS
    hint: str = ""
    says: str = ""

    @property
    def is_expectation(self) -> bool:
        """Return whether this step is an expectation; otherwise it is an action."""
        return self.kind in EXPECTATIONS


@dataclass(frozen=True)
class Work:
    """A program or launch file that the student writes. ``default`` is the PACKAGE/PROGRAM on the course page, or empty."""

    about: str
    default: str = ""


@dataclass(frozen=True)
class Exercise:
    """An exercise. ``page`` is the course page that describes it.

    ``live``: watch the student's own master and board, and start nothing. ``ends``: the programs may exit by themselves.
    """

    name: str
    title: str
    steps: tuple[Step, ...]
    page: str = ""
    task: str = ""
    work: tuple[Work, ...] = ()
    solution: tuple[str, ...] = ()
    live: bool = False
    ends: bool = False

    @property
    def questions(self) -> int:
        """Return how many answers the student must give."""
        return sum(step.kind == "answer" for step in self.steps)


def built_in_names() -> list[str]:
    """Return the names of the built-in exercises, in course order."""
    return (FOLDER / "order.txt").read_text(encoding="utf-8").split()


def find_exercise(word: str) -> Exercise:
    """Return an exercise, given its name or the path of its file.

    Raise NotFoundError, with similar names, if it does not exist. Raise ExerciseError if its file cannot be read.
    """
    names = built_in_names()
    if word in names:
        return read_exercise(FOLDER / f"{word}.yaml")
    path = Path(word)
    if path.is_file():
        return read_exercise(path)
    if path.suffix in (".yaml", ".yml") or path.parent != Path():
        raise NotFoundError("exercise", word, hint="there is no such file")
    raise NotFoundError(
        "exercise", word, names, "`minirospy check` lists the exercises; a file is ./my_exercise.yaml"
    )


def read_exercise(path: Path) -> Exercise:
    """Read an exercise's file. Raise ExerciseError if it is unreadable or invalid."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ExerciseError(
            str(path), 0, getattr(error, "strerror", None) or "it is not UTF-8 text"
        ) from error
    return parse_exercise(text, str(path))


def parse_exercise(text: str, file: str) -> Exercise:
    """Parse an exercise in YAML. Raise ExerciseError, which states the fault and the correct form."""
    import yaml

    try:
        found = yaml_text.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark is not None else 0
        raise ExerciseError(file, line, f"this is not YAML: {yaml_text.one_line(error)}") from error
    return _Reader(file).exercise(found)


class _Reader:
    """Converts YAML values to an exercise. Its errors state the file and the location in it."""

    def __init__(self, file: str) -> None:
        self._file = file

    def exercise(self, found: object) -> Exercise:
        if not isinstance(found, dict):
            raise self._error("an exercise is a mapping with `name`, `title` and `steps`")
        self._only(found, _TOP, "the exercise")
        for key in ("name", "title", "steps"):
            if not found.get(key):
                raise self._error(f"`{key}` is missing")
        name = found["name"]
        if not isinstance(name, str) or not name.replace("_", "a").isalnum() or not name.isascii():
            raise self._error(f"name [{name}]: letters, digits and `_` only")
        for key in ("live", "ends"):
            if not isinstance(found.get(key, False), bool):
                raise self._error(f"{key} [{found[key]}]: true or false")
        steps = self._list(found["steps"], "steps")
        parsed = tuple(self._step(each, number) for number, each in enumerate(steps, 1))
        exercise = Exercise(
            name=name,
            title=self._text(found["title"], "title"),
            steps=parsed,
            page=self._text(found.get("page", ""), "page"),
            task=self._text(found.get("task", ""), "task"),
            work=tuple(self._work(each) for each in self._list(found.get("work", []), "work")),
            solution=tuple(
                self._text(each, "solution") for each in self._list(found.get("solution", []), "solution")
            ),
            live=found.get("live", False),
            ends=found.get("ends", False) or any(step.kind == "exits" for step in parsed),
        )
        if not any(step.is_expectation for step in parsed):
            raise self._error(
                "steps: none is an expectation such as {led: 7, is: on}, so any program would pass"
            )
        return exercise

    def _work(self, found: object) -> Work:
        if not isinstance(found, dict) or not found.get("about"):
            raise self._error(
                "each item in `work` is as {about: the node that reads the button, default: rpi_test/my_button.py}"
            )
        self._only(found, {"about", "default"}, "work")
        return Work(self._text(found["about"], "about"), self._text(found.get("default", ""), "default"))

    def _step(self, found: object, number: int) -> Step:
        place = f"step {number}"
        if not isinstance(found, dict):
            raise self._error(
                f"{place}: a step is as {{press: 11}} or {{led: 7, is: on, within: 1}}, not [{found}]"
            )
        # YAML 1.1 parses the key `on` and the values on, off, yes and no as booleans.
        words = {str(key): value for key, value in found.items()}
        known = {**ACTIONS, **EXPECTATIONS}
        kinds = [key for key in words if key in known]
        # `rate` and `message` are kinds of step, and also options of other kinds.
        if len(kinds) > 1:
            kinds = [
                kind for kind in kinds if not any(kind in known[other] for other in kinds if other != kind)
            ]
        if len(kinds) != 1:
            first = next(iter(words), "")
            what = (
                f"[{first}] is not a kind of step{did_you_mean(first, known)}"
                if not kinds
                else f"{' and '.join(kinds)} are two steps"
            )
            raise self._error(f"{place}: {what}; the kinds are {', '.join(known)}")
        kind = kinds[0]
        place = f"{place} ({kind})"
        self._only(words, {kind} | known[kind] | _OPTIONS, place)
        for option in _REQUIRED.get(kind, ()):
            if option not in words:
                raise self._error(f"{place}: `{option}` is missing")
        self._check(kind, words, place)
        return Step(
            kind,
            words[kind],
            {key: words[key] for key in known[kind] if key in words},
            self._seconds(words.get("within", DEFAULT_SECONDS), f"{place}: within"),
            self._text(words.get("hint", ""), f"{place}: hint"),
            self._text(words.get("says", ""), f"{place}: says"),
        )

    def _check(self, kind: str, words: Mapping[str, Any], place: str) -> None:
        """Check in advance the values that would otherwise cause errors only while the student's program is running."""
        subject = words[kind]
        if kind in ("press", "release", "click", "led") and not _is_pin(subject):
            raise self._error(f"{place}: [{subject}] is not a pin: BCM numbers are 0 to 53")
        if kind == "led" and not isinstance(words["is"], bool):
            raise self._error(f"{place}: is [{words['is']}]: on or off")
        if kind == "package" and not isinstance(words["is"], bool):
            raise self._error(f"{place}: is [{words['is']}]: true if it exists, false if it is gone")
        if kind == "log" and words.get("level", "info") not in _LEVELS:
            raise self._error(f"{place}: level [{words['level']}]: debug, info, warn, error or fatal")
        if kind == "leds" and not (isinstance(subject, list) and all(map(_is_pin, subject))):
            raise self._error(f"{place}: [{subject}] is not a list of pins such as [2, 3]")
        if kind in ("wait", "still", "runs_along") or "for" in words:
            self._seconds(words.get("for", subject), place)
        if kind == "person" and not _is_place(subject):
            raise self._error(f"{place}: [{subject}] is not a distance in metres, [ahead, left] or away")
        if "apart" in words and not _is_range(words["apart"]):
            raise self._error(
                f"{place}: apart [{words['apart']}] is not two numbers of seconds such as [0.3, 0.8]"
            )
        if kind == "publish" and not (
            _is_number(words.get("rate", 1)) and 0 <= words.get("rate", 1) <= MAX_HERTZ
        ):
            raise self._error(f"{place}: rate [{words['rate']}] is not a number from 0 to {MAX_HERTZ:g}")
        if not _is_number(words.get("tolerance", 0)):
            raise self._error(f"{place}: tolerance [{words['tolerance']}] is not a number such as 0.2")
        if "between" in words:
            pair = words["between"]
            if _is_parameter(pair) and kind not in _PARAMETER_RANGES:
                raise self._error(
                    f"{place}: between [{pair}]: only {' and '.join(_PARAMETER_RANGES)} take a range around a parameter"
                )
            if not _is_parameter(pair) and not _is_range(pair):
                raise self._error(f"{place}: between [{pair}] is not two numbers such as [8, 12]")
        if isinstance(words.get("between"), dict) and not words.get("says"):
            raise self._error(
                f"{place}: a range around a parameter needs `says`, the sentence that the student reads"
            )
        if kind == "message" and ("equals" in words) == ("between" in words):
            raise self._error(f"{place}: one of `equals` and `between`")
        if kind == "answer" and sum(key in words for key in ("equals", "rate", "host_of")) != 1:
            raise self._error(
                f"{place}: one of `equals`, `rate` (of a topic) and `host_of` (a topic's publisher)"
            )
        names = ("rate", "host_of") if kind == "answer" else ("type", "field")
        for option in names:
            if option in words and not (isinstance(words[option], str) and words[option]):
                raise self._error(
                    f"{place}: {option} [{words[option]}] is not a name such as {_NAMES[option]}"
                )
        if kind in _NAMED_KINDS and not (isinstance(subject, str) and subject):
            raise self._error(f"{place}: [{subject}] is not a name such as /button_state")

    def _only(self, found: Mapping[Any, object], known: Iterable[str], place: str) -> None:
        known = sorted(known)
        for key in found:
            if str(key) not in known:
                raise self._error(
                    f"{place}: [{key}] is unknown{did_you_mean(str(key), known)}; known: {', '.join(known)}"
                )

    def _list(self, found: object, place: str) -> list[object]:
        if isinstance(found, str):
            return [found]
        if not isinstance(found, list):
            raise self._error(f"{place}: [{found}] is not a list")
        return found

    def _text(self, found: object, place: str) -> str:
        if not isinstance(found, str):
            raise self._error(f"{place}: [{found}] is not a text; put it in quotes")
        return " ".join(found.split())

    def _seconds(self, found: object, place: str) -> float:
        if not _is_number(found) or not 0 < found <= MAX_SECONDS:  # type: ignore[operator]
            raise self._error(f"{place}: [{found}] is not a number of seconds up to {MAX_SECONDS:g}")
        return float(found)  # type: ignore[arg-type]

    def _error(self, text: str) -> ExerciseError:
        return ExerciseError(self._file, 0, text)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_parameter(value: object) -> bool:
    return isinstance(value, dict) and list(value) == ["param"] and isinstance(value["param"], str)


def _is_range(value: object) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and all(map(_is_number, value))
        and bool(value[0] <= value[1])
    )


def _is_pin(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 54


def _is_place(value: object) -> bool:
    is_pair = isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
    return value == "away" or _is_number(value) or is_pair
