"""rosmaster.master_api: the Master API as an object with one method per call, for programs that serve or call it.

The responses are those of ``core/graph/master_api.py``. A thread of this object notifies nodes.
Source: http://wiki.ros.org/ROS/Master_API.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, cast
from xmlrpc.client import Error

from minirospy.base.steps import Steps, finish
from minirospy.core.graph.calls import ERROR, Answer
from minirospy.core.graph.master_api import MasterApi, Notice
from minirospy.core.graph.parameters import ParameterTree, ParameterUpdate
from minirospy.core.graph.registry import NodeShutdown
from minirospy.ros.rosmaster.rosmaster.util import xmlrpcapi

__all__ = [
    "LOG_API",
    "MSG",
    "NUM_WORKERS",
    "STATUS",
    "VAL",
    "ROSMasterHandler",
    "mloginfo",
    "mlogwarn",
    "publisher_update_task",
    "service_update_task",
]

STATUS, MSG, VAL = 0, 1, 2
NUM_WORKERS = 3
LOG_API = False
_CALLER_ID = "/master"


_logger = logging.getLogger("rosmaster.master")


def mloginfo(msg: str, *args: object) -> None:
    """Log a message from the master."""
    _logger.info(msg, *args)


def mlogwarn(msg: str, *args: object) -> None:
    """Log and print a warning from the master."""
    _logger.warning(msg, *args)
    print("WARN: " + (msg % args if args else str(msg)))


def publisher_update_task(api: str, topic: str, pub_uris: Sequence[str]) -> None:
    """Send the URIs of a topic's publishers to the node at ``api``. Raise OSError if it does not respond."""
    node: Any = xmlrpcapi(api)
    call = f"publisherUpdate[{topic}] -> {api} {pub_uris}"
    mloginfo(call)
    start = time.time()
    result = "exception"
    try:
        result = f"result={node.publisherUpdate(_CALLER_ID, topic, pub_uris)}"
    except Exception as error:
        result = f"exception={error}"
        raise
    finally:
        mloginfo("%s: sec=%0.2f, %s", call, time.time() - start, result)


def service_update_task(api: str, service: str, uri: str) -> None:
    """Send a service's URI to the node at ``api``. Raise OSError if it does not respond."""
    node: Any = xmlrpcapi(api)
    mloginfo("serviceUpdate[%s, %s] -> %s", service, uri, api)
    node.serviceUpdate(_CALLER_ID, service, uri)


class _Api(MasterApi):
    """The Master API's tables and responses. Notifications to nodes are queued in ``notices``."""

    def __init__(self) -> None:
        super().__init__()
        self.where = ""
        self.notices: queue.SimpleQueue[Notice | None] = queue.SimpleQueue()
        self.is_stopped = False

    @property
    def uri(self) -> str:
        """Return the URI passed to :meth:`ROSMasterHandler._ready`."""
        return self.where

    def notify(self, action: Notice) -> None:
        """Queue a notification for the sending thread."""
        self.notices.put(action)

    def defer(self, uri: str, topic: str) -> None:
        """Do nothing: a delay is not needed, because a notification contains the state at the time of sending."""

    def stop(self) -> None:
        """Stop sending notifications."""
        self.is_stopped = True
        self.notices.put(None)

    def get_status(self, caller_id: str) -> Answer:
        """Reject the call, which only minirospy's own master supports."""
        return [ERROR, "not a call of the Master API", 0]


class ROSMasterHandler:
    """The Master API. Each method's first argument is the caller's name; it returns (code, status message, value)."""

    def __init__(self, num_workers: int = NUM_WORKERS) -> None:
        self.uri: str | None = None
        self.done = False
        self._api = _Api()
        self._lock = threading.Lock()
        threading.Thread(target=self._notify, name="rosmaster", daemon=True).start()

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


def _method(name: str) -> Callable[..., tuple[int, str, object]]:
    """Return a ROSMasterHandler method for a Master API call."""

    def call(*args: Any, **kwds: object) -> tuple[int, str, object]:
        handler, *rest = args
        return cast("ROSMasterHandler", handler)._call(name, tuple(rest))

    call.__name__ = name
    return call


for _name in _Api().dispatcher.methods:
    setattr(ROSMasterHandler, _name, _method(_name))


def _value(tree: ParameterTree, key: str) -> object:
    """Return the value to send in a parameter notification: {} if the parameter is not set."""
    return tree.get(key) if tree.has(key) else {}
