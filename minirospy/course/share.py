"""Show a student's results, board and nodes in the class's table: `minirospy check --share`.

The state is sent one way: as a parameter on the class's master, and as a latched topic on the student's own master, which a fleet
forwards to the teacher's. The teacher's page cannot change anything on the student's computer.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable
from typing import Any

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.board.board import Board
from minirospy.board.model import BUTTONS, LEDS
from minirospy.core.idl.load import message_class
from minirospy.course.results import CLASS_PARAMETER, Record
from minirospy.introspect.streams import ToolNode, TopicPublisher
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["share"]

_POLL_SECONDS = 0.2  # seconds between pin readings; changes are missed if an LED blinks faster than 2.5 Hz
_BEAT_SECONDS = 3.0  # seconds between heartbeats; the page marks a computer as gone after missing three
_ASK_SECONDS = 2.0  # timeout in seconds for calls to a master
_TOPIC = CLASS_PARAMETER  # the page's classroom.js also finds this topic with a fleet robot's name before it


def share(record: Record, environment: Environment, ended: Callable[[], bool] = lambda: False) -> None:
    """Send the results, the board's state and the nodes until ``ended()`` is true or `rosnode kill` stops the sender.

    Raise MasterUnreachableError if the class's master does not respond at the start; later failures are retried.
    """
    uri = record.master or environment.master_uri
    with (
        Board() as board,
        contextlib.closing(MasterProxy(uri, "/check_share", timeout=_ASK_SECONDS)) as master,
        _OwnMaster(environment) as own,
    ):
        master.get_pid()
        beat, sent, due = 0, "", 0.0
        while not ended() and not own.is_killed:
            pins = "".join(str(board.get(pin)) for pin in (*LEDS, *BUTTONS))
            now = time.monotonic()
            if pins != sent or now >= due:
                beat += 1
                state = {
                    "leds": pins[: len(LEDS)],
                    "buttons": pins[len(LEDS) :],
                    "nodes": own.nodes(),
                    "beat": beat,
                }
                own.publish(record, state)
                # The teacher's computer may be briefly unreachable, so retry at the next heartbeat.
                with contextlib.suppress(MasterUnreachableError, RpcError):
                    master.set_param(f"{record.class_parameter}/now", state)
                    sent = pins
                due = now + _BEAT_SECONDS
            time.sleep(_POLL_SECONDS)


class _OwnMaster:
    """Publishes the topic on the student's own master. If that does not run, each heartbeat tries again to connect to it."""

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._node: ToolNode | None = None
        self._publisher: TopicPublisher | None = None
        self._message: Any = message_class("std_msgs/String")()

    def __enter__(self) -> _OwnMaster:
        return self

    def __exit__(self, *_: object) -> None:
        if self._node:
            self._node.close()

    @property
    def is_killed(self) -> bool:
        """Return whether `rosnode kill` has stopped the node that publishes the topic."""
        return self._node is not None and self._node.ended.is_set()

    def publish(self, record: Record, state: dict[str, object]) -> None:
        """Publish the state, with the results of the checks that have ended on this computer."""
        stored = Record.read(self._environment)
        if not stored.results:
            stored.results = record.results
        stored.student = record.student
        key = record.class_parameter.rpartition("/")[2]
        self._message.data = json.dumps({**stored.to_parameter(), "key": key, "now": state})
        with contextlib.suppress(MinirospyError, RpcError):
            if self._publisher is None:
                self._node = self._node or ToolNode(self._environment, "check_share")
                self._publisher = self._node.publisher(_TOPIC, type(self._message), latch=True)
            self._publisher.publish(self._message)

    def nodes(self) -> list[str]:
        """Return the names of at most ten nodes, except this one."""
        master = MasterProxy(self._environment.master_uri, "/check_share", timeout=_ASK_SECONDS)
        try:
            state = master.get_system_state()
        except (MinirospyError, RpcError):
            return []
        finally:
            master.close()
        found = {node for table in state for nodes in table.values() for node in nodes}
        return sorted(found - {"/rosout", self._node.name if self._node else ""})[:10]
