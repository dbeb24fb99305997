"""The expectations of exercises. Each waits until it holds or its time limit has passed, and returns an Outcome."""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from minirospy.base.errors import (
    BoardError,
    MessageException,
    MinirospyError,
    NotFoundError,
    RpcRefused,
    ServiceException,
)
from minirospy.board.model import BUTTONS, LEDS, Function
from minirospy.course.exercise import Step
from minirospy.course.programs import Line, Program
from minirospy.course.wording import leds_text, shown
from minirospy.course.world import Arrival, World
from minirospy.introspect.graph import node_host
from minirospy.introspect.services import call_service, fill_request, service_type
from minirospy.workspace.packages import Packages

__all__ = ["EXPECTATIONS", "Outcome", "Trial", "expect"]

_LOG_LINE = re.compile(r"\[ *(?:DEBUG|INFO|WARN|ERROR|FATAL)\] \[(?:WallTime: )?(\d+\.\d+)[^\]]*\]:? (.*)")
_CLOSE = 0.01  # relative tolerance when floating-point numbers are compared
_RATE_SECONDS = 3.0  # seconds over which a rate is measured, unless the exercise specifies them


class Outcome(NamedTuple):
    """The result of an expectation. If it failed, ``observed`` describes what happened instead."""

    holds: bool
    observed: str = ""


@dataclass
class Trial:
    """The state of a check: its world, the time of the last action, and the student's answers that have not been used."""

    world: World
    since: float = field(default_factory=time.monotonic)
    answers: list[str] = field(default_factory=list)
    ask: Callable[[str], str] | None = None

    @property
    def work(self) -> list[Program]:
        """Return the programs written by the student."""
        return [program for program in self.world.programs if program.is_work]


def expect(trial: Trial, step: Step) -> Outcome:
    """Wait until an expectation holds or times out. A graph error, such as an exited node, counts as a failure."""
    try:
        return EXPECTATIONS[step.kind](trial, step)
    except BoardError:
        raise
    except (MinirospyError, MessageException, ServiceException) as error:
        return Outcome(False, str(error))


def _led(trial: Trial, step: Step) -> Outcome:
    world, pin, level = trial.world, step.subject, int(step.options["is"])
    if world.wait_until(lambda: world.board.get(pin) == level, step.within):
        return Outcome(True)
    return Outcome(
        False,
        f"it stays {'lit' if world.board.get(pin) else 'dark'}{_why_dark(trial, [pin]) if level else ''}",
    )


def _leds(trial: Trial, step: Step) -> Outcome:
    world, pins = trial.world, sorted(step.subject)
    if world.wait_until(lambda: _lit(world) == pins, step.within):
        return Outcome(True)
    return Outcome(False, f"{leds_text(_lit(world))}{_why_dark(trial, pins)}")


def _lit(world: World) -> list[int]:
    return [pin for pin in LEDS if world.board.get(pin)]


def _why_dark(trial: Trial, pins: list[int]) -> str:
    """Explain why LEDs are dark, for example because a pin is not an output, or another pin was used instead."""
    states = trial.world.board.state().pins
    inputs = [pin for pin in pins if states[pin].function is Function.IN]
    if not inputs:
        return ""
    others = [
        number
        for number, state in enumerate(states)
        if number not in pins and state.function is Function.OUT and number not in BUTTONS
    ]
    pin_names = f"GPIO {' and '.join(map(str, inputs))}"
    verb = "are no outputs" if len(inputs) > 1 else "is no output"
    instead = f"; the program's outputs are GPIO {', '.join(map(str, others))}" if others else ""
    return f", and {pin_names} {verb}{instead}"


def _still(trial: Trial, step: Step) -> Outcome:
    world, seconds = trial.world, float(step.subject)
    end = time.monotonic() + (step.within + seconds) * world.patience
    changes = 0
    while time.monotonic() < end:
        edges = world.board.watch(LEDS, timeout=seconds)
        if next(edges, None) is None:
            return Outcome(True)
        changes += 1
    return Outcome(False, f"they still change ({changes} times)")


def _runs_along(trial: Trial, step: Step) -> Outcome:
    seconds = float(step.subject) if not isinstance(step.subject, bool) else _RATE_SECONDS
    low, high = _with_parameters(trial.world, step.options)["between"]
    found = 0.0
    end = time.monotonic() + step.within * trial.world.patience
    while True:
        rising = [edge.time for edge in trial.world.board.watch(LEDS, timeout=seconds) if edge.level]
        found = (len(rising) - 1) / (rising[-1] - rising[0]) if len(rising) > 1 else 0.0
        if low <= found <= high:
            return Outcome(True)
        if time.monotonic() > end:
            return Outcome(False, f"{found:.1f} are" if found else "none is lit")


def _node(trial: Trial, step: Step) -> Outcome:
    world, name = trial.world, f"/{step.subject.lstrip('/')}"
    if world.wait_until(lambda: name in world.nodes(), step.within):
        return Outcome(True)
    return Outcome(False, f"the nodes are {_listed(world.nodes())}")


def _topic(trial: Trial, step: Step) -> Outcome:
    return _registered(trial, step, "publishers", "no node publishes it")


def _subscribes(trial: Trial, step: Step) -> Outcome:
    return _registered(trial, step, "subscribers", "no node subscribes to it")


def _registered(trial: Trial, step: Step, table: str, missing: str) -> Outcome:
    world, topic, type_ = trial.world, step.subject, step.options.get("type")

    def topics() -> Mapping[str, list[str]]:
        found: Mapping[str, list[str]] = getattr(world.graph.state(), table)
        return {name: [node for node in nodes if node != world.node.name] for name, nodes in found.items()}

    def is_there() -> bool:
        return bool(topics().get(topic)) and type_ in (None, world.graph.master.get_topic_types().get(topic))

    if world.wait_until(is_there, step.within):
        return Outcome(True)
    if topics().get(topic):
        return Outcome(False, f"its type is {world.graph.master.get_topic_types().get(topic)}")
    others = {
        name
        for name, nodes in topics().items()
        if nodes and set(nodes) & world.nodes() and not name.startswith("/rosout")
    }
    return Outcome(False, f"{missing}; the topics are {_listed(others)}")


def _message(trial: Trial, step: Step) -> Outcome:
    world, topic, path = trial.world, step.subject, step.options["field"]
    options = _with_parameters(world, step.options)
    values: list[object] = []
    seen = 0

    def has_arrived() -> bool:
        nonlocal seen
        arrivals = [each for each in world.arrivals(topic) if each.time >= trial.since]
        new, seen = arrivals[seen:], len(arrivals)
        found = [value for each in new for value in _values(world, each, path)]
        values.extend(found)
        return any(_fits(value, options) for value in found)

    if world.wait_until(has_arrived, step.within):
        return Outcome(True)
    if values:
        return Outcome(False, f"the last of {len(values)} messages has {shown(values[-1])}")
    return Outcome(False, "no message arrives")


def _values(world: World, arrival: Arrival, path: str) -> list[object]:
    """Return the value of a message's field as a list, which is empty if an array on the path is too short."""
    try:
        return [world.value(arrival, path)]
    except IndexError:
        return []


def _with_parameters(world: World, options: Mapping[str, Any]) -> Mapping[str, Any]:
    """Replace each ``{param: /name}`` with the parameter's value or, for a range, with 70 to 140 % of it.

    Raise NotFoundError if the parameter is not set, or if it must be a number and is not.
    """
    found = dict(options)
    for key in ("equals", "between"):
        if not isinstance(found.get(key), dict) or "param" not in found[key]:
            continue
        name = str(found[key]["param"])
        try:
            value = world.graph.master.get_param(name)
        except RpcRefused:
            raise NotFoundError("parameter", name, hint="it is not set") from None
        if key == "equals":
            found[key] = value
        elif isinstance(value, int | float) and value > 0:
            found[key] = [0.7 * value, 1.4 * value]
        else:
            raise NotFoundError("parameter", name, hint=f"[{value}] is not a number above 0")
    return found


def _rate(trial: Trial, step: Step) -> Outcome:
    world, topic = trial.world, step.subject
    low, high = step.options["between"]
    seconds = float(step.options.get("for", _RATE_SECONDS))
    start = time.monotonic()
    found = 0.0

    def fits() -> bool:
        nonlocal found
        window = [
            each.time for each in world.arrivals(topic) if each.time >= max(start, time.monotonic() - seconds)
        ]
        found = (len(window) - 1) / (window[-1] - window[0]) if len(window) > 1 else 0.0
        # Do not pass before the full time has been measured: a short burst of messages must not be enough.
        return time.monotonic() - start >= seconds and len(window) > 2 and bool(low <= found <= high)

    if world.wait_until(fits, max(step.within, seconds + 1)):
        return Outcome(True)
    return Outcome(False, f"it has {found:.1f}" if found else "no message arrives")


def _span(trial: Trial, step: Step) -> Outcome:
    world, topic, path = trial.world, step.subject, step.options["field"]
    low, high = step.options["between"]
    found: list[float] = []

    def fits() -> bool:
        found[:] = [
            float(value)
            for each in world.arrivals(topic)
            for value in _values(world, each, path)
            if isinstance(value, int | float)
        ]
        return bool(found) and bool(low <= max(found) - min(found) <= high)

    if world.wait_until(fits, step.within):
        return Outcome(True)
    return Outcome(False, f"it changes by {max(found) - min(found):.2f}" if found else "no message arrives")


def _service(trial: Trial, step: Step) -> Outcome:
    world, name, type_ = trial.world, step.subject, step.options.get("type")
    if not world.wait_until(lambda: name in world.graph.state().services, step.within):
        known = {
            each
            for each in world.graph.state().services
            if not each.endswith(("/get_loggers", "/set_logger_level"))
        }
        return Outcome(False, f"no node does; the services are {_listed(known)}")
    found = service_type(world.graph, name)
    # Accept a type without a package, because it may be in the student's own package.
    accepted = type_ in (None, found) or ("/" not in str(type_) and found.partition("/")[2] == type_)
    return Outcome(True) if accepted else Outcome(False, f"its type is {found}")


def call(trial: Trial, step: Step) -> object:
    """Wait for a service and call it; return the response. Raise NotFoundError or ServiceException if that fails."""
    world, name = trial.world, step.subject
    # Wait even if the student's programs have exited, because a program of the exercise may provide the service.
    world.wait_until(lambda: name in world.graph.state().services, step.within, needs_work=False)
    type_ = service_type(world.graph, name)
    request = fill_request(type_, [step.options.get("request", {})])
    return call_service(world.graph, name, type_, request)


def _response(trial: Trial, step: Step) -> Outcome:
    name = step.options["field"]
    response = call(trial, step)
    if not hasattr(response, name):
        return Outcome(False, f"the response has no field {name}")
    value = getattr(response, name)
    return Outcome(_equal(value, step.options["equals"]), f"it is {shown(value)}")


def _param(trial: Trial, step: Step) -> Outcome:
    world, name = trial.world, step.subject
    found: object = None

    def fits() -> bool:
        nonlocal found
        try:
            found = world.graph.master.get_param(name)
        except RpcRefused:
            return False
        return "is" not in step.options or _equal(found, step.options["is"])

    if world.wait_until(fits, step.within):
        return Outcome(True)
    return Outcome(False, "it is not set" if found is None else f"it is {shown(found)}")


def _logs(trial: Trial, step: Step) -> Outcome:
    texts = [str(each) for each in (step.subject if isinstance(step.subject, list) else [step.subject])]
    found: list[tuple[float, str]] = []

    def fits() -> bool:
        found[:] = [entry for line in _printed(trial) if (entry := _log_entry(line))]
        return _in_order(texts, [text for _, text in found]) is not None

    if not trial.world.wait_until(_or_ended(trial, fits), step.within) or not fits():
        return Outcome(
            False, f"it logs {_listed([text for _, text in found], 6)}" if found else "it logs nothing"
        )
    places = _in_order(texts, [text for _, text in found])
    assert places is not None
    apart = step.options.get("apart")
    times = [found[place][0] for place in places]
    gaps = [after - before for before, after in itertools.pairwise(times)]
    wrong = [gap for gap in gaps if apart and not apart[0] <= gap <= apart[1]]
    return Outcome(not wrong, f"{wrong[0]:.2f} s are between two of them" if wrong else "")


def _log_entry(line: Line) -> tuple[float, str] | None:
    found = _LOG_LINE.search(line.text)
    return (float(found[1]), found[2]) if found else None


def _in_order(expected: list[str], texts: list[str]) -> list[int] | None:
    """Return the indexes at which the expected texts occur in ``texts`` in the expected order, or None if they do not."""
    places: list[int] = []
    for each in expected:
        start = places[-1] + 1 if places else 0
        place = next(
            (
                at
                for at in range(start, len(texts))
                if each == texts[at] or (len(each) > 3 and each in texts[at])
            ),
            None,
        )
        if place is None:
            return None
        places.append(place)
    return places


def _prints(trial: Trial, step: Step) -> Outcome:
    text = str(step.subject)

    def fits() -> bool:
        return any(text in line.text for line in _printed(trial))

    if trial.world.wait_until(_or_ended(trial, fits), step.within) and fits():
        return Outcome(True)
    lines = [line.text for line in _printed(trial) if line.text.strip()]
    return Outcome(False, f"its last line is [{lines[-1]}]" if lines else "it prints nothing")


def _prints_not(trial: Trial, step: Step) -> Outcome:
    found = next((line.text for line in _printed(trial) if str(step.subject) in line.text), None)
    return Outcome(found is None, f"it prints [{found}]")


def _exits(trial: Trial, step: Step) -> Outcome:
    if not trial.world.wait_until(lambda: all(each.status is not None for each in trial.work), step.within):
        return Outcome(False, "it still runs")
    wrong = [each.status for each in trial.work if each.status != step.subject]
    return Outcome(not wrong, f"its status is {wrong[0]}" if wrong else "")


def _package(trial: Trial, step: Step) -> Outcome:
    # Create a new Packages each time, because a Packages caches the folders that it finds.
    is_there = step.options["is"]
    holds = trial.world.wait_until(lambda: (step.subject in Packages().names()) == is_there, step.within)
    return Outcome(holds, f"it is {'still there' if not is_there else 'not there'}")


def _answer(trial: Trial, step: Step) -> Outcome:
    if trial.answers:
        given = trial.answers.pop(0)
    elif trial.ask is not None:
        given = trial.ask(str(step.subject))
    else:
        return Outcome(False, "there is no answer; give it as an argument")
    given = given.strip()
    options = step.options
    if "rate" in options:
        measured = _measured_rate(trial, options["rate"])
        tolerance = float(options.get("tolerance", 0.2)) * measured
        number = re.search(r"\d+(?:[.,]\d+)?", given)
        holds = number is not None and abs(float(number[0].replace(",", ".")) - measured) <= tolerance
        return Outcome(holds, f"your answer is [{given}]")
    expected = _publisher_host(trial, options["host_of"]) if "host_of" in options else options["equals"]
    return Outcome(_normal(given) == _normal(str(expected)), f"your answer is [{given}]")


def _normal(text: str) -> str:
    return re.sub(r"^[a-z]+://|:\d+/?$|[^a-z0-9.]", "", text.lower().strip())


def _measured_rate(trial: Trial, topic: str) -> float:
    world = trial.world
    world.wait_until(lambda: len(world.arrivals(topic)) > 20, 20.0)
    times = [each.time for each in world.arrivals(topic)]
    if len(times) < 3:
        raise NotFoundError("topic", topic, hint="no messages arrive from it on this computer")
    return (len(times) - 1) / (times[-1] - times[0])


def _publisher_host(trial: Trial, topic: str) -> str:
    nodes = trial.world.graph.state().publishers.get(topic, ())
    host = node_host(trial.world.graph.node_uri(nodes[0])) if nodes else None
    if host is None:
        raise NotFoundError("topic", topic, hint="no node publishes it")
    return host


def _rostest(trial: Trial, step: Step) -> Outcome:
    command = [sys.executable, "-m", "minirospy.ros.rostest.commands.rostest", *str(step.subject).split()]
    try:
        done = subprocess.run(
            command,
            env=dict(trial.world.environ),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=step.within * trial.world.patience,
        )
    except subprocess.TimeoutExpired:
        return Outcome(False, f"it takes longer than {step.within * trial.world.patience:g} s")
    if done.returncode == 0:
        return Outcome(True)
    lines = [
        line
        for line in (done.stdout + done.stderr).splitlines()
        if re.search(r"Error: |ERROR: |FAILURE", line)
    ]
    return Outcome(False, lines[0].strip() if lines else f"rostest ends with status {done.returncode}")


def _printed(trial: Trial) -> list[Line]:
    """Return the output lines of the student's programs, in order of arrival."""
    return sorted((line for program in trial.work for line in program.lines), key=lambda line: line.time)


def _or_ended(trial: Trial, fits: Callable[[], bool]) -> Callable[[], bool]:
    """Return a condition that holds if ``fits`` does, or if all the student's programs have exited and their output was read."""

    def holds() -> bool:
        has_ended = bool(trial.work) and all(each.status is not None for each in trial.work)
        if has_ended:
            for each in trial.work:
                each.wait_for_output()
        return fits() or has_ended

    return holds


def _fits(value: object, options: Mapping[str, Any]) -> bool:
    if "between" in options:
        low, high = options["between"]
        return isinstance(value, int | float) and low <= value <= high
    return _equal(value, options["equals"])


def _equal(value: object, expected: object) -> bool:
    if isinstance(value, float) and isinstance(expected, int | float):
        return abs(value - expected) <= _CLOSE * max(abs(expected), _CLOSE)
    if isinstance(value, list | tuple) and isinstance(expected, list):
        return len(value) == len(expected) and all(map(_equal, value, expected))
    return bool(value == expected)


def _listed(names: set[str] | list[str], most: int = 8) -> str:
    listed = sorted(names) if isinstance(names, set) else names
    if not listed:
        return "none"
    return ", ".join(listed[:most]) + (", ..." if len(listed) > most else "")


EXPECTATIONS: Mapping[str, Callable[[Trial, Step], Outcome]] = {
    "led": _led,
    "leds": _leds,
    "still": _still,
    "runs_along": _runs_along,
    "node": _node,
    "topic": _topic,
    "subscribes": _subscribes,
    "message": _message,
    "rate": _rate,
    "span": _span,
    "service": _service,
    "response": _response,
    "param": _param,
    "logs": _logs,
    "prints": _prints,
    "prints_not": _prints_not,
    "exits": _exits,
    "package": _package,
    "answer": _answer,
    "rostest": _rostest,
}
