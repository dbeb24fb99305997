"""mux_select, mux_add, mux_delete and mux_list call a service of a running mux; demux_select etc. call a service of a demux.

The demux programs exist only in minirospy. The exit status is 1 if the call fails (ROS: 0).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

from topic_tools.srv import MuxAdd, MuxDelete, MuxList, MuxSelect

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError

__all__ = ["main"]


class _Verb(NamedTuple):
    service: type
    takes_topic: bool
    text: Callable[[str, str, str], str]
    """Takes the program (mux or demux), the node's name and the topic; returns the line to print before the call."""


_VERBS = {
    "select": _Verb(MuxSelect, True, lambda kind, name, topic: f'Selecting "{topic}" at {kind} "{name}"'),
    "add": _Verb(MuxAdd, True, lambda kind, name, topic: f'Adding "{topic}" to {kind} "{name}"'),
    "delete": _Verb(MuxDelete, True, lambda kind, name, topic: f'Deleting "{topic}" from {kind} "{name}"'),
    "list": _Verb(MuxList, False, lambda kind, name, topic: f'Listing topics from {kind} "{name}"'),
}
"""The services, keyed by verb. demux's services have the same fields, and therefore the same md5sums, as mux's."""


def main(program: str) -> int:
    """Run a service-calling program, such as mux_select; return its exit status."""
    kind, _, word = program.partition("_")
    verb = _VERBS[word]
    words = rospy.myargv()[1:]
    if len(words) != 1 + verb.takes_topic:
        print(f"USAGE: {program} {kind.upper()}_NAME{' TOPIC' if verb.takes_topic else ''}")
        return 1
    name, topic = words[0], words[1] if verb.takes_topic else ""

    service = f"{name}/{word}"
    try:
        print(f'Waiting for service "{service}"', flush=True)
        rospy.wait_for_service(service)
        print(verb.text(kind, name, topic), flush=True)
        answer = rospy.ServiceProxy(service, verb.service)(*([topic] if verb.takes_topic else []))
    except rospy.ServiceException as error:
        print(f"Service call failed: {error}", flush=True)
        return 1
    except (rospy.ROSInterruptException, KeyboardInterrupt):
        return 1
    except MinirospyError as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return 1
    if word == "list":
        print(list(answer.topics))
    return 0
