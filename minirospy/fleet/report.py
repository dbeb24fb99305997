"""Formats the output of `minirospy fleet status` from the gateways' replies.

Pure. Replies are untrusted and therefore checked.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from minirospy.base.escape import escaped
from minirospy.fleet.clocks import ClockOffset
from minirospy.fleet.keys import Claim

__all__ = ["Answer", "as_json", "is_shallow", "is_shown", "lines", "parse_answer"]

Json = Mapping[str, object]
MAX_LEVELS = 50


@dataclass(frozen=True)
class Answer:
    """A gateway in the fleet: its claim, its reply ({} if there was none), and its clock offset."""

    claim: Claim
    status: Json
    clock: ClockOffset | None = None


def parse_answer(data: bytes) -> Json:
    """Parse a gateway's status; return {} if the data is invalid."""
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) and is_shallow(found) else {}


def is_shallow(value: object, levels: int = MAX_LEVELS) -> bool:
    """Return whether a JSON value has at most ``levels`` levels; the JSON encoder recurses once per level."""
    if isinstance(value, dict):
        value = list(value.values())
    return not isinstance(value, list) or (levels > 0 and all(is_shallow(each, levels - 1) for each in value))


def lines(robots: Iterable[Answer], controls: Iterable[Answer]) -> list[str]:
    """Format the status as lines of text: the robots, then the control rooms with the robots that they receive."""
    robots, controls = list(robots), list(controls)
    found = [
        f"{_count(len({each.claim.name for each in robots}), 'robot')}, {_count(len(controls), 'control room')}"
    ]
    for answer in sorted(robots, key=lambda each: (each.claim.name, each.claim.start)):
        found += _robot_lines(answer, robots, controls)
    for answer in controls:
        found += _control_lines(answer)
    return found


def as_json(robots: Iterable[Answer], controls: Iterable[Answer]) -> str:
    """Return the same data as :func:`lines`, as a JSON string."""

    def described(answer: Answer, shown: bool) -> dict[str, object]:
        clock = answer.clock
        return {
            "name": answer.claim.name,
            "gateway": answer.claim.gateway,
            "shown": shown,
            "offset": clock.offset / 1e9 if clock else None,
            "round_trip": clock.round_trip / 1e9 if clock else None,
            "status": answer.status,
        }

    robots, controls = list(robots), list(controls)
    return json.dumps(
        {
            "robots": [described(each, is_shown(each.claim, controls)) for each in robots],
            "controls": [described(each, True) for each in controls],
        },
        indent=1,
    )


def is_shown(claim: Claim, controls: Iterable[Answer]) -> bool:
    """Return whether a control room shows this gateway's robot, or no control room shows a robot of that name."""
    shown = {
        _text(robot, "gateway")
        for control in controls
        for robot in _tables(control.status, "robots")
        if _text(robot, "name") == claim.name
    }
    return not shown or claim.gateway in shown


def _robot_lines(answer: Answer, robots: Iterable[Answer], controls: Iterable[Answer]) -> list[str]:
    claim = answer.claim
    has_rivals = any(each.claim.name == claim.name and each.claim != claim for each in robots)
    which = f", machine {claim.host}, gateway {claim.gateway}" if has_rivals else ""
    status = answer.status
    if not status:
        return [f"{claim.name}{which}: is there, but does not answer"]
    parts = [
        f"{claim.name} ({_text(status, 'machine')}{which})",
        _count(_number(status, "topics"), "topic"),
        _count(_number(status, "services"), "service"),
        _clock(answer.clock),
    ]
    if not is_shown(claim, controls):
        parts.append("NOT SHOWN: another gateway has this name")

    if status.get("master") is False:
        parts.append("ITS MASTER DOES NOT ANSWER")
    found = [", ".join(part for part in parts if part)]
    found += [
        f"  sends {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')} "
        f"({_size(_number(link, 'bytes'))}, {_text(link, 'priority')}), {_number(link, 'dropped')} dropped, "
        f"{_number(link, 'throttled')} over its rate"
        for link in _tables(status, "sent")
    ]
    return (
        found
        + [
            f"  receives {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')}"
            for link in _tables(status, "passed_in")
        ]
        + _ros1_lines(status)
    )


def _control_lines(answer: Answer) -> list[str]:
    status = answer.status
    if not status:
        return ["control room: is there, but does not answer"]
    name = "" if answer.claim.name == "-" else f" {answer.claim.name}"
    found = [
        f"control room{name} ({_text(status, 'machine')}), {_count(len(_tables(status, 'robots')), 'robot')}"
    ]

    for robot in _tables(status, "robots"):
        found += [
            f"  gets {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')}, "
            f"{_number(link, 'lost')} lost, {_number(link, 'dropped')} dropped, "
            f"delay {_milliseconds(link, 'delay')}, up to {_milliseconds(link, 'longest')}"
            for link in _tables(robot, "links")
        ]
        found += [
            f"  sends {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')}, "
            f"{_number(link, 'dropped')} dropped"
            for link in _tables(robot, "to_robot")
        ]
    return found + _ros1_lines(status)


def _ros1_lines(status: Json) -> list[str]:
    ros1 = status.get("ros1_keys")
    if not isinstance(ros1, dict):
        return []
    found = [
        f"  keys of zenoh-bridge-ros1 ({_text(ros1, 'namespace')}): {_number(ros1, 'announced')} announced, "
        f"{_number(ros1, 'seen')} of others, {_number(ros1, 'refused')} left out"
    ]
    found += [
        f"    sends {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')}, "
        f"{_number(link, 'dropped')} dropped"
        for link in _tables(ros1, "sent")
    ]
    return found + [
        f"    receives {_text(link, 'topic')}: {_count(_number(link, 'messages'), 'message')}"
        for link in _tables(ros1, "passed_in")
    ]


def _clock(clock: ClockOffset | None) -> str:
    if clock is None:
        return "its clock does not answer"
    return f"clock {clock.offset / 1e9:+.3f} s, round trip {clock.round_trip / 1e6:.1f} ms"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _number(table: Json, key: str) -> int:
    found = table.get(key)
    return int(found) if isinstance(found, (int, float)) and abs(found) < 1e18 else 0


def _milliseconds(table: Json, key: str) -> str:
    found = table.get(key)
    return f"{found * 1e3:.1f} ms" if isinstance(found, (int, float)) and abs(found) < 1e18 else "?"


def _text(table: Json, key: str) -> str:
    # JSON may contain unpaired surrogates, which a terminal cannot encode.
    return escaped(str(table.get(key, "?"))[:200].encode(errors="replace").decode())


def _tables(table: Json, key: str) -> list[Json]:
    found = table.get(key)
    return [each for each in found if isinstance(each, dict)] if isinstance(found, list) else []


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 100_000 else f"{count} B"
