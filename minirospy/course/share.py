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
_PUBLISH_SECONDS = 1.0  # minimum seconds between messages on the topic, because each has all results (22 kB)
_TOPIC = CLASS_PARAMETER  # the page's classroom.js also finds this topic in a fleet robot's namespace
_TOOL = "check_share"  # prefix of the names of the nodes that publish the topic
_NOT_STUDENTS = f"{_TOOL}_", "check_class_"  # prefixes of the names of nodes that publish or read the topic


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
        beat, sent, due, publish_due = 0, "", 0.0, 0.0
        unpublished: dict[str, object] | None = None
        while not ended() and not own.is_killed:
            pins = "".join(str(board.get(pin)) for pin in (*LEDS, *BUTTONS))
            now = time.monotonic()
            if pins != sent or now >= due:
                beat += 1
                sent, due = pins, now + _BEAT_SECONDS
                unpublished = {
                    "leds": pins[: len(LEDS)],
                    "buttons": pins[len(LEDS) :],
                    "nodes": own.nodes(),
                    "beat": beat,
                }
                # The teacher's computer may be briefly unreachable, so retry at the next heartbeat.
                with contextlib.suppress(MasterUnreachableError, RpcError):
                    master.set_param(f"{record.class_parameter}/now", unpublished)
            if unpublished and now >= publish_due:
                own.publish(record, unpublished)
                unpublished, publish_due = None, now + _PUBLISH_SECONDS
            time.sleep(_POLL_SECONDS)


class _OwnMaster:
    """Publishes the topic on the student's own master. If that does not run, each heartbeat tries again to connect to it."""

    def __init__(self, environment: Environment) -> None:
        self._environment = environment
        self._node: ToolNode | None = None
        self._publisher: TopicPublisher | None = None
        self._answers = False
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
        """Publish the state, with the results of the checks that have ended on this computer.

        Do nothing if the topic is not advertised yet and the master did not respond to the last call of `nodes`, because
        advertising would block for much longer than that call.
        """
        if self._publisher is None and not self._answers:
            return
        stored = Record.read(self._environment)
        if not stored.results:
            stored.results = record.results
        stored.student = record.student
        key = record.class_parameter.rpartition("/")[2]
        self._message.data = json.dumps({**stored.to_parameter(), "key": key, "now": state})
        with contextlib.suppress(MinirospyError, RpcError):
            publisher = self._publisher or self._advertise()
            publisher.publish(self._message)

    def _advertise(self) -> TopicPublisher:
        node = ToolNode(self._environment, _TOOL)
        try:
            self._publisher = node.publisher(_TOPIC, type(self._message), latch=True)
        except BaseException:
            # The node has recorded the topic, and would reject a second attempt, so the next attempt creates a new node.
            node.close()
            raise
        self._node = node
        return self._publisher

    def nodes(self) -> list[str]:
        """Return the names of at most ten nodes, without those that use the topic. The list is empty without a master."""
        master = MasterProxy(self._environment.master_uri, "/check_share", timeout=_ASK_SECONDS)
        self._answers = False
        try:
            state = master.get_system_state()
        except (MinirospyError, RpcError):
            return []
        finally:
            master.close()
        self._answers = True
        found = {node for table in state for nodes in table.values() for node in nodes} - {"/rosout"}
        return sorted(name for name in found if not name.rpartition("/")[2].startswith(_NOT_STUDENTS))[:10]
