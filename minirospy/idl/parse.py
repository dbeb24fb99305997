"""Definition text -> spec. Source: http://wiki.ros.org/msg, http://wiki.ros.org/srv, http://wiki.ros.org/actionlib."""

from __future__ import annotations

import re

from minirospy.errors import DefinitionError
from minirospy.idl.spec import (
    PRIMITIVES,
    ActionSpec,
    Constant,
    Field,
    FieldType,
    MessageSpec,
    ServiceSpec,
)

__all__ = ["parse_action", "parse_message", "parse_service"]

_LINE = re.compile(r"^(?P<type>[A-Za-z][\w/]*(?:\[\d*\])?)\s+(?P<rest>\S.*)$", re.ASCII)
_NAME = re.compile(r"^[A-Za-z]\w*$", re.ASCII)
_TYPE = re.compile(r"^(?P<base>(?:[A-Za-z]\w*/)?[A-Za-z]\w*)(?P<array>\[(?P<length>\d*)\])?$", re.ASCII)
_RANGES = {
    f"{sign}int{bits}": (0, 2**bits - 1) if sign else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
} | {"byte": (-128, 127), "char": (0, 255)}


def parse_message(text: str, package: str, name: str, where: str = "") -> MessageSpec:
    """A .msg text. ``where`` names it in errors (default: the type). Raises DefinitionError."""
    return _parse(text, package, name, where or f"{package}/{name}", 1)


def parse_service(text: str, package: str, name: str, where: str = "") -> ServiceSpec:
    """A .srv text. Raises DefinitionError."""
    where = where or f"{package}/{name}"
    parts = _split(text, 2, where, "request --- response")
    request, response = (
        _parse(part, package, name + suffix, where, line)
        for (part, line), suffix in zip(parts, ("Request", "Response"), strict=True)
    )
    return ServiceSpec(package, name, request, response, text)


def parse_action(text: str, package: str, name: str, where: str = "") -> ActionSpec:
    """A .action text. Raises DefinitionError."""
    where = where or f"{package}/{name}"
    parts = _split(text, 3, where, "goal --- result --- feedback")
    prefix = f"{package}/{name}"
    status = "Header header\nactionlib_msgs/GoalStatus status\n"
    texts = {
        "Goal": parts[0][0],
        "Result": parts[1][0],
        "Feedback": parts[2][0],
        "ActionGoal": f"Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
        "ActionResult": f"{status}{name}Result result\n",
        "ActionFeedback": f"{status}{name}Feedback feedback\n",
        "Action": (
            f"{name}ActionGoal action_goal\n{name}ActionResult action_result\n"
            f"{name}ActionFeedback action_feedback\n"
        ),
    }
    lines = {"Goal": parts[0][1], "Result": parts[1][1], "Feedback": parts[2][1]}
    messages = tuple(
        _parse(body, package, name + suffix, where if suffix in lines else prefix, lines.get(suffix, 1))
        for suffix, body in texts.items()
    )
    return ActionSpec(package, name, messages, text)


def _split(text: str, count: int, where: str, form: str) -> list[tuple[str, int]]:
    """The parts between lines of ``---``, each with the number of its first line."""
    parts: list[tuple[str, int]] = []
    current: list[str] = []
    first = 1
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip() == "---":
            parts.append(("".join(f"{kept}\n" for kept in current), first))
            current, first = [], number + 1
        else:
            current.append(line)
    parts.append(("\n".join(current), first))
    if len(parts) != count:
        raise DefinitionError(
            where, 1, f"{len(parts) - 1} lines of '---' instead of {count - 1}: write {form}"
        )
    return parts


def _parse(text: str, package: str, name: str, where: str, first_line: int) -> MessageSpec:
    fields: list[Field] = []
    constants: list[Constant] = []
    seen: set[str] = set()
    for number, line in enumerate(text.split("\n"), first_line):
        bare = line.split("#", 1)[0].strip()
        if not bare:
            continue
        match = _LINE.match(bare)
        if not match:
            raise DefinitionError(where, number, f"[{bare}] is neither 'type name' nor 'type NAME=value'")
        type_ = _parse_type(match["type"], package, where, number)
        rest = match["rest"]
        if "=" in rest:
            constant = _parse_constant(type_, rest, line, where, number)
            constants.append(constant)
            declared = constant.name
        else:
            fields.append(Field(rest, type_))
            declared = rest
        if not _NAME.match(declared):
            raise DefinitionError(where, number, f"[{declared}] is not a legal field name")
        if declared in seen:
            raise DefinitionError(where, number, f"[{declared}] is declared twice")
        seen.add(declared)
    return MessageSpec(package, name, tuple(fields), tuple(constants), text)


def _parse_type(text: str, package: str, where: str, line: int) -> FieldType:
    match = _TYPE.match(text)
    if not match:
        raise DefinitionError(where, line, f"[{text}] is not a legal type")
    base = match["base"]
    if base == "Header":
        base = "std_msgs/Header"
    elif base not in PRIMITIVES and "/" not in base:
        base = f"{package}/{base}"
    if match["array"] is None:
        return FieldType(base)
    return FieldType(base, True, int(match["length"]) if match["length"] else None)


def _parse_constant(type_: FieldType, rest: str, line: str, where: str, number: int) -> Constant:
    name = rest.split("=", 1)[0].strip()
    if type_.is_array or type_.base in ("time", "duration") or not type_.is_primitive:
        raise DefinitionError(where, number, f"a constant cannot be of type [{type_}]")
    if type_.base == "string":
        # A string takes the rest of its line, comment signs included.
        text = line.split("=", 1)[1].strip()
        return Constant(name, type_.base, text, text)
    text = rest.split("=", 1)[1].strip()
    try:
        return Constant(name, type_.base, _constant_value(type_.base, text), text)
    except ValueError:
        raise DefinitionError(where, number, f"[{text}] is not a value of type {type_.base}") from None


def _constant_value(type_: str, text: str) -> bool | int | float:
    if type_ == "bool":
        if text in ("True", "False"):
            return text == "True"
        return bool(int(text))
    if type_ in ("float32", "float64"):
        return float(text)
    value = int(text, 0) if text[:1].isdigit() and text.lower().startswith(("0x", "0b", "0o")) else int(text)
    low, high = _RANGES[type_]
    if not low <= value <= high:
        raise ValueError(text)
    return value
