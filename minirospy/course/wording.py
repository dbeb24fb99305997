"""The sentences in a report: each describes an expectation and the action before it. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from minirospy.board.model import BUTTONS, LEDS
from minirospy.course.exercise import DEFAULT_SECONDS, Step

__all__ = ["action_phrase", "button_name", "leds_text", "sentence", "shown"]


def sentence(step: Step, after: str = "", patience: float = 1.0) -> str:
    """Return the sentence for an expectation, such as "The LED at GPIO 7 lights within 1 s after button 1 is pressed".

    ``after`` is the phrase of the action before it.
    """
    if step.says:
        return step.says
    text = _untimed_sentence(step)
    if step.kind in _UNTIMED:
        return text
    within = step.within * patience
    timed = f" within {within:g} s" if step.within != DEFAULT_SECONDS or after else ""
    return f"{text}{timed}{f' after {after}' if after else ''}"


def action_phrase(step: Step) -> str:
    """Return the phrase for an action, such as "button 1 is pressed", or "" if the action has no visible effect."""
    subject = step.subject
    match step.kind:
        case "press" | "click":
            return f"{button_name(subject)} is pressed"
        case "release":
            return f"{button_name(subject)} is released"
        case "person" if subject == "away":
            return "the person has left"
        case "person":
            ahead = subject[0] if isinstance(subject, list) else subject
            return f"a person stands {ahead:g} m before the scanner"
        case "publish":
            return f"{subject} has a message {shown(step.options.get('message'))}"
        case "log":
            return f"a node logs [{subject}]"
        case "call":
            return f"{subject} is called"
        case _:
            return ""


def button_name(pin: int) -> str:
    """Return a button's name: its number on the board, if it has one, and its pin."""
    return f"button {BUTTONS.index(pin) + 1} (GPIO {pin})" if pin in BUTTONS else f"the button at GPIO {pin}"


def leds_text(pins: Sequence[int]) -> str:
    """Describe the lit LEDs, as in "the LEDs at GPIO 2 and 3 are lit" or "no LED is lit"."""
    if not pins:
        return "no LED is lit"
    if len(pins) == 1:
        colour = f"{LEDS[pins[0]]} " if pins[0] in LEDS else ""
        return f"the {colour}LED at GPIO {pins[0]} is lit"
    return f"the LEDs at GPIO {', '.join(map(str, pins[:-1]))} and {pins[-1]} are lit"


def shown(value: object) -> str:
    """Return a value on one line of at most 80 characters, similar to YAML."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, dict):
        text = ", ".join(f"{key}: {shown(each)}" for key, each in value.items())
    elif isinstance(value, str):
        text = repr(value)
    else:
        text = str(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


_UNTIMED = frozenset({"prints_not", "answer", "rostest", "still", "runs_along"})


def _untimed_sentence(step: Step) -> str:
    subject: Any = step.subject
    options = step.options
    of_type = f" with the type {options['type']}" if options.get("type") else ""
    between = options.get("between", (0, 0))
    # A range may refer to a parameter, whose value is not known before the check.
    low, high = between if not isinstance(between, dict) else (0, 0)
    expected = f"between {low:g} and {high:g}" if "between" in options else shown(options.get("equals"))
    match step.kind:
        case "led":
            return f"The LED at GPIO {subject} {'lights' if options['is'] else 'is dark'}"
        case "leds":
            text = leds_text(subject)
            return f"Only {text}" if subject else "No LED is lit"
        case "still":
            return f"The LEDs stop within {step.within:g} s, and stay as they are for {float(subject):g} s"
        case "runs_along":
            return f"Between {low:g} and {high:g} LEDs are lit per second"
        case "node":
            return f"The node {subject} runs"
        case "topic":
            return f"A node publishes {subject}{of_type}"
        case "subscribes":
            return f"A node subscribes to {subject}{of_type}"
        case "message":
            return f"A message on {subject} has {options['field']} {expected}"
        case "rate":
            return f"{subject} has between {low:g} and {high:g} messages per second"
        case "span":
            return f"{options['field']} of {subject} changes by {low:g} to {high:g}"
        case "service":
            return f"A node offers the service {subject}{of_type}"
        case "response":
            return f"{subject}, called with {shown(options.get('request', {}))}, returns {options['field']} {expected}"
        case "param":
            value = f" is {shown(options['is'])}" if "is" in options else " is set"
            return f"The parameter {subject}{value}"
        case "logs":
            texts = subject if isinstance(subject, list) else [subject]
            quoted = ", ".join(f"[{text}]" for text in texts)
            apart = options.get("apart")
            return f"The program logs {quoted}" + (f", {apart[0]:g} to {apart[1]:g} s apart" if apart else "")
        case "prints":
            return f"The program prints [{subject}]"
        case "prints_not":
            return f"The program does not print [{subject}]"
        case "exits":
            return f"The program ends by itself with status {subject}"
        case "package":
            return f"The package {subject} {'is found' if options['is'] else 'is gone'}"
        case "answer":
            return f"{subject}"
        case "rostest":
            return f"The test {subject} passes"
        case kind:
            raise AssertionError(kind)
