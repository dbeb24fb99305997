"""rosmaster.master_api: the Master API as an object with one method per call, for programs to serve or call.

The responses are those of ``core/graph/master_api.py``. A thread of this object notifies nodes.
Source: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Any, cast
from xmlrpc.client import Error

from minirospy.base.steps import Steps, finish
from minirospy.core.graph.calls import ERROR, Answer
from minirospy.core.graph.master_api import MasterApi, Notice
from minirospy.core.graph.parameters import ParameterTree, ParameterUpdate
from minirospy.core.graph.registry import NodeShutdown
from minirospy.ros.rosmaster.rosmaster.util import xmlrpcapi

__all__ = ["LOG_API", "MSG", "NUM_WORKERS", "STATUS", "VAL", "ROSMasterHandler"]

STATUS, MSG, VAL = 0, 1, 2
NUM_WORKERS = 3
LOG_API = False
_CALLER_ID = "/master"


class _Api(MasterApi):
    """The Master API's tables and responses. Notifications for nodes are put into ``notices``."""

    def __init__(self) -> None:
        super().__init__()
        self.where = ""
        self.notices: queue.SimpleQueue[Notice | None] = queue.SimpleQueue()
        self.is_stopped = False

    @property
    def uri(self) -> str:
        """Return the URI that was passed to :meth:`ROSMasterHandler._ready`."""
        return self.where

    def notify(self, action: Notice) -> None:
        """Queue a notification for the thread that sends it."""
        self.notices.put(action)

    def defer(self, uri: str, topic: str) -> None:
        """Do nothing. Deferring has no effect here, because a notification contains the state at the time when it is sent."""

    def stop(self) -> None:
        """Stop sending notifications."""
        self.is_stopped = True
        self.notices.put(None)

    def get_status(self, caller_id: str) -> Answer:
        """Refuse the call, which only minirospy's own master supports."""
        return [ERROR, "not a call of the Master API", 0]


class ROSMasterHandler:
    """The Master API: each method's first argument is the caller's name; it returns (code, status message, value)."""

    def __init__(self, num_workers: int = NUM_WORKERS) -> None:
        self.uri: str | None = None
        self.done = False
        self._api = _Api()
        self._lock = threading.Lock()
        threading.Thread(target=self._notify, name="rosmaster", daemon=True).start()

    def __getattr__(self, name: str) -> Callable[..., tuple[int, str, object]]:
        # Provide one method for each call in the table.
        if name.startswith("_") or name not in self._api.dispatcher.methods:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return lambda *args: self._call(name, args)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._api.dispatcher.methods]

    def _ready(self, uri: str) -> None:
        self.uri = self._api.where = uri

    def _shutdown(self, reason: str = "") -> None:
        self.done = True
        self._api.stop()

    def _ok(self) -> bool:
        return not self.done

    def _call(self, name: str, args: tuple[object, ...]) -> tuple[int, str, object]:
        with self._lock:
            answer = self._api.dispatch(name, args)
            code, text, value = (
                answer if isinstance(answer, list) else finish(cast("Steps[list[Any]]", answer))
            )
        return code, text, value

    def _notify(self) -> None:
        while (notice := self._api.notices.get()) is not None:
            with contextlib.suppress(OSError, Error):
                self._send(notice)

    def _send(self, notice: Notice) -> None:
        node: Any = xmlrpcapi(notice.uri)
        if node is None:
            return
        if isinstance(notice, NodeShutdown):
            node.shutdown(_CALLER_ID, f"[{notice.name}] Reason: {notice.reason}")
        elif isinstance(notice, ParameterUpdate):
            with self._lock:
                value = _value(self._api.parameters, notice.key)
            node.paramUpdate(_CALLER_ID, notice.key, value)
        else:
            with self._lock:
                publishers = self._api.registry.publisher_uris(notice.topic)
            node.publisherUpdate(_CALLER_ID, notice.topic, publishers)


def _value(tree: ParameterTree, key: str) -> object:
    """Return the value for a node's notification, which is {} if the parameter is not set."""
    return tree.get(key) if tree.has(key) else {}
