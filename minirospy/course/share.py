"""Show a student's board and nodes in the class's table: `minirospy check --share`.

The state is sent one way, as a parameter on the class's master. The teacher's page cannot change anything on the student's
computer.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from minirospy.base.environment import Environment
from minirospy.base.errors import MasterUnreachableError, MinirospyError, RpcError
from minirospy.board.board import Board
from minirospy.board.model import BUTTONS, LEDS
from minirospy.course.results import Record
from minirospy.runtime.rpc.master_proxy import MasterProxy

__all__ = ["share"]

_POLL_SECONDS = 0.2  # seconds between pin readings; changes are missed if an LED blinks faster than 2.5 Hz
_BEAT_SECONDS = 3.0  # seconds between heartbeats; the page marks a computer as gone after missing three
_ASK_SECONDS = 2.0  # timeout in seconds for calls to a master


def share(record: Record, environment: Environment, ended: Callable[[], bool] = lambda: False) -> None:
    """Send the board's state and the number of nodes to the class's master until ``ended()`` is true.

    Raise MasterUnreachableError if the class's master does not respond at the start; later failures are retried.
    """
    uri = record.master or environment.master_uri
    with (
        Board() as board,
        contextlib.closing(MasterProxy(uri, "/check_share", timeout=_ASK_SECONDS)) as master,
    ):
        master.get_pid()
        beat, sent, due = 0, "", 0.0
        while not ended():
            pins = "".join(str(board.get(pin)) for pin in (*LEDS, *BUTTONS))
            now = time.monotonic()
            if pins != sent or now >= due:
                beat += 1
                state = {
                    "leds": pins[: len(LEDS)],
                    "buttons": pins[len(LEDS) :],
                    "nodes": _nodes(environment),
                    "beat": beat,
                }
                # The teacher's computer may be briefly unreachable, so retry at the next heartbeat.
                with contextlib.suppress(MasterUnreachableError, RpcError):
                    master.set_param(f"{record.class_parameter}/now", state)
                    sent = pins
                due = now + _BEAT_SECONDS
            time.sleep(_POLL_SECONDS)


def _nodes(environment: Environment) -> list[str]:
    """Return the names of at most ten nodes that are registered with the student's own master."""
    master = MasterProxy(environment.master_uri, "/check_share", timeout=_ASK_SECONDS)
    try:
        state = master.get_system_state()
    except (MinirospyError, RpcError):
        return []
    finally:
        master.close()
    return sorted({node for table in state for nodes in table.values() for node in nodes} - {"/rosout"})[:10]
